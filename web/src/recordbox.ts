/** The record among the numbers: what it is, which numbers are fitted to it, and how good they are. */
import { element, isPencil } from "./controls";
import type { LawPage } from "./data";
import type { Fit } from "./fit";
import { plain } from "./plot";
import type { Measured } from "./record";
import type { Document } from "./state";

/** The paths and symbols of all numbers of a law that can be fitted. */
export function free(law: Document, page: LawPage): { path: string; symbol: string }[] {
  const leaves = (value: any, path: string, symbol: string): { path: string; symbol: string }[] => {
    if (typeof value === "number") return [{ path, symbol }];
    return Array.isArray(value) ? value.flatMap((one, i) => leaves(one, `${path}.${i}`, `${symbol}${"₁₂₃₄₅₆₇₈₉"[i] ?? ""}`)) : [];
  };
  return page.numbers.filter(({ choices }) => !choices).flatMap(({ path, symbol }) => leaves(path.split(".").reduce((at: any, key) => at?.[key], law), path, symbol));
}

export class RecordBox {
  /** The paths that are not ticked. */
  readonly held = new Set<string>(["exponent"]);
  private readonly words = element("p", { className: "words" });
  private readonly ticks = element("div", { className: "ticks" });
  private readonly button = element("button", { type: "button", textContent: "Fit" });
  private shape = "";

  constructor(
    private readonly host: HTMLElement,
    private readonly fit: (paths: string[]) => void,
    drop: () => void,
  ) {
    this.button.onclick = () => this.fit(this.paths);
    const away = element("button", { type: "button", textContent: "Remove" });
    away.onclick = drop;
    host.append(element("legend", {}, "Record"), this.words, this.ticks, this.button, away);
  }

  private paths: string[] = [];

  show(record: Measured | null, law: Document, page: LawPage, quality: Omit<Fit, "law" | "done"> | null, busy: boolean, silent: string[] | null): void {
    this.host.hidden = !record;
    if (!record) return;
    const all = free(law, page);
    const shape = JSON.stringify([law["type"], all, [...this.held]]);
    if (shape !== this.shape) {
      this.shape = shape;
      this.ticks.replaceChildren(
        ...all.map(({ path, symbol }) => {
          const box = element("input", { type: "checkbox", checked: !this.held.has(path) });
          box.onchange = () => {
            if (box.checked) this.held.delete(path);
            else this.held.add(path);
            this.paths = all.map((one) => one.path).filter((one) => !this.held.has(one));
          };
          return element("label", {}, box, element(isPencil(law, path) ? "b" : "i", {}, symbol));
        }),
      );
    }
    this.paths = all.map(({ path }) => path).filter((path) => !this.held.has(path));
    this.button.textContent = busy ? "Fitting …" : "Fit";
    const measure = quality
      ? `Misfit (rms): ${plain(+quality.kinetic.toPrecision(3))} while it slips` + (record.breaks.length ? `, ${plain(+quality.broken.toPrecision(3))} at ${record.breaks.length} break-aways. ` : ". ")
      : "";
    const name = record.name.replace(/^.*[/\\]/, "");
    this.words.textContent = `${name}: ${record.t.length} samples. ${measure}`;
    if (silent) {
      const mute = all.filter(({ path }) => silent.includes(path)).map(({ symbol }) => symbol);
      this.words.append(element("strong", {}, mute.length ? `This record says nothing about ${mute.join(", ")}: hold them. ` : "This record says something about every number that was fitted. "));
    }
    this.words.append("The fitted numbers have no intervals here; ");
    // A file of columns is measured first: its rig file says what they are.
    if (!record.command) this.words.append(element("code", {}, `stickslip measure ${name} --rig RIG.toml -o friction.nc`), " and ");
    this.words.append(element("code", {}, `${record.command ?? "stickslip identify friction.nc"} --law ${law["type"]}`), record.command ? " has them." : " have them.");
  }
}
