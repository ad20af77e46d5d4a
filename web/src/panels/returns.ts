/** The return map: each maximum of x, or of a forced motion each stroboscopic x, over the one before; the first ones pale. */
import { rangeOf, widen } from "../plot";
import type { Steady } from "../sweeps";
import { theme } from "../theme";
import { Panel, type Scene } from "./panel";

/** Returns that are shown pale. */
const FIRST = 40;

export class Returns extends Panel {
  row: Steady | null = null;
  refused = "";

  constructor(host: HTMLElement) {
    super(host, "Return map: the next displacement in the section over this one");
  }

  draw({ state: { system, units } }: Scene): void {
    const p = this.plot;
    const g = p.base;
    const values = this.row?.section.map(([x]) => x) ?? [];
    if (this.refused || values.length < 2) return p.say(this.refused || (this.row ? "nothing returns: the motion rests" : "computing …"));
    const forced = system["forcing"].length > 0;
    p.x = p.y = widen(rangeOf(values));
    p.labels = forced ? { x: "x at t = 2πn/Ω", y: "x one period later" } : { x: "maximum of x", y: "next maximum" };
    p.units = [units.length, units.length];
    p.axes();
    p.clip(g);
    const { soft, accent, faint } = theme();
    g.strokeStyle = soft;
    g.setLineDash([4, 4]);
    p.segment(g, p.px(p.x.low), p.py(p.x.low), p.px(p.x.high), p.py(p.x.high));
    g.setLineDash([]);
    for (let n = 0; n + 1 < values.length; n++) {
      g.beginPath();
      g.arc(p.px(values[n]!), p.py(values[n + 1]!), 2, 0, 7);
      g.fillStyle = n < FIRST ? faint : accent;
      g.fill();
    }
    g.restore();
  }
}
