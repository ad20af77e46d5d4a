/** Static friction f_s(t_s, δ) as a surface, with the break-aways of this motion on it; one turns it. */
import { Verb } from "../core";
import { RELEASE } from "../orbit";
import { draggable, plain } from "../plot";
import { behind, over } from "../state";
import { SERIF, theme } from "../theme";
import { Panel, type Scene } from "./panel";

const CELLS = 22;
/** Viridis at five points. */
const VIRIDIS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

function viridis(share: number): string {
  const at = Math.min(0.9999, Math.max(0, share)) * 4;
  const [from, to] = [VIRIDIS[Math.floor(at)]!, VIRIDIS[Math.floor(at) + 1]!];
  return `rgb(${from.map((one, i) => Math.round(one + (at % 1) * (to[i]! - one))).join(" ")})`;
}

export class Surface extends Panel {
  redraw?: () => void;
  private turn = -0.75;
  private tilt = 0.62;
  private before: [number, number] | null = null;

  constructor(host: HTMLElement) {
    super(host, "Static friction over stick time and force rate; drag or use the arrow keys to turn it");
    const { canvas } = this.plot.over;
    canvas.style.cursor = "move";
    const turn = (dx: number, dy: number) => {
      this.turn += dx;
      this.tilt = Math.max(0.1, Math.min(1.4, this.tilt + dy));
      this.redraw?.();
    };
    draggable(
      this.plot,
      (x, y) => {
        if (this.before) turn((x - this.before[0]) / 120, (y - this.before[1]) / 120);
        this.before = [x, y];
      },
      (dx, dy) => turn(dx / 12, -dy / 12),
    );
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (this.before = null));
  }

  draw({ core, orbit, records, state: { system, units } }: Scene): void {
    const p = this.plot;
    const g = p.base;
    const { ink, soft, accent, card } = theme();
    const releases = orbit.events.filter(({ kind, contact }) => kind === RELEASE && contact === 0);
    const breaks = [
      ...records.flatMap(({ breaks: measured }) => measured).map(([time, rate, force]) => ({ stickTime: time, forceRate: rate, force, measured: true })),
      ...releases.slice(-40).map(({ stickTime, forceRate, force }) => ({ stickTime, forceRate, force, measured: false })),
    ];
    const drive = Math.abs(system["stiffness"] * system["drive_velocity"]);
    const rate = Math.max(records.length ? 0 : 0.7, ...breaks.map(({ forceRate }) => 1.15 * Math.abs(forceRate)), 1.5 * drive);
    const usual = 4 * Math.sqrt(system["mass"] / system["stiffness"]);
    const time = Math.max(records.length ? 0 : usual, ...breaks.map(({ stickTime }) => 1.15 * stickTime)) || usual;
    const axis = (end: number) => Array.from({ length: CELLS + 1 }, (_, i) => (i * end) / CELLS);
    const heights = core.ask(Verb.surface, { law: system["law"], stick_times: axis(time), force_rates: axis(rate) }).numbers;
    const seen = [...heights, ...breaks.filter(({ measured }) => measured).map(({ force }) => force)];
    const [low, high] = [Math.min(...seen), Math.max(...seen)];
    p.begin(g);
    const size = Math.min(p.width * 0.6, p.height * 0.72);
    const rise = high > low ? 0.5 / (high - low) : 0;
    const [c, s] = [Math.cos(this.turn), Math.sin(this.turn)];
    const place = (a: number, b: number, f: number): [number, number, number] => {
      const [x, y] = [a - 0.5, b - 0.5];
      const [across, away] = [c * x - s * y, s * x + c * y];
      return [p.width / 2 + across * size, p.height * 0.62 + away * size * Math.sin(this.tilt) - (f - low) * rise * size * Math.cos(this.tilt), away];
    };
    const at = (i: number, j: number) => place(i / CELLS, j / CELLS, heights[j * (CELLS + 1) + i]!);
    const cells: { depth: number; corners: [number, number, number][]; height: number }[] = [];
    for (let j = 0; j < CELLS; j++)
      for (let i = 0; i < CELLS; i++) {
        const corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        cells.push({ depth: corners[0]![2] + corners[2]![2], corners, height: heights[j * (CELLS + 1) + i]! });
      }
    cells.sort((one, other) => one.depth - other.depth);
    g.lineWidth = 0.5;
    for (const { corners, height } of cells) {
      g.beginPath();
      for (const [x, y] of corners) g.lineTo(x, y);
      g.closePath();
      g.fillStyle = viridis(high > low ? (height - low) / (high - low) : 0.6);
      g.strokeStyle = "#ffffff66";
      g.fill();
      g.stroke();
    }
    for (const { stickTime, forceRate, force, measured } of breaks) {
      const [x, y] = place(stickTime / time, Math.abs(forceRate) / rate, Math.abs(force));
      g.beginPath();
      g.arc(x, y, measured ? 2 : 4, 0, 7);
      g.fillStyle = measured ? ink : accent;
      g.fill();
      g.lineWidth = measured ? 0 : 1.5;
      g.strokeStyle = card;
      g.stroke();
    }
    g.fillStyle = ink;
    g.font = `italic 13px ${SERIF}`;
    g.textBaseline = "middle";
    const floor = low - (rise ? 0.1 / rise : 0);
    for (const [name, a, b] of [[`stick time tₛ to ${plain(+time.toPrecision(2))}${behind(units.time)}`, 0.5, 1.12], [`force rate δ to ${plain(+rate.toPrecision(2))}${behind(over(units.force, units.time))}`, 1.1, 0.5]] as const) {
      const [x, y] = place(a, b, floor);
      // Words grow away from the surface.
      g.textAlign = x > p.width / 2 ? "left" : "right";
      const width = g.measureText(name).width + 6;
      const at = [g.textAlign === "left" ? Math.min(x, p.width - width) : Math.max(x, width), Math.max(34, Math.min(p.height - 9, y))] as const;
      // Where they lie on the surface a border keeps them readable.
      g.lineWidth = 4;
      g.strokeStyle = card;
      g.strokeText(name, ...at);
      g.fillText(name, ...at);
    }
    g.fillStyle = soft;
    g.textAlign = "left";
    const range = high > low ? `${plain(+low.toPrecision(3))} ≤ fₛ ≤ ${plain(+high.toPrecision(3))}` : `fₛ = ${plain(+low.toPrecision(4))}`;
    g.fillText(range + behind(units.force), 12, 14);
  }
}
