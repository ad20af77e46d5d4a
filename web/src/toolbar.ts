/** The buttons of the page: what is chosen, played and taken away. */
import { element } from "./controls";
import { film, picture, save, titleOf, toCsv } from "./export";
import type { Page } from "./page";
import type { Panel } from "./panels/panel";
import { neat, rangeOf } from "./plot";
import { type Document, FRESH, get } from "./state";
import { keepTheme, theme } from "./theme";

const $ = <T extends HTMLElement = HTMLElement>(id: string): T => document.getElementById(id) as T;

export function toolbar(page: Page): void {
  choices(page);
  ranges(page);
  motion(page);
  takeAway(page);
  for (const panel of page.panels) takePanel(page, panel);
  addEventListener("hashchange", () => page.open(location.hash));
}

/** Presets, laws, forcing, lessons, and a record of one's own. */
function choices(page: Page): void {
  const groups = new Map<string, HTMLElement>();
  for (const [name, { title, source, group }] of Object.entries(page.data.presets)) {
    const option = element("option", { value: name, textContent: title, title: source });
    if (!groups.has(group)) groups.set(group, element("optgroup", { label: group }));
    groups.get(group)!.append(option);
  }
  const presets = $<HTMLSelectElement>("presets");
  presets.append(element("option", { value: "", textContent: "From a file", hidden: true }), ...groups.values());
  presets.onchange = () => page.open(`#${presets.value}`);
  for (const [name, { sentence }] of Object.entries(page.data.laws)) $("type").append(element("option", { value: name, textContent: name, title: sentence }));
  $<HTMLSelectElement>("type").onchange = ({ target }) => page.change([["system.law", structuredClone(page.data.laws[(target as HTMLSelectElement).value]!.example)]]);
  const switched = (id: string, path: string, on: () => unknown, off: unknown) => ($<HTMLInputElement>(id).onchange = ({ target }) => page.change([[path, (target as HTMLInputElement).checked ? on() : off]]));
  switched("forced", "system.forcing", () => [{ amplitude: 0.05, frequency: 1.25, phase: 0 }], []);
  switched("pressed", "system.normal_force", () => ({ constant: 1, harmonics: [{ amplitude: 0.2, frequency: 1, phase: 0 }], position: 0, velocity: 0 }), null);
  switched("stopped", "system.springs", () => [stopOf(page)], []);
  $("lessons").onclick = () => (page.lessons.at ? page.lessons.close() : page.lessons.show(0, 0));
  const more = $("more");
  more.onclick = () => more.setAttribute("aria-expanded", String(more.parentElement!.classList.toggle("open")));
  $("theme").onclick = () => {
    keepTheme(theme().dark ? "light" : "dark");
    page.redrawAll();
  };
  const choose = $<HTMLInputElement>("file");
  $("measured").onclick = () => choose.click();
  const take = async (files: FileList | null | undefined) => {
    for (const file of files ?? []) page.read(file.name, await file.arrayBuffer());
    choose.value = "";
  };
  choose.onchange = () => void take(choose.files);
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    void take(event.dataTransfer?.files);
  });
}

/** A stop that the motion meets: forty times as stiff as the spring. */
function stopOf({ orbit, state }: Page): Document {
  const highest = orbit ? Math.max(0, ...orbit.x.map((x) => rangeOf(x).high)) : 0;
  const gap = highest > 0 ? neat(0.8 * highest, highest) : 1;
  return { nodes: [[0, 0], [gap, 0], [2 * gap, neat(40 * state.system["stiffness"] * gap, state.system["stiffness"])]], cubic: 0 };
}

/** What the diagram and the map are over, and from where to where. */
function ranges(page: Page): void {
  $<HTMLSelectElement>("over").onchange = ({ target }) => {
    const over = (target as HTMLSelectElement).value;
    const value = Number(get(page.state.system, over));
    const [low, high] = over === "drive_velocity" ? [0.02, 0.6] : [Math.min(0.5 * value, 1.5 * value), Math.max(0.5 * value, 1.5 * value)];
    page.change([["diagram", { over, low: +low.toPrecision(4), high: +(high || 1).toPrecision(4) }]]);
  };
  for (const end of ["low", "high"] as const)
    $<HTMLInputElement>(end).onchange = ({ target }) => {
      const field = target as HTMLInputElement;
      const next = { ...page.state.diagram, [end]: field.valueAsNumber };
      if (next.low < next.high) page.change([["diagram", next]]);
      else field.value = String(page.state.diagram[end]);
    };
  for (const [id, axis, range] of [["map-x", "x", "across"], ["map-y", "y", "up"]] as const)
    $<HTMLSelectElement>(id).onchange = ({ target }) => {
      const path = (target as HTMLSelectElement).value;
      const usual = FRESH.map.x === path ? FRESH.map.across : FRESH.map.y === path ? FRESH.map.up : null;
      const value = Number(get(page.state.system, path));
      const ends = usual && value <= usual[1] && value > usual[1] / 50 ? usual : [Math.min(0, 2 * value), Math.max(0, 2 * value) || 1];
      page.change([["map", { ...page.state.map, [axis]: path, [range]: ends }]]);
    };
}

/** Time: how long, where from, how fast, and heard. */
function motion(page: Page): void {
  $<HTMLInputElement>("time").onchange = ({ target }) => {
    const { valueAsNumber: value } = target as HTMLInputElement;
    page.change(value > 0 ? [["t_end", Math.min(5000, value)]] : []);
  };
  $<HTMLInputElement>("carry").onchange = ({ target }) => (page.carry = (target as HTMLInputElement).checked);
  $("anew").onclick = () => page.change([["start", { x0: null, v0: null }]]);
  $("play").onclick = () => page.play(!page.playing);
  $("next").onclick = () => page.nextEvent();
  $<HTMLInputElement>("speed").oninput = ({ target }) => (page.speed = (target as HTMLInputElement).valueAsNumber);
  $<HTMLSelectElement>("spectrum-of").onchange = ({ target }) => page.change([["view.derivative", Number((target as HTMLSelectElement).value)]]);
  $("listen").onclick = () => {
    if (page.sound.on) page.sound.stop();
    else page.listen();
    $("listen").setAttribute("aria-pressed", String(page.sound.on));
  };
  $("pitch").oninput = () => page.sound.on && page.listen();
  addEventListener("keydown", (event) => {
    // A field takes both keys, a button the space bar.
    const { target, key } = event;
    if (!(target instanceof Element) || target.matches("select, input:not([type=range], [type=checkbox])")) return;
    if (key === " " && !target.matches("button, input, summary")) {
      event.preventDefault();
      page.play(!page.playing);
    } else if (key === "n" && !event.ctrlKey && !event.metaKey) page.nextEvent();
  });
}

function takeAway(page: Page): void {
  $("toml").onclick = () => save("system.toml", page.toml(), "text/plain");
  $("csv").onclick = () => page.orbit && save("orbit.csv", toCsv(page.orbit), "text/csv");
  $("png").onclick = async () => save("stickslip.png", await page.sharp(page.panels, 2, () => picture(page.panels.map(({ plot }) => plot), $("panels"), 2)), "image/png");
  $("save").onclick = () => save("explorer.html", page.savedPage(), "text/html");
  $("link").onclick = async () => {
    page.toAddress();
    await navigator.clipboard?.writeText(location.href.replace(/#.*$/, "") + page.link()).catch(() => undefined);
    $("link").textContent = page.records.length ? "Copied without the record" : "Copied";
    setTimeout(() => ($("link").textContent = "Copy link"), 1200);
  };
}

/** A panel alone: a picture at one to three times, or its motion over one period. */
function takePanel(page: Page, panel: Panel): void {
  const { plot } = panel;
  const figure = plot.host.closest("figure")!;
  const name = titleOf(plot.host).toLowerCase().replaceAll(" ", "-");
  const ways: Record<string, () => Promise<Blob | null>> = {};
  for (const ratio of [1, 2, 3]) ways[`PNG ×${ratio}`] = () => page.sharp([panel], ratio, () => picture([plot], figure, ratio));
  ways["GIF of a period"] = () => {
    const cycle = page.cycle();
    const scene = page.scene();
    if (!cycle || !scene) return Promise.resolve(null);
    return page.sharp([panel], 1, () => film(plot, figure, cycle.seconds, (share) => panel.time(scene, cycle.from + share * cycle.lasts)));
  };
  const select = element("select", { className: "take", title: "Save this panel" }, new Option("⤓", ""), ...Object.keys(ways).map((way) => new Option(way)));
  select.setAttribute("aria-label", `Save the panel ${titleOf(plot.host)}`);
  select.onchange = async () => {
    const way = select.value;
    select.value = "";
    select.disabled = true;
    const blob = await ways[way]!();
    select.disabled = false;
    if (blob) save(`${name}.${way.slice(0, 3).toLowerCase()}`, blob, blob.type);
  };
  const caption = figure.querySelector("figcaption")!;
  let tools = caption.querySelector(".tools");
  if (!tools) caption.append((tools = element("span", { className: "tools" })));
  tools.append(select);
}
