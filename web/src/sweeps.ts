/** Sweeps beside the page: what is asked of a worker, what comes back, and the worker itself. The newest question wins. */
import { Core, Refused, Verb } from "./core";
import { type Fit, fit } from "./fit";
import type { Measured } from "./record";
import type { Document, State } from "./state";

/** One steady motion. */
export interface Steady {
  regime: number;
  period: number;
  chaos: number;
  stuckShare: number;
  x: [number, number];
  periodTime: number;
  mean: number;
  section: [number, number][];
  /** Slip velocities where the slip acceleration changes its sign. */
  turns: Float64Array;
}

/** The regimes as the core names them, by their numbers, and in words. */
export const REGIME_NAMES = ["stick_slip", "almost_harmonic", "stable_slip", "reversing_slip", "at_rest", "diverged", "unfinished"];
export const REGIMES = ["stick-slip", "almost-harmonic", "stable slip", "reversing slip", "at rest", "diverged", "not settled"];

/** Most questions whether to go on that one motion may ask: ten times what the motions of the presets need, and the same on every machine. */
const PATIENCE = 1000;

export interface SweepAsk {
  id: number;
  system: Document;
  names: string[];
  /** Values of the names, one row a column. */
  rows: number[][];
  look: Document;
  x0: number;
  v0?: number | null;
  memory?: (number | null)[] | null;
  /** Whether each motion starts where the one before ended. */
  chain: boolean;
  /** The row to begin with. */
  first?: number;
}

/** A law to be fitted to a record. */
export interface FitAsk {
  id: number;
  law: Document;
  paths: string[];
  records: Measured[];
}

/** What a motion that does not repeat is told by: the motion after many more periods; the growth rate K of the 0–1 test, not a number where there is none; and its largest Lyapunov exponent with its standard error, where its motion has a derivative. */
export interface Chaos {
  late: Steady | null;
  test: number;
  exponent: [value: number, error: number] | null;
}

/** Whether a motion still settles, its amplitude falling (−1) or growing (1): each maximum of x, or each stroboscopic one, is lower or higher than the one before. */
export function trend({ period, section }: Steady): number {
  const steps = section.slice(1).map(([x], i) => Math.sign(x - section[i]![0]));
  return !period && steps.length > 4 && steps.every((step) => step === steps[0]) ? steps[0]! : 0;
}

/** All of one motion. */
export interface ChaosAsk {
  id: number;
  test: Parameters<typeof steady>[1];
  exponent: { system: Document; x0: number[] | null; v0: number[] | null; t_end: number; transient: number; max_events: number };
}

export interface SweepPart {
  id: number;
  from: number;
  rows: Steady[];
  done: boolean;
  events: number;
  refused?: string;
  /** The row of which no answer came. */
  lost?: number;
  /** Whether this says only that the work goes on. */
  alive?: boolean;
  fit?: Fit;
  chaos?: Chaos;
}

/** What is looked at after so many periods; later and longer where the time to run says that the motion is a slow one. */
export function lookOf({ system, t_end }: State, periods: number): Document {
  const forced = system["forcing"].length > 0;
  const run = (t_end * Math.sqrt(system["stiffness"] / system["mass"])) / (2 * Math.PI);
  const transient = periods && Math.max(periods, forced ? 0 : 0.8 * run);
  return { transient, window: forced ? 120 : Math.max(40, 0.4 * run), tolerance: 1e-6, surface: null, decide: 0, points: forced ? 100 : 24, max_events: 20_000 };
}

export function steady(
  core: Core,
  question: { system: Document; names: string[]; values: number[]; look: Document; chain?: boolean; go_on?: boolean; x0?: number; v0?: number | null; memory?: (number | null)[] | null },
): { rows: Steady[]; events: number } {
  const { words, numbers } = core.ask<{ events: number }>(Verb.steady, { ...question, patience: PATIENCE });
  const rows: Steady[] = [];
  for (let at = 0; at < numbers.length; ) {
    const [regime, period, chaos, stuckShare, low, high, periodTime, mean, points, turns] = numbers.subarray(at, at + 10) as unknown as number[];
    at += 10;
    const section = Array.from({ length: points! }, (_, i): [number, number] => [numbers[at + 2 * i]!, numbers[at + 2 * i + 1]!]);
    at += 2 * points!;
    rows.push({
      regime: regime!, period: period!, chaos: chaos!, stuckShare: stuckShare!, x: [low!, high!], periodTime: periodTime!, mean: mean!,
      section, turns: numbers.slice(at, at + turns!),
    });
    at += turns!;
  }
  return { rows, events: words.events };
}

/** Milliseconds that one piece of work should take: so soon a newer question is heard. */
const PIECE = 10;
/** Milliseconds of silence after which a worker is given up (a piece is one motion where motions take long), and while it starts. */
const SILENCE = 3000;
const START = 30_000;
/** Motions that may be left out of one answer. */
const MOST_LOST = 3;

/** What runs where there is no document: a sweep in pieces, given up where a newer one is asked for. */
export function work(scope: { onmessage: ((message: MessageEvent) => void) | null; postMessage(message: unknown): void }): void {
  let core: Core;
  let newest = 0;
  const pause = () =>
    new Promise<void>((next) => {
      const channel = new MessageChannel();
      channel.port1.onmessage = () => {
        channel.port1.close();
        next();
      };
      channel.port2.postMessage(0);
    });
  /** The pieces of a sweep, or the steps of a fit. */
  function* pieces(ask: SweepAsk | FitAsk | ChaosAsk): Generator<Partial<SweepPart>> {
    if ("exponent" in ask) {
      const late = steady(core, ask.test).rows[0] ?? null;
      const chaos = { late, test: late?.chaos ?? NaN, exponent: null };
      yield { chaos, done: Boolean(late?.period) };
      if (late?.period) return;
      yield { done: true, chaos: { ...chaos, exponent: Array.from(core.ask(Verb.lyapunov, ask.exponent).numbers) as [number, number] } };
      return;
    }
    if ("records" in ask) {
      for (const one of fit(core, ask.law, ask.paths, ask.records)) yield one ? { fit: one, done: one.done } : { alive: true };
      return;
    }
    const { rows, ...question } = ask;
    const first = ask.first ?? 0;
    for (let from = first, count = 1, next: number; from < rows.length; from = next) {
      next = Math.min(from + count, rows.length);
      const begun = performance.now();
      const answer = steady(core, { ...question, values: rows.slice(from, next).flat(), go_on: ask.chain && from > first });
      const each = (performance.now() - begun) / (next - from);
      // The cost of a motion changes along a sweep: no piece is more than twice as large as the last.
      count = Math.max(1, Math.min(2 * count, Math.floor(PIECE / Math.max(each, 0.01))));
      yield { from, done: next >= rows.length, ...answer };
    }
  }
  const answer = async (ask: SweepAsk | FitAsk | ChaosAsk) => {
    const part = { id: ask.id, from: 0, rows: [], done: false, events: 0 };
    scope.postMessage({ ...part, alive: true });
    try {
      for (const piece of pieces(ask)) {
        scope.postMessage({ ...part, ...piece });
        await pause();
        if (ask.id !== newest) return;
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      scope.postMessage({ ...part, done: true, refused: error.message });
    }
  };
  scope.onmessage = ({ data }) => {
    if (data.module) core = new Core(data.module);
    else {
      newest = data.id;
      void answer(data);
    }
  };
}

/** What a worker is asked. */
export type Ask = Omit<SweepAsk, "id"> | Omit<FitAsk, "id"> | Omit<ChaosAsk, "id">;

/** A worker of the page; one that has been silent for too long is ended and replaced, and goes on after the motion it stood at. */
export class Sweeper {
  private worker!: Worker;
  private id = 0;
  private silence = 0;
  private asked: Ask | null = null;
  /** The first row of which nothing was heard, and how many were given up. */
  private next = 0;
  private lost = 0;
  /** Whether the worker has ever answered, and whether it has begun what was asked last. */
  private ready = false;
  private begun = false;
  constructor(
    private readonly program: string,
    private readonly module: WebAssembly.Module,
    private readonly hear: (part: SweepPart) => void,
  ) {
    this.renew();
  }

  private renew(): void {
    const url = URL.createObjectURL(new Blob([this.program], { type: "text/javascript" }));
    this.worker = new Worker(url);
    this.ready = false;
    URL.revokeObjectURL(url);
    this.worker.postMessage({ module: this.module });
    this.worker.onmessage = ({ data }: MessageEvent<SweepPart>) => {
      this.ready = true;
      if (data.id !== this.id) return;
      if (data.alive) {
        this.begun = true;
        return this.watch();
      }
      clearTimeout(this.silence);
      this.next = data.from + data.rows.length;
      if (!data.done && !data.refused) this.watch();
      this.hear(data);
    };
  }

  private watch(): void {
    clearTimeout(this.silence);
    // Where the page itself was busy, what has come meanwhile is heard first.
    const twice = () => (this.silence = window.setTimeout(() => this.giveUp(), 50));
    this.silence = window.setTimeout(twice, this.ready ? SILENCE : START);
  }

  private giveUp(): void {
    this.worker.terminate();
    this.renew();
    const { asked, next: lost } = this;
    // What kept it busy was asked before.
    if (asked && !this.begun) return this.post(asked);
    const part = { id: this.id, from: lost, rows: [], events: 0 };
    if (!asked || !("rows" in asked)) return this.hear({ ...part, done: true, refused: asked && "records" in asked ? "a step of the fit took longer than 3 s: leave some numbers out" : "it took longer than 3 s" });
    const { rows, names } = asked;
    this.next = lost + 1;
    const done = this.next >= rows.length || ++this.lost > MOST_LOST;
    const where = names.map((name, i) => `${name} = ${rows[lost]![i]}`).join(", ");
    this.hear({ ...part, lost, done, ...(this.lost > MOST_LOST ? { refused: `the motion at ${where} took longer than 3 s, as others did: choose another range` } : {}) });
    if (!done) this.post({ ...asked, first: this.next });
  }

  private post(asked: Ask): void {
    this.begun = false;
    this.watch();
    this.worker.postMessage({ ...asked, id: ++this.id });
  }

  ask(asked: Ask): void {
    [this.asked, this.next, this.lost] = [asked, 0, 0];
    this.post(asked);
  }
}
