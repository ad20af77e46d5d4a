/** The numbers that the orbit diagram and the regime map may be over, and from where to where they go. */
import { FORCING, NORMAL_FORCE, SPRING } from "./controls";
import type { Data, NumberPage } from "./data";
import { FRESH, type State, type Units, get, mapped, over, put } from "./state";

const field = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;

/** A number as an axis is named. */
export const axisName = (path: string): string => (path === "drive_velocity" ? "drive velocity s" : path.replace(/^law\./, "").replaceAll(/\.\d+/g, "").replaceAll(/[._]/g, " "));

/** Its unit; empty where it is not known. */
export function axisUnit(path: string, { time, velocity, force }: Units): string {
  if (path === "drive_velocity") return velocity;
  if (/^forcing.*amplitude$/.test(path)) return force;
  return path.endsWith("frequency") ? over("", time) : "";
}

function sweepable(data: Data, { system: { law, forcing, normal_force, springs } }: State): Pick<NumberPage, "path" | "symbol">[] {
  const numbers = data.laws[law.type]!.numbers.filter((page) => typeof get(law, page.path) === "number" && !("choices" in page));
  return [
    ...data.oscillator,
    ...(forcing.length ? FORCING : []),
    ...(normal_force ? NORMAL_FORCE : []),
    ...(springs.length ? SPRING : []),
    ...numbers.map((page) => ({ ...page, path: `law.${page.path}` })),
  ];
}

/** The state with axes that its law and forcing have, and whether that changed the diagram. */
export function axesWithin(data: Data, state: State): { state: State; changed: boolean } {
  const known = new Set(sweepable(data, state).map(({ path }) => path));
  const changed = !known.has(state.diagram.over);
  if (changed) state = put(state, "diagram", FRESH.diagram);
  if (!known.has(state.map.x) || !known.has(state.map.y)) state = put(state, "map", FRESH.map);
  return { state: mapped(state), changed };
}

/** Offer them, and show those of the state. */
export function showAxes(data: Data, state: State): void {
  const pages = sweepable(data, state);
  const wanted = pages.map(({ path }) => path).join();
  for (const [id, path] of [["over", state.diagram.over], ["map-x", state.map.x], ["map-y", state.map.y]] as const) {
    const select = field<HTMLSelectElement>(id);
    if (select.dataset["wanted"] !== wanted) {
      select.dataset["wanted"] = wanted;
      select.replaceChildren(...pages.map((page) => new Option(page.symbol, page.path)));
    }
    select.value = path;
  }
  for (const end of ["low", "high"] as const) {
    const input = field<HTMLInputElement>(end);
    if (document.activeElement !== input) input.value = String(+state.diagram[end].toPrecision(6));
  }
}
