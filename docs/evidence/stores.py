"""Damaged Zarr stores: repaired or refused, never different; writes docs/evidence/stores.md.

    python docs/evidence/stores.py [--count N] [--seed SEED]

Ends with code 1 where one was neither.
"""

from __future__ import annotations

import argparse
import collections
import shutil
import tempfile
from pathlib import Path

import numpy as np
import xarray as xr

import stickslip as ss

PAGE = Path(__file__).with_name("stores.md")
SYSTEM = ss.Oscillator(
    damping=0.05, drive_velocity=0.3, law=ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.5, 0.7)
)
OVER = {"forcing.amplitude": np.linspace(0.1, 1.0, 60), "forcing.frequency": np.linspace(0.5, 1.5, 50)}
DAMAGES = ("removed", "cut short", "replaced by another file of the store", "1 to 3 bits changed")
HEAD = """# Damaged stores

A regime map of 3000 oscillators in a Zarr store. Each time one of its files, chosen at random, is damaged; then the map is
asked for again. *Repaired*: the result equals the whole one and every file of the store is the same to the byte. *Refused*:
an `InputError` of one line, and no result. *Else*: another result, another file, or another exception.

Written by `python docs/evidence/stores.py --count {count} --seed {seed}`.

| one file | stores | repaired | refused | else |
|---|---:|---:|---:|---:|
"""


def regime_map(path: Path) -> xr.Dataset:
    """The map, from its store as far as that is whole."""
    return ss.regime_map(SYSTEM, OVER, store=path, transient=2, window=2, workers=1)


def contents(path: Path) -> dict[str, bytes]:
    """Every file of a store."""
    return {str(file.relative_to(path)): file.read_bytes() for file in sorted(path.rglob("*")) if file.is_file()}


def damage(path: Path, rng: np.random.Generator) -> str:
    """Damage one file of a store; what was done to it."""
    files = sorted(file for file in path.rglob("*") if file.is_file())
    file = files[rng.integers(len(files))]
    data = bytearray(file.read_bytes())
    kind = DAMAGES[min(rng.integers(5), 3)]
    if kind == DAMAGES[0]:
        file.unlink()
        return kind
    if kind == DAMAGES[1]:
        data = data[: rng.integers(len(data))]
    elif kind == DAMAGES[2]:
        data = bytearray(files[rng.integers(len(files))].read_bytes())
    else:
        for at in rng.integers(len(data), size=rng.integers(1, 4)):
            data[at] ^= 1 << rng.integers(8)
    file.write_bytes(data)
    return kind


def outcomes(folder: Path, seeds: range, seed: int) -> tuple[collections.Counter[tuple[str, str]], list[str]]:
    """How many stores of each damage were ``"repaired"``, ``"refused"`` or ``"else"``, and what else."""
    whole = regime_map(folder / "whole.zarr").load()
    kept = contents(folder / "whole.zarr")
    counts: collections.Counter[tuple[str, str]] = collections.Counter()
    wrong = []
    for number in seeds:
        path = folder / f"{number}.zarr"
        shutil.copytree(folder / "whole.zarr", path)
        kind = damage(path, np.random.default_rng([seed, number]))
        try:
            again = regime_map(path).load()
        except ss.InputError as error:
            outcome = "refused" if "\n" not in str(error) else "else"
            told = str(error)
        except BaseException as error:  # a panic of the core is no Exception
            if isinstance(error, KeyboardInterrupt):
                raise
            outcome, told = "else", repr(error)
        else:
            outcome = "repaired" if again.identical(whole) and contents(path) == kept else "else"
            told = "another result"
        counts[kind, outcome] += 1
        if outcome == "else":
            wrong.append(f"{number}, {kind}: {told}")
        shutil.rmtree(path)
    left = sorted(file.name for file in folder.iterdir())
    if left != ["whole.zarr"]:
        wrong.append(f"left behind: {', '.join(left)}")
    return counts, wrong


def page(counts: collections.Counter[tuple[str, str]], seed: int) -> str:
    """The table."""
    text = HEAD.format(count=counts.total(), seed=seed)
    rows = [[counts[kind, outcome] for outcome in ("repaired", "refused", "else")] for kind in DAMAGES]
    for name, row in [*zip(DAMAGES, rows, strict=True), ("**all**", np.sum(rows, axis=0).tolist())]:
        text += f"| {name} | {sum(row)} | {' | '.join(map(str, row))} |\n"
    return text


def main() -> None:
    """The run and its page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        counts, wrong = outcomes(Path(folder), range(options.count), options.seed)
    PAGE.write_text(page(counts, options.seed), encoding="utf-8")
    if wrong:
        raise SystemExit("\n".join(wrong))


if __name__ == "__main__":
    main()
