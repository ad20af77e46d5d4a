/** What stands in the page beside the script: laws, presets, state, the packed core. */
import { fromText, unlzma } from "./lzma";
import type { Measured } from "./record";
import type { Preset, State } from "./state";

export interface NumberPage {
  /** Path within the document of the law or the oscillator. */
  path: string;
  symbol: string;
  name: string;
  /** What the documentation says of it. */
  words: string;
  unit: string;
  low: number;
  high: number;
  choices?: number[];
  /** The words that it may be, where it is no number. */
  options?: string[];
}

export interface LawPage {
  sentence: string;
  numbers: NumberPage[];
  /** A document of this law in plain numbers. */
  example: Record<string, any>;
  /** Whether it has an internal state: then motions are integrated. */
  state: boolean;
}

export interface Data {
  version: string;
  laws: Record<string, LawPage>;
  oscillator: NumberPage[];
  presets: Record<string, Preset>;
  /** Markdown. */
  lessons: string[];
  /** Of the page, beside that of the panels. */
  style: string;
}

export function read<T>(id: string): T {
  return JSON.parse(document.getElementById(id)!.textContent!) as T;
}

/** Packed as the core is: words take a third of their room. */
export const data = (): Data => JSON.parse(new TextDecoder().decode(unlzma(fromText(document.getElementById("data")!.textContent!.trim())))) as Data;
export const savedState = (): State | null => read<State | null>("state");
export const savedRecords = (): Measured[] => read<Measured[] | null>("records") ?? [];
