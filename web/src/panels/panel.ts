/** What every panel is: a picture of the system below, of the moment above. */
import { element } from "../controls";
import type { Core } from "../core";
import type { Orbit } from "../orbit";
import { Plot } from "../plot";
import type { Measured } from "../record";
import type { State } from "../state";
import type { Steady } from "../sweeps";

export interface Scene {
  core: Core;
  state: State;
  orbit: Orbit;
  /** Index of the first sample that is shown as steady. */
  steady: number;
  /** The steady motion, where the core tells it. */
  settled: Steady | null;
  /** What was measured, laid over the motion. */
  records: Measured[];
}

export type Change = [path: string, value: unknown];

export abstract class Panel {
  readonly plot: Plot;
  constructor(host: HTMLElement, title: string, labels = { x: "", y: "" }) {
    this.plot = new Plot(host, labels, title);
  }
  /** Name colours below the picture, where it stands in a figure. */
  protected key(entries: [colour: string, words: string][]): void {
    const figure = this.plot.host.closest("figure");
    let row = figure?.querySelector<HTMLElement>("div.key");
    if (figure && !row) figure.append((row = element("div", { className: "key" })));
    const wanted = JSON.stringify(entries);
    if (!row || row.dataset["wanted"] === wanted) return;
    row.dataset["wanted"] = wanted;
    row.replaceChildren(
      ...entries.map(([colour, words]) => {
        const one = element("span", {}, words);
        one.style.setProperty("--c", colour);
        return one;
      }),
    );
    this.plot.fit();
  }
  abstract draw(scene: Scene): void;
  time(_scene: Scene, _t: number): void {}
}
