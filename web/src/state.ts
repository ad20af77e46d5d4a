/** What the page shows, as one value: its difference from a preset is the link. */

export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };
export type Document = { [key: string]: any };

/** The units of what is shown; without them the numbers are dimensionless, and where one is not known it is empty. */
export interface Units {
  time: string;
  length: string;
  velocity: string;
  force: string;
}
const NONE = "dimensionless";
/** A unit as it stands behind the name of an axis. */
export const named = (unit: string): string => (unit ? ` (${unit})` : "");
/** A unit as it stands behind a number. */
export const behind = (unit: string): string => (unit && unit !== NONE ? ` ${unit}` : "");
/** The unit of one over the other. */
export function over(unit: string, below: string): string {
  if (!below || below === NONE) return unit;
  if (!unit || unit === NONE) return `1/${below}`;
  return unit.endsWith(`/${below}`) ? `${unit}²` : `${unit}/${below}`;
}

export interface State {
  preset: string;
  /** The document of one oscillator, as `stickslip simulate` reads it; forcing is a list. */
  system: Document;
  /** A chain of so many equal masses, each tied to its neighbours. */
  chain: { masses: number; coupling: number };
  /** Where it starts, and what the motion remembers that it goes on from (numbers of the core, null where there is none). */
  start: { x0: number[] | null; v0: number[] | null; memory?: (number | null)[] | null };
  t_end: number;
  units: Units;
  diagram: { over: string; low: number; high: number };
  /** The two numbers of the regime map, and from where to where they go. */
  map: { x: string; y: string; across: [number, number]; up: [number, number] };
  /** The moment that is looked at, the panels that are shown (all where none is named), and which derivative the spectrum is of. */
  view: { time: number; panels: string; derivative: number };
}

export interface Preset {
  title: string;
  /** Under which heading it stands. */
  group: string;
  source: string;
  state: Partial<State>;
}

export const FRESH: State = {
  preset: "",
  system: {},
  chain: { masses: 1, coupling: 1 },
  start: { x0: null, v0: null },
  t_end: 150,
  units: { time: NONE, length: NONE, velocity: NONE, force: NONE },
  diagram: { over: "drive_velocity", low: 0.02, high: 0.6 },
  map: { x: "drive_velocity", y: "damping", across: [0.02, 0.6], up: [0, 1] },
  view: { time: 0, panels: "", derivative: 0 },
};

export function presetState(name: string, presets: Record<string, Preset>): State {
  return mapped({ ...structuredClone(FRESH), ...structuredClone(presets[name]!.state), preset: name });
}

/** The state with a regime map that holds its own numbers, unless the map was chosen: such a range is not the usual one and has no end at 0. */
export function mapped(state: State): State {
  const { map, system } = state;
  for (const [path, range] of [[map.x, "across"], [map.y, "up"]] as const) {
    const value = Number(get(system, path));
    const chosen = !map[range].includes(0) && String(map[range]) !== String(FRESH.map[range]);
    if (!chosen && (value < map[range][0] || value > map[range][1])) state = put(state, `map.${range}`, [Math.min(0, 2 * value), Math.max(0, 2 * value) || map[range][1]].map((end) => +end.toPrecision(4)));
  }
  return state;
}

/** The document for the core: the oscillator, or a chain of its like as `stickslip.chain` makes it. */
export function documentOf({ system, chain }: State): Document {
  const n = chain.masses;
  if (n <= 1) return system;
  const { mass, stiffness, damping, drive_velocity, law, forcing, normal_force, springs } = system;
  const matrix = (entry: (i: number, j: number) => number) =>
    Array.from({ length: n }, (_, i) => Array.from({ length: n }, (_, j) => entry(i, j)));
  const degree = (i: number) => (i === 0 || i === n - 1 ? 1 : 2);
  return {
    mass: matrix((i, j) => (i === j ? mass : 0)),
    stiffness: matrix((i, j) => (i === j ? stiffness + chain.coupling * degree(i) : Math.abs(i - j) === 1 ? -chain.coupling : 0)),
    damping: matrix((i, j) => (i === j ? damping : 0)),
    contacts: Array.from({ length: n }, (_, i) => ({ mass: i, drive_velocity, law, normal_force })),
    forcing: forcing.map((force: Document) => ({ ...force, mass: 0 })),
    springs: springs.flatMap((spring: Document) => Array.from({ length: n }, (_, i) => ({ ...spring, mass: i }))),
  };
}

export function get(document: any, path: string): any {
  return path.split(".").reduce((at, key) => at?.[key], document);
}

/** A copy with another value at a path. */
export function put<T>(document: T, path: string, value: unknown): T {
  const [key, ...rest] = path.split(".") as [string, ...string[]];
  const copy: any = Array.isArray(document) ? [...document] : { ...document };
  copy[key] = rest.length ? put(copy[key], rest.join("."), value) : value;
  return copy;
}

function* leaves(value: unknown, path = ""): Generator<[string, Json]> {
  if (value !== null && typeof value === "object") {
    for (const [key, inner] of Object.entries(value)) yield* leaves(inner, path ? `${path}.${key}` : key);
  } else yield [path, value as Json];
}

/** `#almost-harmonic&system.drive_velocity=0.31`: a preset and every number that differs; whole branches where the shape does. */
export function toLink(state: State, presets: Record<string, Preset>): string {
  const from = presetState(state.preset in presets ? state.preset : Object.keys(presets)[0]!, presets) as any;
  const changes: [string, Json][] = [];
  for (const [key, value] of Object.entries(state)) {
    if (key === "preset") continue;
    const shape = (whole: unknown) => JSON.stringify([...leaves(whole)].map(([path]) => path));
    const branches = key === "system" ? Object.keys(value as Document).map((name) => `system.${name}`) : [key];
    for (const branch of branches) {
      const [now, before] = [get(state, branch), get(from, branch)];
      const law = branch === "system.law" && now.type !== before?.type;
      if (law || shape(now) !== shape(before)) changes.push([branch, now]);
      else for (const [path, leaf] of leaves(now, branch)) if (get(from, path) !== leaf) changes.push([path, leaf]);
    }
  }
  const words = changes.map(([path, leaf]) => `${path}=${encodeURIComponent(typeof leaf === "string" ? leaf : JSON.stringify(leaf))}`);
  return `#${[state.preset, ...words].join("&")}`;
}

/** The state of a link, and a sentence about each word in it that says nothing. */
export function fromLink(hash: string, presets: Record<string, Preset>): { state: State; unknown: string[] } {
  const [name = "", ...rest] = hash.replace(/^#/, "").split("&");
  const known = Object.keys(presets);
  const unknown = name && !(name in presets) ? [`the link names the preset “${name}”; known are ${known.join(", ")}`] : [];
  let state = presetState(name in presets ? name : known[0]!, presets);
  // What came from a file has the name of no preset.
  if (!name && rest.length) state.preset = "";
  for (const pair of rest) {
    const cut = pair.indexOf("=");
    const path = pair.slice(0, cut);
    let text: string;
    try {
      text = decodeURIComponent(pair.slice(cut + 1));
    } catch {
      text = pair.slice(cut + 1);
    }
    let value: unknown = text;
    try {
      value = JSON.parse(text);
    } catch {
      /* a word, not a number */
    }
    const place = get(state, path);
    const fits = place === null || typeof place === typeof value || path === "system.law";
    if (cut < 0 || place === undefined || !fits || path.includes("__proto__")) unknown.push(`the link has “${pair}”, which names nothing here`);
    else state = put(state, path, value);
  }
  return { state: mapped(state), unknown };
}

/** The system file of the command line; JavaScript writes numbers so that they are read back to the bit. */
export function toToml(state: State): string {
  const lines: string[] = [];
  const plain = (value: any): string => {
    if (typeof value === "string") return JSON.stringify(value);
    if (Array.isArray(value)) return `[${value.map(plain).join(", ")}]`;
    if (typeof value === "object") return `{${pairs(value).join(", ")}}`;
    return String(value);
  };
  const pairs = (document: Document) => Object.entries(document).flatMap(([key, value]) => (value === null || value === undefined ? [] : [`${key} = ${plain(value)}`]));
  const table = (name: string, document: Document) => lines.push("", name, ...pairs(document));
  // A pencil at infinity is said, as the law's own default of D is a point.
  const law = (one: Document): Document => (one["type"] === "BogaczRyczek" && one["D"] === null ? { ...one, D: "infinity" } : one);
  const { law: friction, forcing, contacts, springs, ...numbers } = documentOf(state);
  lines.push(...pairs(numbers));
  if (friction) table("[law]", law(friction));
  for (const contact of contacts ?? []) {
    table("[[contacts]]", { ...contact, law: null });
    table("[contacts.law]", law(contact.law));
  }
  for (const force of forcing ?? []) table("[[forcing]]", force);
  for (const spring of springs ?? []) table("[[springs]]", spring);
  const { x0, v0, memory } = state.start;
  if (memory) lines.unshift("# Carried on from another motion: what friction remembers of it stands in the link and in the saved page, not in this file.");
  const one = (values: number[] | null) => (values && values.length === 1 ? values[0] : values);
  table("[simulation]", { t_end: state.t_end, x0: one(x0), v0: one(v0) });
  return `${lines.join("\n")}\n`;
}

/** The numbers of the document that numbers of the state move (one of an oscillator, some of a chain), and a row of their values. */
export function varied(state: State, ...paths: string[]): { names: string[]; row(...values: number[]): number[] } {
  const at = (values: number[]): Document => documentOf(paths.reduce((one, path, i) => put(one, `system.${path}`, values[i]), state));
  const now = paths.map((path) => Number(get(state.system, path)));
  const here = new Map(leaves(at(now)));
  const names = [...leaves(at(now.map((value) => value + 1)))].filter(([name, leaf]) => here.get(name) !== leaf).map(([name]) => name);
  return {
    names,
    row: (...values) => {
      const document = at(values);
      return names.map((name) => get(document, name));
    },
  };
}
