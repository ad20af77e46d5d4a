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
export const REGIME_NAMES = ["stick_slip", "almost_harmonic", "stable_slip", "back_and_forth", "at_rest", "diverged", "unfinished"];
export const REGIMES = ["stick-slip", "almost-harmonic", "stable slip", "back and forth", "at rest", "diverged", "not settled"];

/** Most questions whether to go on that one motion may ask: a limit that is the same on every machine. */
const PATIENCE = 20_000;

export interface SweepAsk {
  id: number;
  system: Document;
  names: string[];
  /** Values of the names, one row a column. */
  rows: number[][];
  look: Document;
  x0: number;
  v0?: number | null;
  /** Whether each motion starts where the one before ended. */
  chain: boolean;
}

/** A law to be fitted to a record. */
export interface FitAsk {
  id: number;
  law: Document;
  paths: string[];
  record: Measured;
}

export interface SweepPart {
  id: number;
  from: number;
  rows: Steady[];
  done: boolean;
  events: number;
  refused?: string;
  fit?: Fit;
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
  question: { system: Document; names: string[]; values: number[]; look: Document; chain?: boolean; go_on?: boolean; x0?: number; v0?: number | null },
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

/** Columns in one piece of work: some 10 ms. */
const PIECE = 8;

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
  function* pieces(ask: SweepAsk | FitAsk): Generator<Partial<SweepPart>> {
    if ("record" in ask) {
      for (const one of fit(core, ask.law, ask.paths, ask.record)) yield { fit: one, done: one.done };
      return;
    }
    const { rows, ...question } = ask;
    for (let from = 0; from < rows.length; from += PIECE) {
      const values = rows.slice(from, from + PIECE).flat();
      yield { from, done: from + PIECE >= rows.length, ...steady(core, { ...question, values, go_on: ask.chain && from > 0 }) };
    }
  }
  const answer = async (ask: SweepAsk | FitAsk) => {
    const part = { id: ask.id, from: 0, rows: [], done: false, events: 0 };
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

/** A worker of the page; one that has been silent for too long is replaced. */
export class Sweeper {
  private worker!: Worker;
  private id = 0;
  private silence = 0;
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
    URL.revokeObjectURL(url);
    this.worker.postMessage({ module: this.module });
    this.worker.onmessage = ({ data }: MessageEvent<SweepPart>) => {
      if (data.id !== this.id) return;
      clearTimeout(this.silence);
      if (!data.done && !data.refused) this.watch();
      this.hear(data);
    };
  }

  private watch(): void {
    this.silence = window.setTimeout(() => {
      this.worker.terminate();
      this.renew();
      this.hear({ id: this.id, from: 0, rows: [], done: true, events: 0, refused: "a motion took longer than 10 s: change the range" });
    }, 10_000);
  }

  ask(question: Omit<SweepAsk, "id"> | Omit<FitAsk, "id">): void {
    clearTimeout(this.silence);
    this.watch();
    this.worker.postMessage({ ...question, id: ++this.id });
  }
}
