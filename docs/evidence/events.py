"""Events under an independent judge: run crates/judge on random documents and write docs/evidence/events.md.

    python docs/evidence/events.py [--seeds N] [--first N] [--again] [--certified] [-o FILE]

A seed is 5,000 oscillators, 500 systems, 300 systems under normal forces that vary and on springs that bend, 300 systems of
what those leave out, 300 under friction by polynomials, and under laws with an internal state 40 runs of the core's
integrator and 20 of `stickslip.simulate`.
What a seed gave is a line of events.jsonl: a run that was stopped goes on where it ended. --again runs what failed anew on
the engine of this moment. --certified judges a twentieth of each seed on a build whose assertions check every accepted root.
Ends with code 1 where a failure is left; `stickslip-judge --seed S --first I --oscillators 1` shows its document.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from stickslip.errors import InputError
from stickslip.model.system import system_from_dict
from stickslip.simulation.integration import integrate
from stickslip.simulation.state_orbit import StateOrbit

ROOT = Path(__file__).resolve().parents[2]
SHARES = {
    "oscillators": 5000,
    "systems": 500,
    "loaded": 300,
    "further": 300,
    "polynomials": 300,
    "states": 40,
    "integrated": 20,
}
#: What one document of each kind is called.
ONE = {name: name.removesuffix("s") for name in SHARES}
#: What has certified events.
CERTIFIED = ("oscillator", "system", "loaded", "further", "polynomial")
#: Of a run of `stickslip.simulate` so many steps are judged, and the interpolant after every so many.
STEPS, EVERY = 1500, 4

HEAD = """# Events under an independent judge

Random systems are simulated, and every event is judged by another program (`crates/judge`). It shares no line with the
engine. It has its own equations of motion, its own formulas of every friction law and its own integrators. Written by
`docs/evidence/events.py` from `events.jsonl`, a line a seed.

## What is checked

Between two events lies a phase of smooth motion. Of each phase the judge checks:

* The motion from the reported state leads to the next reported state, and to what `orbit.at` says in between.
* No event is missed and none comes late. The functions whose zeros are events are sampled densely and their minima refined:
  adhesion below its limit, the sign of w, the ends of pieces of friction and of springs, the sense of ẇ on a branch, the
  sign of the normal force.
* The residual of each event: the force against f_s(t_s, δ), w at captures and crossings, the slip speed at nodes, ẇ at turns.
* The reported force, stick time and force rate, the order of events, the mode that follows, and the start.

A phase is judged in double precision first. Where that finds something, the growth of rounding over the phase is computed
too. Where that finds something still, the phase is judged with 31 digits.

A residual is a failure beyond 4096 roundings (9e-13) of its terms, times what the phase does to them: its sensitivity to its
start, to forces and to the path. Energy needs no check of its own: a motion that obeys the equations keeps its balance. A run
that the engine calls diverged is left beyond 1e30 times its start.

## What is drawn

The systems are drawn to provoke. Most runs are short, for many different ones; one in a hundred is twenty times as long.

* **oscillators**: near-critical, heavy and no damping, near resonance, up to four harmonics, static friction from zero to
  some roundings above kinetic, grazes, starts on the edge of adhesion, drives near zero, steep pieces, units over many
  decades, denormal numbers. A fifth of them runs on Taylor series although it has a closed form.
* **systems**: one to six masses with contacts on ramped, reversing and shaken drives and on each other, some with negative
  damping.
* **loaded**: one to three masses under normal forces that vary with time, position and velocity (down to zero, or just
  touching it, so that bodies part and meet) and on springs with stops, pieces and cubic parts.
* **further**: one to four masses of what those leave out: laws composed of others (`Combined`, `Asymmetric`), drives that are
  tables and several waves at once, normal forces of several waves, inclines, masses that are coupled by inertia or lie six
  decades apart, contacts and springs between any two of them, masses on no spring of their own.
* **polynomials**: one to three masses under `PiecewisePolynomial`, a quarter of them under normal forces that vary and on
  springs that bend. Polynomials of degree 2 to 4 go through drawn nodes and meet in corners at which no event lies. Those of
  degree 8 and 16 go through a smooth function.
* **states** and **integrated**: laws with an internal state, see below.

The law of Bogacz and Ryczek is drawn for oscillators only. `max_events` is 400. A run that asks 20,000 times whether to go on
is told not to (`max_seconds`).

## Laws with an internal state

LuGre, Dahl, ElastoPlastic, BoucWen, Regularised and RateState (every evolution of its state, with one and two of them) have
no modes and no certified events. Their runs are judged step by step: those of the core's own integrator (states) and those of
`stickslip.simulate` (integrated). A phase is a step there, and an event a change of sign. The judge has its own formulas of
these laws with their derivatives and its own variables. It integrates by the linearly implicit Euler rule, extrapolated
(Deuflhard 1985), from each reported step to the next at 1e-13. It checks:

* velocities, accelerations and friction forces at each step, to 4096 roundings of their terms;
* that each step leads to the next one, and to what is said of the time between, within 100 times the tolerance of the
  integrator. It is 100 times more where the step holds what no error estimate knows of: a boundary layer, or a corner of
  friction, of a normal force or of a spring. That is so where w or the normal force changes its sign in it, or where the
  judge had to halve its own step five times;
* of `stickslip.simulate`, that velocities change their signs where its table of events says so, and nowhere else.

`tests/test_state_laws.py` and `tests/test_state_systems.py` hold these laws against the balance of energy, limits in which
they become a law with events, and known critical stiffnesses.

## What was found
"""

ROWS = {
    "documents": "documents",
    "not_understood": "documents the judge does not understand",
    "refused": "refused with a sentence",
    "events": "events judged",
    "phases": "phases judged",
    "failures": "documents with a failure",
    "grazes": "grazes: a guard comes within its tolerance of zero and goes back, so that an event and none are both right",
    "edges": "edges: at w = 0 the force is within its tolerance of what adhesion bears, so that both decisions are right",
    "sensitive": "sensitive phases: rounding grows beyond a millionth of the motion",
    "left": "phases left: too many oscillations or too stiff a curve to follow",
}


def source(crate: str) -> str:
    """What names the sources of a crate, as they are now."""
    changed = subprocess.run(
        ["git", "status", "--porcelain", f"crates/{crate}/src"], cwd=ROOT, capture_output=True, text=True
    )
    if changed.stdout:
        raise SystemExit(
            f"expected crates/{crate}/src as committed, got changes; do commit them: a verdict names its engine"
        )
    tree = subprocess.run(
        ["git", "rev-parse", f"HEAD:crates/{crate}/src"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return tree.stdout[:10]


def judge(program: Path, seed: int, first: int = 0, **shares: int) -> tuple[dict, list[dict]]:
    """The counts of some documents of a seed, and what failed."""
    asked = [str(program), "--seed", str(seed), "--first", str(first)]
    integrated = shares.pop("integrated", 0)
    command = [*asked, "--show", "1000000"]
    for name, count in shares.items():
        command += [f"--{name}", str(count)]
    counts, found = verdict(command)
    if integrated:
        documents = subprocess.run(
            [*asked, "--states", str(integrated), "--documents", "1"], stdout=subprocess.PIPE, text=True, check=True
        )
        cases = [json.loads(line) for line in documents.stdout.splitlines()]
        runs = {index: told(case) for index, case in enumerate(cases, first) if "sys" in case}
        runs = {index: run for index, run in runs.items() if run}
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "runs.json"
            path.write_text(json.dumps(list(runs.values())))
            more, failed = verdict([str(program), str(path), "--show", "1000000"])
        counts["integrated"] = more[str(path)]
        for failure in failed:
            failure["from"] = f"integrated {[*runs][int(failure['from'].split()[-1])]}"
        found += failed
    return counts, found


def told(case: dict) -> dict | None:
    """A run of `stickslip.simulate` as the judge reads it; None where it is refused for its work."""
    system = system_from_dict(case["sys"])
    try:
        orbit = integrate(system, case["t_end"], case["x0"], case["v0"], tolerance=1e-10, max_seconds=60.0)
    except InputError as error:
        if "evaluations" not in str(error):
            raise
        return None
    steps = np.asarray(orbit._solution.ts)
    t = steps[steps <= orbit.t_end][:STEPS]
    stop = orbit.stop if t[-1] == orbit.t_end else "cut"
    between = 0.5 * (t[:-1] + t[1:])
    asked = np.arange(between.size) % EVERY == 0
    rows = iter(_rows(orbit, between[asked]))
    events = orbit.events[orbit.events["t"] <= t[-1]]
    changes = zip(events["kind"], events["contact"].tolist(), events["t"].tolist(), strict=True)
    return {
        "document": case,
        "rows": _rows(orbit, t),
        "between": [next(rows) if wanted else None for wanted in asked],
        "tolerance": 1e-10,
        "stop": stop,
        "changes": list(changes),
    }


def _rows(orbit: StateOrbit, t: np.ndarray) -> list[list]:
    """[t, x, v, a, w, force, z] at times."""
    motion = orbit.to_xarray(t)
    columns = [motion[name].to_numpy().reshape(t.size, -1) for name in ("x", "v", "a", "slip_velocity", "force")]
    columns.append(orbit.variables(t)[:, 2 * columns[0].shape[1] :])
    return [[time, *(column[i].tolist() for column in columns)] for i, time in enumerate(t.tolist())]


def verdict(command: list[str]) -> tuple[dict, list[dict]]:
    """What the program says: counts, and what failed."""
    run = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    *lines, summary = run.stdout.splitlines() or [""]
    if run.returncode not in (0, 1) or not summary:
        raise SystemExit(f"the judge ended with code {run.returncode}: {' '.join(command)}")
    found = [{key: value for key, value in json.loads(line).items() if key != "document"} for line in lines]
    return {kind: counts for kind, counts in json.loads(summary).items() if kind != "seed"}, found


def add(to: dict, counts: dict) -> None:
    """Add the numbers of one tree of counts to another."""
    for key, value in counts.items():
        if isinstance(value, dict):
            add(to.setdefault(key, {}), value)
        elif isinstance(value, list) and key not in ("slowest", "worst"):
            to[key] = [a + b for a, b in zip(to.get(key, [0] * len(value)), value, strict=True)]
        elif isinstance(value, int):
            to[key] = to.get(key, 0) + value


def page(chunks: list[dict]) -> str:
    """The page."""
    totals: dict[str, dict] = {}
    again: dict[str, list[int]] = {}
    open_ones = []
    certified: dict[str, dict] = {}
    for chunk in chunks:
        if chunk.get("certified"):
            add(certified, chunk["counts"])
    chunks = [chunk for chunk in chunks if not chunk.get("certified")]
    for chunk in chunks:
        add(totals, chunk["counts"])
        for failure in chunk["failures"]:
            last = failure.get("again")
            if last:
                row = again.setdefault(last["engine"], [0, 0])
                row[0] += 1
                row[1] += bool(last["failures"])
            if not last or last["failures"]:
                open_ones.append((chunk["seed"], (last["failures"] if last else [failure])[0]))
    kinds = list(totals)
    seeds = sorted(chunk["seed"] for chunk in chunks)
    text = [HEAD, f"Seeds: {seeds[0]} to {seeds[-1]}, {len(seeds)} of them.\n"]
    text += [f"| | {' | '.join(kinds)} |", "|---|" + "---:|" * len(kinds)]
    text += [f"| {row} | " + " | ".join(f"{totals[kind][key]:,}" for kind in kinds) + " |" for key, row in ROWS.items()]
    first = sum(row["failures"] for row in totals.values())
    engines = len({chunk["engine"] for chunk in chunks})
    text += ["", f"Failures are those of the first verdicts, over {engines} states of the engine: {first} documents."]
    text += ["Some were faults of the judge."]
    text += [f"Run again with the engine of now (`{e}`), {wrong} of {n} fail." for e, (n, wrong) in again.items()]
    if certified:
        events = list(certified)
        text += [
            "",
            "## Certified roots",
            "",
            "On a build with assertions each accepted root is certified: its guard is evaluated anew beside it, whatever",
            "search found it, and must not be below zero before it nor above zero after it but for rounding. A root that is",
            "not ends the judge. In a fallback what looked like the last step to a root was none, and the search went on.",
            "",
            f"| certified | {' | '.join(events)} |",
            "|---|" + "---:|" * len(events),
        ]
        for key in ("documents", "events", "fallbacks", "failures"):
            text.append(f"| {key} | " + " | ".join(f"{certified[kind][key]:,}" for kind in events) + " |")
    text += ["", "## How runs ended, and the laws", ""]
    text += ["| a run ended by | " + " | ".join(kinds) + " |", "|---|" + "---:|" * len(kinds)]
    for stop in sorted({stop for kind in kinds for stop in totals[kind]["stops"]}):
        text.append(f"| `{stop}` | " + " | ".join(f"{totals[kind]['stops'].get(stop, 0):,}" for kind in kinds) + " |")
    text += ["", "| law | oscillators | with a failure at first |", "|---|---:|---:|"]
    laws = totals.get("oscillators", {}).get("laws_and_failures", {})
    text += [f"| `{law}` | {count:,} | {wrong:,} |" for law, (count, wrong) in sorted(laws.items())]
    if open_ones:
        text += [
            "",
            f"Open: {len(open_ones)} documents.",
            "",
            "| seed | document | what | off | tolerance |",
            "|---:|---|---|---:|---:|",
        ]
        # What is no number has none in JSON.
        text += [
            f"| {s} | {f['from']} | {f['what']} | "
            + " | ".join("no number" if f[key] is None else f"{f[key]:.2g}" for key in ("off", "tolerance"))
            + " |"
            for s, f in open_ones[:60]
        ]
    return "\n".join(text) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=200, help="how many")
    parser.add_argument("--first", type=int, default=1000, help="the first one")
    parser.add_argument("--again", action="store_true", help="run what failed anew, and nothing else")
    parser.add_argument("--certified", action="store_true", help="on a build that certifies every root")
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).with_suffix(".md"))
    options = parser.parse_args()
    store = options.output.with_suffix(".jsonl")
    chunks = [json.loads(line) for line in store.read_text().splitlines()] if store.exists() else []
    names = {"engine": source("stickslip"), "judge": source("judge")}
    # A copy: what is built later is not what these verdicts name.
    program = Path(tempfile.mkdtemp()) / "stickslip-judge"
    profile, shares = "release", SHARES
    if options.certified:
        profile, shares = "debug", {name: count // 20 for name, count in SHARES.items() if ONE[name] in CERTIFIED}
    build = ["cargo", "build", "--quiet", "--locked", "--package", "stickslip-judge"]
    subprocess.run(build + ["--release"] * (not options.certified), cwd=ROOT, check=True)
    shutil.copy2(ROOT / f"target/{profile}/stickslip-judge", program)
    if options.again:
        for chunk in chunks:
            for failure in chunk["failures"]:
                one, index = failure["from"].split()
                kind = next(kind for kind, name in ONE.items() if name == one)
                _, found = judge(program, chunk["seed"], int(index), **{kind: 1})
                failure["again"] = names | {"failures": found}
        store.write_text("".join(f"{json.dumps(chunk)}\n" for chunk in chunks))
    else:
        done = {chunk["seed"] for chunk in chunks if chunk.get("certified", False) == options.certified}
        begun = time.monotonic()
        for seed in range(options.first, options.first + options.seeds):
            if seed in done:
                continue
            counts, found = judge(program, seed, **shares)
            mark = {"certified": True} if options.certified else {}
            chunks.append({"seed": seed} | mark | names | {"counts": counts, "failures": found})
            with store.open("a") as file:
                file.write(f"{json.dumps(chunks[-1])}\n")
            failures = sum(len(chunk["failures"]) for chunk in chunks)
            print(
                f"{len(chunks)} seeds, {failures} failures, {time.monotonic() - begun:.0f} s",
                file=sys.stderr,
                flush=True,
            )
    options.output.write_text(page(chunks))
    left = [
        failure
        for chunk in chunks
        for failure in chunk["failures"]
        if failure.get("again", {"failures": [0]})["failures"]
    ]
    sys.stdout.write("".join(f"{json.dumps(failure)}\n" for failure in left))
    return int(bool(left))


if __name__ == "__main__":
    sys.exit(main())
