// The script from the sources, and the one that unpacks it: node build.mjs
// Each begins with the hash of all sources, so that a test can say when it is stale.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";

const target = new URL("../python/stickslip/explorer/", import.meta.url);
const sources = readdirSync(new URL("src/", import.meta.url), { recursive: true })
  .filter((name) => name.endsWith(".ts"))
  .map((name) => name.replaceAll("\\", "/"))
  .sort();
const hash = createHash("sha256");
for (const name of sources) hash.update(`${name}\n`).update(readFileSync(new URL(`src/${name}`, import.meta.url)));
const digest = hash.digest("hex");

for (const [source, name] of [["main", "explorer"], ["boot", "boot"]]) {
  const { outputFiles } = await build({
    entryPoints: [new URL(`src/${source}.ts`, import.meta.url).pathname],
    bundle: true,
    minify: true,
    charset: "utf8",
    format: "iife",
    target: "es2022",
    legalComments: "none",
    write: false,
  });
  const script = outputFiles[0].text.replaceAll("</script", "<\\/script");
  writeFileSync(new URL(`${name}.js`, target), `// web/src ${digest}\n${script}`);
  console.log(`${name}.js ${script.length} bytes`);
}
