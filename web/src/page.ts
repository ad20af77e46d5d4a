/** The page: one state, the panels that show it, and what changes it. */
import { Controls } from "./controls";
import { Core, Refused, unpack } from "./core";
import { type Data, data as readData, savedRecord, savedState } from "./data";
import { pageWith, picture, save, toCsv } from "./export";
import { sayMotion, sceneOf, settle } from "./facts";
import { type Orbit, simulate } from "./orbit";
import { Diagram } from "./panels/diagram";
import { Displacement } from "./panels/displacement";
import { Law } from "./panels/law";
import type { Change, Panel, Scene } from "./panels/panel";
import { Grid } from "./panels/grid";
import { Phase } from "./panels/phase";
import { Returns } from "./panels/returns";
import { Rig } from "./panels/rig";
import { Spectrum } from "./panels/spectrum";
import { Surface } from "./panels/surface";
import { Lessons } from "./lessons";
import { type Plot, type Range, neat } from "./plot";
import { type Measured, readRecord } from "./record";
import { RecordBox, free } from "./recordbox";
import { type Fit, judge } from "./fit";
import { Sound } from "./sound";
import { type Document, FRESH, type State, documentOf, fromLink, get, presetState, put, toLink, toToml, varied } from "./state";
import { theme } from "./theme";
import { REGIMES, type Steady, type SweepAsk, type SweepPart, Sweeper, lookOf } from "./sweeps";

const $ = <T extends HTMLElement = HTMLElement>(id: string): T => document.getElementById(id) as T;

/** Columns of the orbit diagram. */
const COLUMNS = 300;

export async function start(source: string, program: string): Promise<void> {
  const module = await unpack($("core").textContent!);
  const page = new Page(readData(), new Core(module), program, source);
  (window as any).explorer = page;
  document.body.dataset["ready"] = "yes";
}

/** Something computed beside the page for one panel. */
interface Job {
  panel: Panel;
  /** What its answer is of. */
  key: string;
  /** Whether the panel is in the window. */
  seen: boolean;
  ask(): Omit<SweepAsk, "id">;
  hear(part: SweepPart): void;
}

class Page {
  state: State;
  orbit: Orbit | null = null;
  settled: Steady | null = null;
  refused = "";
  clock = 0;
  /** Whether a change goes on from where the motion is, so that hysteresis is felt. */
  carry = false;
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
  private readonly regimes: Grid;
  private readonly basin: Grid;
  private readonly returns: Returns;
  private readonly sweepers: Sweeper[];
  /** What is computed beside the page for the panels below, one after another; each with what it depends on. */
  private readonly jobs: Job[];
  private job: Job | null = null;
  private readonly side: Sweeper;
  private fitter: Sweeper | null = null;
  private readonly box: RecordBox;
  record: Measured | null = savedRecord();
  fitting = false;
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
    this.diagram = new Diagram($("diagram"));
    this.regimes = new Grid($("regimes"), "Regime map: kinds of motion over two numbers; a click goes there", false);
    this.basin = new Grid($("basin"), "Basins of attraction: starts by the motion they end in; a click starts there", true);
    this.returns = new Returns($("returns"));
    this.panels = [new Rig($("rig")), law, phase, displacement, this.diagram, new Spectrum($("spectrum")), surface, this.regimes, this.basin, this.returns];
    law.change = (changes) => this.change(changes.map(([path, value]) => [`system.${path}`, value]));
    const startAt = ({ x, y }: Plot) => (x0: number, v0: number) => {
      const all = (value: number, { low, high }: Range) => Array.from({ length: this.state.chain.masses }, () => neat(value, high - low));
      this.clock = 0;
      this.change([["start", { x0: all(x0, x), v0: all(v0, y) }]]);
    };
    phase.pick = (x, v) => startAt(phase.plot)(x, v);
    this.basin.pick = (x, v) => startAt(this.basin.plot)(x, v);
    this.basin.here = ({ state: { start, system } }) => [start.x0?.[0] ?? 0, start.v0?.[0] ?? system["drive_velocity"]];
    this.regimes.here = ({ state: { map, system } }) => [get(system, map.x), get(system, map.y)];
    this.regimes.pick = (x, y) => {
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
    this.sweepers = [0, 1].map((which) => new Sweeper(program, core.module, (part) => this.hear(which, part)));
    this.side = new Sweeper(program, core.module, (part) => this.hearSide(part));
    this.jobs = this.sideJobs();
    this.box = new RecordBox($("record-box"), (paths) => this.fit(program, paths), () => this.measure(null));
    this.lessons = new Lessons($("lesson"), data.lessons, (link) => this.open(link));
    this.controls = new Controls($("numbers"), data, (changes) => this.change(changes));
    this.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.state = this.opened();
    this.buttons();
    new ResizeObserver(() => (this.stale = true)).observe($("panels"));
    const seen = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        const job = this.jobs.find(({ panel }) => panel.plot.host === target);
        if (job) job.seen = isIntersecting;
      }
      this.nextJob();
    }, { threshold: 0.25 });
    for (const { panel } of this.jobs) seen.observe(panel.plot.host);
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
    this.clock = state.view.time;
    this.update();
  }

  /** Change numbers by their paths in the state. */
  change(changes: Change[]): void {
    this.notes = [];
    for (const [path, value] of changes) this.state = put(this.state, path, value);
    if (this.carry && changes.some(([path]) => path.startsWith("system."))) this.goOn();
    if (changes.some(([path]) => path.startsWith("chain.masses"))) this.state = put(this.state, "start", { x0: null, v0: null });
    // What the diagram is swept over does not change the diagram itself.
    this.update(!changes.length || changes.every(([path]) => path === `system.${this.state.diagram.over}`));
  }

  /** The motion begins where it ended; a mass that stuck goes with the belt as it is now. What the law remembers starts anew. */
  private goOn(): void {
    const { orbit, state } = this;
    if (!orbit || this.refused) return;
    const last = ({ length }: ArrayLike<number>) => length - 1;
    const x0 = orbit.x.map((x) => x[last(x)]!);
    const v0 = orbit.v.map((v, i) => (orbit.mode[i]![last(v)]! < 0 ? (state.system["drive_velocity"] as number) : v[last(v)]!));
    this.state = put(state, "start", { x0, v0 });
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
    this.settled = settle(this.core, state);
  }

  private scene(): Scene | null {
    return this.orbit && sceneOf(this.core, this.state, this.orbit, this.settled, this.record);
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
    $("regime-key").replaceChildren(
      ...[0, 1, 2, 4].map((regime) => {
        const word = Object.assign(document.createElement("span"), { textContent: REGIMES[regime]! });
        word.style.setProperty("--c", theme().regimes[regime]!);
        return word;
      }),
    );
    for (const button of $("presets").querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.dataset["name"] === this.state.preset));
    if (this.sweepStale) this.sweep();
    this.nextJob();
    this.tellRecord();
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
    const rows = diagram.values.map((value) => row(value));
    const question = { system: documentOf(this.state), names, look: lookOf(this.state, 60), x0: this.state.start.x0?.[0] ?? 0, chain: true };
    this.sweepers[0]!.ask({ ...question, rows });
    this.sweepers[1]!.ask({ ...question, rows: rows.toReversed() });
  }

  private hear(which: number, part: SweepPart): void {
    const { diagram } = this;
    if (part.refused) diagram.refused ||= part.refused;
    part.rows.forEach((row, i) => {
      if (which) diagram.down[COLUMNS - 1 - part.from - i] = row;
      else diagram.up[part.from + i] = row;
    });
    this.swept[which]! += part.rows.length;
    this.diagramStale = true;
  }

  /** The return map, the basins and the regime map, in this order: what each asks, and what it does with the answer. */
  private sideJobs(): Job[] {
    const grid = (panel: Grid, prepare: (state: State) => { names: string[]; row(...values: number[]): number[] }): Job => ({
      panel, key: "", seen: false,
      ask: () => {
        panel.clear();
        const { state } = this;
        const { names, row } = prepare(state);
        const look = lookOf(state, 60);
        Object.assign(look, { points: 1 }, state.system["forcing"].length ? { window: 60 } : {});
        return { system: documentOf(state), names, rows: panel.rows().map((values) => row(...values)), look, chain: false, x0: state.start.x0?.[0] ?? 0, v0: state.start.v0?.[0] ?? null };
      },
      hear: ({ from, rows, refused }) => {
        if (refused) panel.refused ||= refused;
        rows.forEach((one, i) => (panel.cells[from + i] = one));
      },
    });
    const { returns, regimes, basin } = this;
    return [
      {
        panel: returns, key: "", seen: false,
        ask: () => {
          const { state } = this;
          [returns.row, returns.refused] = [null, ""];
          const { names, row } = varied(state, "drive_velocity");
          const look = { ...lookOf(state, 0), window: 800, points: 700 };
          return { system: documentOf(state), names, rows: [row(state.system["drive_velocity"])], look, chain: false, x0: state.start.x0?.[0] ?? 0, v0: state.start.v0?.[0] ?? null };
        },
        hear: ({ rows, refused }) => {
          if (refused) returns.refused = refused;
          returns.row = rows[0] ?? returns.row;
        },
      },
      grid(basin, () => {
        const one = this.state.chain.masses <= 1;
        const { x, y } = this.panels[2]!.plot;
        const wide = ({ low, high }: Range) => ({ low: low - 0.5 * (high - low), high: high + 0.5 * (high - low) });
        [basin.plot.x, basin.plot.y, basin.plot.labels] = [wide(x), wide(y), { x: "start x₀", y: "start ẋ₀" }];
        return { names: one ? ["x0", "v0"] : Array.from({ length: this.state.chain.masses }, (_, i) => [`x0.${i}`, `v0.${i}`]).flat(), row: (x0, v0) => (one ? [x0, v0] : Array.from({ length: this.state.chain.masses }, () => [x0, v0]).flat()) };
      }),
      grid(regimes, (state) => {
        const { map } = state;
        regimes.plot.x = { low: map.across[0], high: map.across[1] };
        regimes.plot.y = { low: map.up[0], high: map.up[1] };
        regimes.plot.labels = { x: this.axisName(map.x), y: this.axisName(map.y) };
        return varied(state, map.x, map.y);
      }),
    ];
  }

  /** What a job depends on: it is done again only where that changed. */
  private keyOf({ panel }: Job): string {
    const { system, chain, start, map } = this.state;
    if (panel === this.regimes) return JSON.stringify([put(put(system, map.x, 0), map.y, 0), chain, start, map]);
    if (panel === this.basin) return JSON.stringify([system, chain]);
    return JSON.stringify([system, chain, start]);
  }

  /** The next of the jobs beside the page whose panel is seen and whose answer is of another state. */
  private nextJob(): void {
    if (this.refused || !this.orbit) return;
    const next = this.jobs.find((job) => job.seen && job.key !== this.keyOf(job));
    const stale = this.job && this.job.key !== this.keyOf(this.job);
    if (!next || (this.job && !stale)) return;
    this.job = next;
    next.key = this.keyOf(next);
    this.side.ask(next.ask());
    this.drawPanel(next.panel);
  }

  private hearSide(part: SweepPart): void {
    const { job } = this;
    if (!job) return;
    job.hear(part);
    this.sideStale = job.panel;
    if (!part.done && !part.refused) return;
    this.job = null;
    this.nextJob();
  }
  private sideStale: Panel | null = null;

  /** Whether the panels beside have nothing left to compute. */
  get idle(): boolean {
    return !this.job && !this.jobs.some((job) => job.seen && job.key !== this.keyOf(job));
  }

  private axisName(path: string): string {
    return path === "drive_velocity" ? "belt speed s" : path.replace(/^law\./, "").replaceAll("_", " ");
  }

  /** Take a record of a file, or none. */
  measure(record: Measured | null): void {
    this.record = record;
    this.fitting = false;
    this.update(true);
  }

  /** A file that was dropped: a record of the rig on the page, or what is wrong with it. */
  read(name: string, text: string): void {
    try {
      const { stiffness, drive_velocity, forcing } = this.state.system;
      const push = (t: number) => forcing.reduce((sum: number, { amplitude, frequency, phase = 0 }: Document) => sum + amplitude * frequency * Math.sin(frequency * t + phase), 0);
      this.measure(readRecord(name, text, (t) => stiffness * drive_velocity + push(t)));
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.notes = [error.message];
      this.tell();
    }
  }

  private fit(program: string, paths: string[]): void {
    if (!this.record || !paths.length) return;
    this.fitter ??= new Sweeper(program, this.core.module, ({ fit, refused }) => {
      if (refused) this.notes = [refused];
      this.fitting = !(refused || fit?.done);
      if (fit) this.change([["system.law", fit.law]]);
    });
    this.fitting = true;
    this.fitter.ask({ law: this.state.system["law"], paths, record: this.record });
    this.tellRecord();
  }

  private tellRecord(): void {
    const { law } = this.state.system;
    let quality: Omit<Fit, "law" | "done"> | null = null;
    try {
      if (this.record) quality = judge(this.core, law, this.record);
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
    }
    this.box.show(this.record, law, this.data.laws[law.type]!, quality, this.fitting);
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
    sayMotion(host, this.state, this.orbit!, this.settled);
  }

  private axisOptions(): void {
    const { law, forcing } = this.state.system;
    const pages = [
      ...this.data.oscillator.map((page) => ({ ...page })),
      ...(forcing.length ? [{ path: "forcing.0.amplitude", symbol: "u₀" }, { path: "forcing.0.frequency", symbol: "Ω" }] : []),
      ...this.data.laws[law.type]!.numbers.filter((page) => typeof get(law, page.path) === "number" && !("choices" in page)).map((page) => ({ ...page, path: `law.${page.path}` })),
    ];
    const has = (name: string) => pages.some(({ path }) => path === name);
    if (!has(this.state.diagram.over)) {
      this.state = put(this.state, "diagram", FRESH.diagram);
      this.sweepStale = true;
    }
    if (!has(this.state.map.x) || !has(this.state.map.y)) this.state = put(this.state, "map", FRESH.map);
    const wanted = pages.map(({ path }) => path).join();
    for (const [id, path] of [["over", this.state.diagram.over], ["map-x", this.state.map.x], ["map-y", this.state.map.y]] as const) {
      const select = $<HTMLSelectElement>(id);
      if (select.dataset["wanted"] !== wanted) {
        select.dataset["wanted"] = wanted;
        select.replaceChildren(...pages.map((page) => new Option(page.symbol, page.path)));
      }
      select.value = path;
    }
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
    if (this.sideStale) {
      this.drawPanel(this.sideStale);
      this.sideStale = null;
    }
    const scene = this.scene();
    if (scene && !this.refused) {
      if (this.playing) this.clock += step * this.speed * Math.max(1 / this.natural, this.record ? scene.orbit.words.t_last / 150 : 0);
      if (this.clock > scene.orbit.words.t_last) this.clock = 0.6 * scene.orbit.words.t_last;
      for (const panel of this.panels) if (panel.plot.width && panel.plot.height) panel.time(scene, this.clock);
    }
    requestAnimationFrame((next) => this.frame(next));
  }

  private get natural(): number {
    const { mass, stiffness } = this.state.system;
    return Math.sqrt(stiffness / mass);
  }

  /** Hear the motion; a change of it is heard at once. */
  listen(): void {
    if (!this.orbit || this.refused) return this.sound.stop();
    this.sound.play(this.core, this.orbit, this.natural, $<HTMLInputElement>("pitch").valueAsNumber);
  }

  toml(): string {
    return toToml(this.state);
  }

  link(): string {
    return toLink(this.state, this.data.presets);
  }

  csv(): string {
    return this.orbit ? toCsv(this.orbit) : "";
  }

  /** How many motions a panel beside shows. */
  cells(id: string): number {
    const job = this.jobs.find(({ panel }) => panel.plot.host.id === id);
    return job?.panel instanceof Grid ? job.panel.cells.length : 0;
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
    return pageWith(this.source, { state: this.state, record: this.record });
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
    $<HTMLInputElement>("carry").onchange = ({ target }) => (this.carry = (target as HTMLInputElement).checked);
    $("anew").onclick = () => this.change([["start", { x0: null, v0: null }]]);
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
    $("lessons").onclick = () => (this.lessons.at ? this.lessons.close() : this.lessons.show(0, 0));
    $("toml").onclick = () => save("system.toml", this.toml(), "text/plain");
    $("csv").onclick = () => this.orbit && save("orbit.csv", this.csv(), "text/csv");
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
    const choose = $<HTMLInputElement>("file");
    $("measured").onclick = () => choose.click();
    const take = async (file: File | undefined) => file && this.read(file.name, await file.text());
    choose.onchange = () => void take(choose.files?.[0]);
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      void take(event.dataTransfer?.files[0]);
    });
    for (const [id, axis, range] of [["map-x", "x", "across"], ["map-y", "y", "up"]] as const)
      $<HTMLSelectElement>(id).onchange = ({ target }) => {
        const path = (target as HTMLSelectElement).value;
        const usual = FRESH.map.x === path ? FRESH.map.across : FRESH.map.y === path ? FRESH.map.up : null;
        const value = Number(get(this.state.system, path));
        const ends = usual && value <= usual[1] && value > usual[1] / 50 ? usual : [Math.min(0, 2 * value), Math.max(0, 2 * value) || 1];
        this.change([["map", { ...this.state.map, [axis]: path, [range]: ends }]]);
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
