/** The orbit diagram: the sweep up strong, the sweep down pale, coloured by regime; one drags the number itself. */
import { axisName, axisUnit } from "../axes";
import { draggable, plain, rangeOf, widen } from "../plot";
import { get } from "../state";
import { REGIMES, type Steady } from "../sweeps";
import { theme } from "../theme";
import { Panel, type Scene } from "./panel";

/** The heights of a motion in the diagram. */
const heightsOf = (row: Steady, forced: boolean, drive: number): ArrayLike<number> => (forced ? row.section.map(([, v]) => drive - v) : row.turns);

/** Share of the picture by which the ends of a motion differ from those of another one. */
const APART = 0.04;

export class Diagram extends Panel {
  change?: (value: number) => void;
  values: number[] = [];
  up: (Steady | undefined)[] = [];
  down: (Steady | undefined)[] = [];
  /** Columns of which no answer came. */
  lost: number[] = [];
  refused = "";

  constructor(host: HTMLElement) {
    super(host, "Orbit diagram, swept up and down; the arrow keys change the number");
    const { canvas } = this.plot.over;
    canvas.style.cursor = "ew-resize";
    draggable(
      this.plot,
      (x) => this.change?.(this.plot.xAt(x)),
      (dx) => this.change?.(this.at + (dx * (this.plot.x.high - this.plot.x.low)) / 200),
    );
  }
  private at = 0;

  draw({ state: { diagram, system, units } }: Scene): void {
    const p = this.plot;
    const g = p.base;
    const forced = system["forcing"].length > 0;
    if (this.refused) return p.say(this.refused);
    p.x = { low: diagram.low, high: diagram.high };
    const drive = (i: number): number => (diagram.over === "drive_velocity" ? this.values[i]! : system["drive_velocity"]);
    const heights = (row: Steady, i: number) => heightsOf(row, forced, drive(i));
    let [low, high] = [0, 0];
    for (const rows of [this.up, this.down])
      rows.forEach((row, i) => {
        for (const y of row ? Array.from(heights(row, i)) : []) {
          low = Math.min(low, y);
          high = Math.max(high, y);
        }
      });
    p.y = widen({ low, high });
    const { regimes, soft } = theme();
    p.labels.x = axisName(diagram.over);
    p.labels.y = forced ? "w at t = 2πn/Ω" : "w where ẇ = 0";
    p.units = [axisUnit(diagram.over, units), units.velocity];
    const rows = [...this.up, ...this.down];
    this.key(regimes.flatMap((colour, i) => (rows.some((row) => row?.regime === i) ? [[colour, REGIMES[i]!]] : [])));
    p.axes();
    const step = (p.px(diagram.high) - p.px(diagram.low)) / Math.max(1, this.values.length - 1);
    for (const [rows, alpha, size] of [[this.down, 0.35, 2.4], [this.up, 0.95, 1.5]] as const)
      rows.forEach((row, i) => {
        if (!row) return;
        const x = p.px(this.values[i]!);
        g.fillStyle = regimes[row.regime]!;
        g.globalAlpha = alpha;
        const seen = new Set<number>();
        const ys = heights(row, i);
        const wide = Math.max(size, step);
        for (let k = 0; k < ys.length; k++) {
          const y = Math.round(p.py(ys[k]!) * 2);
          if (seen.has(y)) continue;
          seen.add(y);
          // On a wide screen the columns touch, so that a line is one.
          g.fillRect(x - wide / 2, y / 2 - size / 2, wide, size);
        }
        if (rows === this.up) g.fillRect(x - step / 2, p.height - p.pad.bottom + 1, step + 0.5, 3);
      });
    g.globalAlpha = 1;
    g.fillStyle = soft;
    g.font = "11px system-ui, sans-serif";
    g.textAlign = "left";
    g.textBaseline = "top";
    const words = this.lost.length ? [`no answer in 3 s at ${this.lost.map((i) => plain(this.values[i]!)).join(", ")}`] : [];
    // Below where the name of the axis leaves room.
    const sweeps = "strong: up, pale: down";
    if (p.named < p.width - g.measureText(sweeps).width - 24) g.fillText(sweeps, 8, p.height - 15);
    else words.push(sweeps);
    g.strokeStyle = theme().card;
    g.lineWidth = 4;
    words.forEach((line, i) => {
      const at = [p.pad.left + 6, p.pad.top + 18 + 14 * i] as const;
      g.strokeText(line, ...at);
      g.fillText(line, ...at);
    });
  }

  /** Whether the motion on the page is another one than the sweeps found at its number. */
  private isAnother(heights: ArrayLike<number>, forced: boolean, drive: number): boolean {
    const { x, y } = this.plot;
    const column = Math.round(((this.at - x.low) / (x.high - x.low)) * (this.values.length - 1));
    const swept = [this.up[column], this.down[column]];
    const here = rangeOf(heights);
    return swept.every((row) => {
      if (!row || !heights.length) return false;
      const there = rangeOf(heightsOf(row, forced, drive));
      return Math.max(Math.abs(there.low - here.low), Math.abs(there.high - here.high)) > APART * (y.high - y.low);
    });
  }
  another = false;

  override time({ settled, state: { diagram, system } }: Scene): void {
    const p = this.plot;
    const g = p.over;
    p.begin(g);
    if (this.refused) return;
    this.at = get(system, diagram.over);
    const x = p.px(this.at);
    if (x < p.pad.left - 1 || x > p.width - p.pad.right + 1) return;
    g.strokeStyle = theme().accent;
    g.lineWidth = 1.6;
    p.segment(g, x, p.pad.top, x, p.height - p.pad.bottom);
    p.dot(g, this.at, p.y.low, 6, theme().card, theme().accent);
    const forced = system["forcing"].length > 0;
    const heights = settled ? heightsOf(settled, forced, system["drive_velocity"]) : [];
    const seen = new Set<number>();
    for (const height of Array.from(heights)) {
      const y = Math.round(p.py(height) / 3);
      if (!seen.has(y)) p.dot(g, this.at, height, 3, theme().card, theme().accent);
      seen.add(y);
    }
    this.another = this.isAnother(heights, forced, system["drive_velocity"]);
    if (!this.another) return;
    const words = "rings: this motion; the sweeps found another";
    g.font = "600 11px system-ui, sans-serif";
    g.fillStyle = theme().card;
    const width = g.measureText(words).width + 8;
    g.fillRect(p.width - p.pad.right - width, p.pad.top, width, 16);
    g.fillStyle = theme().accent;
    g.textAlign = "right";
    g.textBaseline = "top";
    g.fillText(words, p.width - p.pad.right - 4, p.pad.top + 2);
  }
}
