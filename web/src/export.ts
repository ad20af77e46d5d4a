/** What is taken away: TOML, CSV, PNG, the page itself with its state inside. */
import type { Orbit } from "./orbit";
import type { Plot } from "./plot";
import { theme } from "./theme";

export function save(name: string, content: BlobPart, type: string): void {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(new Blob([content], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

export function toCsv(orbit: Orbit): string {
  const names = ["t"];
  const columns = [orbit.t];
  orbit.x.forEach((x, i) => {
    const end = orbit.x.length > 1 ? `_${i}` : "";
    names.push(`x${end}`, `v${end}`, `slip_velocity${end}`, `force${end}`, `branch${end}`);
    columns.push(x, orbit.v[i]!, orbit.w[i]!, orbit.force[i]!, orbit.mode[i]!);
  });
  const rows = Array.from(orbit.t, (_, i) => columns.map((column) => column[i]).join(","));
  return `${[names.join(","), ...rows].join("\n")}\n`;
}

/** All panels as they stand on the page. */
export function picture(plots: Plot[], frame: HTMLElement): Promise<Blob> {
  const box = frame.getBoundingClientRect();
  const ratio = Math.max(2, window.devicePixelRatio || 1);
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [box.width * ratio, box.height * ratio];
  const g = canvas.getContext("2d")!;
  g.fillStyle = theme().card;
  g.fillRect(0, 0, canvas.width, canvas.height);
  for (const { host, base, over } of plots) {
    const place = host.getBoundingClientRect();
    if (!place.width) continue;
    for (const layer of [base, over])
      g.drawImage(layer.canvas, (place.left - box.left) * ratio, (place.top - box.top) * ratio, place.width * ratio, place.height * ratio);
    const title = host.closest("figure")?.querySelector("b")?.textContent ?? "";
    g.fillStyle = theme().ink;
    g.font = `600 ${12 * ratio}px system-ui, sans-serif`;
    g.fillText(title, (place.left - box.left + 12) * ratio, (place.top - box.top - 6) * ratio);
  }
  return new Promise((done, fail) => canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error("no picture"))), "image/png"));
}

/** The page as it was opened, with another content of its elements by their names. */
export function pageWith(source: string, content: Record<string, unknown>): string {
  return Object.entries(content).reduce((page, [id, value]) => {
    const json = JSON.stringify(value).replaceAll("<", "\\u003c");
    return page.replace(new RegExp(`(<script type="application/json" id="${id}">)[^<]*(</script>)`), (_, open: string, close: string) => open + json + close);
  }, source);
}
