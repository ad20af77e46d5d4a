"""What a run costs in instructions of the processor, before and after a change; writes docs/evidence/instructions.md.

    python docs/evidence/instructions.py BEFORE

BEFORE is a commit. Both versions of the example `cost` are built and counted by valgrind (callgrind), which does not depend
on how busy the machine is. Each case is simulated once and twice: the difference is the cost of one run, without the start
of the program.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = Path(__file__).with_name("instructions.md")
CASES = (
    "S3", "P1", "S16", "S15", "paper 0.2", "paper 0.3", "P3", "S16 forced", "S15 forced", "paper 0.2 forced",
    "paper 0.3 forced", "S5", "chain of 10", "chain of 100",
)  # fmt: skip
HEAD = """# Instructions

Instructions of the processor for one event, counted by valgrind: `python docs/evidence/instructions.py {before}`. The
cases are those of `crates/stickslip/examples/cost.rs`. Before is
commit {before}. What a case pays for its rows depends on how many they are, as valgrind counts a long copy byte for byte.

| case | before | now | now / before |
|---|---:|---:|---:|
"""


def built(folder: Path, target: Path) -> Path:
    """The example of a checkout."""
    command = ["cargo", "build", "--quiet", "--release", "--locked", "--package", "stickslip", "--example", "cost"]
    subprocess.run(command, cwd=folder, check=True, env=os.environ | {"CARGO_TARGET_DIR": str(target)})
    return target / "release" / "examples" / "cost"


def instructions(program: Path, case: str, rounds: int) -> tuple[int, int]:
    """Instructions of the whole program, and the events of one run."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(program), case, str(rounds)]
    found = subprocess.run(command, check=True, capture_output=True, text=True)
    counted = re.search(r"Collected : (\d+)", found.stderr)
    row = re.search(rf"^{re.escape(case)} +[\d.]+ +(\d+)", found.stdout, re.MULTILINE)
    if counted is None or row is None:
        sys.exit(f"{case}: valgrind or the example printed something else: {found.stdout}{found.stderr}")
    return int(counted[1]), int(row[1])


def of_event(program: Path, case: str) -> float:
    """Instructions an event."""
    (once, events), (twice, _) = (instructions(program, case, rounds) for rounds in (1, 2))
    return (twice - once) / events


def main() -> None:
    """Build both, count, write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("before", help="commit to compare with")
    before = parser.parse_args().before
    with tempfile.TemporaryDirectory() as folder:
        earlier = Path(folder) / "before"
        subprocess.run(["git", "worktree", "add", "--quiet", "--detach", str(earlier), before], cwd=ROOT, check=True)
        try:
            programs = [built(earlier, Path(folder) / "target"), built(ROOT, ROOT / "target")]
            rows = []
            for case in CASES:
                then, now = (of_event(program, case) for program in programs)
                rows.append(f"| {case} | {then:.0f} | {now:.0f} | {now / then:.2f} |\n")
                print(rows[-1], end="", flush=True)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(earlier)], cwd=ROOT, check=True)
    PAGE.write_text(HEAD.format(before=before[:7]) + "".join(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
