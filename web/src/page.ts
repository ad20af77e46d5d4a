/** The page: one state, the panels that show it, and what changes it. */
import { Controls } from "./controls";
import { Core, Refused, unpack } from "./core";
import { type Data, data as readData, savedState } from "./data";
import { pageWith, picture, save, toCsv } from "./export";
import { type Orbit, RELEASE, simulate } from "./orbit";
import { Diagram } from "./panels/diagram";
import { Displacement } from "./panels/displacement";
import { Law } from "./panels/law";
import type { Change, Panel, Scene } from "./panels/panel";
import { Phase } from "./panels/phase";
import { Rig } from "./panels/rig";
import { Spectrum } from "./panels/spectrum";
import { Surface } from "./panels/surface";
import { Sound } from "./sound";
import { type State, documentOf, fromLink, get, presetState, put, toLink, toToml, varied } from "./state";
import { REGIMES, REGIME_NAMES, type Steady, type SweepPart, Sweeper, lookOf, steady } from "./sweeps";

const $ = <T extends HTMLElement = HTMLElement>(id: string): T => document.getElementById(id) as T;

/** Columns of the orbit diagram. */
const COLUMNS = 300;
/** Periods that are left out before a motion counts as steady. */
const TRANSIENT = 80;
const NO_SWEEP = "The orbit diagram is swept in closed form, for one mass and laws of linear pieces. For this system: stickslip sweep.";

export async function start(source: string, program: string): Promise<void> {
  const module = await unpack($("core").textContent!);
  const page = new Page(readData(), new Core(module), program, source);
  (window as any).explorer = page;
  document.body.dataset["ready"] = "yes";
}

class Page {
  state: State;
  orbit: Orbit | null = null;
  settled: Steady | null = null;
  refused = "";
  clock = 0;
  playing: boolean;
  /** Columns of the diagram that have come: up and down. */
  swept = [0, 0];
  private speed = 3;
  private stale = true;
  private sweepStale = true;
  private diagramStale = false;
  private last = 0;
  private notes: string[] = [];
  private readonly panels: Panel[];
  private readonly diagram: Diagram;
  private readonly controls: Controls;
  private readonly sweepers: Sweeper[];
  readonly sound = new Sound();

  constructor(
    private readonly data: Data,
    readonly core: Core,
    program: string,
    private readonly source: string,
  ) {
    const law = new Law($("law"), data.laws);
    const phase = new Phase($("phase"));
    const displacement = new Displacement($("displacement"));
    const surface = new Surface($("surface"));
    this.diagram = new Diagram($("diagram"));
    this.panels = [new Rig($("rig")), law, phase, displacement, this.diagram, new Spectrum($("spectrum")), surface];
    law.change = (changes) => this.change(changes.map(([path, value]) => [`system.${path}`, value]));
    phase.pick = (x, v) => {
      const all = (value: number) => Array.from({ length: this.state.chain.masses }, () => +value.toFixed(3));
      this.clock = 0;
      this.change([["start", { x0: all(x), v0: all(v) }]]);
    };
    displacement.seek = (t) => this.seek(t);
    displacement.step = (by) => this.seek(this.clock + (by * this.state.t_end) / 400);
    this.diagram.change = (value) => {
      const { over, low, high } = this.state.diagram;
      this.change([[`system.${over}`, +Math.max(low, Math.min(high, value)).toFixed(4)]]);
    };
    surface.redraw = () => this.drawPanel(surface);
    this.sweepers = [0, 1].map((which) => new Sweeper(program, core.module, (part) => this.hear(which, part)));
    this.controls = new Controls($("numbers"), data, (changes) => this.change(changes));
    this.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.state = this.opened();
    this.buttons();
    new ResizeObserver(() => (this.stale = true)).observe($("panels"));
    this.update();
    requestAnimationFrame((now) => this.frame(now));
  }

  /** The state of the link, else the one saved in the page, else the first preset. */
  private opened(): State {
    const saved = savedState();
    if (saved && location.hash.length < 2) return { ...structuredClone(presetState(this.presetOf(saved.preset), this.data.presets)), ...saved };
    const { state, unknown } = fromLink(location.hash, this.data.presets);
    this.notes = unknown;
    return state;
  }

  private presetOf(name: string): string {
    return name in this.data.presets ? name : Object.keys(this.data.presets)[0]!;
  }

  /** Take the state of a link; what says nothing in it is named. */
  open(hash: string): void {
    const { state, unknown } = fromLink(hash, this.data.presets);
    this.notes = unknown;
    this.state = state;
    this.clock = 0;
    this.update();
  }

  /** Change numbers by their paths in the state. */
  change(changes: Change[]): void {
    this.notes = [];
    for (const [path, value] of changes) this.state = put(this.state, path, value);
    if (changes.some(([path]) => path.startsWith("chain.masses"))) this.state = put(this.state, "start", { x0: null, v0: null });
    // What the diagram is swept over does not change the diagram itself.
    this.update(!changes.length || changes.every(([path]) => path === `system.${this.state.diagram.over}`));
  }

  private update(sameDiagram = false): void {
    this.stale = true;
    if (!sameDiagram) this.sweepStale = true;
  }

  seek(t: number): void {
    this.clock = Math.max(0, Math.min(this.orbit?.words.t_last ?? 0, t));
  }

  /** To the next event, and stop there. */
  nextEvent(): void {
    const next = this.orbit?.events.find(({ t }) => t > this.clock + 1e-9);
    this.seek(next ? next.t : 0);
    this.play(false);
  }

  play(on: boolean): void {
    this.playing = on;
    $("play").textContent = on ? "Pause" : "Play";
  }

  private compute(): void {
    const { state } = this;
    this.refused = "";
    try {
      this.orbit = simulate(this.core, state);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.refused = error.message;
    }
    this.settled = null;
    if (this.refused) return;
    const { names, row } = varied(state, "drive_velocity");
    const values = row(state.system["drive_velocity"]);
    const question = { system: documentOf(state), names, values, look: lookOf(state.system, TRANSIENT), x0: state.start.x0?.[0] ?? 0, v0: state.start.v0?.[0] ?? null };
    try {
      this.settled = steady(this.core, question).rows[0] ?? null;
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
    }
  }

  private scene(): Scene | null {
    const { orbit, core, state, settled } = this;
    if (!orbit) return null;
    // The last third, at most forty natural periods of it.
    const period = 2 * Math.PI * Math.sqrt(state.system["mass"] / state.system["stiffness"]);
    const from = Math.max(0.6 * orbit.words.t_last, orbit.words.t_last - 40 * period);
    let first = orbit.t.findIndex((t) => t >= from);
    if (first < 0) first = 0;
    return { core, state, orbit, steady: first, settled };
  }

  private drawPanel(panel: Panel): void {
    const scene = this.scene();
    if (!scene || this.refused) return;
    panel.plot.fit();
    if (!panel.plot.width || !panel.plot.height) return;
    try {
      panel.draw(scene);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      panel.plot.say(error.message);
    }
  }

  private redraw(): void {
    this.compute();
    this.controls.show(this.state);
    $<HTMLSelectElement>("type").value = this.state.system["law"].type;
    $<HTMLInputElement>("forced").checked = this.state.system["forcing"].length > 0;
    $<HTMLInputElement>("time").value = String(this.state.t_end);
    this.axisOptions();
    for (const button of $("presets").querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.dataset["name"] === this.state.preset));
    if (this.sweepStale) this.sweep();
    for (const panel of this.panels) this.drawPanel(panel);
    if (this.sound.on) this.listen();
    this.tell();
    document.body.classList.toggle("refused", Boolean(this.refused));
  }

  private sweep(): void {
    this.sweepStale = false;
    const { diagram } = this;
    const { over, low, high } = this.state.diagram;
    diagram.values = Array.from({ length: COLUMNS }, (_, i) => low + ((high - low) * i) / (COLUMNS - 1));
    [diagram.up, diagram.down, diagram.refused, this.swept] = [[], [], "", [0, 0]];
    if (this.refused) return;
    const { names, row } = varied(this.state, over);
    const rows = diagram.values.map(row);
    const question = { system: documentOf(this.state), names, look: lookOf(this.state.system, 60), x0: this.state.start.x0?.[0] ?? 0 };
    this.sweepers[0]!.ask({ ...question, rows });
    this.sweepers[1]!.ask({ ...question, rows: rows.toReversed() });
  }

  private hear(which: number, part: SweepPart): void {
    const { diagram } = this;
    if (part.refused) diagram.refused ||= this.orbit?.words.exact ? part.refused : NO_SWEEP;
    part.rows.forEach((row, i) => {
      if (which) diagram.down[COLUMNS - 1 - part.from - i] = row;
      else diagram.up[part.from + i] = row;
    });
    this.swept[which]! += part.rows.length;
    this.diagramStale = true;
  }

  /** One sentence on the steady motion, and what there is to say about the link. */
  private tell(): void {
    const host = $("facts");
    host.replaceChildren();
    const strong = (text: string, name = "") => host.append(Object.assign(document.createElement("b"), { textContent: text, className: name }));
    if (this.notes.length) {
      strong(`${this.notes.join("; ")}. `, "bad");
    }
    if (this.refused) {
      strong(this.refused, "bad");
      return;
    }
    const { settled, orbit } = this as { settled: Steady | null; orbit: Orbit };
    const name = settled ? REGIMES[settled.regime]! : REGIMES[REGIME_NAMES.indexOf(orbit.words.regime)]!;
    strong(name[0]!.toUpperCase() + name.slice(1), "regime");
    const forced = this.state.system["forcing"].length > 0;
    const say = (before: string, value: number, digits: number, after = "") => {
      host.append(before);
      strong(value.toFixed(digits));
      if (after) host.append(after);
    };
    if (settled) {
      if (settled.periodTime > 0) {
        if (forced) say(", repeats after ", settled.period, 0, settled.period > 1 ? " forcing periods" : " forcing period");
        else say(", period ", settled.periodTime, 6);
      } else if (settled.period === 0) host.append(", does not repeat");
      if (settled.x[1] - settled.x[0] > 1e-9) say(", amplitude ", (settled.x[1] - settled.x[0]) / 2, 5);
    }
    const last = orbit.events.findLast(({ kind, t, contact }) => kind === RELEASE && contact === 0 && t > 0.6 * orbit.words.t_last);
    if (last) {
      say(", sticks for ", last.stickTime, 4);
      say(" and breaks away at ", Math.abs(last.force), 4);
    }
    host.append(`. ${orbit.words.events} events, ${orbit.words.exact ? "each exact" : "by Taylor series"}`);
    if (orbit.words.stop !== "t_end") host.append(`; ${orbit.words.sentence}`);
    host.append(".");
  }

  private axisOptions(): void {
    const select = $<HTMLSelectElement>("over");
    const { law, forcing } = this.state.system;
    const pages = [
      ...this.data.oscillator.map((page) => ({ ...page })),
      ...(forcing.length ? [{ path: "forcing.0.amplitude", symbol: "u₀" }, { path: "forcing.0.frequency", symbol: "Ω" }] : []),
      ...this.data.laws[law.type]!.numbers.filter((page) => typeof get(law, page.path) === "number" && !("choices" in page)).map((page) => ({ ...page, path: `law.${page.path}` })),
    ];
    const wanted = pages.map(({ path }) => path).join();
    if (select.dataset["wanted"] !== wanted) {
      select.dataset["wanted"] = wanted;
      select.replaceChildren(...pages.map(({ path, symbol }) => new Option(symbol, path)));
    }
    if (!pages.some(({ path }) => path === this.state.diagram.over)) {
      this.state = put(this.state, "diagram", { over: "drive_velocity", low: 0.02, high: 0.6 });
      this.sweepStale = true;
    }
    select.value = this.state.diagram.over;
    for (const end of ["low", "high"] as const) {
      const input = $<HTMLInputElement>(end);
      if (document.activeElement !== input) input.value = String(this.state.diagram[end]);
    }
  }

  private frame(now: number): void {
    const step = Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    if (this.stale) {
      this.stale = this.diagramStale = false;
      this.redraw();
    } else if (this.diagramStale) {
      this.diagramStale = false;
      this.drawPanel(this.diagram);
    }
    const scene = this.scene();
    if (scene && !this.refused) {
      if (this.playing) this.clock += step * this.speed;
      if (this.clock > scene.orbit.words.t_last) this.clock = 0.6 * scene.orbit.words.t_last;
      for (const panel of this.panels) if (panel.plot.width && panel.plot.height) panel.time(scene, this.clock);
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  /** Hear the motion; a change of it is heard at once. */
  listen(): void {
    const { mass, stiffness } = this.state.system;
    if (!this.orbit || this.refused) return this.sound.stop();
    this.sound.play(this.core, this.orbit, Math.sqrt(stiffness / mass), $<HTMLInputElement>("pitch").valueAsNumber);
  }

  toml(): string {
    return toToml(this.state);
  }

  link(): string {
    return toLink(this.state, this.data.presets);
  }

  savedPage(): string {
    return pageWith(this.source, this.state);
  }

  private buttons(): void {
    for (const [name, { title, source }] of Object.entries(this.data.presets)) {
      const button = Object.assign(document.createElement("button"), { textContent: title, title: source, type: "button" });
      button.dataset["name"] = name;
      button.onclick = () => this.open(`#${name}`);
      $("presets").append(button);
    }
    for (const [name, page] of Object.entries(this.data.laws)) {
      const option = new Option(name, name);
      option.title = page.sentence;
      $("type").append(option);
    }
    $<HTMLSelectElement>("type").onchange = ({ target }) => this.change([["system.law", structuredClone(this.data.laws[(target as HTMLSelectElement).value]!.example)]]);
    $<HTMLInputElement>("forced").onchange = ({ target }) =>
      this.change([["system.forcing", (target as HTMLInputElement).checked ? [{ amplitude: 0.05, frequency: 1.25, phase: 0 }] : []]]);
    $<HTMLInputElement>("time").onchange = ({ target }) => {
      const value = (target as HTMLInputElement).valueAsNumber;
      if (value > 0) this.change([["t_end", Math.min(5000, value)]]);
    };
    $<HTMLSelectElement>("over").onchange = ({ target }) => {
      const over = (target as HTMLSelectElement).value;
      const value = Number(get(this.state.system, over));
      const [low, high] = over === "drive_velocity" ? [0.02, 0.6] : [Math.min(0.5 * value, 1.5 * value), Math.max(0.5 * value, 1.5 * value)];
      this.change([["diagram", { over, low: +low.toPrecision(4), high: +(high || 1).toPrecision(4) }]]);
    };
    for (const end of ["low", "high"] as const)
      $<HTMLInputElement>(end).onchange = ({ target }) => {
        const next = { ...this.state.diagram, [end]: (target as HTMLInputElement).valueAsNumber };
        if (next.low < next.high) this.change([["diagram", next]]);
      };
    $("play").onclick = () => this.play(!this.playing);
    this.play(this.playing);
    const heard = () => $("listen").setAttribute("aria-pressed", String(this.sound.on));
    $("listen").onclick = () => {
      if (this.sound.on) this.sound.stop();
      else this.listen();
      heard();
    };
    $("pitch").oninput = () => this.sound.on && this.listen();
    $("next").onclick = () => this.nextEvent();
    $<HTMLInputElement>("speed").oninput = ({ target }) => (this.speed = (target as HTMLInputElement).valueAsNumber);
    $("theme").onclick = () => {
      document.documentElement.dataset["theme"] = document.documentElement.dataset["theme"] === "dark" ? "light" : "dark";
      this.stale = true;
    };
    $("toml").onclick = () => save("system.toml", this.toml(), "text/plain");
    $("csv").onclick = () => this.orbit && save("orbit.csv", toCsv(this.orbit), "text/csv");
    $("png").onclick = async () => save("stickslip.png", await picture(this.panels.map(({ plot }) => plot), $("panels")), "image/png");
    $("save").onclick = () => save("explorer.html", this.savedPage(), "text/html");
    $("link").onclick = async () => {
      try {
        history.replaceState(null, "", this.link());
      } catch {
        // A page within another has no address of its own.
      }
      await navigator.clipboard?.writeText(location.href.replace(/#.*$/, "") + this.link()).catch(() => undefined);
      $("link").textContent = "Copied";
      setTimeout(() => ($("link").textContent = "Copy link"), 1200);
    };
    addEventListener("hashchange", () => this.open(location.hash));
    addEventListener("keydown", (event) => {
      if (event.target !== document.body) return;
      if (event.key === " ") {
        event.preventDefault();
        this.play(!this.playing);
      } else if (event.key === "n") this.nextEvent();
    });
  }
}
