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
  private readonly list = element("div");
  private readonly words = element("p", { className: "words" });
  private readonly ticks = element("div", { className: "ticks" });
  private readonly button = element("button", { type: "button", textContent: "Fit" });
  private shape = "";

  constructor(
    private readonly host: HTMLElement,
    private readonly fit: (paths: string[]) => void,
    private readonly drop: (record: Measured) => void,
  ) {
    this.button.onclick = () => this.fit(this.paths);
    host.append(element("legend", {}, "Record"), this.list, this.words, this.ticks, this.button);
  }

  private paths: string[] = [];

  show(records: Measured[], law: Document, page: LawPage, quality: Omit<Fit, "law" | "done"> | null, busy: boolean, silent: string[] | null): void {
    this.host.hidden = !records.length;
    if (!records.length) return;
    this.names(records);
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
    // A law with an internal state has no break-away force to be compared.
    const breaks = page.state ? 0 : records.reduce((sum, record) => sum + record.breaks.length, 0);
    const measure = quality
      ? `Misfit (rms): ${plain(+quality.kinetic.toPrecision(3))} while it slips` + (breaks ? `, ${plain(+quality.broken.toPrecision(3))} at ${breaks} break-aways. ` : ". ")
      : "";
    this.words.textContent = measure;
    const these = records.length > 1 ? "These records say" : "This record says";
    if (silent) {
      const mute = all.filter(({ path }) => silent.includes(path)).map(({ symbol }) => symbol);
      this.words.append(element("strong", {}, mute.length ? `${these} nothing about ${mute.join(", ")}: hold them. ` : `${these} something about every number that was fitted. `));
    }
    this.words.append("The fitted numbers have no intervals here; ");
    // A file of columns is measured first: its rig file says what they are.
    const plainly = records.filter(({ file }) => !file);
    for (const record of plainly) this.words.append(element("code", {}, `stickslip measure ${nameOf(record)} --rig RIG.toml -o ${frictionOf(record)}`), " and ");
    const files = records.map((record) => record.file ?? frictionOf(record)).join(" ");
    this.words.append(element("code", {}, `stickslip identify ${files} --law ${law["type"]}`), plainly.length ? " have them." : " has them.");
  }

  /** A line for each record, with a button that takes it away; built anew where others come. */
  private names(records: Measured[]): void {
    const shape = records.map(({ name, t }) => `${name} ${t.length}`).join();
    if (this.list.dataset["shape"] === shape) return;
    this.list.dataset["shape"] = shape;
    this.list.replaceChildren(
      ...records.map((record) => {
        const away = element("button", { type: "button", textContent: "Remove" });
        away.setAttribute("aria-label", `Remove ${nameOf(record)}`);
        away.onclick = () => this.drop(record);
        return element("div", { className: "line" }, element("span", {}, `${nameOf(record)}: ${record.t.length} samples`), away);
      }),
    );
  }
}

const nameOf = ({ name }: Measured): string => name.replace(/^.*[/\\]/, "");
/** What `stickslip measure` makes of a record. */
const frictionOf = (record: Measured): string => nameOf(record).replace(/\.\w+$/, "") + ".nc";
