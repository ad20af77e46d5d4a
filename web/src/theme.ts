/** Colours of the page, of branches and of regimes, in both themes; the branches are those of `stickslip.show`. */

export interface Theme {
  dark: boolean;
  ink: string;
  soft: string;
  grid: string;
  faint: string;
  card: string;
  accent: string;
  stick: string;
  line: string;
  /** By the number of the branch: fall, upper, common, lower, climb, steep. */
  branches: string[];
  /** By the number of the regime. */
  regimes: string[];
}

const LIGHT: Theme = {
  dark: false, ink: "#24221e", soft: "#6c675c", grid: "#ece7dc", faint: "#cfcbc2", card: "#fffefb", accent: "#7b3fa0", stick: "#8a8a8a", line: "#0072b2",
  branches: ["#009e73", "#d55e00", "#2b2b2b", "#0072b2", "#e69f00", "#cc79a7"],
  regimes: ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#8a8a8a", "#b00020", "#777777"],
};
const DARK: Theme = {
  dark: true, ink: "#ece9e2", soft: "#a8a294", grid: "#33312d", faint: "#565249", card: "#232220", accent: "#c39ae0", stick: "#a5a5a5", line: "#6cb6e8",
  branches: ["#2fbf8f", "#f0803c", "#e8e8e8", "#6cb6e8", "#f0b429", "#e29ac4"],
  regimes: ["#f0803c", "#6cb6e8", "#2fbf8f", "#e29ac4", "#a5a5a5", "#ff6b6b", "#999999"],
};

/** Show the page light or dark from now on. */
export function keepTheme(name: string): void {
  document.documentElement.dataset["theme"] = name;
  try {
    localStorage["stickslip-theme"] = name;
  } catch {
    // A page within another may have no storage.
  }
}

/** What was chosen on a page before. */
export function keptTheme(): string {
  try {
    return localStorage["stickslip-theme"] ?? "";
  } catch {
    return "";
  }
}

export const theme = (): Theme => (document.documentElement.dataset["theme"] === "dark" ? DARK : LIGHT);
export const SERIF = "'STIX Two Text', 'Cambria Math', Georgia, serif";

/** The colour of a mode of a law: grey while stuck, else that of its branch. */
export function colourOf(law: string, mode: number): string {
  const { stick, branches } = theme();
  if (mode < 0) return stick;
  return law === "BogaczRyczek" ? (branches[mode] ?? stick) : branches[mode % 2 ? 1 : 3]!;
}
