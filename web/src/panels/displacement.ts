/** x(t) of every mass, sticks shaded; one drags the moment. */
import { indexAt, valueAt } from "../orbit";
import { draggable, rangeOf, widen } from "../plot";
import { colourOf, theme } from "../theme";
import { Panel, type Scene } from "./panel";

export class Displacement extends Panel {
  seek?: (t: number) => void;
  step?: (by: number) => void;

  constructor(host: HTMLElement) {
    super(host, "Displacement over time; the arrow keys move the moment", { x: "time t", y: "displacement x" });
    draggable(
      this.plot,
      (x) => this.seek?.(this.plot.xAt(x)),
      (dx) => this.step?.(dx),
    );
  }

  draw({ orbit, records, state: { system, units } }: Scene): void {
    const p = this.plot;
    p.units = [units.time, units.length];
    const g = p.base;
    const { accent, dark, faint, line, stick } = theme();
    const ranges = orbit.x.map((x) => rangeOf(x));
    const measured = records.flatMap(({ t, x }) => {
      const end = t.findIndex((time) => time > orbit.words.t_last);
      return x ? [[t, x].map((all) => (end < 0 ? all : all.slice(0, end))) as [number[], number[]]] : [];
    });
    for (const [, x] of measured) ranges.push(rangeOf(x));
    p.x = { low: 0, high: orbit.words.t_last };
    p.y = widen({ low: Math.min(...ranges.map(({ low }) => low)), high: Math.max(...ranges.map(({ high }) => high)) });
    p.axes();
    p.clip(g);
    const mode = orbit.mode[0]!;
    g.fillStyle = dark ? "#ffffff14" : "#0000000d";
    for (let i = 0; i < mode.length - 1; ) {
      let end = i;
      while (end < mode.length - 1 && mode[end]! < 0) end++;
      if (end > i) g.fillRect(p.px(orbit.t[i]!), p.pad.top, p.px(orbit.t[end]!) - p.px(orbit.t[i]!), p.height - p.pad.top - p.pad.bottom);
      i = Math.max(end, i + 1);
    }
    g.lineWidth = 1.2;
    g.strokeStyle = faint;
    for (const x of orbit.x.slice(1)) p.line(g, orbit.t, x);
    // Where a spring bends: a stop, or the end of a play.
    g.setLineDash([4, 4]);
    for (const { nodes } of system["springs"]) for (const [x] of nodes.slice(1, -1)) p.segment(g, p.pad.left, p.py(x), p.width, p.py(x));
    g.setLineDash([]);
    g.strokeStyle = accent;
    for (const [t, x] of measured) p.line(g, t, x);
    g.lineWidth = 1.7;
    p.runs(orbit.t, orbit.x[0]!, mode, 0, (one) => (one < 0 ? stick : line));
    g.restore();
  }

  override time({ orbit, state: { system } }: Scene, t: number): void {
    const p = this.plot;
    const g = p.over;
    p.begin(g);
    g.lineWidth = 1;
    g.strokeStyle = theme().ink;
    p.segment(g, p.px(t), p.pad.top, p.px(t), p.height - p.pad.bottom);
    p.dot(g, t, valueAt(orbit.t, orbit.x[0]!, t), 4.5, colourOf(system["law"].type, orbit.mode[0]![indexAt(orbit.t, t)]!));
  }
}
