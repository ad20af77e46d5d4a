/** One box for each panel that may be put away. */
import { element } from "./controls";
import { titleOf } from "./export";
import type { Panel } from "./panels/panel";

export class PanelBoxes {
  private readonly boxes: HTMLInputElement[];

  constructor(
    host: HTMLElement,
    private readonly panels: Panel[],
    change: (shown: string) => void,
  ) {
    this.boxes = panels.map(({ plot }) => element("input", { type: "checkbox", value: plot.host.id }));
    for (const box of this.boxes)
      box.onchange = () => {
        const shown = this.boxes.filter(({ checked }) => checked).map(({ value }) => value);
        change(shown.length < this.boxes.length ? shown.join() : "");
      };
    host.append(...this.boxes.map((box, i) => element("label", {}, box, element("span", {}, titleOf(panels[i]!.plot.host)))));
  }

  /** Show the panels that a state names; all where it names none. */
  show(names: string): void {
    this.panels.forEach(({ plot: { host } }, i) => {
      const shown = !names || names.split(",").includes(host.id);
      host.closest("figure")!.hidden = !shown;
      this.boxes[i]!.checked = shown;
    });
  }
}
