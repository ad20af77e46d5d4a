/** The numbers of the system and its law, as sliders with fields; their names, ranges and words come from the package. */
import type { Data, NumberPage } from "./data";
import type { Change } from "./panels/panel";
import { type Document, type State, get } from "./state";

/** Whether a number of a law is one of the paper's pencils: points, set upright where one letter means a number too. */
export const isPencil = (law: Document, path: string): boolean => law["type"] === "BogaczRyczek" && /^[ABCD](\.|$)/.test(path);

export function element<K extends keyof HTMLElementTagNameMap>(tag: K, properties: object = {}, ...children: (Node | string)[]): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  Object.assign(made as object, properties);
  made.append(...children);
  return made;
}

/** The velocity a motion starts with. */
const PUSH: NumberPage = { path: "", symbol: "ẋ₀", name: "push", words: "velocity that the push gives", unit: "velocity", low: -0.6, high: 0.6 };
export const FORCING: NumberPage[] = [
  { path: "forcing.0.amplitude", symbol: "u₀", name: "amplitude", words: "amplitude of the forcing", unit: "force", low: 0, high: 0.5 },
  { path: "forcing.0.frequency", symbol: "Ω", name: "frequency", words: "angular frequency of the forcing", unit: "", low: 0.1, high: 4 },
];
export const NORMAL_FORCE: NumberPage[] = [
  { path: "normal_force.constant", symbol: "n₀", name: "constant part", words: "constant part of the normal force, over that of the law", unit: "", low: 0, high: 3 },
  { path: "normal_force.harmonics.0.amplitude", symbol: "nₐ", name: "swing", words: "amplitude of its harmonic", unit: "", low: 0, high: 1 },
  { path: "normal_force.harmonics.0.frequency", symbol: "Ωₙ", name: "frequency of the swing", words: "angular frequency of its harmonic", unit: "", low: 0.1, high: 4 },
  { path: "normal_force.position", symbol: "nₓ", name: "with x", words: "what it gains with the displacement, ∂n/∂x", unit: "", low: -2, high: 2 },
  { path: "normal_force.velocity", symbol: "nᵥ", name: "with ẋ", words: "what it gains with the velocity, ∂n/∂ẋ", unit: "", low: -2, high: 2 },
];
export const SPRING: NumberPage[] = [{ path: "springs.0.cubic", symbol: "κ₃", name: "cubic part", words: "factor of x³ in the force of the spring", unit: "", low: -1, high: 3 }];
/** Nodes of a table above which it is folded. */
const FOLDED = 12;

export class Controls {
  private shape = "";
  private law: Document | null = null;
  private refreshers: { input: HTMLElement; refresh(state: State): void }[] = [];

  constructor(
    private readonly host: HTMLElement,
    private readonly data: Data,
    private readonly change: (changes: Change[]) => void,
  ) {}

  /** Show the numbers of a state; built anew only where it has other numbers. */
  show(state: State): void {
    const { law, forcing, normal_force, springs } = state.system as Document;
    this.law = law;
    const shape = JSON.stringify([law.type, forcing.length, normal_force?.harmonics.length, springs[0]?.nodes.length, state.chain.masses > 1, Object.entries(law).map(([key, value]) => [key, Array.isArray(value) ? value.length : value === null])]);
    if (shape !== this.shape) {
      this.shape = shape;
      this.build(state);
    }
    this.refreshers = this.refreshers.filter(({ input }) => input.isConnected);
    for (const { refresh } of this.refreshers) refresh(state);
  }

  /** Sliders of numbers by their paths in the state, to stand elsewhere on the page. */
  sliders(paths: string[], { system: { law } }: State): HTMLElement[] {
    const known: Record<string, NumberPage> = { "start.v0.0": PUSH };
    for (const page of [...this.data.oscillator, ...FORCING, ...NORMAL_FORCE, ...SPRING]) known[`system.${page.path}`] = page;
    for (const page of this.data.laws[law.type]!.numbers) known[`system.law.${page.path}`] = page;
    return paths.filter((path) => path in known).map((path) => this.slider(known[path]!, path));
  }

  private build(state: State): void {
    const { law, forcing, normal_force, springs } = state.system as Document;
    const groups: HTMLElement[] = [];
    groups.push(this.group("Rig", this.data.oscillator.map((page) => this.slider(page, `system.${page.path}`))));
    const chain: NumberPage[] = [{ path: "masses", symbol: "n", name: "masses in a row", words: "masses in a row", unit: "", low: 1, high: 5, choices: [1, 2, 3, 4, 5] }];
    if (state.chain.masses > 1) chain.push({ path: "coupling", symbol: "κ", name: "coupling", words: "stiffness of the springs between neighbours", unit: "", low: 0, high: 5 });
    groups.push(this.group("Chain", chain.map((page) => this.slider(page, `chain.${page.path}`))));
    if (forcing.length)
      groups.push(
        this.group("Forcing", FORCING.map((page) => this.slider(page, `system.${page.path}`))),
      );
    const there = ({ path }: NumberPage) => get(state.system, path) !== undefined;
    if (normal_force) groups.push(this.group("Normal force", NORMAL_FORCE.filter(there).map((page) => this.slider(page, `system.${page.path}`))));
    springs.forEach(({ nodes }: Document, i: number) => {
      const rows = i ? [] : SPRING.map((page) => this.slider(page, `system.${page.path}`));
      if (nodes?.length) rows.push(this.nodes(nodes.map((_: unknown, k: number) => `system.springs.${i}.nodes.${k}`), ["displacement", "force"], "node of the spring", element("i", {}, "x, r")));
      groups.push(this.group(springs.length > 1 ? `Spring ${i + 1}` : "Spring", rows));
    });
    const page = this.data.laws[law.type]!;
    const within = (one: NumberPage) => one.path.startsWith("static_friction.");
    for (const [name, numbers] of [["Law", page.numbers.filter((one) => !within(one))], ["Static friction fₛ", page.numbers.filter(within)]] as const)
      if (numbers.length) groups.push(this.group(name, numbers.flatMap((one) => this.rows(one, law))));
    this.host.replaceChildren(...groups);
  }

  /** The controls of one parameter of the law: a number, a pencil that may lie at infinity, or a table of nodes. */
  private rows(page: NumberPage, law: Document): HTMLElement[] {
    const value = get(law, page.path);
    const path = `system.law.${page.path}`;
    const rows: HTMLElement[] = [];
    if (isPencil(law, page.path) && page.path !== "B") rows.push(this.infinity(page, law));
    if (typeof value === "number") rows.push(this.slider(page, path));
    else if (page.options) rows.push(this.options(page, path));
    else if (page.path === "second_b") rows.push(this.secondState(false));
    if (page.path === "second_length" && typeof value === "number") rows.push(this.secondState(true));
    if (Array.isArray(value)) {
      const pairs: string[] = Array.isArray(value[0]) ? value.map((_: unknown, i: number) => `${path}.${i}`) : [path];
      const sides = page.unit === "velocity, force" ? ["slip velocity", "force"] : page.path === "l" ? ["slope", "height at w = 0"] : ["first", "second"];
      const table = this.nodes(pairs, sides, page.words, element(isPencil(law, page.path) ? "b" : "i", {}, page.symbol));
      rows.push(pairs.length > FOLDED ? element("details", {}, element("summary", {}, `${page.symbol}: ${pairs.length} nodes`), table) : table);
    }
    return rows;
  }

  /** Pairs of numbers as fields. */
  private nodes(pairs: string[], sides: string[], words: string, symbol: HTMLElement): HTMLElement {
    const fields = pairs.flatMap((pair, i) => sides.map((side, j) => this.number(`${pair}.${j}`, `${words}: ${pairs.length > 1 ? `node ${i + 1}, ` : ""}${side}`)));
    return element("div", { className: "nodes" }, symbol, ...fields);
  }

  private group(name: string, rows: HTMLElement[]): HTMLElement {
    return element("fieldset", {}, element("legend", {}, name), ...rows);
  }

  private number(path: string, label: string): HTMLInputElement {
    const input = element("input", { type: "number", step: "any" });
    input.setAttribute("aria-label", label);
    input.addEventListener("change", () => {
      if (Number.isFinite(input.valueAsNumber)) this.change([[path, input.valueAsNumber]]);
      else input.value = was;
    });
    let was = "";
    this.refreshers.push({ input, refresh: (state) => {
      was = String(+Number(get(state, path)).toPrecision(8));
      if (document.activeElement !== input) input.value = was;
    } });
    return input;
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
    const refresh = (state: State) => {
      const value = Number(get(state, path));
      // A number far from the usual range brings its own.
      if (value > top || (first && !choices && low === 0 && value > 0 && value < top / 50)) top = value * (value > top ? 1.5 : 3);
      first = false;
      const share = choices ? choices.indexOf(value) / steps : (value - low) / (top - low);
      range.value = String(Math.round(share * steps));
      range.style.setProperty("--at", `${100 * Math.max(0, Math.min(1, share))}%`);
      range.setAttribute("aria-valuetext", String(value));
    };
    this.refreshers.push({ input: range, refresh });
    return element("div", { className: "number", title: words }, element("i", {}, symbol), element("span", {}, name === symbol ? words : name), this.number(path, `${name} ${symbol}, as a number`), range);
  }

  /** A word among others. The composite evolution of a state has a cutoff velocity, no other one has. */
  private options({ path: key, symbol, name, words, options }: NumberPage, path: string): HTMLElement {
    const select = element("select", { ariaLabel: name }, ...options!.map((word) => new Option(word)));
    select.addEventListener("change", () => {
      const law = this.law!;
      const cutoff: Change[] = key === "law" && "cutoff_velocity" in law ? [["system.law.cutoff_velocity", select.value === "composite" ? law["reference_velocity"] : null]] : [];
      this.change([[path, select.value], ...cutoff]);
    });
    this.refreshers.push({ input: select, refresh: (state) => (select.value = get(state, path)) });
    return element("label", { className: "line", title: words }, element("span", {}, key === "law" ? "evolution" : symbol), select);
  }

  /** Whether friction of rock has a second state variable: at first of half the effect, over a tenth of the length. */
  private secondState(there: boolean): HTMLElement {
    const box = element("input", { type: "checkbox", checked: there });
    box.addEventListener("change", () => {
      const { b, length } = this.law!;
      this.change([["system.law.second_b", there ? null : b / 2], ["system.law.second_length", there ? null : length / 10]]);
    });
    return element("label", { className: "line" }, box, element("span", {}, "second state variable"));
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
