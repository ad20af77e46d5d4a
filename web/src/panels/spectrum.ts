/** The spectrum of displacement, velocity, acceleration or friction over whole periods of the second half; the forcing is marked. */
import { Verb } from "../core";
import { wholePeriods } from "../orbit";
import { over } from "../state";
import { theme } from "../theme";
import { Panel, type Scene } from "./panel";

const SAMPLES = 4096;

/** Amplitudes of the frequencies 0 … n/2 of samples under Hann's window. */
export function amplitudes(samples: Float64Array): Float64Array {
  const n = samples.length;
  let mean = 0;
  for (const value of samples) mean += value / n;
  const re = new Float64Array(n);
  const im = new Float64Array(n);
  const bits = Math.log2(n);
  for (let i = 0; i < n; i++) {
    let j = 0;
    for (let bit = 0; bit < bits; bit++) j = (j << 1) | ((i >> bit) & 1);
    re[j] = (samples[i]! - mean) * (1 - Math.cos((2 * Math.PI * i) / n));
  }
  for (let size = 2; size <= n; size *= 2) {
    const angle = (-2 * Math.PI) / size;
    for (let k = 0; k < size / 2; k++) {
      const [c, s] = [Math.cos(angle * k), Math.sin(angle * k)];
      for (let i = k; i < n; i += size) {
        const j = i + size / 2;
        const [a, b] = [re[j]! * c - im[j]! * s, re[j]! * s + im[j]! * c];
        [re[j], im[j]] = [re[i]! - a, im[i]! - b];
        [re[i], im[i]] = [re[i]! + a, im[i]! + b];
      }
    }
  }
  return Float64Array.from({ length: n / 2 }, (_, i) => (2 * Math.hypot(re[i]!, im[i]!)) / n);
}

export class Spectrum extends Panel {
  constructor(host: HTMLElement) {
    super(host, "Spectrum of the motion", { x: "frequency ω / ω₀", y: "" });
  }

  draw({ core, orbit, state: { system, units, view } }: Scene): void {
    const p = this.plot;
    const g = p.base;
    const [from, to] = wholePeriods(orbit);
    p.labels.y = `log₁₀ |${["x", "ẋ", "ẍ", "f"][view.derivative]}|`;
    p.units = ["", [units.length, units.velocity, over(units.velocity, units.time), units.force][view.derivative]!];
    const natural = Math.sqrt(system["stiffness"] / system["mass"]);
    const x = core.ask(Verb.states, { from, to, count: SAMPLES }).numbers.subarray(view.derivative * SAMPLES, (view.derivative + 1) * SAMPLES);
    const heights = amplitudes(x).map((height) => Math.log10(Math.max(height, 1e-30)));
    const unit = (2 * Math.PI) / (to - from) / natural;
    const count = Math.min(heights.length, Math.ceil(6 / unit));
    const top = Math.ceil(Math.max(...heights.subarray(0, count)) + 0.2);
    p.x = { low: 0, high: 6 };
    p.y = { low: top - 6, high: top };
    p.axes();
    p.clip(g);
    const { line, accent } = theme();
    const frequencies = Float64Array.from({ length: count }, (_, i) => i * unit);
    g.strokeStyle = g.fillStyle = line;
    g.lineWidth = 1.4;
    p.line(g, frequencies, heights, 0, count);
    g.lineTo(p.px(6), p.height);
    g.lineTo(p.px(0), p.height);
    g.globalAlpha = 0.1;
    g.fill();
    g.globalAlpha = 1;
    g.strokeStyle = accent;
    g.setLineDash([4, 3]);
    for (const force of system["forcing"]) p.segment(g, p.px(force.frequency / natural), p.pad.top, p.px(force.frequency / natural), p.height);
    g.restore();
  }
}
