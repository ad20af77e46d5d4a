/** The phase plane: the transient faint, the steady part by branch, sticks grey; a click starts there. */
import { valueAt, indexAt } from "../orbit";
import { type Plot, draggable, rangeOf, widen } from "../plot";
import { SERIF, colourOf, theme } from "../theme";
import { Panel, type Scene } from "./panel";

export class Phase extends Panel {
  pick?: (x: number, v: number) => void;

  constructor(host: HTMLElement) {
    super(host, "Phase plane: velocity over displacement; the arrow keys move the start", { x: "displacement x", y: "velocity ẋ" });
    const { canvas } = this.plot.over;
    canvas.style.cursor = "crosshair";
    const to = (x: number, y: number) => {
      if (this.plot.inside(x, y)) this.pick?.(this.plot.xAt(x), this.plot.yAt(y));
    };
    draggable(this.plot, to, (dx, dy) => to(this.plot.px(this.start[0]) + 4 * dx, this.plot.py(this.start[1]) - 4 * dy));
  }
  /** Where the motion on the page started: the arrow keys move it. */
  private start: [number, number] = [0, 0];

  draw({ orbit, steady, settled, records, state: { system, units } }: Scene): void {
    const p = this.plot;
    p.units = [units.length, units.velocity];
    const g = p.base;
    const { faint, soft, ink } = theme();
    const [x, v, mode] = [orbit.x[0]!, orbit.v[0]!, orbit.mode[0]!];
    const measured = records.flatMap(({ x, w, drive }) => (x ? [{ x, v: w.map((one) => (drive ?? system["drive_velocity"]) - one) }] : []));
    if (!p.held) {
      p.x = widen(rangeOf([...rangeEnds(x), ...measured.flatMap((one) => rangeEnds(one.x))]));
      // A mass that slips steadily is a point, not a picture of rounding.
      const least = 0.1 * Math.abs(system["drive_velocity"]);
      p.y = widen(rangeOf([-least, least, ...rangeEnds(v), ...measured.flatMap((one) => rangeEnds(one.v))]));
    }
    p.axes();
    p.clip(g);
    for (const one of measured) p.cloud(one.x, one.v);
    g.lineWidth = 1;
    g.strokeStyle = faint;
    p.line(g, x, v, 0, steady + 1);
    g.setLineDash([4, 4]);
    g.strokeStyle = soft;
    p.segment(g, p.px(p.x.low), p.py(system["drive_velocity"]), p.px(p.x.high), p.py(system["drive_velocity"]));
    g.setLineDash([]);
    const busy = orbit.words.events > 150;
    g.lineWidth = busy ? 1 : 2.4;
    g.globalAlpha = busy ? 0.55 : 1;
    p.runs(x, v, mode, steady, (one) => colourOf(system["law"].type, one));
    g.globalAlpha = 1;
    g.fillStyle = ink;
    for (const [sx, sv] of system["forcing"].length ? (settled?.section ?? []) : []) {
      g.beginPath();
      g.arc(p.px(sx), p.py(sv), settled!.section.length > 20 ? 1.4 : 3.4, 0, 7);
      g.fill();
    }
    g.restore();
    g.fillStyle = soft;
    g.font = `italic 12px ${SERIF}`;
    g.textAlign = "right";
    g.textBaseline = "bottom";
    g.fillText("ẋ = s", p.width - p.pad.right - 3, p.py(system["drive_velocity"]) - 3);
  }

  override time({ orbit, state: { system, start } }: Scene, t: number): void {
    const p = this.plot;
    this.start = [start.x0?.[0] ?? 0, start.v0?.[0] ?? system["drive_velocity"]];
    const g = p.over;
    const i = indexAt(orbit.t, t);
    p.begin(g);
    p.clip(g);
    tail(p, orbit.t, i, t, orbit.x[0]!, orbit.v[0]!);
    p.dot(g, valueAt(orbit.t, orbit.x[0]!, t), valueAt(orbit.t, orbit.v[0]!, t), 5.5, colourOf(system["law"].type, orbit.mode[0]![i]!));
    g.restore();
  }
}

function rangeEnds(values: ArrayLike<number>): number[] {
  const { low, high } = rangeOf(values);
  return values.length ? [low, high] : [];
}

/** The last moments, fading. */
function tail(p: Plot, times: Float64Array, i: number, t: number, xs: Float64Array, ys: Float64Array): void {
  const g = p.over;
  g.lineWidth = 5;
  g.strokeStyle = theme().ink;
  for (let k = i; k > 0 && t - times[k]! < 1.5; k--) {
    g.globalAlpha = 0.16 * (1 - (t - times[k]!) / 1.5);
    p.segment(g, p.px(xs[k]!), p.py(ys[k]!), p.px(xs[k - 1]!), p.py(ys[k - 1]!));
  }
  g.globalAlpha = 1;
}
