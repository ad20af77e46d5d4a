/** Unpacks the program of a page and runs it: packed it takes half the room. */
import { fromText, unlzma } from "./lzma";

const program = document.createElement("script");
program.textContent = new TextDecoder().decode(unlzma(fromText(document.getElementById("program")!.textContent!.trim())));
document.currentScript!.after(program);
