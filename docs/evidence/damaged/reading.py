"""What reads an input, and what must hold of all that was read."""

from __future__ import annotations

import functools
import random
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from damaged.whole_inputs import EXAMPLES, orbits

import stickslip as ss
from stickslip.laws import Law

RIG = {"instrument": "displacement", "column": "x", "unit": "m", "stiffness": 40.0, "mass": 1.0, "drive_velocity": 10.0}


def read_record(path: Path, rng: random.Random) -> None:
    """A record under a layout."""
    from stickslip.measurement import Layout, Rig
    from stickslip.measurement.read import as_record

    layout = {"missing": rng.choice(("refuse", "drop")), "torn_rows": rng.choice(("refuse", "drop"))}
    if path.suffix == ".csv":
        layout |= {"decimal": rng.choice("...,"), "header": rng.random() < 0.9, "skip_rows": int(rng.random() < 0.1)}
    if path.suffix == ".look":
        layout |= {"format": "look"}
    column, time_column = rng.choice(
        [("x", "t"), ("x", "t"), (2, 1), (2, 1), ("run.x", "run.t"), ("segments.x", "segments.t")]
    )
    record = as_record(path, Rig(**RIG | {"column": column, "time_column": time_column, "read": Layout(**layout)}))
    assert np.isfinite(record.signal).all()
    assert (np.diff(record.time) > 0).all()


def read_motion(path: Path, _: random.Random) -> None:
    """The masses of a motion, each a record."""
    from stickslip.measurement import Rig
    from stickslip.measurement.masses import masses_of
    from stickslip.measurement.read import as_record

    for part in (masses_of(path) or {"": path}).values():
        record = as_record(part, Rig(**RIG))
        assert np.isfinite(record.signal).all()


def read_orbit(path: Path, _: random.Random) -> None:
    """An orbit is refused, or the same as what was saved."""
    orbit = ss.load(path)
    found = (
        type(orbit.system).__name__,
        np.array(orbit.at(np.linspace(0, orbit.t_end, 7))).tobytes(),
        len(orbit.events),
    )
    assert found in _whole_orbits(), "another orbit"


@functools.cache
def _whole_orbits() -> list[tuple[str, bytes, int]]:
    found = []
    for content in orbits():
        with tempfile.NamedTemporaryFile(suffix=".nc") as file:
            Path(file.name).write_bytes(content)
            orbit = ss.load(file.name)
            states = np.array(orbit.at(np.linspace(0, orbit.t_end, 7)))
            found.append((type(orbit.system).__name__, states.tobytes(), len(orbit.events)))
    return found


def read_friction(path: Path, _: random.Random) -> None:
    """A friction record, as identification takes it."""
    from stickslip.identification.records import read_records

    (record,) = read_records(path)
    assert np.isfinite(record.force).all()
    _ = (record.slips, record.step, record.own_slip(), record.both_senses())


def read_rig(source: Any, _: random.Random) -> None:
    """A rig of any instrument."""
    from stickslip.measurement import load_rig

    load_rig(source)


def read_law(source: Any, _: random.Random) -> None:
    """A law whose forces are numbers."""
    law = ss.load_law(source) if isinstance(source, Path) else Law.from_dict(source)
    forces = [law.break_away_force([0.0, 1e-3, 1.0, 1e6], rate) for rate in (0.0, 1e-6, 1.0, 1e6)]
    forces += [law.kinetic_force([1e-9, 0.01, 0.1, 1.0, 10.0])]
    assert all(np.isfinite(force).all() for force in forces), f"{law}: force is {forces}"


def read_system(source: Any, _: random.Random) -> None:
    """An oscillator or a system of masses."""
    from stickslip.model.system import system_from_dict
    from stickslip.model.system_file import load_system

    _ = load_system(source) if isinstance(source, Path) else system_from_dict(source)


def read_setup(source: Any, _: random.Random) -> None:
    """A setup and its calibration."""
    from stickslip.tracking.scale.calibration import read_calibration
    from stickslip.tracking.setup import Setup

    setup = Setup.of(source)
    if setup.calibration is not None:
        read_calibration(setup.calibration, EXAMPLES, 12.0)


def read_tracker(path: Path, _: random.Random) -> None:
    """A motion of OSP Tracker."""
    from stickslip.tracking.video.osp import read_osp

    read_osp(path)


def read_image(path: Path, _: random.Random) -> None:
    """A picture of 8 bits."""
    from stickslip.tracking.video.source import read_picture

    assert read_picture(path).dtype == np.uint8


def read_film(path: Path, _: random.Random) -> None:
    """All pictures of a film."""
    from stickslip.tracking.video.source import Film

    for _time, _picture in Film(path):
        pass
