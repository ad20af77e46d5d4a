/** Lessons: Markdown files in steps, each with a state of the page, what to look at, and words. */
import { element } from "./controls";

interface Step {
  heading: string;
  /** The link of its state, the ids of the panels to look at, and the paths of the numbers that are moved in it. */
  link: string;
  look: string[];
  moves: string[];
  paragraphs: string[];
}

export interface Lesson {
  title: string;
  steps: Step[];
}

/** `# title`, then steps: `## heading`, a line with the state between backticks, the panels and after a semicolon the numbers to move, paragraphs; `?` asks. */
export function parse(text: string): Lesson {
  const [head = "", ...parts] = text.split(/^## /m);
  const steps = parts.map((part) => {
    const [heading = "", state = "", ...rest] = part.trim().split("\n");
    const [, link = "", names = ""] = /^`([^`]*)`\s*(.*)$/.exec(state) ?? [];
    const [look = [], moves = []] = names.split(/;\s*/).map((list) => list.split(/,\s*/).filter(Boolean));
    return { heading, link, look, moves, paragraphs: rest.join("\n").trim().split(/\n\s*\n/) };
  });
  return { title: head.replace(/^# /, "").trim(), steps };
}

/** Words with *emphasis* and **strong** ones; nothing else is markup. */
function words(text: string): (Node | string)[] {
  return text
    .split(/(\*\*[^*]+\*\*|\*[^*]+\*)/)
    .map((part) => (part.startsWith("**") ? element("strong", {}, part.slice(2, -2)) : part.startsWith("*") && part.length > 2 ? element("em", {}, part.slice(1, -1)) : part));
}

export class Lessons {
  readonly all: Lesson[];
  at: [lesson: number, step: number] | null = null;

  constructor(
    private readonly host: HTMLElement,
    texts: string[],
    private readonly open: (link: string) => void,
    /** Sliders of numbers of the state. */
    private readonly sliders: (paths: string[]) => HTMLElement[],
  ) {
    this.all = texts.map(parse);
  }

  show(lesson: number, step: number): void {
    const { title, steps } = this.all[lesson]!;
    const { heading, link, look, moves, paragraphs } = steps[step]!;
    this.at = [lesson, step];
    this.open(link);
    const button = (text: string, to: () => void, off = false) => {
      const made = element("button", { type: "button", textContent: text, disabled: off });
      made.onclick = to;
      return made;
    };
    const select = element("select", { ariaLabel: "Lesson" }, ...this.all.map((one, i) => new Option(`${i + 1} ${one.title}`, String(i), false, i === lesson)));
    select.onchange = () => this.show(Number(select.value), 0);
    const next: [number, number] | null = step + 1 < steps.length ? [lesson, step + 1] : lesson + 1 < this.all.length ? [lesson + 1, 0] : null;
    this.host.replaceChildren(
      element(
        "nav",
        {},
        select,
        element("span", {}, `${step + 1} of ${steps.length}`),
        button("Back", () => this.show(lesson, step - 1), !step),
        button(next && next[0] > lesson ? "Next lesson" : "Next", () => next && this.show(...next), !next),
        button("Set again", () => this.open(link)),
        button("Close", () => this.close()),
      ),
      element("h2", {}, heading),
      ...paragraphs.map((text) => element("p", { className: text.startsWith("?") ? "question" : "" }, ...words(text.replace(/^\?\s*/, "")))),
      ...this.sliders(moves),
    );
    this.host.scrollTo({ top: 0 });
    this.host.setAttribute("aria-label", title);
    this.host.hidden = false;
    for (const marked of document.querySelectorAll(".look")) marked.classList.remove("look");
    for (const id of look) (document.getElementById(id)?.closest("figure, fieldset") ?? null)?.classList.add("look");
    document.getElementById("panels")!.scrollTo({ top: 0 });
    // On a phone the words come first; elsewhere the last panel is brought into sight, then the first.
    if (getComputedStyle(document.body).display === "grid") for (const id of look.toReversed()) document.getElementById(id)?.closest("figure, fieldset")?.scrollIntoView({ block: "nearest" });
    else this.host.scrollIntoView();
  }

  close(): void {
    this.at = null;
    this.host.hidden = true;
    for (const marked of document.querySelectorAll(".look")) marked.classList.remove("look");
  }
}
