/** The two sweeps of the orbit diagram, up and down, each in a worker of its own. */
import type { Diagram } from "./panels/diagram";
import { type State, documentOf, varied } from "./state";
import { type SweepPart, Sweeper, lookOf } from "./sweeps";

/** Columns of the orbit diagram. */
const COLUMNS = 300;
/** Periods that are left out in each column, and after which one that repeats already is done: where forcing or many masses make that rare, never. */
const TRANSIENT = 60;
const EARLY = 12;

export class DiagramSweep {
  /** Columns that have come: up and down. */
  swept = [0, 0];
  /** Whether columns have come that are not drawn yet. */
  stale = false;
  private readonly sweepers: Sweeper[];
  /** What was asked last. */
  private asked = "";

  constructor(
    private readonly diagram: Diagram,
    program: string,
    module: WebAssembly.Module,
  ) {
    this.sweepers = [0, 1].map((which) => new Sweeper(program, module, (part) => this.hear(which, part)));
  }

  clear(state: State): void {
    const { low, high } = state.diagram;
    const values = Array.from({ length: COLUMNS }, (_, i) => low + ((high - low) * i) / (COLUMNS - 1));
    Object.assign(this.diagram, { values, up: [], down: [], lost: [], refused: "" });
    this.swept = [0, 0];
    this.asked = "";
  }

  /** Sweep anew, unless this is what was swept last and no column of it is missing. */
  start(state: State): void {
    const { names, row } = varied(state, state.diagram.over);
    const early = state.system["forcing"].length || state.chain.masses > 1 ? 0 : EARLY;
    const question = { system: documentOf(state), names, look: { ...lookOf(state, TRANSIENT), early }, x0: state.start.x0?.[0] ?? 0, chain: true };
    const asked = JSON.stringify([question, state.diagram]);
    if (asked === this.asked && !this.diagram.lost.length) return;
    this.clear(state);
    this.asked = asked;
    const rows = this.diagram.values.map((value) => row(value));
    this.sweepers[0]!.ask({ ...question, rows });
    this.sweepers[1]!.ask({ ...question, rows: rows.toReversed() });
  }

  get done(): boolean {
    return this.swept.every((count) => count >= COLUMNS);
  }

  private hear(which: number, { from, rows, refused, lost }: SweepPart): void {
    const { diagram } = this;
    const column = (row: number) => (which ? COLUMNS - 1 - row : row);
    if (refused) diagram.refused ||= refused;
    if (lost !== undefined) diagram.lost.push(column(lost));
    rows.forEach((row, i) => ((which ? diagram.down : diagram.up)[column(from + i)] = row));
    this.swept[which]! += rows.length + (lost === undefined ? 0 : 1);
    this.stale = true;
  }
}
