/** The core as WebAssembly: a question in JSON, words and numbers back. The only file that knows the module's memory. */

import { fromText, unlzma } from "./lzma";

interface Exports {
  memory: WebAssembly.Memory;
  question(len: number): number;
  columns(len: number): number;
  answer(verb: number): number;
  words(): number;
  words_len(): number;
  numbers(): number;
  numbers_len(): number;
}

export const Verb = { orbit: 0, states: 1, steady: 2, curve: 3, surface: 4, lyapunov: 5 } as const;
export type Verb = (typeof Verb)[keyof typeof Verb];

const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** A sentence of the core: what it expected and what it got. */
export class Refused extends Error {}

export class Core {
  private exports: Exports;
  /** Questions asked so far: what a change costs is counted in them. */
  calls = 0;

  constructor(readonly module: WebAssembly.Module) {
    this.exports = this.instance();
  }

  private instance(): Exports {
    return new WebAssembly.Instance(this.module, {}).exports as unknown as Exports;
  }

  /** Columns of one length go as numbers, not as text. */
  ask<Words = Record<string, unknown>>(verb: Verb, question: unknown, columns: ArrayLike<number>[] = []): { words: Words; numbers: Float64Array } {
    this.calls++;
    const bytes = encoder.encode(JSON.stringify(question));
    let bad: number;
    try {
      // The calls may grow the memory, which detaches its buffer: it is asked for after each.
      const at = this.exports.question(bytes.length);
      new Uint8Array(this.exports.memory.buffer, at, bytes.length).set(bytes);
      const rows = columns[0]?.length ?? 0;
      const first = this.exports.columns(rows * columns.length);
      const room = new Float64Array(this.exports.memory.buffer, first, rows * columns.length);
      columns.forEach((column, i) => room.set(column, i * rows));
      bad = this.exports.answer(verb);
    } catch (error) {
      this.exports = this.instance(); // a trap costs one instance
      throw error;
    }
    const { exports } = this;
    const words = decoder.decode(new Uint8Array(exports.memory.buffer, exports.words(), exports.words_len()));
    if (bad) throw new Refused(words);
    const numbers = new Float64Array(exports.memory.buffer, exports.numbers(), exports.numbers_len()).slice();
    return { words: JSON.parse(words), numbers };
  }
}

/** The module from the packed text of its element. */
export const unpack = (text: string): Promise<WebAssembly.Module> => WebAssembly.compile(unlzma(fromText(text.trim())));
