"""All tests marked slow, run once; writes docs/evidence/slow_tests.md.

    python docs/evidence/slow_tests.py --keep RESULTS.jsonl [--again FILE ...]

One process a file, so that none disturbs another; results are kept line by line, and a run that was ended goes on where it
was. `--again` runs files whose results are there once more. Ends with code 1 where a test failed.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGE = Path(__file__).with_name("slow_tests.md")
#: Tests whose run is a page of its own here.
PAGES = {
    "test_a_million_damaged_inputs": "readers.md",
    "test_the_table_of_random_oscillators_finds_none_wrong": "critical-velocities.md",
}
PACKAGES = ("numpy", "scipy", "pandas", "xarray", "zarr", "h5netcdf", "matplotlib", "opencv-python-headless", "pytest")
HEAD = """# The slow tests

Every test marked slow, run once with `python docs/evidence/slow_tests.py`, one process a file. Skipped are those whose
records, which others have published, were not there. Left out are the runs that are pages of their own: {pages}.

| file | passed | failed | skipped |
|---|---:|---:|---:|
"""


def run(file: str) -> dict[str, Any]:
    """The outcomes of one file: name of a test and ``passed``, ``failed`` or ``skipped``."""
    left = " and ".join(f"not {name}" for name in PAGES)
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        arguments = ["-m", "pytest", "-q", "-m", "slow", "-k", left, f"--junitxml={report}", f"tests/{file}"]
        child = subprocess.run(
            [sys.executable, *arguments], capture_output=True, text=True, check=False, cwd=ROOT, env=os.environ
        )
        if not report.exists():
            return {"file": file, "tests": {file: "failed"}, "output": child.stdout[-3000:] + child.stderr[-3000:]}
        cases = list(ElementTree.parse(report).iter("testcase"))
    tests = {}
    for case in cases:
        marks = {child.tag for child in case}
        tests[str(case.get("name"))] = (
            "failed" if marks & {"failure", "error"} else "skipped" if "skipped" in marks else "passed"
        )
    output = child.stdout[-6000:] if "failed" in tests.values() else ""
    return {"file": file, "tests": tests, "output": output}


def page(results: list[dict[str, Any]]) -> str:
    """The table: a row a file."""
    text = HEAD.format(pages=", ".join(f"[{name}]({name})" for name in PAGES.values()))
    rows = []
    for result in results:
        outcomes = list(result["tests"].values())
        rows.append((result["file"], *(outcomes.count(kind) for kind in ("passed", "failed", "skipped"))))
    rows.append(("**all**", *(sum(row[index] for row in rows) for index in (1, 2, 3))))
    text += "".join(f"| {' | '.join(map(str, row))} |\n" for row in rows)
    failed = [
        f"{result['file']}::{name}" for result in results for name, kind in result["tests"].items() if kind == "failed"
    ]
    if failed:
        text += "\nFailed:\n\n" + "".join(f"- `{name}`\n" for name in failed)
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in PACKAGES)
    return text + f"\nPython {platform.python_version()}, {versions}; {platform.system()} on {platform.machine()}.\n"


def main() -> None:
    """Run what is not there yet, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--keep", type=Path, required=True, help="where the results go line by line")
    parser.add_argument("--again", nargs="+", default=[], metavar="FILE", help="files to run once more")
    options = parser.parse_args()
    lines = options.keep.read_text(encoding="utf-8").splitlines() if options.keep.exists() else []
    found = {item["file"]: item for item in map(json.loads, lines)}
    files = [path.name for path in sorted((ROOT / "tests").glob("test_*.py")) if "mark.slow" in path.read_text("utf-8")]
    for file in files:
        if file in found and file not in options.again:
            continue
        found[file] = run(file)
        options.keep.parent.mkdir(parents=True, exist_ok=True)
        with options.keep.open("a", encoding="utf-8") as kept:
            kept.write(json.dumps(found[file]) + "\n")
        print(file, found[file]["tests"], found[file]["output"], flush=True)
    results = [found[file] for file in files if found[file]["tests"]]
    PAGE.write_text(page(results), encoding="utf-8")
    if any("failed" in result["tests"].values() for result in results):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
