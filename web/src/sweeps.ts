/** Sweeps beside the page: what is asked of a worker, what comes back, and the worker itself. The newest question wins. */
import { Core, Refused, Verb } from "./core";
import type { Document } from "./state";

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
}

export interface SweepPart {
  id: number;
  from: number;
  rows: Steady[];
  done: boolean;
  events: number;
  refused?: string;
}

export function lookOf(system: Document, transient: number): Document {
  const forced = system["forcing"].length > 0;
  return { transient, window: forced ? 120 : 40, tolerance: 1e-6, surface: null, decide: 0, points: forced ? 100 : 24, max_events: 20_000 };
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
  const sweep = async ({ id, system, names, rows, look, x0 }: SweepAsk) => {
    for (let from = 0; from < rows.length && id === newest; from += PIECE) {
      const part: SweepPart = { id, from, rows: [], done: from + PIECE >= rows.length, events: 0 };
      try {
        const values = rows.slice(from, from + PIECE).flat();
        Object.assign(part, steady(core, { system, names, values, look, chain: true, go_on: from > 0, x0 }));
      } catch (error) {
        if (!(error instanceof Refused)) throw error;
        part.refused = error.message;
      }
      scope.postMessage(part);
      if (part.refused) return;
      await pause();
    }
  };
  scope.onmessage = ({ data }) => {
    if (data.module) core = new Core(data.module);
    else {
      newest = data.id;
      void sweep(data);
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

  ask(question: Omit<SweepAsk, "id">): void {
    clearTimeout(this.silence);
    this.watch();
    this.worker.postMessage({ ...question, id: ++this.id } satisfies SweepAsk);
  }
}
