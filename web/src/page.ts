/** The page: one state, the panels that show it, and what changes it. */
import { axesWithin, showAxes } from "./axes";
import { Controls, element } from "./controls";
import { Core, Refused, unpack } from "./core";
import { type Data, data as readData, savedRecords, savedState } from "./data";
import { DiagramSweep } from "./diagramsweep";
import { pageWith, toCsv } from "./export";
import { sayMotion, sceneOf, settle } from "./facts";
import { type Fit, judge } from "./fit";
import { Jobs } from "./jobs";
import { Lessons } from "./lessons";
import { columnsOf } from "./netcdf";
import { type Orbit, simulate } from "./orbit";
import { Diagram } from "./panels/diagram";
import { Displacement } from "./panels/displacement";
import { Grid } from "./panels/grid";
import { Law } from "./panels/law";
import type { Change, Panel, Scene } from "./panels/panel";
import { PanelBoxes } from "./panelboxes";
import { Phase } from "./panels/phase";
import { Returns } from "./panels/returns";
import { Rig } from "./panels/rig";
import { Spectrum } from "./panels/spectrum";
import { Surface } from "./panels/surface";
import { type Plot, type Range, neat } from "./plot";
import { type Measured, ofColumns, readRecord } from "./record";
import { RecordBox, free } from "./recordbox";
import { Sound } from "./sound";
import { type Document, type State, fromLink, get, presetState, put, toLink, toToml } from "./state";
import { type Steady, Sweeper } from "./sweeps";
import { theme } from "./theme";
import { toolbar } from "./toolbar";

const $ = <T extends HTMLElement = HTMLElement>(id: string): T => document.getElementById(id) as T;

/** Milliseconds between two pictures of a diagram on its way: all its points are drawn each time. */
const DIAGRAM_PAUSE = 60;

export async function start(source: string, program: string): Promise<void> {
  const data = readData();
  document.head.append(element("style", {}, data.style));
  const page = new Page(data, new Core(await unpack($("core").textContent!)), program, source);
  (window as any).explorer = page;
  document.body.dataset["ready"] = "yes";
}

export class Page {
  state: State;
  orbit: Orbit | null = null;
  settled: Steady | null = null;
  refused = "";
  clock = 0;
  /** Whether a change goes on from where the motion is, so that hysteresis is felt. */
  carry = false;
  playing: boolean;
  /** Natural times a second. */
  speed = 3;
  readonly panels: Panel[];
  private stale = true;
  private sweepStale = true;
  /** Whether a link stopped the motion. */
  private held = false;
  private last = 0;
  private notes: string[] = [];
  private readonly diagram: Diagram;
  private readonly sweeps: DiagramSweep;
  private readonly jobs: Jobs;
  private readonly controls: Controls;
  private fitter: Sweeper | null = null;
  private readonly box: RecordBox;
  private readonly boxes: PanelBoxes;
  records: Measured[] = savedRecords();
  fitting = false;
  /** The numbers of which a record said nothing when a law was fitted to it. */
  silent: { of: string; paths: string[] } | null = null;
  readonly sound = new Sound();
  readonly lessons: Lessons;

  constructor(
    readonly data: Data,
    readonly core: Core,
    program: string,
    private readonly source: string,
  ) {
    const law = new Law($("law"), data.laws);
    const phase = new Phase($("phase"));
    const displacement = new Displacement($("displacement"));
    const surface = new Surface($("surface"));
    const [spectrum, returns] = [new Spectrum($("spectrum")), new Returns($("returns"))];
    const regimes = new Grid($("regimes"), "Regime map: kinds of motion over two numbers; a click goes there", false);
    const basin = new Grid($("basin"), "Basins of attraction: starts by the motion they end in; a click starts there", true);
    this.diagram = new Diagram($("diagram"));
    this.panels = [new Rig($("rig")), law, phase, displacement, this.diagram, spectrum, surface, regimes, basin, returns];
    law.change = (changes) => this.change(changes.map(([path, value]) => [`system.${path}`, value]));
    const startAt = ({ x, y }: Plot) => (x0: number, v0: number) => {
      const all = (value: number, { low, high }: Range) => Array.from({ length: this.state.chain.masses }, () => neat(value, high - low));
      this.clock = 0;
      this.change([["start", { x0: all(x0, x), v0: all(v0, y) }]]);
    };
    phase.pick = (x, v) => startAt(phase.plot)(x, v);
    basin.pick = (x, v) => startAt(basin.plot)(x, v);
    basin.here = ({ state: { start, system } }) => [start.x0?.[0] ?? 0, start.v0?.[0] ?? system["drive_velocity"]];
    regimes.here = ({ state: { map, system } }) => [get(system, map.x), get(system, map.y)];
    regimes.pick = (x, y) => {
      const { map } = this.state;
      this.change([
        [`system.${map.x}`, neat(x, map.across[1])],
        [`system.${map.y}`, neat(y, map.up[1])],
      ]);
    };
    displacement.seek = (t) => this.seek(t);
    displacement.step = (by) => this.seek(this.clock + (by * this.state.t_end) / 400);
    this.diagram.change = (value) => {
      const { over, low, high } = this.state.diagram;
      this.change([[`system.${over}`, neat(Math.max(low, Math.min(high, value)), high)]]);
    };
    surface.redraw = () => this.drawPanel(surface);
    this.sweeps = new DiagramSweep(this.diagram, program, core.module);
    const host = {
      state: () => this.state,
      ready: () => Boolean(this.orbit && !this.refused),
      integrated: () => this.integrated,
      // Of an integration the core has no derivative.
      wild: () => this.settled?.period === 0 && !this.integrated,
      draw: (panel: Panel) => this.drawPanel(panel),
      tell: () => this.tell(),
    };
    this.jobs = new Jobs({ returns, basin, regimes, phase: phase.plot }, host, program, core.module);
    this.box = new RecordBox($("record-box"), (paths) => this.fit(program, paths), (record) => this.measure(this.records.filter((one) => one !== record)));
    this.controls = new Controls($("numbers"), data, (changes) => this.change(changes));
    this.lessons = new Lessons($("lesson"), data.lessons, (link) => this.open(link), (paths) => this.controls.sliders(paths, this.state));
    this.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.state = this.opened();
    this.boxes = new PanelBoxes($("panel-boxes"), this.panels, (shown) => this.change([["view.panels", shown]]));
    toolbar(this);
    this.play(this.playing);
    this.showMoment();
    new ResizeObserver(() => (this.stale = true)).observe($("panels"));
    // On a phone the rig stays on top, under the words on the motion.
    new ResizeObserver(() => document.body.style.setProperty("--facts", `${$("facts").offsetHeight}px`)).observe($("facts"));
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
    this.showMoment();
    this.update();
  }

  /** A link that names a moment shows it, still; one that names none lets the page go on. */
  private showMoment(): void {
    const { time } = this.state.view;
    this.clock = time;
    if (time ? this.playing : this.held) {
      this.play(!time);
      this.held = time > 0;
    }
  }

  /** Change numbers by their paths in the state. */
  change(changes: Change[]): void {
    this.notes = [];
    for (const [path, value] of changes) this.state = put(this.state, path, value);
    if (this.carry && changes.some(([path]) => path.startsWith("system."))) this.goOn(changes.some(([path]) => path.startsWith("system.law")));
    if (changes.some(([path]) => path.startsWith("chain.masses"))) this.state = put(this.state, "start", { x0: null, v0: null });
    // What the diagram is swept over does not change the diagram itself.
    this.update(changes.every(([path]) => path === `system.${this.state.diagram.over}` || path.startsWith("view.")));
  }

  /** The motion begins where it ended, with what friction remembers; a mass that stuck goes with the belt as it is now. Under another law there is nothing to remember. */
  private goOn(anotherLaw: boolean): void {
    const { orbit, state } = this;
    if (!orbit || this.refused) return;
    const last = ({ length }: ArrayLike<number>) => length - 1;
    const x0 = orbit.x.map((x) => x[last(x)]!);
    const v0 = orbit.v.map((v, i) => (orbit.mode[i]![last(v)]! < 0 ? (state.system["drive_velocity"] as number) : v[last(v)]!));
    const { end } = orbit.words;
    this.state = put(state, "start", { x0, v0, ...(end.length && !anotherLaw ? { memory: end } : {}) });
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
    if (this.orbit?.events.length) this.seek(next ? next.t : 0);
    this.play(false);
  }

  play(on: boolean): void {
    this.playing = on;
    this.held = false;
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
    this.settled = this.integrated ? null : settle(this.core, state);
  }

  /** Whether the motion is integrated step by step: then its steady motion is computed beside the page. */
  private get integrated(): boolean {
    return this.orbit?.words.engine === "integrated";
  }

  scene(): Scene | null {
    return this.orbit && sceneOf(this.core, this.state, this.orbit, this.settled, this.records);
  }

  /** Whether the orbit diagram would look another one: its own number moves no point of it. */
  private diagramIsOld(): boolean {
    const { plot, refused } = this.diagram;
    const key = JSON.stringify([this.sweeps.swept, refused, plot.host.clientWidth, plot.host.clientHeight, theme().dark, this.state.diagram, this.refused]);
    const old = key !== this.diagramKey;
    this.diagramKey = key;
    return old;
  }
  private diagramKey = "";
  private diagramDrawn = 0;
  /** The moment that the panels show; NaN where one was drawn anew. */
  private momentDrawn = NaN;

  private drawPanel(panel: Panel): void {
    this.momentDrawn = NaN;
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
    const { forcing, normal_force, springs } = this.state.system;
    for (const [id, on] of [["forced", forcing.length], ["pressed", normal_force], ["stopped", springs.length]] as const) $<HTMLInputElement>(id).checked = Boolean(on);
    $<HTMLSelectElement>("spectrum-of").value = String(this.state.view.derivative);
    $<HTMLInputElement>("time").value = String(+this.state.t_end.toPrecision(6));
    this.axisOptions();
    const preset = this.data.presets[this.state.preset];
    $<HTMLSelectElement>("presets").value = this.state.preset;
    $("source").textContent = preset?.source ?? "";
    this.boxes.show(this.state.view.panels);
    if (this.sweepStale) {
      this.sweepStale = false;
      if (this.refused) this.sweeps.clear(this.state);
      else this.sweeps.start(this.state);
    }
    this.jobs.next();
    this.tellRecord();
    for (const panel of this.panels) if (panel !== this.diagram || this.diagramIsOld()) this.drawPanel(panel);
    if (this.sound.on) this.listen();
    this.tell();
    document.body.classList.toggle("refused", Boolean(this.refused));
    this.remember();
  }

  /** Keep the state in the address once it changed, so that a reload brings it back. */
  private remember(): void {
    const link = toLink(this.state, this.data.presets);
    this.first ??= link;
    clearTimeout(this.waiting);
    if (link !== this.first || location.hash) this.waiting = window.setTimeout(() => this.toAddress(), 500);
  }
  private first: string | null = null;
  private waiting = 0;

  toAddress(): void {
    try {
      history.replaceState(null, "", this.link());
    } catch {
      // A page within another has no address of its own.
    }
  }

  /** Columns of the orbit diagram that have come: up and down. */
  get swept(): number[] {
    return this.sweeps.swept;
  }

  /** Whether the panels beside have nothing left to compute. */
  get idle(): boolean {
    return this.jobs.idle;
  }

  /** Lay records over the motion. */
  measure(records: Measured[]): void {
    this.records = records;
    this.silent = null;
    this.fitting = false;
    this.update(true);
  }

  /** A file that was dropped: a record of the rig on the page, beside those that are there, or a page that was saved; or what is wrong with it. */
  read(name: string, content: string | ArrayBuffer): void {
    try {
      const columns = typeof content === "string" ? null : columnsOf(content);
      const text = columns ? "" : typeof content === "string" ? content : new TextDecoder().decode(content);
      const page = /^\s*<!doctype html/i.test(text) ? new DOMParser().parseFromString(text, "text/html") : null;
      if (page) return this.take(name, page);
      const { stiffness, drive_velocity, forcing } = this.state.system;
      const push = (t: number) => forcing.reduce((sum: number, { amplitude, frequency, phase = 0 }: Document) => sum + amplitude * frequency * Math.sin(frequency * t + phase), 0);
      const rig = { drive: drive_velocity, stiffness, adhesion: (t: number) => stiffness * drive_velocity + push(t) };
      const record = columns ? ofColumns(name, columns, rig) : readRecord(name, text, rig);
      this.measure([...this.records.filter((one) => one.name !== name), record]);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.notes = [error.message];
      this.tell();
    }
  }

  /** The state and the records of a page that was saved. */
  private take(name: string, page: globalThis.Document): void {
    const refuse = (got: string) => new Refused(`${name}: expected a page that Save page or stickslip explore wrote, got ${got}; choose a CSV file or such a page`);
    const read = (id: string) => {
      try {
        return JSON.parse(page.getElementById(id)?.textContent || "null");
      } catch (error) {
        throw refuse(`one whose ${id} is broken (${(error as Error).message})`);
      }
    };
    const [state, records] = [read("state"), read("records")];
    if (!state?.system) throw refuse("another one");
    const next: State = { ...structuredClone(presetState(this.presetOf(state.preset), this.data.presets)), ...state };
    const lacks = Object.keys(this.state.system).filter((key) => state.system[key] === undefined);
    if (lacks.length) throw refuse(`one whose system has no ${lacks.join(", ")}`);
    // What the core refuses leaves the page as it was.
    simulate(this.core, next, 1);
    this.state = next;
    this.update();
    this.measure(records ?? []);
  }

  private fit(program: string, paths: string[]): void {
    if (!this.records.length || !paths.length) return;
    this.fitter ??= new Sweeper(program, this.core.module, ({ fit, refused }) => {
      this.fitting = !(refused || fit?.done);
      if (fit) this.change([["system.law", fit.law]]);
      if (fit?.silent) this.silent = { of: JSON.stringify(fit.law), paths: fit.silent };
      if (refused) this.notes = [refused];
      this.stale = true;
    });
    this.fitting = true;
    this.fitter.ask({ law: this.state.system["law"], paths, records: this.records });
    this.tellRecord();
  }

  private tellRecord(): void {
    const { law } = this.state.system;
    let quality: Omit<Fit, "law" | "done"> | null = null;
    try {
      if (this.records.length) quality = judge(this.core, law, this.records);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
    }
    // Said of the law that was fitted, not of what is made of it afterwards.
    const { silent } = this;
    this.box.show(this.records, law, this.data.laws[law.type]!, quality, this.fitting, silent?.of === JSON.stringify(law) ? silent.paths : null);
  }

  /** One sentence on the steady motion, and what there is to say about the link. */
  private tell(): void {
    const host = $("facts");
    host.replaceChildren();
    if (this.integrated && !this.refused) [this.settled, this.momentDrawn] = [this.jobs.steady, NaN];
    const strong = (text: string, name = "") => host.append(Object.assign(document.createElement("b"), { textContent: text, className: name }));
    if (this.notes.length) {
      strong(`${this.notes.join("; ")}. `, "bad");
    }
    if (this.refused) {
      strong(this.refused, "bad");
      return;
    }
    sayMotion(host, this.state, this.orbit!, this.settled, this.integrated ? { late: null, test: NaN, exponent: null } : this.jobs.chaos);
  }

  /** What can be swept or mapped may have changed with the law. */
  private axisOptions(): void {
    const { state, changed } = axesWithin(this.data, this.state);
    this.state = state;
    this.sweepStale ||= changed;
    showAxes(this.data, state);
  }

  private frame(now: number): void {
    const step = Math.min(0.1, (now - this.last) / 1000);
    this.last = now;
    if (this.stale) {
      this.stale = false;
      this.redraw();
    } else if (this.sweeps.stale && (now > this.diagramDrawn + DIAGRAM_PAUSE || this.sweeps.done)) {
      [this.sweeps.stale, this.diagramDrawn] = [false, now];
      if (this.diagramIsOld()) this.drawPanel(this.diagram);
    }
    if (this.jobs.stale) {
      this.drawPanel(this.jobs.stale);
      this.jobs.stale = null;
    }
    const { orbit } = this;
    if (orbit && !this.refused) {
      if (this.playing) this.clock += step * this.speed * Math.max(1 / this.natural, this.records.length ? orbit.words.t_last / 150 : 0);
      if (this.clock > orbit.words.t_last) this.clock = 0.6 * orbit.words.t_last;
      // A page that stands still costs nothing.
      if (this.clock !== this.momentDrawn) {
        this.momentDrawn = this.clock;
        const scene = this.scene()!;
        for (const panel of this.panels) if (panel.plot.width && panel.plot.height) panel.time(scene, this.clock);
      }
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  /** Draw all anew, as after another theme. */
  redrawAll(): void {
    this.stale = true;
  }

  /** Panels drawn with so many pixels of the canvas for one of the page, while something is made of them. */
  async sharp<Made>(panels: Panel[], sharpness: number, make: () => Promise<Made>): Promise<Made> {
    const set = (value: number | null) => {
      for (const panel of panels) {
        panel.plot.sharpness = value;
        this.drawPanel(panel);
        const scene = this.scene();
        if (scene && !this.refused && panel.plot.width) panel.time(scene, this.clock);
      }
    };
    set(sharpness);
    try {
      return await make();
    } finally {
      set(null);
    }
  }

  /** The last period of the motion, or ten natural ones where it has none, and how long the page takes to show it. */
  cycle(): { from: number; lasts: number; seconds: number } | null {
    if (!this.orbit || this.refused) return null;
    const end = this.orbit.words.t_last;
    const period = this.settled?.periodTime ?? 0;
    const lasts = Math.min(period > 0 && period < 0.5 * end ? period : (20 * Math.PI) / this.natural, 0.5 * end);
    return { from: end - lasts, lasts, seconds: Math.max(1.5, Math.min(8, (lasts * this.natural) / this.speed)) };
  }

  private get natural(): number {
    const { mass, stiffness } = this.state.system;
    return Math.sqrt(stiffness / mass);
  }

  /** Hear the motion; a change of it is heard at once. */
  listen(): void {
    if (!this.orbit || this.refused) return this.sound.stop();
    // At its left end the slider leaves the pitch as it is: of a system in SI units.
    const { valueAsNumber: pitch, min } = $<HTMLInputElement>("pitch");
    this.sound.play(this.core, this.orbit, this.natural, pitch > Number(min) ? pitch : this.natural / (2 * Math.PI), this.state.view.derivative === 3 ? 3 : 1);
  }

  toml(): string {
    return toToml(this.state);
  }

  /** The state with the moment that is looked at. */
  private get shown(): State {
    return put(this.state, "view.time", this.playing ? 0 : +this.clock.toPrecision(6));
  }

  link(): string {
    return toLink(this.shown, this.data.presets);
  }

  csv(): string {
    return this.orbit ? toCsv(this.orbit) : "";
  }

  cells(id: string): number {
    return this.jobs.cells(id);
  }

  /** The paths of the numbers of the law that can be fitted. */
  fittable(): string[] {
    const { law } = this.state.system;
    return free(law, this.data.laws[law.type]!).map(({ path }) => path);
  }

  /** Leave a number out of the fit. */
  hold(path: string): void {
    this.box.held.add(path);
    this.stale = true;
    this.tellRecord();
  }

  savedPage(): string {
    return pageWith(this.source, { state: this.shown, records: this.records });
  }
}
