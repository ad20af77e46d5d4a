"""Damage whole files and documents in every way and read them: nothing but `InputError` may come of it.

python docs/evidence/readers.py --each 10000          # writes readers.md beside this file
python docs/evidence/readers.py --only matlab --each 1000000 --seed 2 -o page.md
python docs/evidence/readers.py --again matlab:1:4711 # one input of the page, with its traceback
"""

from __future__ import annotations

import argparse
import collections
import functools
import itertools
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import traceback
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from damaged import reading, whole_inputs
from damaged.damage import spoil_bytes, spoil_document

import stickslip as ss

PAGE = Path(__file__).with_suffix(".md")
LONGEST = 100
"""Seconds after which an input counts as one that hangs: more than a reader grants a file, on a machine that is busy."""
MEMORY = 4 << 30
"""Bytes that the process which reads may have: an input that asks for more fails."""
CHUNK = 20_000
"""Inputs of one process."""


@dataclass(frozen=True)
class Target:
    """A reader: whole inputs, how their files end, and what reads them and looks at what was read."""

    inputs: Callable[[], list[Any]]
    ending: str
    read: Callable[[Path | Any, random.Random], object]


TARGETS = {
    "text": Target(whole_inputs.texts, ".csv", reading.read_record),
    "JSON": Target(whole_inputs.json_rows, ".json", reading.read_record),
    "look": Target(whole_inputs.looks, ".look", reading.read_record),
    "matlab": Target(whole_inputs.matlabs, ".mat", reading.read_record),
    "motion": Target(whole_inputs.motions, ".nc", reading.read_motion),
    "orbit": Target(whole_inputs.orbits, ".nc", reading.read_orbit),
    "friction": Target(whole_inputs.frictions, ".nc", reading.read_friction),
    "rig file": Target(whole_inputs.rigs, ".toml", reading.read_rig),
    "rig": Target(lambda: [tomllib.loads(text.decode()) for text in whole_inputs.rigs()], "", reading.read_rig),
    "law file": Target(lambda: whole_inputs.toml(whole_inputs.law_documents, "law"), ".toml", reading.read_law),
    "law": Target(whole_inputs.law_documents, "", reading.read_law),
    "system file": Target(lambda: whole_inputs.toml(whole_inputs.system_documents), ".toml", reading.read_system),
    "system": Target(whole_inputs.system_documents, "", reading.read_system),
    "setup file": Target(whole_inputs.setups, ".toml", reading.read_setup),
    "setup": Target(lambda: [tomllib.loads(text.decode()) for text in whole_inputs.setups()], "", reading.read_setup),
    "tracker text": Target(whole_inputs.trackers, ".txt", reading.read_tracker),
    "tracker": Target(whole_inputs.projects, ".trz", reading.read_tracker),
    "picture": Target(whole_inputs.pictures, ".png", reading.read_image),
    "film": Target(whole_inputs.films, ".avi", reading.read_film),
}
SLOW = {"matlab": 0.3, "motion": 0.03, "orbit": 0.03, "friction": 0.03, "film": 0.01, "picture": 0.1, "tracker": 0.1}
QUICK = dict.fromkeys(("law", "law file", "system", "system file", "setup", "setup file"), 3.0)
SHARES = SLOW | QUICK
"""Of the inputs of the others, by the time that one takes."""


class Hangs(Exception):
    """An input that takes too long."""


def attempt(name: str, seed: int, index: int, folder: Path) -> tuple[str, str]:
    """What became of one input: ``"read"``, ``"refused"`` or what else, and why."""
    target, rng = TARGETS[name], random.Random(f"{name}:{seed}:{index}")
    whole = inputs_of(name)[rng.randrange(len(inputs_of(name)))]
    source: Any
    if isinstance(whole, bytes):
        ending = target.ending
        if name == "tracker":
            ending = ".trz" if whole[:2] == b"PK" else ".trk"
        source = folder / f"input{ending}"
        source.write_bytes(spoil_bytes(whole, rng))
    else:
        source = spoil_document(whole, rng)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            target.read(source, rng)
    except ss.InputError as error:
        sentence = str(error)
        return ("refused", "") if "\n" not in sentence else ("lines", sentence)
    except Hangs:
        return "hangs", ""
    except BaseException as error:  # a panic of the core is no Exception
        if isinstance(error, KeyboardInterrupt):
            raise
        return type(error).__name__, "".join(traceback.format_exception(error)[-3:])
    return "read", ""


@functools.cache
def inputs_of(name: str) -> list[Any]:
    """Of a reader, made once."""
    return TARGETS[name].inputs()


def several(name: str, seed: int, first: int, count: int, tell: Callable[[str, int, str], None]) -> None:
    """`count` inputs of one reader; `tell` hears what became of each."""

    def late(*_: object) -> None:
        raise Hangs

    before = signal.signal(signal.SIGALRM, late)
    room = "/dev/shm" if Path("/dev/shm").is_dir() else None
    try:
        with tempfile.TemporaryDirectory(dir=room) as folder:
            for index in range(first, first + count):
                signal.alarm(LONGEST)
                kind, why = attempt(name, seed, index, Path(folder))
                signal.alarm(0)
                tell(kind, index, why)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def serve(name: str, seed: int, first: int, count: int) -> None:
    """The work of one process: a line for each input."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    several(name, seed, first, count, lambda *told: print(json.dumps(told), flush=True))


def run(name: str, seed: int, count: int) -> tuple[collections.Counter[str], list[str]]:
    """Outcomes of `count` inputs and the failures among them, each as ``kind reader:seed:index why``."""
    outcomes: collections.Counter[str] = collections.Counter()
    failures = []
    at, start = 0, time.monotonic()
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    while at < count:
        arguments = [sys.executable, __file__, "--serve", f"{name}:{seed}:{at}", "--each", str(min(CHUNK, count - at))]
        child = subprocess.run(arguments, capture_output=True, text=True, check=False, env=environment)
        for line in child.stdout.splitlines():
            if not line.startswith('["'):
                failures.append(f"prints {name}:{seed}:{at} {line}")
                continue
            kind, index, why = json.loads(line)
            outcomes[kind] += 1
            at = index + 1
            if kind not in ("read", "refused"):
                failures.append(f"{kind} {name}:{seed}:{index} {why}")
        if child.returncode > 0:
            raise RuntimeError(child.stderr)
        if child.returncode:
            outcomes["ends the process"] += 1
            failures.append(f"ends the process {name}:{seed}:{at} {child.returncode} {child.stderr[-300:]}")
            at += 1
    print(name, count, dict(outcomes), f"{time.monotonic() - start:.0f} s", flush=True)
    return outcomes, failures


Row = tuple[int, int, int]


def page(rows: dict[str, Row], each: int, seed: int) -> str:
    """The table of a run: inputs, read and refused of each reader."""
    lines = [
        "# Readers of damaged files and documents",
        "",
        "Whole inputs of every reader are changed, cut, doubled and moved in one to eight positions each. Then they are",
        "read, and what was read is checked. A record must be finite and its time increase. A law's forces must be",
        "numbers. An orbit must be the one that was saved. *Read* counts what was accepted, *refused* an `InputError` of",
        "one line. *Else* counts another exception, a force that is no number, a process that ended, more than 4 GB, or",
        "more than 100 s.",
        "",
        f"Made by `python docs/evidence/readers.py --each {each} --seed {seed}`. `--only` makes some readers anew.",
        "",
        "| reader | inputs | read | refused | else |",
        "|---|---:|---:|---:|---:|",
    ]
    inputs, read, refused = (sum(column) for column in zip(*rows.values(), strict=True))
    for name, (count, *found) in [*rows.items(), ("**all**", (inputs, read, refused))]:
        lines.append(f"| {name} | {count} | {found[0]} | {found[1]} | {count - sum(found)} |")
    return "\n".join(lines) + "\n"


def rows_of(path: Path) -> dict[str, Row]:
    """The rows of a page that is there."""
    found: dict[str, Row] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        name, *cells = (cell.strip() for cell in line.strip("|").split("|"))
        if name in TARGETS:
            count, read, refused, _ = map(int, cells)
            found[name] = count, read, refused
    return found


def main() -> None:
    """The whole run, or one input again."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--each", type=int, default=1000, help="inputs of each reader; fewer of those that take longer")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="readers at once")
    parser.add_argument("--only", nargs="+", default=list(TARGETS), choices=list(TARGETS))
    parser.add_argument("--again", metavar="READER:SEED:INDEX")
    parser.add_argument("--serve", metavar="READER:SEED:INDEX", help=argparse.SUPPRESS)
    parser.add_argument("-o", "--output", type=Path, default=PAGE)
    options = parser.parse_args()
    if options.again or options.serve:
        name, seed, index = (options.again or options.serve).split(":")
        if options.serve:
            serve(name, int(seed), int(index), options.each)
        else:
            with tempfile.TemporaryDirectory() as folder:
                print(*attempt(name, int(seed), int(index), Path(folder)), sep="\n")
        return
    rows = rows_of(options.output)
    counts = [max(1, round(options.each * SHARES.get(name, 1.0))) for name in options.only]
    with ThreadPoolExecutor(options.jobs) as pool:
        found = pool.map(run, options.only, itertools.repeat(options.seed), counts)
        for name, count, (outcomes, failures) in zip(options.only, counts, found, strict=True):
            rows[name] = count, outcomes["read"], outcomes["refused"]
            for failure in {" ".join(failure.split()[-12:]): failure for failure in failures}.values():
                print("   ", failure, flush=True)
            kept = {reader: rows[reader] for reader in TARGETS if reader in rows}
            options.output.write_text(page(kept, options.each, options.seed), encoding="utf-8")


if __name__ == "__main__":
    main()
