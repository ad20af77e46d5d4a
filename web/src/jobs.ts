/** What is computed beside the page for the panels below, one after another, where they are seen: return map, basins, regime map. */
import { axisName, axisUnit } from "./axes";
import { Grid } from "./panels/grid";
import { LONG, steadyQuestion } from "./facts";
import type { Panel } from "./panels/panel";
import type { Returns } from "./panels/returns";
import { type Plot, type Range, widen } from "./plot";
import { type State, documentOf, put, varied } from "./state";
import { type Ask, type Chaos, type Steady, type SweepPart, Sweeper, lookOf } from "./sweeps";

/** Something computed for one panel. */
interface Job {
  panel: Panel | null;
  /** What its answer is of. */
  key: string;
  /** Whether the panel is in the window, or a motion is shown of which it tells something. */
  seen: boolean;
  /** What it depends on: it is done again only where that changed. */
  depends(state: State): unknown;
  ask(state: State): Ask;
  hear(part: SweepPart): void;
}

export interface Beside {
  returns: Returns;
  basin: Grid;
  regimes: Grid;
  /** The plane of the starts. */
  phase: Plot;
}

/** What the page does for the jobs. */
interface Host {
  state(): State;
  /** Whether there is a motion at all. */
  ready(): boolean;
  /** Whether it is integrated, so that its steady motion takes too long for the page itself. */
  integrated(): boolean;
  /** Whether it moves and does not repeat. */
  wild(): boolean;
  draw(panel: Panel): void;
  tell(): void;
}

export class Jobs {
  /** The panel to which something has come that is not drawn yet. */
  stale: Panel | null = null;
  private readonly all: Job[];
  private running: Job | null = null;
  private readonly sweeper: Sweeper;

  constructor(
    panels: Beside,
    private readonly host: Host,
    program: string,
    module: WebAssembly.Module,
  ) {
    this.sweeper = new Sweeper(program, module, (part) => this.hear(part));
    this.chaotic = this.chaosJob();
    this.settling = this.steadyJob();
    this.all = [this.settling, this.chaotic, returnsJob(panels.returns), basinJob(panels.basin, panels.phase), regimesJob(panels.regimes)];
    const seen = new IntersectionObserver(
      (entries) => {
        for (const { target, isIntersecting } of entries) {
          const job = this.all.find(({ panel }) => panel?.plot.host === target);
          if (job) job.seen = isIntersecting;
        }
        this.next();
      },
      { threshold: 0.25 },
    );
    for (const { panel } of this.all) if (panel) seen.observe(panel.plot.host);
  }

  private key(job: Job): string {
    return JSON.stringify(job.depends(this.host.state()));
  }

  /** Whether nothing is left to compute. */
  get idle(): boolean {
    return !this.running && !this.all.some((job) => job.seen && job.key !== this.key(job));
  }

  /** Begin the next of those whose panel is seen and whose answer is of another state. */
  next(): void {
    if (!this.host.ready()) return;
    this.settling.seen = this.host.integrated();
    this.chaotic.seen = this.host.wild();
    const next = this.all.find((job) => job.seen && job.key !== this.key(job));
    const outdated = this.running && this.running.key !== this.key(this.running);
    if (!next || (this.running && !outdated)) return;
    this.running = next;
    next.key = this.key(next);
    this.sweeper.ask(next.ask(this.host.state()));
    if (next.panel) this.host.draw(next.panel);
  }

  private hear(part: SweepPart): void {
    const job = this.running;
    if (!job) return;
    job.hear(part);
    if (job.panel) this.stale = job.panel;
    if (!part.done && !part.refused) return;
    this.running = null;
    if (!job.panel) this.host.tell();
    this.next();
  }

  private readonly settling: Job;
  private settled: Steady | null = null;

  /** The steady motion of an integration; null while it is computed. */
  get steady(): Steady | null {
    return this.settling.key === this.key(this.settling) ? this.settled : null;
  }

  private steadyJob(): Job {
    return {
      panel: null, key: "", seen: false,
      depends: ({ system, chain, start }) => [system, chain, start],
      ask: (state) => {
        this.settled = null;
        const { values, ...question } = steadyQuestion(state);
        return { ...question, x0: question.x0 ?? 0, rows: [values], chain: false };
      },
      hear: ({ rows }) => (this.settled = rows[0] ?? this.settled),
    };
  }

  private readonly chaotic: Job;
  private found: Chaos | null = null;

  /** What tells whether the motion on the page is chaotic; null while it is computed. */
  get chaos(): Chaos | null {
    return this.running !== this.chaotic && this.chaotic.key === this.key(this.chaotic) ? this.found : null;
  }

  private chaosJob(): Job {
    return {
      panel: null, key: "", seen: false,
      depends: ({ system, chain, start }) => [system, chain, start],
      ask: (state) => {
        this.found = null;
        const { mass, stiffness, forcing } = state.system;
        const t_end = (LONG * 2 * Math.PI) / (forcing[0]?.frequency || Math.sqrt(stiffness / mass));
        return { test: steadyQuestion(state, true, LONG), exponent: { system: documentOf(state), ...state.start, t_end, transient: 0.2, max_events: 1e6 } };
      },
      // Of some motions there is no derivative: then the 0–1 test stands alone.
      hear: ({ chaos, refused }) => {
        this.found = chaos ?? this.found ?? (refused ? { late: null, test: NaN, exponent: null } : null);
        // Where everything sticks the exponent is −∞.
        if (this.found?.exponent?.some((one) => !Number.isFinite(one))) this.found = { ...this.found, exponent: null };
      },
    };
  }

  /** How many motions a panel shows. */
  cells(id: string): number {
    const panel = this.all.find(({ panel: one }) => one?.plot.host.id === id)?.panel;
    return panel instanceof Grid ? panel.cells.length : 0;
  }
}

const startOf = ({ start }: State) => ({ x0: start.x0?.[0] ?? 0, v0: start.v0?.[0] ?? null, memory: start.memory ?? null });

function returnsJob(panel: Returns): Job {
  return {
    panel, key: "", seen: false,
    depends: ({ system, chain, start }) => [system, chain, start],
    ask: (state) => {
      [panel.row, panel.refused] = [null, ""];
      const { names, row } = varied(state, "drive_velocity");
      const look = { ...lookOf(state, 0), window: 800, points: 700 };
      return { system: documentOf(state), names, rows: [row(state.system["drive_velocity"])], look, chain: false, ...startOf(state) };
    },
    hear: ({ rows, refused, lost }) => {
      if (refused || lost !== undefined) panel.refused = refused ?? "the motion took longer than 3 s";
      panel.row = rows[0] ?? panel.row;
    },
  };
}

function gridJob(panel: Grid, depends: Job["depends"], prepare: (state: State) => { names: string[]; row(...values: number[]): number[] }): Job {
  return {
    panel, key: "", seen: false, depends,
    ask: (state) => {
      panel.clear();
      const { names, row } = prepare(state);
      // A start of its own has nothing to remember.
      const fresh = names.some((name) => /^[xv]0/.test(name));
      const look = { ...lookOf(state, 60), points: 8, ...(state.system["forcing"].length ? { window: 60 } : {}) };
      return { system: documentOf(state), names, rows: panel.rows().map((values) => row(...values)), look, chain: false, ...startOf(state), ...(fresh ? { memory: null } : {}) };
    },
    hear: ({ from, rows, refused }) => {
      if (refused) panel.refused ||= refused;
      rows.forEach((one, i) => (panel.cells[from + i] = one));
    },
  };
}

function basinJob(panel: Grid, phase: Plot): Job {
  // Wide enough for a stick-slip motion too, whatever the motion on the page is.
  const around = ({ low, high }: Range, ...more: number[]): Range => widen({ low: Math.min(low, ...more), high: Math.max(high, ...more) }, 0.25);
  return gridJob(
    panel,
    ({ system, chain }) => [system, chain],
    ({ chain: { masses }, system: { drive_velocity: s }, units }) => {
      panel.plot.units = [units.length, units.velocity];
      [panel.plot.x, panel.plot.y, panel.plot.labels] = [around(phase.x, 0), around(phase.y, -3 * s, 1.2 * s), { x: "start x₀", y: "start ẋ₀" }];
      const each = Array.from({ length: masses });
      if (masses <= 1) return { names: ["x0", "v0"], row: (x0, v0) => [x0!, v0!] };
      return { names: each.flatMap((_, i) => [`x0.${i}`, `v0.${i}`]), row: (x0, v0) => each.flatMap(() => [x0!, v0!]) };
    },
  );
}

function regimesJob(panel: Grid): Job {
  return gridJob(
    panel,
    ({ system, chain, start, map }) => [put(put(system, map.x, 0), map.y, 0), chain, start, map],
    (state) => {
      const { map } = state;
      panel.plot.x = { low: map.across[0], high: map.across[1] };
      panel.plot.y = { low: map.up[0], high: map.up[1] };
      panel.plot.labels = { x: axisName(map.x), y: axisName(map.y) };
      panel.plot.units = [axisUnit(map.x, state.units), axisUnit(map.y, state.units)];
      return varied(state, map.x, map.y);
    },
  );
}
