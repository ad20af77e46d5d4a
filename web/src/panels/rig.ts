/** The rig: belt, masses, springs, damper, the friction arrow in the colour of its branch, the forcing arrow. */
import { indexAt, valueAt } from "../orbit";
import { type Plot, rangeOf } from "../plot";
import { type Document, behind } from "../state";
import { SERIF, colourOf, theme } from "../theme";
import { Panel, type Scene } from "./panel";

type Layer = CanvasRenderingContext2D;

function spring(g: Layer, from: number, to: number, y: number, coils: number, height: number): void {
  const lead = Math.min(16, (to - from) * 0.12);
  g.beginPath();
  g.moveTo(from, y);
  g.lineTo(from + lead, y);
  for (let i = 0; i < coils; i++) g.lineTo(from + lead + ((to - from - 2 * lead) * (i + 0.5)) / coils, y + (i % 2 ? height : -height));
  g.lineTo(to - lead, y);
  g.lineTo(to, y);
  g.stroke();
}

function damper(g: Layer, from: number, to: number, y: number, stretch: number): void {
  const start = from + 26;
  const length = 46;
  const head = Math.max(start + 8, Math.min(start + length - 4, start + length / 2 + stretch * 0.25));
  g.beginPath();
  g.moveTo(from, y);
  g.lineTo(start, y);
  g.moveTo(start + length, y - 8);
  g.lineTo(start, y - 8);
  g.lineTo(start, y + 8);
  g.lineTo(start + length, y + 8);
  g.moveTo(head, y - 6);
  g.lineTo(head, y + 6);
  g.moveTo(head, y);
  g.lineTo(to, y);
  g.stroke();
}

function arrow(g: Layer, x: number, y: number, length: number, colour: string, name: string): void {
  if (Math.abs(length) < 3) return;
  const sign = Math.sign(length);
  g.strokeStyle = g.fillStyle = colour;
  g.lineWidth = 3;
  g.beginPath();
  g.moveTo(x, y);
  g.lineTo(x + length - sign * 7, y);
  g.stroke();
  g.beginPath();
  g.moveTo(x + length, y);
  g.lineTo(x + length - sign * 10, y - 5.5);
  g.lineTo(x + length - sign * 10, y + 5.5);
  g.fill();
  g.font = `italic 14px ${SERIF}`;
  g.textAlign = sign > 0 ? "left" : "right";
  g.textBaseline = "middle";
  g.fillText(name, x + length + sign * 5, y);
}

/** The normal force of a contact over that of its law, as the core has it: 0 where the bodies part. */
export function normalForce({ constant, harmonics, position, velocity }: Document, t: number, x: number, v: number): number {
  const waves = harmonics.reduce((sum: number, { amplitude, frequency, phase = 0 }: Document) => sum + amplitude * Math.cos(frequency * t + phase), 0);
  return Math.max(0, constant + waves + position * x + velocity * v);
}

function belt(g: Layer, left: number, right: number, ground: number, way: number): void {
  const { dark, ink, soft, card } = theme();
  const r = 12;
  g.fillStyle = dark ? "#2c2b28" : "#e9e4d8";
  g.strokeStyle = ink;
  g.lineWidth = 2;
  g.beginPath();
  g.moveTo(left, ground);
  g.lineTo(right, ground);
  g.arc(right, ground + r, r, -Math.PI / 2, Math.PI / 2);
  g.lineTo(left, ground + 2 * r);
  g.arc(left, ground + r, r, Math.PI / 2, -Math.PI / 2);
  g.closePath();
  g.fill();
  g.stroke();
  g.save();
  g.beginPath();
  g.rect(left, ground, right - left, 2 * r);
  g.clip();
  g.lineWidth = 1.6;
  g.strokeStyle = soft;
  const gap = 36;
  const shift = ((way % gap) + gap) % gap;
  const mark = (x: number, y: number, dy: number) => {
    g.beginPath();
    g.moveTo(x, y);
    g.lineTo(x - 6, y + dy);
    g.stroke();
  };
  for (let x = left - gap + shift; x < right + gap; x += gap) mark(x, ground + 1, 7);
  for (let x = right + gap - shift; x > left - gap; x -= gap) mark(x, ground + 2 * r - 1, -7);
  g.restore();
  for (const cx of [left, right]) {
    g.beginPath();
    g.arc(cx, ground + r, r - 4, 0, 7);
    g.fillStyle = card;
    g.fill();
    g.lineWidth = 1.5;
    g.strokeStyle = ink;
    g.stroke();
    g.beginPath();
    g.moveTo(cx, ground + r);
    g.lineTo(cx + (r - 4) * Math.cos(way / r), ground + r + (r - 4) * Math.sin(way / r));
    g.stroke();
  }
}

export class Rig extends Panel {
  constructor(host: HTMLElement) {
    super(host, "The rig: masses on a moving belt, held by springs and dampers");
  }

  draw(): void {
    this.plot.begin(this.plot.base);
  }

  override time({ orbit, state: { system, units } }: Scene, t: number): void {
    const p: Plot = this.plot;
    const g = p.over;
    p.begin(g);
    // On a high panel everything is larger.
    const zoom = Math.max(1, Math.min(2, p.height / 150));
    g.scale(zoom, zoom);
    const [wide, high] = [p.width / zoom, p.height / zoom];
    const { dark, ink, soft, card, accent } = theme();
    const count = orbit.x.length;
    const narrow = wide < 480;
    const block = { w: Math.max(46, (narrow ? 86 : 104) - 12 * (count - 1)), h: 52 };
    const ground = high - 36;
    const wall = narrow ? 34 : 52;
    const ranges = orbit.x.map((x) => rangeOf(x));
    const reach = Math.max(...ranges.map(({ high }) => high), 0) - Math.min(...ranges.map(({ low }) => low), 0) || 1;
    const strongest = Math.max(...orbit.force.map((force) => rangeOf(force)).flatMap(({ low, high }) => [-low, high])) || 1;
    const fastest = Math.max(...orbit.v.map((v) => rangeOf(v)).flatMap(({ low, high }) => [-low, high]));
    const room = wide - wall - 90;
    const gap = count > 1 ? (room - 60) / count : 0;
    const rest = wall + (count > 1 ? 70 + block.w / 2 : room * 0.4);
    const unit = (count > 1 ? gap - block.w : room * 0.48) / reach;
    const s: number = system["drive_velocity"];
    const right = wide - (narrow ? 30 : 60);
    belt(g, wall + (narrow ? 36 : 60), right, ground, s * t * unit);
    g.lineWidth = 2;
    g.strokeStyle = ink;
    p.segment(g, wall, ground - 84, wall, ground + 6);
    g.lineWidth = 1;
    g.strokeStyle = soft;
    for (let y = ground - 78; y < ground + 8; y += 10) p.segment(g, wall, y, wall - 9, y + 8);
    const places = orbit.x.map((x, i) => rest + i * gap + valueAt(orbit.t, x, t) * unit);
    g.setLineDash([3, 4]);
    p.segment(g, rest, ground - block.h - 22, rest, ground);
    g.setLineDash([]);
    g.fillStyle = soft;
    g.font = `italic 13px ${SERIF}`;
    g.textAlign = "center";
    g.textBaseline = "middle";
    g.fillText("x = 0", rest, ground - block.h - 30);
    const index = indexAt(orbit.t, t);
    places.forEach((x, i) => {
      const left = x - block.w / 2;
      const middle = ground - block.h / 2;
      const from = i ? places[i - 1]! + block.w / 2 : wall;
      g.strokeStyle = ink;
      g.lineWidth = 1.8;
      spring(g, from, left, i ? middle : middle - 13, i ? 5 : 11, i ? 6 : 9);
      if (!i) damper(g, from, left, middle + 14, x - rest);
      const mode = orbit.mode[i]![index]!;
      const colour = colourOf(system["law"].type, mode);
      g.fillStyle = dark ? "#3a3835" : card;
      g.lineWidth = 2;
      g.strokeStyle = ink;
      g.beginPath();
      g.roundRect(left, ground - block.h, block.w, block.h, 6);
      g.fill();
      g.stroke();
      g.fillStyle = colour;
      g.fillRect(left + 1, ground - 7, block.w - 2, 6);
      g.fillStyle = ink;
      g.font = `600 ${count > 1 ? 11 : 13}px system-ui, sans-serif`;
      g.textAlign = "center";
      g.textBaseline = "middle";
      const w = orbit.w[i]![index]!;
      const words = mode < 0 ? "sticks" : w >= 0 ? "slips back" : "slips ahead";
      g.fillText(count > 2 ? words.split(" ")[0]! : words, x, middle - 4);
      const { normal_force: normal } = system;
      if (normal) {
        const down = Math.min(40, 16 * normalForce(normal, t, valueAt(orbit.t, orbit.x[i]!, t), valueAt(orbit.t, orbit.v[i]!, t)));
        g.save();
        g.translate(left + 14, ground - block.h - 3 - down);
        g.rotate(Math.PI / 2);
        arrow(g, 0, 0, down, soft, "");
        g.restore();
        g.font = `italic 14px ${SERIF}`;
        if (!i) g.fillText("n", left + 26, ground - block.h - 10);
      }
      const force = valueAt(orbit.t, orbit.force[i]!, t);
      arrow(g, x + block.w / 2 + 3, ground - 12, Math.max(-60, Math.min(60, (force / strongest) * (count > 1 ? 26 : 54))), colour, count > 1 ? "" : "f");
      if (!i)
        for (const { amplitude, frequency, phase = 0 } of system["forcing"])
          arrow(g, x + block.w / 2 + 3, ground - 42, (amplitude / strongest) * Math.cos(frequency * t + phase) * 250, accent, "u");
    });
    arrow(g, right - 96, ground + 12, Math.max(-60, Math.min(60, 60 * (s / Math.max(fastest, Math.abs(s), 1e-300)))), soft, "s");
    g.fillStyle = soft;
    g.textAlign = "right";
    g.font = "12px system-ui, sans-serif";
    g.fillText(`t = ${t.toFixed(orbit.words.t_last < 20 ? 3 : 1)}${behind(units.time)}`, wide - 14, 16);
  }
}
