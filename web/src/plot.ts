/** A plot on two canvases: what changes with the system below, what changes with time above. */
import { named } from "./state";
import { SERIF, theme } from "./theme";

export interface Range {
  low: number;
  high: number;
}

export function ticks({ low, high }: Range, about: number): number[] {
  const raw = (high - low) / about;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= raw * 0.999)!;
  const values: number[] = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) values.push(k * step);
  return values;
}

export function plain(value: number): string {
  if (Math.abs(value) < 1e-12) return "0";
  const far = Math.abs(value) >= 1e4 || Math.abs(value) < 1e-3;
  const short = +value.toPrecision(6);
  return (far ? short.toExponential() : String(short)).replaceAll("-", "−").replace("e+", "e");
}

/** A number as one sets it by hand: to a part in ten thousand of what is seen. */
export function neat(value: number, span: number): number {
  return +value.toFixed(Math.max(0, Math.min(20, 3 - Math.floor(Math.log10(span)))));
}

export function rangeOf(values: ArrayLike<number>, from = 0, to = values.length): Range {
  let low = Infinity;
  let high = -Infinity;
  for (let i = from; i < to; i++) {
    const value = values[i]!;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? { low, high } : { low: 0, high: 1 };
}

export function widen({ low, high }: Range, share = 0.06): Range {
  // What hardly moves is not blown up to fill the picture.
  const extra = Math.max((high - low) * share, 1e-3 * Math.max(Math.abs(low), Math.abs(high)), 1e-12);
  return { low: low - extra, high: high + extra };
}

export class Plot {
  readonly base: CanvasRenderingContext2D;
  readonly over: CanvasRenderingContext2D;
  width = 0;
  height = 0;
  ratio = 1;
  /** Pixels of the canvas for one of the page, where it is to be another than the screen's. */
  sharpness: number | null = null;
  /** Whether a pointer is down on it: what it points at stays where it is. */
  held = false;
  /** Pixels of the page for one of the drawing: words and lines are larger on a large screen. */
  zoom = 1;
  x: Range = { low: 0, high: 1 };
  y: Range = { low: 0, high: 1 };
  /** Behind the names of the axes. */
  units: [x: string, y: string] = ["", ""];
  /** How far from the right end the name of the x axis reaches. */
  named = 0;
  pad = { left: 60, right: 12, top: 10, bottom: 36 };

  constructor(
    readonly host: HTMLElement,
    public labels: { x: string; y: string },
    title: string,
  ) {
    host.classList.add("plot");
    const canvas = (name: string) => {
      const element = document.createElement("canvas");
      element.className = name;
      host.append(element);
      return element;
    };
    this.base = canvas("base").getContext("2d")!;
    this.over = canvas("over").getContext("2d")!;
    this.over.canvas.setAttribute("role", "img");
    this.over.canvas.setAttribute("aria-label", title);
    this.base.canvas.setAttribute("aria-hidden", "true");
  }

  /** Take the size of the host; whether it changed. */
  fit(): boolean {
    this.zoom = Number(getComputedStyle(this.host).getPropertyValue("--scale")) || 1;
    const [width, height] = [this.host.clientWidth / this.zoom, this.host.clientHeight / this.zoom];
    const ratio = this.zoom * (this.sharpness ?? Math.min(window.devicePixelRatio || 1, 3));
    if (width === this.width && height === this.height && ratio === this.ratio) return false;
    [this.width, this.height, this.ratio] = [width, height, ratio];
    for (const { canvas } of [this.base, this.over]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    return true;
  }

  private share(value: number, { low, high }: Range): number {
    return (value - low) / (high - low);
  }
  px(x: number): number {
    return this.pad.left + this.share(x, this.x) * (this.width - this.pad.left - this.pad.right);
  }
  py(y: number): number {
    return this.height - this.pad.bottom - this.share(y, this.y) * (this.height - this.pad.top - this.pad.bottom);
  }
  xAt(px: number): number {
    return this.x.low + ((px - this.pad.left) / (this.width - this.pad.left - this.pad.right)) * (this.x.high - this.x.low);
  }
  yAt(py: number): number {
    return this.y.low + ((this.height - this.pad.bottom - py) / (this.height - this.pad.top - this.pad.bottom)) * (this.y.high - this.y.low);
  }
  inside(px: number, py: number): boolean {
    return px >= this.pad.left && px <= this.width - this.pad.right && py >= this.pad.top && py <= this.height - this.pad.bottom;
  }

  begin(layer: CanvasRenderingContext2D): void {
    layer.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    layer.clearRect(0, 0, this.width, this.height);
    layer.lineJoin = layer.lineCap = "round";
    layer.globalAlpha = 1;
    layer.setLineDash([]);
  }

  axes(about = { x: Math.max(3, Math.min(6, this.width / 90)), y: Math.max(3, Math.min(6, this.height / 55)) }): void {
    const g = this.base;
    const { ink, soft, grid } = theme();
    this.begin(g);
    const bottom = this.height - this.pad.bottom;
    const right = this.width - this.pad.right;
    g.font = "11px system-ui, sans-serif";
    g.lineWidth = 1;
    g.fillStyle = soft;
    g.strokeStyle = grid;
    g.textAlign = "center";
    g.textBaseline = "top";
    let free = 0;
    for (const tick of ticks(this.x, about.x)) {
      const at = Math.round(this.px(tick)) + 0.5;
      this.segment(g, at, this.pad.top, at, bottom);
      const label = plain(tick);
      const half = g.measureText(label).width / 2;
      // Whole, and not over the one before.
      const middle = Math.min(at, this.width - half - 1);
      if (middle - half < free) continue;
      g.fillText(label, middle, bottom + 5);
      free = middle + half + 4;
    }
    g.textAlign = "right";
    g.textBaseline = "middle";
    for (const tick of ticks(this.y, about.y)) {
      const at = Math.round(this.py(tick)) + 0.5;
      this.segment(g, this.pad.left, at, right, at);
      g.fillText(plain(tick), this.pad.left - 6, at, this.pad.left - 20);
    }
    g.strokeStyle = soft;
    g.beginPath();
    g.moveTo(this.pad.left + 0.5, this.pad.top);
    g.lineTo(this.pad.left + 0.5, bottom + 0.5);
    g.lineTo(right, bottom + 0.5);
    g.stroke();
    g.font = `italic 13px ${SERIF}`;
    g.fillStyle = ink;
    g.textAlign = "right";
    g.textBaseline = "bottom";
    // Without its unit where there is no room for it.
    const name = (label: string, unit: string, room: number) => (g.measureText(label + named(unit)).width < room ? label + named(unit) : label);
    const x = name(this.labels.x, this.units[0], right);
    g.fillText(x, right, this.height - 1, right);
    this.named = g.measureText(x).width + this.pad.right;
    g.save();
    g.translate(8, (this.pad.top + bottom) / 2);
    g.rotate(-Math.PI / 2);
    g.textAlign = "center";
    g.textBaseline = "middle";
    const room = this.pad.top + bottom - 4;
    g.fillText(name(this.labels.y, this.units[1], room), 0, 0, room);
    g.restore();
  }

  clip(layer: CanvasRenderingContext2D): void {
    layer.save();
    layer.beginPath();
    layer.rect(this.pad.left, this.pad.top - 1, this.width - this.pad.left - this.pad.right, this.height - this.pad.top - this.pad.bottom + 1);
    layer.clip();
  }

  /** A straight line between two pixels. */
  segment(layer: CanvasRenderingContext2D, x0: number, y0: number, x1: number, y1: number): void {
    layer.beginPath();
    layer.moveTo(x0, y0);
    layer.lineTo(x1, y1);
    layer.stroke();
  }

  line(layer: CanvasRenderingContext2D, xs: ArrayLike<number>, ys: ArrayLike<number>, from = 0, to = xs.length): void {
    layer.beginPath();
    for (let i = from; i < to; i++) layer.lineTo(this.px(xs[i]!), this.py(ys[i]!));
    layer.stroke();
  }

  /** Measured points, small and soft. */
  cloud(xs: ArrayLike<number>, ys: ArrayLike<number>): void {
    const g = this.base;
    g.fillStyle = theme().accent;
    g.globalAlpha = 0.4;
    for (let i = 0; i < xs.length; i++) g.fillRect(this.px(xs[i]!) - 1, this.py(ys[i]!) - 1, 2, 2);
    g.globalAlpha = 1;
  }

  /** Bars of one standard error up and down. */
  errors(xs: ArrayLike<number>, ys: ArrayLike<number>, errors: ArrayLike<number>): void {
    const g = this.base;
    g.strokeStyle = theme().accent;
    g.globalAlpha = 0.18;
    g.lineWidth = 1;
    g.beginPath();
    for (let i = 0; i < errors.length; i++) {
      const x = this.px(xs[i]!);
      g.moveTo(x, this.py(ys[i]! - errors[i]!));
      g.lineTo(x, this.py(ys[i]! + errors[i]!));
    }
    g.stroke();
    g.globalAlpha = 1;
  }

  /** One stroke for each run of a mode. */
  runs(xs: ArrayLike<number>, ys: ArrayLike<number>, modes: ArrayLike<number>, from: number, style: (mode: number) => string): void {
    for (let i = from; i < xs.length - 1; ) {
      let end = i + 1;
      while (end < xs.length && modes[end] === modes[i]) end++;
      this.base.strokeStyle = style(modes[i]!);
      this.line(this.base, xs, ys, i, Math.min(end + 1, xs.length));
      i = end;
    }
  }

  dot(layer: CanvasRenderingContext2D, x: number, y: number, radius: number, fill: string, edge = theme().card): void {
    layer.beginPath();
    layer.arc(this.px(x), this.py(y), radius, 0, 7);
    layer.fillStyle = fill;
    layer.fill();
    layer.lineWidth = 1.5;
    layer.strokeStyle = edge;
    layer.stroke();
  }

  /** Words in the middle, where there is nothing to draw. */
  say(words: string): void {
    const g = this.base;
    this.begin(g);
    g.fillStyle = theme().soft;
    g.font = "13px system-ui, sans-serif";
    g.textAlign = "center";
    g.textBaseline = "middle";
    const lines: string[] = [];
    for (const word of words.split(" ")) {
      const last = lines.at(-1);
      if (last !== undefined && g.measureText(`${last} ${word}`).width < this.width - 40) lines[lines.length - 1] = `${last} ${word}`;
      else lines.push(word);
    }
    lines.forEach((line, i) => g.fillText(line, this.width / 2, this.height / 2 + (i - (lines.length - 1) / 2) * 18));
  }
}

/** Follow a pointer from press to release, in pixels of the drawing; the arrow keys call `nudge` with a direction. */
export function draggable(plot: Plot, move: (x: number, y: number) => void, nudge?: (dx: number, dy: number) => void): void {
  const { canvas } = plot.over;
  const follow = ({ offsetX, offsetY }: PointerEvent) => move(offsetX / plot.zoom, offsetY / plot.zoom);
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    plot.held = true;
    follow(event);
  });
  for (const end of ["pointerup", "pointercancel"] as const)
    canvas.addEventListener(end, (event) => {
      plot.held = false;
      if (end === "pointerup") follow(event);
    });
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) follow(event);
  });
  if (!nudge) return;
  canvas.tabIndex = 0;
  canvas.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? 10 : 1;
    const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [0, 0];
    if (!dx && !dy) return;
    event.preventDefault();
    nudge(dx * step, dy * step);
  });
}
