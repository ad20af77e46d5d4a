// One script from the sources, and the core packed: node build.mjs CORE.wasm
// The script begins with the hash of its sources, so that a test can say when it is stale.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const target = new URL("../python/stickslip/explorer/", import.meta.url);
const sources = readdirSync(new URL("src/", import.meta.url), { recursive: true })
  .filter((name) => name.endsWith(".ts"))
  .map((name) => name.replaceAll("\\", "/"))
  .sort();
const hash = createHash("sha256");
for (const name of sources) hash.update(`${name}\n`).update(readFileSync(new URL(`src/${name}`, import.meta.url)));

const { outputFiles } = await build({
  entryPoints: [new URL("src/main.ts", import.meta.url).pathname],
  bundle: true,
  minify: true,
  charset: "utf8",
  format: "iife",
  target: "es2022",
  legalComments: "none",
  write: false,
});
const script = outputFiles[0].text.replaceAll("</script", "<\\/script");
writeFileSync(new URL("explorer.js", target), `// web/src ${hash.digest("hex")}\n${script}`);

const packed = gzipSync(readFileSync(process.argv[2]), { level: 9 });
packed[9] = 255; // the byte of the header that names an operating system
writeFileSync(new URL("core.wasm.gz", target), packed);
console.log(`explorer.js ${script.length} bytes, core.wasm.gz ${packed.length} bytes`);
