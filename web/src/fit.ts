/** Least squares of a law along a record: damped Gauss–Newton over the numbers that are ticked. */
import { type Core, Refused, Verb } from "./core";
import { type Measured, known } from "./record";
import { type Document, get, put } from "./state";

export interface Fit {
  law: Document;
  /** Root mean squares of measured minus predicted force: while it slips, weighted by the path; of the break-aways. */
  kinetic: number;
  broken: number;
  /** Whether no step makes it better. */
  done: boolean;
  /** The paths of numbers of which the record says nothing, found at the end. */
  silent?: string[];
}

/** The force of the law along the record, sample by sample. */
export function predicted(core: Core, law: Document, record: Measured): Float64Array {
  const { t, w, stuck, rate } = record;
  return core.ask(Verb.curve, { law }, [t, w, stuck.map(Number), rate]).numbers.subarray(0, t.length);
}

/** Two groups of equal weight, each with the sum of its squares 1/n of what its rows have, over all records. */
function residuals(core: Core, law: Document, records: Measured[]): { rows: Float64Array; kinetic: number; broken: number } {
  const weights = records.map((record) => {
    const first = known(record);
    return record.t.map((_, i) => (record.stuck[i] || i < first ? 0 : Math.abs(record.w[i]!)));
  });
  const whole = weights.flat().reduce((sum, one) => sum + one, 0) || 1;
  // A law with an internal state has no break-away force: its slips alone are compared.
  const breaks = core.ask<{ state: boolean }>(Verb.curve, { law }).words.state ? [] : records.flatMap((record) => record.breaks);
  const limits = !breaks.length ? new Float64Array() : core.ask(Verb.surface, { law, stick_times: breaks.map(([time]) => time), force_rates: breaks.map(([, rate]) => rate), pairs: true }).numbers;
  const slips = records.flatMap((record, n) => {
    const model = predicted(core, law, record);
    return weights[n]!.map((weight, i) => (weight ? (model[i]! - record.force[i]!) * Math.sqrt(weight / whole) : 0));
  });
  const sticks = breaks.map(([, , height], i) => (limits[i]! - height) / Math.sqrt(breaks.length));
  const size = (rows: number[]) => Math.sqrt(rows.reduce((sum, one) => sum + one * one, 0));
  return { rows: Float64Array.from([...slips, ...sticks]), kinetic: size(slips), broken: size(sticks) };
}

const dot = (a: Float64Array, b: Float64Array) => a.reduce((sum, value, k) => sum + value * b[k]!, 0);
const square = (rows: Float64Array) => dot(rows, rows);

/** x of A x = b by elimination with pivots; null where A is singular. */
function solve(a: number[][], b: number[]): number[] | null {
  const n = b.length;
  const m = a.map((row, i) => [...row, b[i]!]);
  for (let k = 0; k < n; k++) {
    let pivot = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(m[i]![k]!) > Math.abs(m[pivot]![k]!)) pivot = i;
    [m[k], m[pivot]] = [m[pivot]!, m[k]!];
    if (!m[k]![k]) return null;
    for (let i = 0; i < n; i++) {
      if (i === k) continue;
      const share = m[i]![k]! / m[k]![k]!;
      for (let j = k; j <= n; j++) m[i]![j]! -= share * m[k]![j]!;
    }
  }
  return m.map((row, i) => row[n]! / row[i]!);
}

/** A number of which the record says nothing: moved by its whole size, it changes the forces by less than this share or than the noise, as the others make up for it. */
const SILENT = 1e-3;

/** What of a column lies along none of the axes. */
const rest = (column: Float64Array, axes: Float64Array[]) => axes.reduce((left, axis) => {
  const share = dot(left, axis);
  return left.map((value, k) => value - share * axis[k]!);
}, column);

/** Axes of the space of the columns, but of what is left of one by rounding. */
function axesOf(columns: Float64Array[]): Float64Array[] {
  const axes: Float64Array[] = [];
  for (const column of columns) {
    const left = rest(column, axes);
    const length = Math.sqrt(square(left));
    if (length > 1e-6 * Math.sqrt(square(column))) axes.push(left.map((value) => value / length));
  }
  return axes;
}

/** The length of each column that no sum of the others makes up for. */
function own(columns: Float64Array[]): number[] {
  // In their own space the columns are as short as they are many.
  const axes = axesOf(columns);
  const short = columns.map((column) => Float64Array.from(axes, (axis) => dot(axis, column)));
  return short.map((column, i) => Math.sqrt(square(rest(column, axesOf(short.filter((_, j) => j !== i))))));
}

/** How good a law is on a record as it stands. */
export function judge(core: Core, law: Document, records: Measured[]): Omit<Fit, "law" | "done"> {
  const { kinetic, broken } = residuals(core, law, records);
  return { kinetic, broken };
}

/** Better and better laws: one a step, the last one `done`; null after each piece of work between. Numbers that the record does not move stay. */
export function* fit(core: Core, start: Document, paths: string[], records: Measured[]): Generator<Fit | null> {
  let law = start;
  let now = residuals(core, law, records);
  let damping = 1e-3;
  const sizes = paths.map((path) => Math.abs(get(law, path)) || 0.1);
  const moved = (by: number[]) => paths.reduce((one, path, i) => put(one, path, get(law, path) + by[i]! * sizes[i]!), law);
  const tried = (candidate: Document) => {
    try {
      return residuals(core, candidate, records);
    } catch (error) {
      if (error instanceof Refused) return null; // numbers that make no law
      throw error;
    }
  };
  let columns: Float64Array[] = [];
  for (let step = 0; step < 60; step++) {
    columns = [];
    for (let i = 0; i < paths.length; i++) {
      columns.push(new Float64Array(now.rows.length));
      for (const h of [1e-4, -1e-4]) {
        const near = tried(moved(paths.map((_, j) => (j === i ? h : 0))));
        yield null;
        if (!near) continue;
        columns[i] = near.rows.map((value, k) => (value - now.rows[k]!) / h);
        break;
      }
    }
    const normal = columns.map((a) => columns.map((b) => dot(a, b)));
    const down = columns.map((a) => -dot(a, now.rows));
    const floor = 1e-12 * Math.max(...normal.map((row, i) => row[i]!), 1e-300);
    let better = false;
    while (damping < 1e9 && !better) {
      const by = solve(normal.map((row, i) => row.map((value, j) => (i === j ? value * (1 + damping) + floor : value))), down);
      const candidate = by && moved(by);
      const next = candidate && tried(candidate);
      yield null;
      if (next && square(next.rows) < square(now.rows)) {
        const gain = 1 - square(next.rows) / square(now.rows);
        [law, now, damping, better] = [candidate, next, damping / 5, true];
        yield { law, kinetic: now.kinetic, broken: now.broken, done: false };
        if (gain < 1e-9) damping = Infinity;
      } else damping *= 4;
    }
    if (damping >= 1e9) break;
  }
  const forces = Float64Array.from(records.flatMap((record) => record.force));
  const [size, noise] = [forces, now.rows].map((all) => Math.sqrt(square(all) / forces.length)) as [number, number];
  const silent = own(columns).flatMap((length, i) => (length < Math.max(SILENT * size, noise) ? [paths[i]!] : []));
  yield { law, kinetic: now.kinetic, broken: now.broken, done: true, silent };
}
