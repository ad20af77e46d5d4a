/** Motions over a plane of two numbers, from coarse to fine: the regime map, and the basins of attraction; a click goes there. */
import { type Range, draggable } from "../plot";
import { REGIMES, type Steady, trend } from "../sweeps";
import { theme } from "../theme";
import { Panel, type Scene } from "./panel";

/** Cells a side at the finest. */
const CELLS = 40;

/** The cells from coarse to fine: column, row and how many cells each stands for. */
export const ORDER: [number, number, number][] = [];
for (let size = 8; size >= 1; size /= 2)
  for (let j = 0; j < CELLS; j += size) for (let i = 0; i < CELLS; i += size) if (size === 8 || i % (2 * size) || j % (2 * size)) ORDER.push([i, j, size]);

export class Grid extends Panel {
  pick?: (x: number, y: number) => void;
  cells: (Steady | undefined)[] = [];
  refused = "";
  /** Where the numbers of a scene lie in this plane; null where they do not. */
  here?: (scene: Scene) => [number, number] | null;
  private found: { mean: number; regime: number; period: number }[] = [];

  constructor(
    host: HTMLElement,
    title: string,
    /** Whether motions of one regime are told apart by where they are: basins. */
    private readonly apart: boolean,
  ) {
    super(host, title);
    const { canvas } = this.plot.over;
    canvas.style.cursor = "crosshair";
    const to = (x: number, y: number) => {
      if (this.plot.inside(x, y)) this.pick?.(this.plot.xAt(x), this.plot.yAt(y));
    };
    draggable(
      this.plot,
      to,
      (dx, dy) => to(this.plot.px(this.at[0]) + 4 * dx, this.plot.py(this.at[1]) - 4 * dy),
    );
  }
  private at: [number, number] = [0, 0];

  /** The values of each cell, in their order: of the finest one, which a coarse one stands for until its neighbours have come. */
  rows(): number[][] {
    const { x, y } = this.plot;
    const middle = ({ low, high }: Range, cell: number) => low + ((high - low) * (cell + 0.5)) / CELLS;
    return ORDER.map(([i, j]) => [middle(x, i), middle(y, j)]);
  }

  clear(): void {
    [this.cells, this.refused, this.found] = [[], "", []];
  }

  /** What the colours of the cells mean: only those that there are. */
  private legend(): [string, string][] {
    const cells = this.cells.filter((cell) => cell !== undefined);
    const { regimes, ink, soft, card } = theme();
    const mixed = (colour: string, share: number, other: string) => `color-mix(in srgb, ${colour} ${share}%, ${other})`;
    const entries = regimes.flatMap((colour, i): [string, string][] => (cells.some(({ regime }) => regime === i) ? [[mixed(colour, 75, card), REGIMES[i]!]] : []));
    const first = regimes[cells[0]?.regime ?? 0]!;
    const ranks = cells.map((cell) => this.rank(cell));
    if (ranks.some(Boolean)) entries.push([mixed(regimes[cells[ranks.findIndex(Boolean)]!.regime]!, 35, card), this.apart ? "paler: others of its kind" : "paler: repeats after several turns"]);
    for (const [changes, colour, words] of [[false, ink, "darker: does not repeat"], [true, soft, "greyer: still settling"]] as const) {
      const wild = cells.find((cell) => !cell.period && Boolean(trend(cell)) === changes);
      if (wild) entries.push([mixed(mixed(regimes[wild.regime] ?? first, 75, card), 65, colour), words]);
    }
    return entries;
  }

  /** How many other motions of its kind were found before it. */
  private rank({ regime, period, mean, x }: Steady): number {
    if (!this.apart) return period > 1 ? 1 : 0;
    const near = 1e-3 * Math.max(x[1] - x[0], Math.abs(mean), 1e-12);
    const alike = this.found.filter((one) => one.regime === regime);
    const rank = alike.findIndex((one) => one.period === period && (!period || Math.abs(one.mean - mean) < near));
    if (rank >= 0) return rank;
    this.found.push({ mean, regime, period });
    return alike.length;
  }

  /** The colour of a regime; paler for each other motion of it, darker where it does not repeat. */
  private paint(cell: Steady): void {
    const g = this.plot.base;
    g.fillStyle = theme().regimes[cell.regime]!;
    g.globalAlpha = Math.max(0.2, 0.75 - 0.25 * this.rank(cell));
  }

  draw(): void {
    const p = this.plot;
    const g = p.base;
    if (this.refused || !this.cells.length) return p.say(this.refused || "computing …");
    this.key(this.legend());
    p.axes();
    p.clip(g);
    const { ink, soft, card } = theme();
    const [width, height] = [(p.px(p.x.high) - p.px(p.x.low)) / CELLS, (p.py(p.y.low) - p.py(p.y.high)) / CELLS];
    this.cells.forEach((cell, k) => {
      if (!cell) return;
      const [i, j, size] = ORDER[k]!;
      // Whole pixels, so that no seams show.
      const [left, right] = [i, i + size].map((at) => Math.round(p.px(p.x.low) + at * width)) as [number, number];
      const [top, bottom] = [j + size, j].map((at) => Math.round(p.py(p.y.low) - at * height)) as [number, number];
      const box = [left, top, right - left, bottom - top] as const;
      g.globalAlpha = 1;
      g.fillStyle = card;
      g.fillRect(...box);
      this.paint(cell);
      g.fillRect(...box);
      if (cell.period) return;
      g.fillStyle = trend(cell) ? soft : ink;
      g.globalAlpha = 0.35;
      g.fillRect(...box);
    });
    g.globalAlpha = 1;
    g.restore();
  }

  override time(scene: Scene): void {
    const p = this.plot;
    p.begin(p.over);
    const at = this.refused || !this.cells.length ? null : this.here?.(scene);
    if (!at) return;
    this.at = at;
    p.clip(p.over);
    p.dot(p.over, at[0], at[1], 5.5, theme().card, theme().accent);
    p.over.restore();
  }
}
