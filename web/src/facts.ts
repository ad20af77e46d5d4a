/** The steady motion in one sentence, and what is needed to say it. */
import { type Core, Refused } from "./core";
import { type Orbit, RELEASE } from "./orbit";
import type { Scene } from "./panels/panel";
import { plain } from "./plot";
import type { Measured } from "./record";
import { type State, behind, documentOf, over, varied } from "./state";
import { type Chaos, REGIMES, REGIME_NAMES, type Steady, lookOf, steady, trend } from "./sweeps";

/** Periods that are left out before a motion counts as steady. */
const TRANSIENT = 80;
/** Returns by which a forced motion that does not repeat is told regular from chaotic. */
const DECIDE = 400;
/** Periods over which an exponent is averaged, and after which a motion that does not repeat is looked at again. */
export const LONG = 600;

/** What the core is asked for the steady motion of a state after so many periods; the 0–1 test, where there is one, takes three times as long as the rest. */
export function steadyQuestion(state: State, test = false, periods = TRANSIENT): Parameters<typeof steady>[1] {
  const { names, row } = varied(state, "drive_velocity");
  const look = { ...lookOf(state, periods), decide: test && state.system["forcing"].length ? DECIDE : 0 };
  return { system: documentOf(state), names, values: row(state.system["drive_velocity"]), look, x0: state.start.x0?.[0] ?? 0, v0: state.start.v0?.[0] ?? null, memory: state.start.memory ?? null };
}

/** The steady motion of a state; null where the core does not tell it. */
export function settle(core: Core, state: State, test = false): Steady | null {
  try {
    return steady(core, steadyQuestion(state, test)).rows[0] ?? null;
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    return null;
  }
}

export function sceneOf(core: Core, state: State, orbit: Orbit, settled: Steady | null, records: Measured[]): Scene {
  // The last third, at most forty natural periods of it.
  const period = 2 * Math.PI * Math.sqrt(state.system["mass"] / state.system["stiffness"]);
  const from = Math.max(0.6 * orbit.words.t_last, orbit.words.t_last - 40 * period);
  return { core, state, orbit, steady: Math.max(0, orbit.t.findIndex((t) => t >= from)), settled, records };
}

/** What a motion that does not repeat is. The exponent tells; the 0–1 test is a hint, which weak chaos and long periods deceive. */
function kindOf({ late, test, exponent }: Chaos): string {
  if (late && trend(late)) return "";
  if (!exponent) return test > 0.7 ? ": likely chaotic" : test < 0.3 ? ": likely two frequencies" : "";
  const [value, error] = exponent;
  if (value > 3 * error) return ": chaotic";
  // Only of forced motions there is a 0–1 test.
  if (value < -3 * error || Number.isNaN(test)) return ": it still settles, or its period is long";
  return test < 0.3 ? ": two frequencies" : ": undecided";
}

/** Add the sentence to an element; `chaos` is null while it is computed. */
export function sayMotion(host: HTMLElement, state: State, orbit: Orbit, settled: Steady | null, chaos: Chaos | null): void {
  const strong = (text: string, name = "") => host.append(Object.assign(document.createElement("b"), { textContent: text, className: name }));
  // What it becomes in the end, however long it is shown.
  const ends = settled?.period === 0 && chaos?.late?.period ? chaos.late : null;
  settled = ends ?? settled;
  const almost = settled?.period === 0 && REGIME_NAMES[settled.regime] === "almost_harmonic";
  const name = almost ? "never sticks" : settled ? REGIMES[settled.regime]! : REGIMES[REGIME_NAMES.indexOf(orbit.words.regime)]!;
  strong(name[0]!.toUpperCase() + name.slice(1), "regime");
  if (ends) host.append(" after a long transient");
  const forced = state.system["forcing"].length > 0;
  const { time, length, velocity, force } = state.units;
  const say = (before: string, value: number, digits: number, after = "") => {
    host.append(before);
    strong(Math.abs(value) >= 1000 ? plain(value) : digits < 1 || Math.abs(value) >= 0.01 ? value.toFixed(digits) : value.toPrecision(4));
    if (after) host.append(after);
  };
  if (settled) {
    if (settled.periodTime > 0) {
      if (forced) say(", repeats after ", settled.period, 0, settled.period > 1 ? " forcing periods" : " forcing period");
      else say(", period ", settled.periodTime, 6, behind(time));
    } else if (settled.period === 0) {
      const way = trend(chaos?.late ?? settled);
      host.append(way ? `, still ${forced ? "settling" : way < 0 ? "dying out" : "growing"}` : ", does not repeat");
      if (chaos) {
        const known: string[] = [];
        if (!Number.isNaN(chaos.test)) known.push(`0–1 test K = ${chaos.test.toFixed(2)}`);
        if (chaos.exponent) {
          const [value, error] = chaos.exponent;
          const digits = Math.max(0, Math.min(20, -Math.floor(Math.log10(error))));
          known.push(`Lyapunov exponent ${plain(+value.toFixed(digits))} ± ${plain(+error.toFixed(digits))}${behind(over("", time))} over ${LONG} periods`);
        }
        host.append(kindOf(chaos), known.length ? ` (${known.join(", ")})` : "");
      } else host.append(" (chaotic? computing …)");
    }
    // Of a motion that comes to rest an amplitude would only say how long one has waited.
    if (["stable_slip", "at_rest"].includes(REGIME_NAMES[settled.regime]!)) say(" at x = ", settled.mean, 4, behind(length));
    else say(", amplitude ", (settled.x[1] - settled.x[0]) / 2, 5, behind(length));
  }
  const last = orbit.events.findLast(({ kind, t, contact }) => kind === RELEASE && contact === 0 && t > 0.6 * orbit.words.t_last);
  if (last) {
    say(", sticks for ", last.stickTime, 4, behind(time));
    say(" and breaks away at ", Math.abs(last.force), 4, behind(force));
  }
  const { x0, v0, memory } = state.start;
  if (x0 || v0) {
    host.append(memory ? "; carried on, with the memory of friction, from x₀ = " : "; started at x₀ = ");
    strong(plain(x0?.[0] ?? 0));
    host.append(`${behind(length)}, ẋ₀ = `);
    strong(plain(v0?.[0] ?? state.system["drive_velocity"]));
    host.append(behind(velocity));
  }
  const { events, engine } = orbit.words;
  if (engine === "integrated") host.append(". Integrated to 10⁻⁶ a step, without events: the law has an internal state and creeps where others stick");
  else host.append(`. ${events} ${events === 1 ? "event" : "events"}, ${engine === "taylor" ? "by Taylor series" : events === 1 ? "exact" : "each exact"}`);
  if (orbit.words.stop !== "t_end") host.append(`; ${orbit.words.sentence}`);
  host.append(".");
}
