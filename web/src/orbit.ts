/** A motion as columns, and where they are read. */
import { Core, Verb } from "./core";
import { type State, documentOf } from "./state";

interface OrbitWords {
  samples: number;
  masses: number;
  contacts: number;
  events: number;
  /** In closed form, by Taylor series, or integrated. */
  engine: "exact" | "taylor" | "integrated";
  regime: string;
  stop: string;
  sentence: string;
  t_last: number;
  /** What it remembers at its end beside position and velocity; empty where there is nothing. */
  end: (number | null)[];
}

export interface Orbit {
  words: OrbitWords;
  t: Float64Array;
  /** Mass by mass. */
  x: Float64Array[];
  v: Float64Array[];
  /** Contact by contact; mode is −1 while stuck, else the branch of the law. */
  w: Float64Array[];
  force: Float64Array[];
  mode: Float64Array[];
  events: OrbitEvent[];
}

export interface OrbitEvent {
  t: number;
  kind: number;
  contact: number;
  x: number;
  v: number;
  force: number;
  stickTime: number;
  forceRate: number;
}

/** The kind of a break-away. */
export const RELEASE = 0;

export function simulate(core: Core, state: State, samples = 4000): Orbit {
  const { words, numbers } = core.ask<OrbitWords>(Verb.orbit, {
    system: documentOf(state),
    x0: state.start.x0,
    v0: state.start.v0,
    memory: state.start.memory ?? null,
    t_end: state.t_end,
    max_events: 100000,
    per_segment: 8,
    samples,
  });
  const n = words.samples;
  let next = 0;
  const column = () => numbers.subarray(next++ * n, next * n);
  const t = column();
  const orbit: Orbit = { words, t, x: [], v: [], w: [], force: [], mode: [], events: [] };
  for (let i = 0; i < words.masses; i++) {
    orbit.x.push(column());
    orbit.v.push(column());
  }
  for (let c = 0; c < words.contacts; c++) {
    orbit.w.push(column());
    orbit.force.push(column());
    orbit.mode.push(column());
  }
  for (let at = next * n; at < numbers.length; at += 8) {
    const [time, kind, contact, x, v, force, stickTime, forceRate] = numbers.subarray(at, at + 8);
    orbit.events.push({ t: time!, kind: kind!, contact: contact!, x: x!, v: v!, force: force!, stickTime: stickTime!, forceRate: forceRate! });
  }
  return orbit;
}

/** Index of the last sample at or before t. */
export function indexAt(t: Float64Array, time: number): number {
  let low = 0;
  let high = t.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (t[middle]! <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** A column at a time, linear between samples. */
export function valueAt(t: Float64Array, column: Float64Array, time: number): number {
  const i = indexAt(t, time);
  const j = Math.min(i + 1, t.length - 1);
  const share = t[j]! > t[i]! ? (time - t[i]!) / (t[j]! - t[i]!) : 0;
  return column[i]! + Math.min(1, share) * (column[j]! - column[i]!);
}

/** The first and the last maximum of x in the second half; the half itself where there are none. */
export function wholePeriods({ t, v, words }: Orbit): [number, number] {
  const times: number[] = [];
  const speed = v[0]!;
  for (let i = 1; i < t.length; i++)
    if (t[i]! > 0.5 * words.t_last && speed[i - 1]! > 0 && speed[i]! <= 0) times.push(t[i - 1]! + ((t[i]! - t[i - 1]!) * speed[i - 1]!) / (speed[i - 1]! - speed[i]!));
  return times.length > 1 ? [times[0]!, times.at(-1)!] : [0.5 * words.t_last, words.t_last];
}
