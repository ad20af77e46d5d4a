/** A measured record: friction over slip velocity and its break-aways; out of a file that is dropped, or put in by `stickslip explore`. */
import { Refused } from "./core";

export interface Measured {
  name: string;
  t: number[];
  /** Slip velocity, 0 while stuck. */
  w: number[];
  force: number[];
  /** Standard error of the force, where it is known. */
  error?: number[] | null;
  stuck: boolean[];
  /** Rate of the force while stuck. */
  rate: number[];
  x: number[] | null;
  /** Velocity of the drive, where it is known. */
  drive: number | null;
  /** Stick time, force rate and break-away force of each. */
  breaks: [number, number, number][];
  /** The friction file it is of, for `stickslip identify`. */
  file?: string;
}

const NAMES: Record<string, string[]> = {
  t: ["t", "time"],
  w: ["slip_velocity", "w"],
  force: ["force", "friction", "f"],
  x: ["x", "displacement"],
  error: ["force_error"],
  stuck: ["stuck", "branch"],
};

/** Samples of slips that are drawn and fitted, about. */
const SAMPLES = 3000;

/** The rig that a record is read for: the velocity of its drive, its stiffness, and the force rate that it would put on a stick at a time. */
export interface Rig {
  drive: number;
  stiffness: number;
  adhesion(t: number): number;
}

/** Read a CSV file with named columns, or a record as JSON. */
export function readRecord(name: string, text: string, { drive, adhesion }: Rig): Measured {
  if (/^\uFFFDHDF|^CDF[\x01\x02\x05]/.test(text) || /\.(nc|toml|md)$/i.test(name))
    throw new Refused(`${name}: expected a CSV file, a page that was saved, or a netCDF file of stickslip measure or simulate, got another file; run stickslip explore ${name}, which reads more of them`);
  if (/^\s*\{/.test(text)) {
    let record: Measured;
    try {
      record = JSON.parse(text);
    } catch (error) {
      throw new Refused(`${name}: expected a record as JSON, got text that ends or errs (${(error as Error).message}); export it again`);
    }
    const same = ["w", "force", "stuck", "rate"].every((key) => (record as any)[key]?.length === record.t?.length);
    if (!same || !record.breaks) throw new Refused(`${name}: expected the columns t, w, force, stuck and rate of one length, and breaks; write it by stickslip explore`);
    return { ...record, drive: record.drive ?? drive, name };
  }
  const [head = "", ...lines] = text.trim().split(/\r?\n/);
  const header = head.split(",").map((word) => word.trim());
  // Of a row of masses, as the page writes it, the first one.
  const at = Object.fromEntries(Object.entries(NAMES).map(([key, names]) => [key, header.findIndex((word) => names.includes(word.replace(/_0$/, "")))]));
  for (const key of ["t", "w", "force"])
    if (at[key]! < 0) throw new Refused(`${name}: expected a column named ${NAMES[key]!.join(" or ")}, got ${header.slice(0, 8).join(", ")}; name the columns in the first line`);
  const columns = Object.fromEntries(Object.keys(NAMES).map((key) => [key, [] as number[]])) as Record<string, number[]>;
  lines.forEach((line, i) => {
    const words = line.split(",");
    for (const [key, column] of Object.entries(at)) {
      if (column < 0) continue;
      const word = (words[column] ?? "").trim();
      const value = /^(true|false)$/i.test(word) ? -Number(/^t/i.test(word)) : Number(word || NaN);
      if (!Number.isFinite(value)) throw new Refused(`${name}, row ${i + 2}, column ${header[column]}: expected a number, got “${word.slice(0, 20)}”; mend or leave out the row`);
      columns[key]!.push(value);
    }
  });
  const { t, w, force, x, error, stuck: mark } = columns as Record<"t" | "w" | "force" | "x" | "error" | "stuck", number[]>;
  const back = t.findIndex((time, i) => time < t[i - 1]!);
  if (back > 0) throw new Refused(`${name}, row ${back + 2}: expected times that increase, got ${t[back]} after ${t[back - 1]}; sort the rows`);
  if (t.length < 10) throw new Refused(`${name}: expected at least 10 rows, got ${t.length}; take a longer record`);
  const fast = w.reduce((most, one) => Math.max(most, Math.abs(one)), 0);
  // The page's own CSV says the branch, −1 while stuck; others may say 1 or true.
  const branch = header[at["stuck"]!]?.startsWith("branch");
  const stuck = w.map((one, i) => (mark.length ? (branch ? mark[i]! < 0 : mark[i] !== 0) : Math.abs(one) < 1e-6 * fast));
  return { name, t, drive, // At its end a slip is as fast as rounding lets it be.
    w: w.map((one, i) => (stuck[i] || Math.abs(one) < 1e-12 * fast ? 0 : one)), force, stuck, x: x.length ? x : null, error: error.length ? error : null, ...sticks(t, force, stuck, adhesion) };
}

const middle = (values: number[]) => {
  const sorted = values.toSorted((a, b) => a - b);
  return (sorted[(sorted.length - 1) >> 1]! + sorted[sorted.length >> 1]!) / 2;
};
/** How far half of the values lie from their middle. */
const scatter = (values: number[]) => {
  const at = middle(values);
  return middle(values.map((value) => Math.abs(value - at)));
};
const mean = (values: ArrayLike<number>) => Array.prototype.reduce.call(values, (sum: any, one) => sum + one, 0) as number / values.length;

/** Break-aways of a friction file. Where friction drifts along the record each is that above the kinetic force of its own slip, as `stickslip identify` takes it. */
function brokenAway(columns: Map<string, Float64Array>, time: Float64Array, w: Float64Array, load: Float64Array, stick: Float64Array): Measured["breaks"] {
  const [at, times, rates, broken] = ["t", "stick_time", "force_rate", "force"].map((key) => columns.get(`break_away/${key}`)!) as [Float64Array, Float64Array, Float64Array, Float64Array];
  let i = 0;
  const rows = Array.from(broken, (force, k): [number, number, number, number] => {
    let [path, work] = [0, 0];
    while (i < time.length && (time[i]! < at[k]! || stick[i])) i++;
    for (; i < time.length && !stick[i]; i++) {
      path += Math.abs(w[i]!);
      work += Math.abs(w[i]!) * load[i]!;
    }
    return [times[k]!, rates[k]!, force, work / path];
  }).filter((row) => row.every(Number.isFinite));
  const levels = rows.map((row) => row[3]);
  const drifts = rows.length >= 5 && scatter(rows.map((row) => row[2] - row[3])) <= 0.7 * scatter(rows.map((row) => row[2]));
  const usual = mean(levels);
  return rows.map(([rest, rate, force, level]) => [rest, rate, drifts ? force - level + usual : force]);
}

/** The columns of a friction file, with its own break-aways, or of an orbit. */
export function ofColumns(name: string, columns: Map<string, Float64Array>, { drive, stiffness, adhesion }: Rig): Measured {
  const [time, speed, load, stick] = ["time", "slip_velocity", "force", "stuck"].map((key) => columns.get(key));
  if (!time || !speed || !load || !stick) throw new Refused(`${name}: expected the columns time, slip_velocity, force and stuck, got ${[...columns.keys()].slice(0, 8).join(", ")}; choose a file of stickslip measure or simulate`);
  const stride = Math.max(1, Math.floor(stick.filter((one) => !one).length / SAMPLES));
  // Of each slip every n-th sample and its last, of each stick both ends.
  const rows: number[] = [];
  time.forEach((t, i) => {
    const kept = stick[i] !== stick[i - 1] || stick[i] !== stick[i + 1] || (!stick[i] && i % stride === 0);
    if (kept && Number.isFinite(t + speed[i]! + load[i]!)) rows.push(i);
  });
  const pick = (column: Float64Array | undefined) => (column ? rows.map((i) => column[i]!) : null);
  const [start, stuck, force, error, where] = [time[rows[0]!]!, rows.map((i) => stick[i] !== 0), pick(load)!, pick(columns.get("force_error")), pick(columns.get("displacement") ?? columns.get("x"))];
  const t = rows.map((i) => time[i]! - start);
  // On the mean the spring carries the friction; where a sensor has its zero says nothing.
  const shift = where && columns.has("displacement") ? mean(load) / stiffness - mean(where) : 0;
  const { rate, breaks } = sticks(t, force, stuck, adhesion);
  const velocity = columns.get("velocity") ?? columns.get("v");
  const measured = columns.has("break_away/force");
  return {
    name, t, force, stuck, rate, error: error?.some(Boolean) ? error : null, w: rows.map((i) => (stick[i] ? 0 : speed[i]!)), x: where && where.map((x) => x + shift),
    drive: velocity ? speed[rows[0]!]! + velocity[rows[0]!]! : drive, ...(measured ? { breaks: brokenAway(columns, time, speed, load, stick), file: name } : { breaks }),
  };
}

/** The rate of the force in each stick, and what broke away at its end. While it slips the rate is what adhesion would feel. */
function sticks(t: number[], force: number[], stuck: boolean[], adhesion: (t: number) => number): Pick<Measured, "rate" | "breaks"> {
  const rate = t.map(adhesion);
  const breaks: Measured["breaks"] = [];
  for (let i = 0; i < t.length; ) {
    let end = i;
    while (stuck[i] && end + 1 < t.length && stuck[end + 1]) end++;
    if (stuck[i] && end > i) {
      const slope = (force[end]! - force[i]!) / (t[end]! - t[i]!);
      rate.fill(slope, i, end + 1);
      if (i > 0 && end + 1 < t.length) breaks.push([t[end]! - t[i]!, Math.abs(slope), Math.abs(force[end]!)]);
    }
    i = end + 1;
  }
  return { rate, breaks };
}

/** From where on a law is compared: a stick or a turn of the slip tells what the law remembers. */
export function known({ w, stuck }: Measured): number {
  for (let i = 1; i < w.length - 1; i++) if (stuck[i] || (w[i]! < w[i - 1]! && w[i]! <= w[i + 1]!)) return i;
  return 0;
}
