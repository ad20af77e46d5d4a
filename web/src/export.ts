/** What is taken away: TOML, CSV, PNG, GIF, the page itself with its state inside. */
import { GIFEncoder, applyPalette, quantize } from "gifenc";
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

/** Paint panels on one canvas as they stand in a frame, each with its title. */
function paint(plots: Plot[], box: DOMRect, ratio: number): CanvasRenderingContext2D {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
  const g = canvas.getContext("2d", { willReadFrequently: true })!;
  g.fillStyle = theme().card;
  g.fillRect(0, 0, canvas.width, canvas.height);
  for (const { host, base, over, zoom } of plots) {
    const place = host.getBoundingClientRect();
    if (!place.width) continue;
    const [left, top] = [(place.left - box.left) * ratio, (place.top - box.top) * ratio];
    for (const layer of [base, over]) g.drawImage(layer.canvas, left, top, place.width * ratio, place.height * ratio);
    g.fillStyle = theme().ink;
    const unit = zoom * ratio;
    g.font = `600 ${12 * unit}px system-ui, sans-serif`;
    g.fillText(titleOf(host), left + 12 * unit, top - 6 * unit);
  }
  return g;
}

export const titleOf = (host: HTMLElement): string => host.closest("figure")?.querySelector("b")?.textContent ?? "";

/** Panels as a picture, as sharp as they are drawn. */
export function picture(plots: Plot[], frame: HTMLElement, ratio: number): Promise<Blob> {
  const { canvas } = paint(plots, frame.getBoundingClientRect(), ratio);
  return new Promise((done, fail) => canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error("no picture"))), "image/png"));
}

/** Frames of a GIF, colours of each, and the shortest time that browsers show one, in milliseconds. */
const FRAMES = 40;
const COLOURS = 64;
const SHORTEST = 20;

/** One panel over some time of the motion, in so many seconds; `show` draws the panel at a share of it. The page goes on meanwhile. */
export async function film(plot: Plot, frame: HTMLElement, seconds: number, show: (share: number) => void): Promise<Blob> {
  const gif = GIFEncoder();
  const pause = () => new Promise((next) => setTimeout(next));
  for (let i = 0; i < FRAMES; i++) {
    show(i / FRAMES);
    const g = paint([plot], frame.getBoundingClientRect(), 1);
    const { data, width, height } = g.getImageData(0, 0, g.canvas.width, g.canvas.height);
    const palette = quantize(data, COLOURS);
    await pause();
    gif.writeFrame(applyPalette(data, palette), width, height, { palette, delay: Math.max(SHORTEST, (1000 * seconds) / FRAMES) });
    await pause();
  }
  gif.finish();
  return new Blob([gif.bytes()], { type: "image/gif" });
}

/** The page as it was opened, with another content of its elements by their names. */
export function pageWith(source: string, content: Record<string, unknown>): string {
  return Object.entries(content).reduce((page, [id, value]) => {
    const json = JSON.stringify(value).replaceAll("<", "\\u003c");
    return page.replace(new RegExp(`(<script type="application/json" id="${id}">)[^<]*(</script>)`), (_, open: string, close: string) => open + json + close);
  }, source);
}
