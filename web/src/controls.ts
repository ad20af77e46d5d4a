/** The numbers of the system and its law, as sliders with fields; their names, ranges and words come from the package. */
import type { Data, NumberPage } from "./data";
import type { Change } from "./panels/panel";
import { type Document, type State, get } from "./state";

export function element<K extends keyof HTMLElementTagNameMap>(tag: K, properties: object = {}, ...children: (Node | string)[]): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  Object.assign(made as object, properties);
  made.append(...children);
  return made;
}

export class Controls {
  private shape = "";
  private readonly refreshers: ((state: State) => void)[] = [];

  constructor(
    private readonly host: HTMLElement,
    private readonly data: Data,
    private readonly change: (changes: Change[]) => void,
  ) {}

  /** Show the numbers of a state; built anew only where it has other numbers. */
  show(state: State): void {
    const { law, forcing } = state.system as Document;
    const shape = JSON.stringify([law.type, forcing.length, state.chain.masses > 1, Object.entries(law).map(([key, value]) => [key, Array.isArray(value) ? value.length : value === null])]);
    if (shape !== this.shape) {
      this.shape = shape;
      this.build(state);
    }
    for (const refresh of this.refreshers) refresh(state);
  }

  private build(state: State): void {
    this.refreshers.length = 0;
    const { law, forcing } = state.system as Document;
    const groups: HTMLElement[] = [];
    groups.push(this.group("Rig", this.data.oscillator.map((page) => this.slider(page, `system.${page.path}`))));
    const chain: NumberPage[] = [{ path: "masses", symbol: "n", name: "masses in a row", words: "masses in a row", unit: "", low: 1, high: 5, choices: [1, 2, 3, 4, 5] }];
    if (state.chain.masses > 1) chain.push({ path: "coupling", symbol: "κ", name: "coupling", words: "stiffness of the springs between neighbours", unit: "", low: 0, high: 5 });
    groups.push(this.group("Chain", chain.map((page) => this.slider(page, `chain.${page.path}`))));
    if (forcing.length)
      groups.push(
        this.group("Forcing", [
          this.slider({ path: "", symbol: "u₀", name: "amplitude", words: "amplitude of the forcing", unit: "force", low: 0, high: 0.5 }, "system.forcing.0.amplitude"),
          this.slider({ path: "", symbol: "Ω", name: "frequency", words: "angular frequency of the forcing", unit: "", low: 0.1, high: 4 }, "system.forcing.0.frequency"),
        ]),
      );
    const page = this.data.laws[law.type]!;
    groups.push(this.group("Law", page.numbers.flatMap((one) => this.rows(one, law))));
    this.host.replaceChildren(...groups);
  }

  /** The controls of one parameter of the law: a number, a pencil that may lie at infinity, or a table of nodes. */
  private rows(page: NumberPage, law: Document): HTMLElement[] {
    const value = get(law, page.path);
    const path = `system.law.${page.path}`;
    const pencil = law["type"] === "BogaczRyczek" && ["A", "C", "D"].includes(page.path);
    const rows: HTMLElement[] = [];
    if (pencil) rows.push(this.infinity(page, law));
    if (typeof value === "number") rows.push(this.slider(page, path));
    else if (typeof value === "string") rows.push(element("p", { className: "words" }, `${page.symbol}: ${value}`));
    else if (Array.isArray(value)) {
      const nodes: string[] = Array.isArray(value[0]) ? value.flatMap((_: unknown, i: number) => [`${path}.${i}.0`, `${path}.${i}.1`]) : [`${path}.0`, `${path}.1`];
      rows.push(element("div", { className: "nodes" }, element("i", {}, page.symbol), ...nodes.map((one) => this.field(one, page.words))));
    }
    return rows;
  }

  private group(name: string, rows: HTMLElement[]): HTMLElement {
    return element("fieldset", {}, element("legend", {}, name), ...rows);
  }

  private number(path: string, label: string): HTMLInputElement {
    const input = element("input", { type: "number", step: "any" });
    input.setAttribute("aria-label", label);
    input.addEventListener("change", () => {
      if (Number.isFinite(input.valueAsNumber)) this.change([[path, input.valueAsNumber]]);
    });
    this.refreshers.push((state) => {
      if (document.activeElement !== input) input.value = String(+Number(get(state, path)).toPrecision(8));
    });
    return input;
  }

  private field(path: string, label: string): HTMLElement {
    return this.number(path, label);
  }

  private slider(page: NumberPage, path: string): HTMLElement {
    const { symbol, name, words, low, high, choices } = page;
    const range = element("input", { type: "range" });
    range.setAttribute("aria-label", `${name} ${symbol}`);
    const steps = choices ? choices.length - 1 : 500;
    Object.assign(range, { min: "0", max: String(steps), step: "1" });
    let top = high;
    let first = true;
    range.addEventListener("input", () => {
      const share = range.valueAsNumber / steps;
      this.change([[path, choices ? choices[range.valueAsNumber] : +(low + share * (top - low)).toPrecision(4)]]);
    });
    this.refreshers.push((state) => {
      const value = Number(get(state, path));
      // A number far from the usual range brings its own.
      if (value > top || (first && !choices && low === 0 && value > 0 && value < top / 50)) top = value * (value > top ? 1.5 : 3);
      first = false;
      const share = choices ? choices.indexOf(value) / steps : (value - low) / (top - low);
      range.value = String(Math.round(share * steps));
      range.style.setProperty("--at", `${100 * Math.max(0, Math.min(1, share))}%`);
      range.setAttribute("aria-valuetext", String(value));
    });
    return element("div", { className: "number", title: words }, element("i", {}, symbol), element("span", {}, name === symbol ? words : name), this.number(path, `${name} ${symbol}, as a number`), range);
  }

  /** Whether a pencil lies at infinity; where it comes back from there its lines stay about where they were. */
  private infinity(page: NumberPage, law: Document): HTMLElement {
    const box = element("input", { type: "checkbox", checked: law[page.path] === null });
    const slope = (angle: number) => Math.tan((angle * Math.PI) / 180);
    const back: Record<string, number[]> = {
      A: [-0.5, +(1.75 - slope(law["phi"]) * 0.5).toFixed(3)],
      C: [-0.5, +(1.12 - slope(law["psi"]) * 0.91).toFixed(3)],
      D: [0.33, 2.4],
    };
    box.addEventListener("change", () => this.change([[`system.law.${page.path}`, box.checked ? null : back[page.path]]]));
    return element("label", { className: "line" }, box, element("span", {}, `pencil ${page.path} at infinity`));
  }
}
