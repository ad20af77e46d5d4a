"""Records that contradict their rig, or themselves, are refused or named; those that do not are measured as ever."""

import numpy as np
import pytest

import stickslip as ss

T = np.arange(0, 20, 0.01)
SPEED = 0.1 * np.sin(2 * np.pi * 0.3 * T) + 0.03 * np.sin(2 * np.pi * 0.71 * T)
FORCE = np.sign(SPEED) * (12 + 25 * np.abs(SPEED)) + 0.2 * np.random.default_rng(1).standard_normal(T.size)


def rig(time="", speed="", force="", **more):
    """A rig of a force and a speed, with the units that it says."""
    units = {"time": ("t", time), "velocity": ("v", speed), "force": ("F", force)}
    columns = {name: {"column": column} | ({"unit": unit} if unit else {}) for name, (column, unit) in units.items()}
    return {"instrument": "direct_force", "columns": columns, **more}


def written(path, head, force=1.0, time=1.0):
    lines = [f"{a * time:.3f},{b:.6f},{c * force:.5f}" for a, b, c in zip(T, SPEED, FORCE, strict=True)]
    path.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def notes(record, its_rig, words):
    """Those of the notes that hold these words."""
    return [note for note in ss.measure(record, its_rig).attrs["notes"] if words in note]


def test_a_row_of_units_that_contradicts_the_rig_is_refused_with_the_fix(tmp_path):
    path = written(tmp_path / "r.csv", "t,v,F\ns,m/s,mN\n", force=1e3)
    with pytest.raises(ss.InputError, match=r"'F' is in mN and the rig says N; write unit = \"mN\" for force"):
        ss.measure(path, rig(force="N"))
    assert ss.measure(path, rig(force="mN")).attrs["force"] == pytest.approx(14, abs=1)
    path = written(tmp_path / "r.csv", "t,v,F\n[ms],[m/s],[N]\n", time=1e3)
    with pytest.raises(ss.InputError, match="'t' is in ms and the rig says s"):
        ss.measure(path, rig(time="s"))
    spring = dict(instrument="spring_force", column="F", stiffness=1e3, mass=1, drive_velocity=0.1, unit="kN")
    with pytest.raises(ss.InputError, match="'F' is in N and the rig says kN"):
        ss.measure(path, spring | {"time_unit": "ms"})


def test_a_row_of_units_counts_where_the_rig_gives_none_and_that_is_said(tmp_path):
    path = written(tmp_path / "r.csv", "t,v,F\ns,m/s,mN\n", force=1e3)
    assert ss.measure(path, rig()).attrs["force"] == pytest.approx(14, abs=1)
    assert notes(path, rig(), "column 'F' was read in mN, as the record says; the rig gives no unit for force")
    assert not notes(path, rig(), "column 't' was read")
    path = written(tmp_path / "r.csv", "t,v,F\ns,m/s,V\n")
    assert notes(path, rig(), "V is none that is known, so give the unit of that column in the rig")
