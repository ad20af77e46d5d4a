/** The script is the page's where there is a document, and the worker's where there is none. */
import { start } from "./page";
import { work } from "./sweeps";

if (typeof document === "undefined") work(self as any);
else {
  // The page as it was opened, before anything in it changes; it ends with this script.
  const source = `<!doctype html>\n${document.documentElement.outerHTML}\n`;
  const program = document.currentScript!.textContent!;
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset["theme"] ||= dark ? "dark" : "light";
  void start(source, program);
}
