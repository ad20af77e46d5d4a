/** The friction law: up and down broad, the memory loop of this motion coloured by branch, handles to take it by. */
import { Verb } from "../core";
import type { LawPage } from "../data";
import type { Document } from "../state";
import { indexAt, valueAt } from "../orbit";
import { type Range, rangeOf, widen } from "../plot";
import { colourOf, theme } from "../theme";
import { ABOVE, type Handle, handlesOf } from "./handles";
import { type Change, Panel, type Scene } from "./panel";

const SAMPLES = 240;

export class Law extends Panel {
  change?: (changes: Change[]) => void;
  private held = "";
  /** −1 where the drive goes backwards: then the law of one sense stands on the left, turned about the origin. */
  private side = 1;
  private readonly buttons = new Map<string, HTMLButtonElement>();
  private handles = new Map<string, Handle>();

  constructor(
    host: HTMLElement,
    private readonly pages: Record<string, LawPage>,
  ) {
    super(host, "Friction law: friction over slip velocity, with handles", { x: "slip velocity w = s − ẋ", y: "friction f" });
  }

  /** Force along a slip that speeds up from rest to `top` and slows down again; empty where the core refuses the law. */
  private curve({ core, state: { system } }: Scene, top: number): { w: number[]; f: Float64Array } {
    const up = Array.from({ length: SAMPLES }, (_, i) => (this.side * i * top) / (SAMPLES - 1));
    const w = [...up, ...up.slice(0, -1).reverse()];
    const rate = Math.abs(system["stiffness"] * system["drive_velocity"]);
    const columns = [w.map((_, i) => i), w, w.map((_, i) => Number(i === 0)), w.map(() => rate)];
    return { w, f: core.ask(Verb.curve, { law: system["law"] }, columns).numbers.subarray(0, w.length) };
  }

  draw(scene: Scene): void {
    const { orbit, steady, state: { system, units } } = scene;
    const p = this.plot;
    p.units = [units.velocity, units.force];
    const g = p.base;
    const law = system["law"];
    const paper = law.type === "BogaczRyczek";
    const side = (this.side = system["drive_velocity"] < 0 && !law.backward ? -1 : 1);
    const { dark, faint, soft } = theme();
    const points: [number, number][] = paper ? [law.A, law.B, law.C, law.D].filter(Boolean) : Object.values(law).filter(Array.isArray).flat().filter((one: any): one is [number, number] => Array.isArray(one) && one.length === 2);
    const [w, f] = [orbit.w[0]!, orbit.force[0]!];
    const least = paper ? 0.7 : 2.5 * Math.abs(system["drive_velocity"]);
    const lists = [rangeOf(w), ...scene.records.map((record) => rangeOf(record.w)), rangeOf([0, side * Math.max(least, Math.min(4 * least, 1.05 / law.weakening || 0))]), rangeOf(points.map(([x]) => side * x).concat(0))];
    if (!this.held) p.x = widen({ low: Math.min(...lists.map(({ low }) => low)), high: Math.max(...lists.map(({ high }) => high)) }, 0.08);
    let drawn: { w: number[]; f: Float64Array } | null = null;
    try {
      drawn = this.curve(scene, this.right);
    } catch {
      // The sentence of the core stands on top of the page.
    }
    const parts: [Document, number][] = [[law, 1], ...["forward", "backward", "static", "kinetic", "law"].flatMap((key): [Document, number][] => (law[key]?.type ? [[law[key], key === "backward" ? -1 : 1]] : []))];
    const levels = parts.flatMap(([part, sense]) => ["break_away", "kinetic", "static", "limit", "growth"].flatMap((key) => (typeof part[key] === "number" ? [sense * side * (part[key] + (part[ABOVE[key] ?? ""] ?? 0))] : [])));
    if (!this.held) {
      const forces = [rangeOf(f), ...scene.records.map((record) => rangeOf(record.force)), ...(drawn ? [rangeOf(drawn.f.map((one, i) => (i ? one : side * Math.abs(one))))] : []), rangeOf(points.map(([, y]) => side * y).concat(levels, 0))];
      const high = Math.max(...forces.map(({ high: one }) => one));
      const low = Math.min(0, ...forces.map(({ low: one }) => one));
      p.y = { low: low - (low < 0 ? 0.06 * (high - low) : 0), high: high + 0.08 * (high - low) };
    }
    p.axes();
    p.clip(g);
    g.lineWidth = 1.2;
    g.strokeStyle = faint;
    p.segment(g, p.px(0), p.pad.top, p.px(0), p.height - p.pad.bottom);
    if (drawn) {
      g.lineWidth = 5;
      g.lineCap = "butt";
      g.strokeStyle = dark ? "#403d38" : "#e4dfd3";
      p.line(g, drawn.w, drawn.f, 1, SAMPLES);
      p.line(g, drawn.w, drawn.f, SAMPLES, drawn.w.length);
      g.lineCap = "round";
    }
    for (const record of scene.records) {
      p.errors(record.w, record.force, record.error ?? []);
      p.cloud(record.w, record.force);
    }
    const mode = orbit.mode[0]!;
    const entry = (branch: number) => {
      for (let i = steady + 1; i < mode.length; i++) if (mode[i] === branch && mode[i - 1] !== branch) return [w[i]!, f[i]!] as [number, number];
      return null;
    };
    const lower = paper ? entry(3) : null;
    if (paper) {
      const [a, b] = [law.l[0], side * law.l[1]];
      g.strokeStyle = soft;
      g.lineWidth = 1.2;
      g.setLineDash([6, 5]);
      const [from, to] = [Math.max(p.x.low, (p.y.low - b) / a), Math.min(p.x.high, (p.y.high - b) / a)];
      p.segment(g, p.px(from), p.py(a * from + b), p.px(to), p.py(a * to + b));
      g.setLineDash([2, 4]);
      for (const [pencil, through] of [[law.A, entry(1)], [law.B, lower], [law.C, entry(2)], [law.D, entry(4)]] as const)
        if (pencil && through) p.segment(g, p.px(side * pencil[0]), p.py(side * pencil[1]), p.px(through[0]), p.py(through[1]));
      g.setLineDash([]);
    }
    g.lineWidth = 1;
    g.strokeStyle = faint;
    p.line(g, w, f, 0, steady + 1);
    g.lineWidth = orbit.words.events > 150 ? 1.2 : 2.6;
    p.runs(w, f, mode, steady, (one) => colourOf(law.type, one));
    g.restore();
    this.place(scene, drawn, lower);
  }

  /** The end of the picture in the sense of the drive. */
  private get right(): number {
    const { low, high } = this.plot.x;
    return this.side > 0 ? high : -low;
  }

  /** The handles as buttons over the picture: by hand, by finger, by the arrow keys. */
  private place({ core, state: { system } }: Scene, drawn: { w: number[]; f: Float64Array } | null, lower: [number, number] | null): void {
    const law = system["law"];
    const { side, right, plot } = this;
    const page = this.pages[law.type];
    if (!page || !drawn) return;
    let breakAway = NaN;
    try {
      breakAway = core.ask(Verb.surface, { law, stick_times: [0], force_rates: [Math.abs(system["stiffness"] * system["drive_velocity"])] }).numbers[0]!;
    } catch {
      // A law with an internal state has no break-away force of its own.
    }
    // Seen in the sense of the drive.
    const upper = (at: number) => side * drawn.f[Math.max(1, Math.min(SAMPLES - 1, Math.round((at / right) * (SAMPLES - 1))))]!;
    let corner = lower;
    if (!corner) {
      let least = 1;
      for (let i = 1; i < SAMPLES; i++) if (side * drawn.f[i]! < side * drawn.f[least]!) least = i;
      corner = [drawn.w[least]!, drawn.f[least]!];
    }
    const handles = handlesOf(law, page, { upper, breakAway, corner: [side * corner[0], side * corner[1]], top: side > 0 ? plot.y.high : -plot.y.low, right }).map((handle) => ({
      ...handle, w: side * handle.w, f: side * handle.f, set: (w: number, f: number) => handle.set(side * w, side * f),
    }));
    this.handles = new Map(handles.map((handle) => [handle.key, handle]));
    for (const [key, button] of this.buttons)
      if (!this.handles.has(key)) {
        button.remove();
        this.buttons.delete(key);
      }
    for (const { key, label, name, w, f } of handles) {
      const button = this.buttons.get(key) ?? this.button(key);
      const [x, y] = [this.plot.px(w), this.plot.py(f)];
      button.style.transform = `translate(${x * this.plot.zoom}px, ${y * this.plot.zoom}px)`;
      button.dataset["label"] = label;
      button.hidden = !Number.isFinite(x + y) || x < this.plot.pad.left - 8 || x > this.plot.width + 4 || y < -4 || y > this.plot.height - this.plot.pad.bottom + 8;
      button.setAttribute("aria-label", `${name ?? (label || key)}: slip velocity ${w.toPrecision(4)}, force ${f.toPrecision(4)}; arrow keys move it`);
    }
  }

  private button(key: string): HTMLButtonElement {
    const button = document.createElement("button");
    button.className = "handle";
    button.type = "button";
    button.dataset["key"] = key;
    const move = (w: number, f: number) => this.change?.(this.handles.get(key)?.set(w, f) ?? []);
    button.addEventListener("pointerdown", (event) => {
      this.held = key;
      button.setPointerCapture(event.pointerId);
    });
    button.addEventListener("pointermove", (event) => {
      if (this.held !== key) return;
      const { host, zoom } = this.plot;
      const box = host.getBoundingClientRect();
      move(this.plot.xAt((event.clientX - box.left) / zoom), this.plot.yAt((event.clientY - box.top) / zoom));
    });
    for (const end of ["pointerup", "pointercancel"])
      button.addEventListener(end, () => {
        this.held = "";
        this.change?.([]);
      });
    button.addEventListener("keydown", (event) => {
      const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [0, 0];
      const handle = this.handles.get(key);
      if ((!dx && !dy) || !handle) return;
      event.preventDefault();
      const size = ({ low, high }: Range) => ((event.shiftKey ? 10 : 1) / 100) * 10 ** Math.round(Math.log10(this.side > 0 ? high : -low));
      // The next key may come before the next picture: it goes on from here.
      handle.w += dx * size(this.plot.x);
      handle.f += dy * size(this.plot.y);
      move(handle.w, handle.f);
    });
    this.buttons.set(key, button);
    this.plot.host.append(button);
    return button;
  }

  override time({ orbit, state: { system } }: Scene, t: number): void {
    const p = this.plot;
    const g = p.over;
    p.begin(g);
    p.clip(g);
    const i = indexAt(orbit.t, t);
    p.dot(g, valueAt(orbit.t, orbit.w[0]!, t), valueAt(orbit.t, orbit.force[0]!, t), 5.5, colourOf(system["law"].type, orbit.mode[0]![i]!));
    g.restore();
  }
}
