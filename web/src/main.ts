/** The script is the explorer's where its page stands, the elements' in another page, and the worker's where there is no document. */
import { start } from "./page";
import { work } from "./sweeps";
import { keptTheme } from "./theme";

function begin(): void {
  // The page as it was opened, before anything in it changes: without this script, which is unpacked from it again.
  const here = document.currentScript!;
  const program = here.textContent!;
  here.remove();
  const source = `<!doctype html>\n${document.documentElement.outerHTML}\n`;
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const whole = document.getElementById("panels");
  document.documentElement.dataset["theme"] ||= (whole && keptTheme()) || (dark ? "dark" : "light");
  if (whole) {
    start(source, program).catch((error: Error) => {
      document.getElementById("facts")!.textContent = `This browser does not start the page, which needs WebAssembly: ${error.message}`;
    });
  }
  // An element is a class of the document's, which a worker has not.
  else void import("./element").then(({ StickSlip }) => customElements.define("stick-slip", StickSlip));
}

if (typeof document === "undefined") work(self as any);
else begin();
