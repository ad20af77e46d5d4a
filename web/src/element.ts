/** `<stick-slip>`: a live figure in another page. All of them share the module; each starts when it is seen, over its still picture. */
import { Core, Refused, unpack } from "./core";
import { element } from "./controls";
import { sayMotion, sceneOf, settle } from "./facts";
import { simulate } from "./orbit";
import { Displacement } from "./panels/displacement";
import { Law } from "./panels/law";
import type { Panel, Scene } from "./panels/panel";
import { Phase } from "./panels/phase";
import { Rig } from "./panels/rig";
import { Spectrum } from "./panels/spectrum";
import { Surface } from "./panels/surface";
import { plain } from "./plot";
import { type Data, data } from "./data";
import type { Measured } from "./record";
import { FRESH, type State, behind, fromLink, put } from "./state";

type Make = (host: HTMLElement, data: Data) => Panel;
const PANELS: Record<string, Make> = {
  rig: (host) => new Rig(host),
  law: (host, { laws }) => new Law(host, laws),
  phase: (host) => new Phase(host),
  displacement: (host) => new Displacement(host),
  spectrum: (host) => new Spectrum(host),
  surface: (host) => new Surface(host),
};

let shared: Promise<{ module: WebAssembly.Module; data: Data }> | null = null;

export class StickSlip extends HTMLElement {
  state!: State;
  private records: Measured[] = [];
  private panels: Panel[] = [];
  private core!: Core;
  private scene: Scene | null = null;
  private stale = true;
  private clock = 0;
  private momentDrawn = NaN;
  private last = 0;
  private playing = false;
  private seen = false;
  private readonly words = element("p", { className: "facts" });

  connectedCallback(): void {
    new IntersectionObserver(([entry]) => {
      this.seen = entry!.isIntersecting;
      if (this.seen && !this.dataset["ready"]) {
        this.dataset["ready"] = "starting";
        void this.start();
      } else if (this.seen && this.core) requestAnimationFrame((now) => this.frame(now));
    }).observe(this);
  }

  private async start(): Promise<void> {
    shared ??= unpack(document.getElementById("core")!.textContent!).then((module) => ({ module, data: data() }));
    const { module, data: known } = await shared;
    this.core = new Core(module);
    const own = JSON.parse(this.querySelector("script")?.textContent ?? "{}");
    this.state = { ...structuredClone(FRESH), ...(own.state ?? fromLink(this.getAttribute("address") ?? "", known.presets).state) };
    this.records = own.records ?? [];
    this.playing = !this.hasAttribute("still") && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    const hosts = (this.getAttribute("panels") ?? "rig,law,phase").split(",").filter((name) => name in PANELS);
    const grid = element("div", { className: "live" });
    this.panels = hosts.map((name) => {
      const host = element("div", { className: name });
      grid.append(host);
      return PANELS[name]!(host, known);
    });
    for (const panel of this.panels) {
      const change = (path: string, value: unknown) => {
        this.state = put(this.state, path, value);
        this.stale = true;
      };
      if (panel instanceof Law) panel.change = (changes) => (changes.length ? changes.forEach(([path, value]) => change(`system.${path}`, value)) : (this.stale = true));
      if (panel instanceof Phase) panel.pick = (x, v) => change("start", { x0: [x], v0: [v] });
      if (panel instanceof Displacement) panel.seek = (t) => (this.clock = Math.max(0, t));
      if (panel instanceof Surface) panel.redraw = () => (this.stale = true);
    }
    const speed = this.state.system["drive_velocity"];
    const range = element("input", { type: "range", min: "0", max: String(3 * speed || 1), step: "any", value: String(speed), ariaLabel: "Drive velocity s" });
    const value = element("output");
    const say = () => (value.textContent = `${plain(+this.state.system["drive_velocity"].toPrecision(4))}${behind(this.state.units.velocity)}`);
    say();
    range.oninput = () => {
      this.state = put(this.state, "system.drive_velocity", +range.valueAsNumber.toPrecision(4));
      say();
      this.stale = true;
    };
    const play = element("button", { type: "button", textContent: this.playing ? "Pause" : "Play" });
    play.onclick = () => {
      this.playing = !this.playing;
      play.textContent = this.playing ? "Pause" : "Play";
    };
    this.classList.add("explorer");
    this.replaceChildren(this.words, grid, element("p", {}, play, " drive velocity s ", range, " ", value));
    new ResizeObserver(() => (this.stale = true)).observe(this);
    this.dataset["ready"] = "yes";
    requestAnimationFrame((now) => this.frame(now));
  }

  private draw(): void {
    [this.stale, this.momentDrawn] = [false, NaN];
    this.words.replaceChildren();
    try {
      const orbit = simulate(this.core, this.state);
      // That of an integration takes too long for a page of figures.
      const settled = orbit.words.engine === "integrated" ? null : settle(this.core, this.state, true);
      this.scene = sceneOf(this.core, this.state, orbit, settled, this.records);
      sayMotion(this.words, this.state, orbit, settled, { late: null, test: settled?.chaos ?? NaN, exponent: null });
      for (const panel of this.panels) {
        panel.plot.fit();
        panel.draw(this.scene);
      }
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.words.textContent = error.message;
    }
  }

  private frame(now: number): void {
    if (!this.seen || !this.isConnected) return;
    if (this.stale) this.draw();
    const { scene } = this;
    if (scene) {
      const end = scene.orbit.words.t_last;
      if (this.playing) this.clock += (Math.min(0.1, (now - this.last) / 1000) * end) / 50;
      if (this.clock > end) this.clock = 0.6 * end;
      if (this.clock !== this.momentDrawn) for (const panel of this.panels) panel.time(scene, this.clock);
      this.momentDrawn = this.clock;
    }
    this.last = now;
    requestAnimationFrame((next) => this.frame(next));
  }
}
