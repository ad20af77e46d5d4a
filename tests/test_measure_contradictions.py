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
    spring = {
        "instrument": "spring_force",
        "column": "F",
        "stiffness": 1e3,
        "mass": 1,
        "drive_velocity": 0.1,
        "unit": "kN",
    }
    with pytest.raises(ss.InputError, match="'F' is in N and the rig says kN"):
        ss.measure(path, spring | {"time_unit": "ms"})


def test_a_row_of_units_counts_where_the_rig_gives_none_and_that_is_said(tmp_path):
    path = written(tmp_path / "r.csv", "t,v,F\ns,m/s,mN\n", force=1e3)
    assert ss.measure(path, rig()).attrs["force"] == pytest.approx(14, abs=1)
    assert notes(path, rig(), "column 'F' was read in mN, as the record says; the rig gives no unit for force")
    assert not notes(path, rig(), "column 't' was read")
    path = written(tmp_path / "r.csv", "t,v,F\ns,m/s,V\n")
    assert notes(path, rig(), "V is none that is known, so give the unit of that column in the rig")


@pytest.mark.slow
def test_a_record_that_is_given_twice_counts_once(tmp_path):
    path = written(tmp_path / "r.csv", "t,v,F\n")
    other = written(tmp_path / "copy.csv", "t,v,F\n")
    once = ss.measure(path, rig())
    twice = ss.measure([path, other], rig())
    assert twice.attrs["force"] == once.attrs["force"]
    assert "copy.csv holds the same samples: they count once" in twice.attrs["notes"][0]
    slider = ss.Oscillator(0.05, 0.2, ss.laws.StaticKinetic(1.0, 0.6))
    t = np.arange(0, 200, 0.05)
    x = ss.simulate(slider, 200.0).at(t)[0] + 1e-4 * np.random.default_rng(1).standard_normal(t.size)
    friction, again = (ss.measure({"t": t, "x": x}, ss.measurement.Rig.of(slider)) for _ in range(2))
    one, two = ss.identify(friction, law="StaticKinetic"), ss.identify([friction, again], law="StaticKinetic")
    np.testing.assert_array_equal(one.parameters["high"], two.parameters["high"])
    assert any("record 2 holds the same samples: they count once" in note for note in two.notes)


def arrays(**changed):
    return {"t": T, "v": SPEED, "F": FORCE} | changed


def test_isolated_spikes_of_a_force_are_left_out_and_counted():
    random = np.random.default_rng(2)
    spikes = random.random(T.size) < 0.005
    spoilt = np.where(spikes, FORCE + 150 * np.sign(random.standard_normal(T.size)), FORCE)
    found = ss.measure(arrays(F=spoilt), rig())
    assert any(f"{spikes.sum()} isolated impulses of the force" in note for note in found.attrs["notes"])
    assert np.abs(found["force"]).max() < 20
    # What belongs to friction stays: peaks where the slip turns, and noise.
    stribeck = FORCE + 6 * np.sign(SPEED) * np.exp(-np.abs(SPEED) / 0.002)
    for force in (FORCE, stribeck):
        assert not notes(arrays(F=force), rig(), "isolated impulses")


def test_a_speed_without_its_sign_is_refused():
    with pytest.raises(ss.InputError, match="never does: it seems to be recorded without its sign"):
        ss.measure(arrays(v=np.abs(SPEED)), rig())
    # One way, with a zero of the force in the midst of its range: nothing is wrong with the sign of the speed.
    speed = 0.1 + 0.09 * np.sin(2 * np.pi * 0.3 * T)
    for v, force in ((speed, 40 * (speed - 0.1)), (np.abs(SPEED), np.abs(FORCE)), (SPEED, FORCE)):
        assert not notes(arrays(v=v, F=force), rig(), "sign")


def test_a_force_without_its_sign_is_named():
    assert notes(arrays(F=np.abs(FORCE)), rig(), "as a force recorded without its sign is")
    assert not notes(arrays(F=FORCE + 40), rig(), "without its sign")
    asymmetric = np.where(SPEED > 0, FORCE, 0.6 * FORCE)
    assert not notes(arrays(F=asymmetric), rig(), "without its sign")


@pytest.mark.parametrize(("mass", "stiffness", "speed", "short"), [(1.2, 600, 0.05, False), (1200, 0.6, 50, True)])
def test_a_record_of_less_than_a_free_period_shows_no_steady_slip(mass, stiffness, speed, short) -> None:
    law = ss.laws.StaticKinetic(break_away=6.0, kinetic=4.0)
    orbit = ss.simulate(ss.Oscillator(mass=1.2, stiffness=600, damping=0.5, drive_velocity=0.05, law=law), 10)
    t = np.arange(0, 3, 0.002)
    x = orbit.to_xarray(5 + t)["x"].to_numpy() + 1e-5 * np.random.default_rng(0).standard_normal(t.size)
    rig = {"instrument": "spring_force", "column": "f", "unit": "N"}
    rig |= {"mass": mass, "stiffness": stiffness, "drive_velocity": speed}
    friction = ss.measure({"t": t, "f": 600 * x}, rig)
    assert friction.attrs["regime"] == ("unknown" if short else "stick_slip")
    words = "the record of 3 s is 1.1 % of the free period of 281 s of this rig"
    assert (words in " ".join(friction.attrs["notes"])) == short
