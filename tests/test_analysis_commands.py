"""`stickslip sweep` and `stickslip basins`: results, pictures, refusals; and what they draw."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
from stickslip.cli.main import main
from stickslip.dynamics import diagrams
from stickslip.show import REGIME_COLOURS, orbit_diagram_plot
from stickslip.show.diagram import alike_everywhere
from stickslip.show.maps import _basin_colours

# A belt whose friction first falls and then rises with speed: stick-slip and stable slip coexist.
FALLING = ss.laws.PiecewiseLinear(nodes=[(0.0, 1.0), (1.0, 0.6), (2.0, 0.8)], break_away=1.0)
MASS = ss.Oscillator(damping=0.0, drive_velocity=1.2, law=FALLING)


@pytest.fixture
def document(tmp_path):
    path = tmp_path / "system.toml"
    path.write_text(MASS.to_toml())
    return str(path)


def test_a_sweep_both_ways_shows_what_coexists(document, tmp_path, capsys):
    store, picture = tmp_path / "diagram.zarr", tmp_path / "diagram.png"
    command = ["sweep", document, "--over", "drive_velocity=0.8:1.6:17", "--direction", "up", "--direction", "down"]
    assert main([*command, "-o", str(store), "--plot", str(picture), "--transient", "60", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["runs"] == 34
    assert set(said["regimes"]) == {"stick_slip", "stable_slip"}
    diagram = xr.open_zarr(store, chunks=None)
    differ = (diagram["regime"].sel(direction="up") != diagram["regime"].sel(direction="down")).to_numpy()
    assert 3 <= differ.sum() < 17
    assert picture.stat().st_size > 10_000
    drawn = np.concatenate([line.get_ydata() for line in orbit_diagram_plot(diagram, quantity="amplitude").lines])
    shown = np.where(differ, diagram["amplitude"], diagram["amplitude"].sel(direction="up"))
    np.testing.assert_allclose(np.unique(drawn), np.unique(shown))


def test_a_map_and_its_basins_from_the_command_line(document, tmp_path, capsys):
    over = ["--over", "drive_velocity=0.8:1.6:5", "--over", "damping=0,0.05,0.1"]
    assert main(["sweep", document, *over, "--transient", "50", "--plot", str(tmp_path / "map.png")]) == 0
    assert "stable slip" in capsys.readouterr().out
    starts = ["--x", "-1:2:7", "--v", "-1:2:7"]
    assert main(["basins", document, *starts, "--transient", "50", "--json", "--plot", str(tmp_path / "b.png")]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["starts"] == 49
    assert sum(row["fraction"] for row in said["attractors"]) == 1
    assert {row["regime"] for row in said["attractors"]} == {"stick_slip", "stable_slip"}


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--over", "drive_velocty=0:1:5"], "did you mean 'drive_velocity'"),
        (["--over", "damping=0:1"], "expected NAME=LO:HI:N"),
        (["--over", "damping=1:0:5"], "increasing order"),
        (["--over", "damping=0:1:5", "--over", "damping=0:1:5"], "named once"),
        (["--over", "damping=0:1:5", "--over", "mass=1:2:5", "--direction", "up"], "only a diagram over one parameter"),
        (["--over", "damping=0:1:5", "--quantity", "amplitude"], "only the picture (--plot) of a diagram"),
        (["--over", "law.nodes=0:1:5"], "not a number of the system"),
        (["--over", "mass=-1:2:5"], "mass must be greater than 0"),
        (["--over", "damping=0:1:5", "--workers", "0"], "workers must be"),
    ],
)
def test_refusals_are_one_sentence(document, capsys, options, sentence):
    assert main(["sweep", document, *options]) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1


def test_basins_of_a_smooth_law_run_each_motion_once():
    # What makes them as fast as a loop over simulate: the same events, from the first to the end of the window.
    system = ss.Oscillator(0.1, 1.4, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5))
    found = ss.basins(system, x=[-1.0, 1.0], v=[0.0, 0.5], transient=56, window=32, workers=1)
    alone = [[len(ss.simulate(system, 88 * 2 * np.pi, x, v).events) for v in (0.0, 0.5)] for x in (-1.0, 1.0)]
    assert found["events"].values.tolist() == alone
    assert max(map(max, alone)) > 100


def test_basins_have_labels_and_fractions_of_known_size():
    # Without damping, on the piece of slope +0.2 between w = 1 and 2 the steady slip at w = 1.2 is stable: starts near it
    # stay. At (x, v) = (f(1.2), 0) = (0.64, 0) the motion rests exactly.
    result = ss.basins(MASS, x=np.linspace(0.54, 0.74, 11), v=np.linspace(-0.1, 0.1, 5), transient=80)
    assert result["label"].dims == ("x", "v")
    assert result["attractor_regime"].values.tolist() == ["stable_slip"]
    np.testing.assert_allclose(result["attractor_x_mean"], 0.64, atol=1e-3)
    assert result["fraction"].values.tolist() == [1.0]


def test_basins_call_a_transient_undecided_until_more_is_asked_for(document, capsys):
    swing = ss.Oscillator(0.001, 0.0, ss.laws.Coulomb(0.0), forcing=ss.Harmonic(0.3, 0.7))
    starts = {"x": [1.0], "v": [0.0], "transient": 20, "window": 8}
    early = ss.basins(swing, **starts)
    assert early["attractor_recurrence"].values.tolist() == ["undecided"]
    labels = [item.get_text() for item in ss.show.basins_plot(early).get_legend().get_texts()]
    assert labels == ["reversing slip, undecided (100 %)"]
    wild = ss.Oscillator(0.0, 0.1, ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.8, 1.3))
    told = ss.basins(wild, **starts, decide=500)
    assert told["attractor_recurrence"].values.tolist() == ["chaotic"]
    assert main(["basins", document, "--x", "1:1.5:2", "--v", "0:0.1:1", "--transient", "1", "--window", "2"]) == 0
    assert "does not repeat" not in capsys.readouterr().out


def test_basins_tell_motions_of_one_regime_apart():
    # Coulomb's oscillator at rest sticks anywhere in |x| < f: one attractor, however many places.
    rest = ss.Oscillator(damping=0.0, drive_velocity=0.0, law=ss.laws.Coulomb(0.5))
    result = ss.basins(rest, x=np.linspace(-3.1, 3.2, 9), v=[0.0, 1.0], transient=20, window=4)
    assert result["attractor_regime"].values.tolist() == ["at_rest"]
    # Without friction each start has its own orbit.
    free = ss.Oscillator(damping=0.0, drive_velocity=0.0, law=ss.laws.Coulomb(0.0))
    result = ss.basins(free, x=[1.0, 2.0, 3.0], v=[0.0], transient=20, window=8)
    assert sorted(result["label"].values.ravel().tolist()) == [0, 1, 2]


def test_systems_of_masses_go_through_the_same_calls():
    pair = ss.chain(2, ss.laws.StaticKinetic(1.0, 0.6), 0.2)
    diagram = ss.orbit_diagram(
        pair, "contacts.0.drive_velocity", [0.1, 0.2], direction=("up", "down"), periods=12, keep=6, workers=1
    )
    assert (diagram["regime"] == "stick_slip").all()
    assert diagram["x_end"].dims == ("direction", "contacts.0.drive_velocity", "mass")
    result = ss.basins(pair, x=[0.0, 0.5], v=[0.2], mass=1, transient=6, window=6, workers=1)
    assert result["label"].shape == (2, 1)


@pytest.mark.parametrize(
    ("law", "parameter"),
    [
        (ss.laws.ExponentialStribeck(1.0, 0.6, 0.1), "law.scale"),
        (ss.laws.LuGre(100.0, 2.0, 0.1, kinetic=0.6, break_away=1.0, scale=0.1), "drive_velocity"),
    ],
    ids=["smooth", "with a state"],
)
def test_laws_without_a_closed_form_go_through_the_same_calls(law, parameter):
    system = ss.Oscillator(damping=0.1, drive_velocity=0.1, law=law)
    diagram = ss.orbit_diagram(system, parameter, [0.1, 0.12], periods=10, keep=5)
    assert diagram["regime"].values.tolist() == ["stick_slip", "stick_slip"]
    assert ss.section(system, t_end=60).sizes["point"] >= 2


@pytest.mark.parametrize("chunk", [64, 1], ids=["within a part", "from part to part"])
def test_a_sweep_hands_on_the_internal_state_of_a_law(chunk, monkeypatch):
    law = ss.laws.LuGre(100.0, 2.0, 0.1, kinetic=0.6, break_away=1.0, scale=0.1)
    system, speeds = ss.Oscillator(damping=0.1, drive_velocity=0.1, law=law), [0.1, 0.12]
    monkeypatch.setattr(diagrams, "CHUNK", chunk)
    swept = ss.orbit_diagram(system, "drive_velocity", speeds, direction="up", periods=5, keep=2, workers=1)
    t_end = 5 * system.natural_period
    first = ss.integrate(replace(system, drive_velocity=speeds[0]), t_end)
    x, v, state = first.variables(np.array([t_end]))[0]
    x, v = first.at(t_end)
    second = ss.integrate(replace(system, drive_velocity=speeds[1]), t_end, x, v, state=[state])
    assert swept["x_end"].values == pytest.approx([x, second.at(t_end)[0]], rel=1e-9)
    # Without the state the motion begins with a jerk.
    fresh = ss.integrate(replace(system, drive_velocity=speeds[1]), t_end, x, v)
    assert abs(fresh.at(t_end)[0] - second.at(t_end)[0]) > 1e-3


def test_pictures_say_what_they_show():
    forced = ss.Oscillator(
        damping=0.05, drive_velocity=0.3, law=ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.5, 0.7)
    )
    chart = ss.regime_map(
        forced, {"forcing.amplitude": [0.1, 1.0, 1.8], "forcing.frequency": [0.6, 1.0]}, transient=40, window=16
    )
    for quantity in ("regime", "period", "amplitude"):
        ax = ss.show.regime_map_plot(chart, quantity=quantity)
        ax.figure.canvas.draw()
        assert ax.get_xlabel() == "forcing amplitude u₀ (dimensionless)"
    legend = ss.show.regime_map_plot(chart).get_legend()
    shown = {text.get_text() for text in legend.get_texts()}
    assert shown == {
        {"stick_slip": "stick-slip", "reversing_slip": "reversing slip"}.get(word, word.replace("_", " "))
        for word in chart["regime"].values.ravel()
    }
    points = ss.section(forced, "release", t_end=300)
    ax = ss.show.section_plot(points, across="phase", up="x")
    assert ax.get_title() == "at every release"
    ax = ss.show.return_map_plot(ss.return_map(points, "phase"))
    assert ax.get_ylabel() == "phase θ of the forcing, next return (rad)"
    ax = ss.show.return_map_plot(ss.release_map(forced, np.linspace(0, 6, 20)))
    assert len(ax.lines[1].get_xdata()) == 20
    with pytest.raises(ss.InputError, match="quantity must be"):
        ss.show.regime_map_plot(chart, quantity="colour")


WILD = ss.Oscillator(0.0, 0.1, ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.8, 1.3))


def test_a_sweep_lists_where_motions_repeat_and_where_they_are_chaotic(tmp_path, capsys):
    path = tmp_path / "system.toml"
    path.write_text(WILD.to_toml())
    asked = ["sweep", str(path), "--over", "forcing.frequency=1.3,1.31,3.0", "--decide", "500"]
    assert main(asked) == 0
    said = capsys.readouterr().out
    assert [" ".join(line.split()) for line in said.splitlines()[-2:]] == ["1.3 … 1.31 chaotic", "3 … 3 period 1"]
    assert main([*asked, "--json"]) == 0
    chaotic, periodic = json.loads(capsys.readouterr().out)["windows"]
    assert (chaotic["from"], chaotic["to"], chaotic["recurrence"]) == (1.3, 1.31, "chaotic")
    assert (periodic["from"], periodic["recurrence"], periodic["period"]) == (3.0, "periodic", 1)


def test_motions_that_may_still_change_are_counted_and_hatched(tmp_path, capsys):
    path = tmp_path / "system.toml"
    path.write_text(WILD.to_toml())
    assert main(["sweep", str(path), "--over", "forcing.frequency=1.3,3.0"]) == 0
    assert "undecided: 1 of 2 motions did not repeat and may still change" in capsys.readouterr().out
    diagram = ss.orbit_diagram(WILD, "forcing.frequency", [1.3, 3.0])
    legend = ss.show.orbit_diagram_plot(diagram).get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["undecided (1 of 2 runs)"]


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        (["sweep", "--over", "speed=1:2:3"], "stickslip: sweep: the system has no number 'speed'"),
        (["basins", "--x", "0:1:3", "--v", "0:1"], "--v: expected LO:HI:N or A,B,C, such as -1:1:60, got '0:1'"),
        (["basins", "--x", "0:1:3", "--v", "0:1:3", "--mass", "1"], "mass must be a whole number from 0 to 0, got 1"),
        (["continue", "--over", "speed=1:2"], "stickslip: continue: the system has no number 'speed'"),
    ],
)
def test_refusals_speak_of_the_command_and_its_options(document, capsys, asked, sentence):
    assert main([asked[0], document, *asked[1:]]) == 2
    assert sentence in capsys.readouterr().err


@pytest.mark.slow
def test_a_torus_is_one_attractor_and_not_drawn_as_several():
    """Where the forcing is weak a torus attracts everything; in a finite window each run on it visits other points."""
    system = ss.Oscillator(0.05, 0.3, ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.1, 1.0))
    ways = ("up", "down", "fresh")
    diagram = ss.orbit_diagram(system, "forcing.frequency", np.linspace(1.8625, 1.975, 4), direction=ways)
    assert (diagram["period"].to_numpy() == 0).all()
    assert alike_everywhere(diagram, "forcing.frequency").all()
    # Independent of the rule: two long runs from apart cover the same curve.
    torus = replace(system, forcing=ss.Harmonic(0.1, 1.9))
    one, other = (ss.section(torus, t_end=20000, transient=0.2, x0=x0) for x0 in (0.0, 1.0))
    gap = np.hypot(*(one[name].to_numpy()[:, None] - other[name].to_numpy() for name in ("x", "v")))
    assert gap.min(axis=1).max() < 0.02
    # Two periodic motions that coexist stay apart: forced three times as strongly, beyond the fold at 1.235.
    strong = replace(system, forcing=ss.Harmonic(0.3, 1.0))
    diagram = ss.orbit_diagram(strong, "forcing.frequency", np.arange(1.1, 1.7, 0.05), direction=("up", "down"))
    apart = diagram["forcing.frequency"].to_numpy()[~alike_everywhere(diagram, "forcing.frequency")]
    assert ((apart > 1.2) & (apart < 1.7)).all()
    assert len(apart) > 5


def test_a_motion_that_repeats_in_one_window_and_not_in_another_is_one_attractor():
    system = ss.paper.oscillator(0.3, ss.Harmonic(0.02, 1.8))
    starts = {"x": np.linspace(-1, 2, 6), "v": np.linspace(-1, 1, 6)}
    # After 1000 periods all of them repeat after 4 returns; before that some are on their way.
    assert set(ss.basins(system, **starts, transient=1000)["period"].to_numpy().ravel()) == {4}
    early = ss.basins(system, **starts, transient=600)
    assert set(early["period"].to_numpy().ravel()) == {0, 4}
    assert early["attractor_period"].to_numpy().tolist() == [4]
    assert early["fraction"].to_numpy().tolist() == [1.0]


@pytest.mark.parametrize(("over", "units"), [("drive_velocity", "dimensionless"), ("mass", "SI")])
def test_a_map_and_a_diagram_over_a_mass_are_not_dimensionless(over, units):
    system, values = ss.paper.oscillator(0.3), [0.9, 1.1]
    assert ss.orbit_diagram(system, over, values, periods=3, keep=1).attrs["units"] == units
    assert ss.regime_map(system, {over: values}, transient=2, window=1).attrs["units"] == units


def test_a_basin_has_the_colour_of_its_regime_and_no_two_have_one():
    regimes = ["stable_slip", "stick_slip", "stick_slip"]
    colours = _basin_colours(regimes)
    assert colours[:2] == [REGIME_COLOURS[regime] for regime in regimes[:2]]
    for several in (regimes, ["stick_slip"] * 8, list(REGIME_COLOURS)):
        assert len(set(_basin_colours(several))) == len(several)
