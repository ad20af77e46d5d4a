/** The steady motion as a tone: its velocity, or friction, between maxima of the displacement, the natural frequency at a pitch one hears. */
import { type Core, Verb } from "./core";
import { type Orbit, wholePeriods } from "./orbit";

/** Seconds of a cross-fade. */
const FADE = 0.04;

/** The velocity (1), or friction (3), so that 2π/`natural` lasts 1/`pitch` seconds, at most four seconds of it. */
export function samples(core: Core, orbit: Orbit, natural: number, pitch: number, rate: number, of: 1 | 3): Float32Array<ArrayBuffer> {
  const [from, to] = wholePeriods(orbit);
  const perSecond = (pitch * 2 * Math.PI) / natural;
  const count = Math.max(2, Math.min(4 * rate, Math.round(((to - from) / perSecond) * rate)));
  const v = core.ask(Verb.states, { from, to, count }).numbers.subarray(of * count, (of + 1) * count);
  const mean = v.reduce((sum, value) => sum + value, 0) / count;
  const peak = v.reduce((most, value) => Math.max(most, Math.abs(value - mean)), 1e-3 * Math.abs(mean) + 1e-12);
  return Float32Array.from(v, (value) => (0.35 * (value - mean)) / peak);
}

export class Sound {
  private context?: AudioContext;
  private playing: { source: AudioBufferSourceNode; gain: GainNode } | null = null;

  get on(): boolean {
    return this.playing !== null;
  }

  play(core: Core, orbit: Orbit, natural: number, pitch: number, of: 1 | 3): void {
    const context = (this.context ??= new AudioContext());
    const tone = samples(core, orbit, natural, pitch, context.sampleRate, of);
    const buffer = context.createBuffer(1, tone.length, context.sampleRate);
    buffer.copyToChannel(tone, 0);
    const [source, gain] = [context.createBufferSource(), context.createGain()];
    Object.assign(source, { buffer, loop: true });
    source.connect(gain).connect(context.destination);
    gain.gain.setValueAtTime(0, context.currentTime);
    gain.gain.linearRampToValueAtTime(1, context.currentTime + FADE);
    this.stop();
    source.start();
    this.playing = { source, gain };
  }

  stop(): void {
    if (!this.playing || !this.context) return;
    const { source, gain } = this.playing;
    const now = this.context.currentTime;
    gain.gain.cancelScheduledValues(now);
    gain.gain.setValueAtTime(gain.gain.value, now);
    gain.gain.linearRampToValueAtTime(0, now + FADE);
    source.stop(now + FADE);
    this.playing = null;
  }
}
