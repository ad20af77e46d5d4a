/** What of a law can be taken by hand in the plane of slip velocity and friction, for every law of the catalogue. */
import { neat } from "../plot";
import type { Document } from "../state";
import type { LawPage } from "../data";
import type { Change } from "./panel";

export interface Handle {
  /** The path of the number in the law, unique among the handles. */
  key: string;
  label: string;
  /** What it is, where its label does not say so. */
  name?: string;
  w: number;
  f: number;
  set(w: number, f: number): Change[];
}

export interface Drawn {
  /** The force of a slip that speeds up from rest, at some slip velocity. */
  upper(w: number): number;
  /** The break-away force without rest at the force rate of the drive. */
  breakAway: number;
  /** Corners of the loop of this motion. */
  corner: [number, number];
  /** The upper and the right end of the picture. */
  top: number;
  right: number;
}

const round = (value: number) => +value.toFixed(4);
/** From 0 to the end of the picture. */
const within = (value: number, end: number) => neat(Math.max(0, value), end);
const degrees = (slope: number) => round((Math.atan(slope) * 180) / Math.PI);
const slopeOf = (angle: number) => Math.tan((angle * Math.PI) / 180);

/** Growth that stands on top of another force. */
export const ABOVE: Record<string, string> = { limit: "kinetic", growth: "kinetic" };

/** Rings that a table of nodes has at most. */
const RINGS = 9;

/** Rings of nodes: of a long table some of them, each of which takes the nodes up to the next rings with it. */
function nodeHandles(path: string, symbol: string, nodes: [number, number][], drawn: Drawn): Handle[] {
  const last = nodes.length - 1;
  const few = nodes.length <= RINGS;
  const chosen = few ? nodes.map((_, i) => i) : Array.from({ length: RINGS }, (_, k) => Math.round((k * last) / (RINGS - 1)));
  return chosen.map((i, k) => {
    const [w, f] = nodes[i]!;
    const name = `${symbol} ${i + 1} of ${nodes.length}`;
    const handle = { key: `${path}.${i}`, label: i ? "" : symbol, name, w, f };
    const [before, after] = [nodes[chosen[k - 1] ?? -1]?.[0], nodes[chosen[k + 1] ?? -1]?.[0]];
    if (few) {
      const gap = 0.005 * drawn.right;
      const between = (to: number) => Math.min((after ?? Infinity) - gap, Math.max((before ?? 0) + gap, to));
      return { ...handle, set: (to, force) => [[`law.${path}.${i}`, [i ? neat(between(to), drawn.right) : 0, within(force, drawn.top)]]] };
    }
    // One at the ring, falling to nothing at the rings beside it.
    const share = (at: number) => {
      const end = at < w ? before : after;
      return at === w ? 1 : end === undefined ? 0 : Math.max(0, 1 - (at - w) / (end - w));
    };
    return { ...handle, set: (_to, force) => [[`law.${path}`, nodes.map(([at, height]) => [at, share(at) ? within(height + share(at) * (force - f), drawn.top) : height])]] };
  });
}

/** What a number that stands before a function of the slip velocity is multiplied by there. */
const FACTORS: Record<string, (w: number) => number> = { "Cubic linear": (w) => -w, "Cubic cubic": (w) => w ** 3, "PoppStelter square": (w) => w * w };

/** The handles of a law by the dimensions of its parameters: points, nodes, levels at w = 0, scales along w. */
export function handlesOf(law: Document, page: LawPage, drawn: Drawn): Handle[] {
  if (law["type"] === "BogaczRyczek") return paperHandles(law, drawn);
  if (law["type"] === "RateState") return rockHandles(law, drawn);
  const handles: Handle[] = [];
  for (const { path, symbol, unit } of page.numbers) {
    // A number of a law within is named after what that law is for.
    const cut = path.lastIndexOf(".") + 1;
    const [inside, key] = [path.slice(0, cut), path.slice(cut)];
    const whole = inside.split(".").reduce((at, word) => (word ? at?.[word] : at), law);
    const value = whole?.[key];
    const part = inside && !inside.startsWith("law.") ? ` ${inside.slice(0, -1)}` : "";
    const label = symbol + part;
    // Friction of the other sense stands below.
    const side = inside === "backward." ? -1 : 1;
    const speeds = (w: number) => (side > 0 ? drawn.upper(w) : -(whole["kinetic"] ?? whole["break_away"] ?? 0));
    const factor = FACTORS[`${whole?.["type"]} ${key}`] ?? (key === "viscous" ? (w: number) => w : null);
    if (unit === "velocity, force" && Array.isArray(value)) {
      if (side > 0) handles.push(...nodeHandles(path, label, value, drawn));
    } else if (typeof value !== "number") continue;
    else if (unit === "force" || unit === "velocity, force") {
      const below = ABOVE[key] ? whole[ABOVE[key]] : 0;
      handles.push({ key: path, label, w: 0, f: side * (value + below), set: (_w, f) => [[`law.${path}`, within(side * f - below, drawn.top)]] });
    } else if (unit === "velocity")
      handles.push({ key: path, label, w: side * value, f: speeds(value), set: (w) => [[`law.${path}`, neat(Math.max(0.001 * drawn.right, side * w), drawn.right)]] });
    else if (unit === "velocity^-1")
      handles.push({ key: path, label: `1/${label}`, w: side / value, f: speeds(1 / value), set: (w) => [[`law.${path}`, +(1 / Math.max(0.01 * drawn.right, side * w)).toPrecision(4)]] });
    else if (factor && side > 0) {
      // The further the number is from the others on the right, the better it is told from them.
      const w = drawn.right * (key === "linear" ? 0.35 : 0.8);
      handles.push({ key: path, label, w, f: drawn.upper(w), set: (_w, f) => [[`law.${path}`, within(value + (f - drawn.upper(w)) / factor(w), drawn.top / Math.abs(factor(drawn.right)))]] });
    }
  }
  if (law["type"] === "BoucWen") {
    // What a long slip ends at.
    const level = law["stiffness"] * (law["amplitude"] / (law["beta"] + law["gamma"])) ** (1 / law["exponent"]);
    handles.push({ key: "stiffness", label: "k z∞", w: 0.8 * drawn.right, f: level, set: (_w, f) => [["law.stiffness", within((law["stiffness"] * f) / level, (drawn.top * law["stiffness"]) / level)]] });
  }
  return handles;
}

/** Steady friction N (μ₀ + (a − b) ln(w/V₀)) of rock: its level far to the right, and what it loses on the way there. */
function rockHandles(law: Document, { right, top }: Drawn): Handle[] {
  const { normal_force: load, a, b, reference_friction: level, reference_velocity: at } = law as Record<string, number>;
  const logarithm = (w: number) => Math.log(w / at!);
  const force = (w: number) => load! * (level! + (a! - b!) * logarithm(w));
  const [fast, slow] = [0.8 * right, 0.1 * right];
  return [
    { key: "reference_friction", label: "μ₀", w: fast, f: force(fast), set: (_w, f) => [["law.reference_friction", within(level! + (f - force(fast)) / load!, top / load!)]] },
    // The level far to the right stays.
    { key: "b", label: "b", w: slow, f: force(slow), set: (_w, f) => { const next = +Math.max(0, b! + (f - force(slow)) / (load! * Math.log(fast / slow))).toPrecision(4); return [["law.b", next], ["law.reference_friction", +(level! + (next - b!) * logarithm(fast)).toPrecision(6)]]; } },
  ];
}

/** Pencils A, B, C, D, both ends of l, f_s, and the angles of the pencils at infinity. */
function paperHandles(law: Document, { upper, breakAway, corner, top }: Drawn): Handle[] {
  const handles: Handle[] = [];
  for (const name of ["A", "B", "C", "D"]) {
    const point = law[name];
    if (!point) continue;
    handles.push({ key: name, label: name, name: `pencil ${name}`, w: point[0], f: point[1], set: (w, f) => [[`law.${name}`, [round(name === "B" ? Math.min(0, w) : w), round(f)]]] });
  }
  const [slope, intercept] = law["l"];
  const low = Math.max(0.12, (0.15 - intercept) / slope);
  const high = Math.max(low + 0.25, Math.min(0.62, (top - 0.3 - intercept) / slope));
  for (const [key, here, there] of [["l.0", low, high], ["l.1", high, low]] as const)
    handles.push({
      key,
      label: "l",
      name: key === "l.1" ? "line l, upper end" : "line l, lower end",
      w: here,
      f: slope * here + intercept,
      set: (w, f) => {
        const fixed = slope * there + intercept;
        if (Math.abs(w - there) < 0.05) return [];
        const to = (f - fixed) / (w - there);
        return to > 0.2 ? [["law.l", [round(to), round(fixed - to * there)]]] : [];
      },
    });
  const initial: number = law["static_friction"].initial;
  handles.push({ key: "f_s", label: "fₛ(0, δ)", w: 0, f: breakAway, set: (_w, f) => [["law.static_friction.initial", round(Math.max(0.05, initial + f - breakAway))]] });
  if (!law["A"]) {
    const start = law["beta"] * 1.5;
    const w = Math.max(start + 0.06, 0.45 * corner[0]);
    const f0 = upper(start);
    handles.push({ key: "phi", label: "φ", w, f: f0 + slopeOf(law["phi"]) * (w - start), set: (to, f) => (to > start + 0.02 ? [["law.phi", Math.max(-88, Math.min(-1, degrees((f - f0) / (to - start))))]] : []) });
  }
  if (!law["C"]) {
    const w = corner[0] + 0.22;
    const f0 = corner[1];
    handles.push({ key: "psi", label: "ψ", w, f: f0 + slopeOf(law["psi"]) * 0.22, set: (to, f) => (to > corner[0] + 0.02 ? [["law.psi", Math.max(-40, Math.min(85, degrees((f - f0) / (to - corner[0]))))]] : []) });
  }
  if (!law["D"]) {
    const w = 0.3 * corner[0];
    const rise = 0.35;
    handles.push({ key: "eta", label: "η", w: w + rise / slopeOf(law["eta"]), f: upper(w) - 0.6 + rise, set: (to) => [["law.eta", Math.max(20, Math.min(89.5, degrees(rise / Math.max(0.003, to - w))))]] });
  }
  return handles;
}
