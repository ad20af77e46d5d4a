"""Events under an independent judge: run crates/judge on random documents and write docs/evidence/events.md.

    python docs/evidence/events.py [--oscillators N] [--systems N] [--seeds S ...] [-o FILE]

Ends with code 1 where a failure is left, and prints the documents that reproduce them.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

HEAD = """# Events under an independent judge

Written by `docs/evidence/events.py`. The judge (`crates/judge`) reads the document of a run for itself, with its own
equations of motion, its own formulas of every friction law and its own integrators, in doubles and, where those find
something, in pairs of doubles (31 digits). Of each phase between two events it checks

* that the motion from the reported state leads to the next reported state, and to what `orbit.at` says in between;
* that no guard falls below zero: adhesion below its limit, the sign of w, the ends of pieces, the sense of ẇ on a branch,
  by dense samples and refined minima, so that no event is missed and none comes late;
* the residual of each event: the force against f_s(t_s, δ), w at captures and crossings, the slip speed at nodes, ẇ at turns;
* the reported force, stick time and force rate, the order of events, the mode that follows, and the start.

A residual counts as a failure beyond 4096 roundings (9e-13) of its terms, times what the phase does to them: its own
sensitivity to its start, to forces and to the way passed. Energy needs no check of its own: a motion that agrees with the
equations keeps its balance.

The documents are drawn to provoke: near-critical, heavy and no damping, near resonance, up to four harmonics, static
friction from zero to some ulps above kinetic, grazes, starts on the edge of adhesion, drives near zero, steep pieces, units
over many decades, denormal numbers; systems of one to six masses with contacts on ramped, reversing and shaken drives and on
each other, some with negative damping.
The law of Bogacz and Ryczek is not drawn yet. A fifth of the oscillators runs on Taylor series although it has a closed form.
"""

ROWS = {
    "documents": "documents",
    "not_understood": "documents the judge does not understand",
    "refused": "refused with a sentence",
    "events": "events judged",
    "phases": "phases judged",
    "failures": "failures",
    "grazes": "grazes: a guard comes within its tolerance of zero and goes back, so that an event and none are both right",
    "edges": "edges: at w = 0 the force is within its tolerance of what adhesion bears, so that both decisions are right",
    "sensitive": "sensitive phases: rounding grows beyond a millionth of the motion",
    "left": "phases left: too many oscillations or too stiff a curve to follow",
}


def judge(oscillators: int, systems: int, seeds: list[int], threads: int) -> tuple[dict[str, dict], list[str]]:
    """The counts of all seeds together, and the lines of failures."""
    totals: dict[str, dict] = {}
    failures: list[str] = []
    for index, seed in enumerate(seeds):
        share = [count // len(seeds) + (index < count % len(seeds)) for count in (oscillators, systems)]
        command = ["cargo", "run", "--quiet", "--release", "--locked", "--package", "stickslip-judge", "--"]
        command += ["--oscillators", str(share[0]), "--systems", str(share[1])]
        command += ["--seed", str(seed), "--threads", str(threads)]
        run = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        *lines, summary = run.stdout.splitlines() or [""]
        if run.returncode not in (0, 1) or not summary:
            raise SystemExit(f"the judge ended with code {run.returncode}: {' '.join(command)}")
        failures += lines
        add(totals, {kind: counts for kind, counts in json.loads(summary).items() if kind != "seed"})
    return totals, failures


def add(to: dict, counts: dict) -> None:
    """Add the numbers of one tree of counts to another."""
    for key, value in counts.items():
        if isinstance(value, dict):
            add(to.setdefault(key, {}), value)
        elif isinstance(value, list) and key != "slowest":
            to[key] = [a + b for a, b in zip(to.get(key, [0] * len(value)), value, strict=True)]
        elif isinstance(value, int):
            to[key] = to.get(key, 0) + value


def page(totals: dict[str, dict], seeds: list[int]) -> str:
    """The page."""
    kinds = list(totals)
    text = [HEAD, f"Seeds: {', '.join(map(str, seeds))}.\n"]
    text += [f"| | {' | '.join(kinds)} |", "|---|" + "---:|" * len(kinds)]
    text += [f"| {row} | " + " | ".join(f"{totals[kind][key]:,}" for kind in kinds) + " |" for key, row in ROWS.items()]
    text += ["", "| a run ended by | " + " | ".join(kinds) + " |", "|---|" + "---:|" * len(kinds)]
    for stop in sorted({stop for kind in kinds for stop in totals[kind]["stops"]}):
        text.append(f"| `{stop}` | " + " | ".join(f"{totals[kind]['stops'].get(stop, 0):,}" for kind in kinds) + " |")
    text += ["", "`max_events` is 400 here.", "", "| law | oscillators | failures |", "|---|---:|---:|"]
    laws = totals.get("oscillators", {}).get("laws_and_failures", {})
    text += [f"| `{law}` | {count:,} | {wrong:,} |" for law, (count, wrong) in sorted(laws.items())]
    found = {kind: totals[kind]["kinds"] for kind in kinds if totals[kind]["failures"]}
    if found:
        text += ["", "| what failed | in | times |", "|---|---|---:|"]
        text += [
            f"| {what} | {kind} | {count:,} |" for kind, kinds in found.items() for what, count in sorted(kinds.items())
        ]
    return "\n".join(text) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--oscillators", type=int, default=1_000_000)
    parser.add_argument("--systems", type=int, default=100_000)
    parser.add_argument("--seeds", type=int, nargs="+", default=[20, 21, 22, 23])
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).with_suffix(".md"))
    options = parser.parse_args()
    totals, failures = judge(options.oscillators, options.systems, options.seeds, options.threads)
    options.output.write_text(page(totals, options.seeds))
    sys.stdout.write("".join(f"{line}\n" for line in failures))
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
