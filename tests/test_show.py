"""Pictures are drawn where they should be, with what they should show, without a warning and without a window."""

import re
import subprocess
import sys
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest

import stickslip as ss
from stickslip import show
from stickslip.dynamics import orbit_diagram, sign_changes

REGIMES = {"stick_slip": 0.20, "almost_harmonic": 0.30, "stable_slip": 0.45}

#: The paper's law with one f_s(0), whatever the force rate.
PAPER = ss.paper.calibration.CALIBRATIONS["one f_s(0)"]


@pytest.fixture(scope="module", params=REGIMES.values(), ids=list(REGIMES))
def orbit(request):
    return ss.simulate(PAPER.oscillator(request.param), 100)


@pytest.fixture(scope="module")
def diagram():
    return orbit_diagram(
        PAPER.oscillator(0.3), "drive_velocity", [0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5], periods=80
    )


def drawn(ax) -> None:
    ax.figure.canvas.draw()


def names(ax) -> list[str]:
    return [line.get_label() for line in ax.lines if not line.get_label().startswith("_")]


@pytest.mark.parametrize("picture", [show.phase_plane, show.friction_loop])
def test_a_picture_makes_its_own_figure_or_draws_where_told(picture, orbit):
    own = picture(orbit)
    drawn(own)
    assert own.get_xlabel().endswith("(dimensionless)")
    assert own.get_ylabel().endswith("(dimensionless)")
    assert not own.spines["top"].get_visible()
    _, mine = plt.subplots()
    assert picture(orbit, mine) is mine


def test_friction_loop_is_coloured_by_branch_and_higher_while_w_grows():
    ax = show.friction_loop(ss.simulate(PAPER.oscillator(0.30), 100))
    lines = {line.get_label(): line.get_xydata() for line in ax.lines}
    assert {"upper", "common", "lower", "climb"} <= set(lines)
    assert "stick" not in lines
    upper, lower = (lines[name][np.isfinite(lines[name][:, 0])] for name in ("upper", "lower"))
    grid = np.linspace(0.21, 0.32, 20)
    over = [np.interp(grid, *line[np.argsort(line[:, 0])].T) for line in (upper, lower)]
    assert (over[0] > over[1]).all()
    assert upper[:, 1].max() == pytest.approx(1.084, abs=1e-12)


def test_friction_loop_of_stick_slip_has_the_stick_at_zero_and_the_reaction_of_the_spring():
    orbit = ss.simulate(PAPER.oscillator(0.20), 100)
    ax = show.friction_loop(orbit)
    stick = next(line for line in ax.lines if line.get_label() == "stick").get_xydata()
    stick = stick[np.isfinite(stick[:, 0])]
    assert (stick[:, 0] == 0).all()
    released = orbit.events[orbit.events["kind"] == "release"]["force"].iloc[-1]
    assert stick[:, 1].max() == pytest.approx(released, abs=1e-4)


def test_friction_loop_of_stable_slip_is_a_dot():
    assert names(show.friction_loop(ss.simulate(PAPER.oscillator(0.45), 100))) == ["steady slip"]


def test_friction_loop_of_a_law_without_branches_is_coloured_by_the_sense_of_w():
    law = ss.laws.StaticKinetic(1.0, 0.6)
    orbit = ss.simulate(ss.Oscillator(damping=0.0, drive_velocity=0.2, law=law), 100)
    assert names(show.friction_loop(orbit)) == ["stick", "|w| grows", "|w| falls"]


@pytest.mark.parametrize(
    "law",
    [
        ss.laws.ExponentialStribeck(1.0, 0.5, 0.4),
        ss.laws.smooth_from_function(lambda w: 0.3 + 0.7 * np.exp(-w / 0.35) + 0.1 * w**2, w_max=4.0, break_away=1.15),
        ss.laws.Asymmetric(ss.laws.ExponentialStribeck(1.0, 0.5, 0.4), ss.laws.Coulomb(0.8)),
    ],
)
def test_friction_loop_draws_the_force_of_the_law_at_each_slip_velocity(law):
    orbit = ss.simulate(ss.Oscillator(damping=0.1, drive_velocity=0.5, law=law), 60)
    lines = {line.get_label(): line.get_xydata() for line in show.friction_loop(orbit).lines}
    slip = np.concatenate([lines["|w| grows"], lines["|w| falls"]])
    slip = slip[slip[:, 0] > 1e-6]
    assert np.ptp(slip[:, 0]) > 0.5
    np.testing.assert_allclose(slip[:, 1], law.kinetic_force(slip[:, 0]), atol=1e-9)


def test_friction_loop_with_forcing_joins_the_friction_of_the_orbit():
    forcing = ss.Harmonic(0.05, 0.7)
    orbit = ss.simulate(PAPER.oscillator(0.15, forcing), 200)
    ax = show.friction_loop(orbit)
    stick = next(line for line in ax.lines if line.get_label() == "stick").get_xydata()
    motion = orbit.to_xarray(np.linspace(100, 200, 20_001))
    force = motion["force"].to_numpy()[motion["stuck"].to_numpy()]
    assert np.nanmax(stick[:, 1]) == pytest.approx(force.max(), abs=1e-2)
    assert np.nanmin(stick[:, 1]) == pytest.approx(force.min(), abs=1e-2)


def test_time_series_has_three_panels_with_shaded_sticks():
    orbit = ss.simulate(PAPER.oscillator(0.20), 60)
    panels = show.time_series(orbit)
    drawn(panels[0])
    sticks = int((orbit.segments["direction"] == 0).sum())
    assert len(panels) == 3
    assert all(len(panel.collections[0].get_paths()) == sticks for panel in panels)
    _, one = plt.subplots()
    assert show.time_series(orbit, one, start=10, stop=20) == [one] * 3
    assert one.get_xlim() == (10, 20)


def test_each_mass_of_a_system_is_drawn_in_a_colour_of_its_own():
    law = ss.laws.StaticKinetic(1.0, 0.6)
    chain = ss.System([1, 1], [[2.2, -1.2], [-1.2, 2.2]], 0.1, [ss.Contact(0, law, 0.1), ss.Contact(1, law, 0.1)])
    orbit = ss.simulate(chain, 60, x0=[0.1, -0.2])
    late = orbit.to_xarray([60.0])
    ax = show.phase_plane(orbit)
    assert [line.get_label() for line in ax.get_lines() if line.get_label()[0] != "_"] == ["mass 0", "mass 1"]
    panels = show.time_series(orbit, start=30)
    for panel, name in zip(panels, ("x", "v", "force"), strict=True):
        drawn = [line.get_ydata()[-1] for line in panel.get_lines()[::2]]  # the others are the sticks
        np.testing.assert_allclose(drawn, late[name][0])


def test_an_orbit_of_a_law_with_an_internal_state_is_drawn():
    orbit = ss.simulate(ss.Oscillator(0.1, 0.2, ss.laws.LuGre.example()), 60)
    assert max(np.size(line.get_ydata()) for line in show.phase_plane(orbit).get_lines()) > 100
    assert show.time_series(orbit)[2].get_lines()[0].get_ydata()[-1] == pytest.approx(
        float(orbit.to_xarray([60.0])["force"][0])
    )


def test_si_systems_are_labelled_with_units():
    law = ss.laws.Coulomb(0.5)
    orbit = ss.simulate(ss.Oscillator(damping=0.1, drive_velocity=1e-3, law=law, mass=0.4, stiffness=168.0), 5)
    assert show.phase_plane(orbit).get_xlabel() == "position x (m)"
    assert show.friction_loop(orbit).get_ylabel() == "friction F (N)"
    assert show.phase_plane(orbit, units="dimensionless").get_xlabel() == "position x (dimensionless)"


@pytest.mark.parametrize(
    "law",
    [
        ss.laws.Coulomb(1.0),
        ss.laws.StaticKinetic(1.0, 0.6),
        ss.laws.PiecewiseLinear(nodes=[(0, 1), (0.2, 0.6), (0.5, 0.7)], break_away=1.1),
        ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.4),
        ss.laws.BogaczRyczek(),
    ],
    ids=lambda law: type(law).__name__,
)
def test_every_law_is_drawn_with_its_break_away(law):
    ax = show.law_plot(law)
    drawn(ax)
    dot = next(line for line in ax.lines if line.get_label() == "break-away, no rest")
    assert dot.get_ydata()[0] == law.break_away_force(0.0)
    grows = law.break_away_force(1e9) > law.break_away_force(0.0)
    assert ("break-away, long rest" in names(ax)) == grows
    assert ("ẇ < 0" in names(ax)) == isinstance(law, ss.laws.BogaczRyczek)
    drawn(show.break_away_plot(law))


def test_a_fitted_law_is_drawn_with_the_band_of_its_covariance():
    # The normal 95 % interval reaches 1.96 standard deviations either way; the draws tell its ends to 0.2 of one.
    names, errors = ["break_away", "kinetic"], np.array([0.05, 0.02])
    law = ss.laws.StaticKinetic(1.0, 0.6).with_covariance(pd.DataFrame(np.diag(errors**2), index=names, columns=names))
    (kinetic,), (static,) = show.law_plot(law).collections, show.break_away_plot(law).collections
    for shade, middle, error in ((kinetic, 0.6, 0.02), (static, 1.0, 0.05)):
        low, high = shade.get_paths()[0].vertices[:, 1].min(), shade.get_paths()[0].vertices[:, 1].max()
        assert (low, high) == pytest.approx((middle - 1.96 * error, middle + 1.96 * error), abs=0.2 * error)
    assert not show.law_plot(replace(law, kinetic=0.5)).collections


def test_orbit_diagram_has_the_regimes_of_the_paper(diagram):
    assert list(dict.fromkeys(diagram["regime"].values)) == ["stick_slip", "almost_harmonic", "stable_slip"]
    assert diagram["turning_x"].dims == ("drive_velocity", "point")
    row = diagram.sel(drive_velocity=0.3)
    assert float(row["amplitude"]) == pytest.approx(0.1722900911, abs=1e-9)
    assert float(row["w_min"]) == pytest.approx(0.18105080863, abs=1e-9)
    assert float(row["turning_slip_velocity"].min()) == float(row["w_min"])
    assert int(np.isfinite(diagram["turning_x"].sel(drive_velocity=0.5)).sum()) == 1
    assert float(diagram["w_min"].sel(drive_velocity=0.2)) == 0.0


@pytest.mark.parametrize("quantity", ["x", "slip_velocity"])
def test_orbit_diagram_is_drawn_with_named_regimes(diagram, quantity):
    ax = show.orbit_diagram_plot(diagram, quantity=quantity)
    drawn(ax)
    assert [text.get_text() for text in ax.texts] == ["stick-slip", "almost-harmonic", "stable slip"]


def test_a_diagram_of_one_direction_is_drawn_the_same_in_a_list(diagram):
    listed = show.orbit_diagram_plot(diagram.expand_dims(direction=["up"]))
    plain = show.orbit_diagram_plot(diagram)
    assert [line.get_color() for line in listed.lines] == [line.get_color() for line in plain.lines]
    assert listed.get_legend() is None


@pytest.mark.parametrize("directions", [["up"], ["up", "down"]])
def test_unfinished_values_of_a_diagram_are_marked_below_the_points_and_named(diagram, directions):
    both = diagram.expand_dims(direction=directions).copy(deep=True)
    both["regime"][0, 3:5] = "unfinished"
    both["turning_x"][0, 3:5] = np.nan
    ax = show.orbit_diagram_plot(both)
    drawn(ax)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert f"unfinished (2 of {len(directions) * diagram.sizes['drive_velocity']} runs)" in texts
    (band,) = (patch for patch in ax.patches if patch.get_label().startswith("unfinished"))
    values = diagram["drive_velocity"].to_numpy()
    ends, (_, top) = band.get_extents().transformed(ax.transData.inverted()).get_points().T
    assert top < np.nanmin(both["turning_x"].to_numpy())
    assert ends == pytest.approx([(values[2] + values[3]) / 2, (values[4] + values[5]) / 2])


def test_progress_is_told_after_each_part():
    told = []
    orbit_diagram(
        PAPER.oscillator(0.3), "damping", [0.2, 0.3], periods=30, progress=lambda done, n: told.append((done, n))
    )
    assert told == [(2, 2)]


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: orbit_diagram(PAPER.oscillator(0.3), "drive_velocty", [0.3]), "did you mean 'drive_velocity'"),
        (lambda: orbit_diagram(PAPER.oscillator(0.3), "damping", [0.3, 0.2]), "increasing order"),
        (lambda: orbit_diagram(PAPER.oscillator(0.3), "damping", [0.3], keep=0), "keep must be"),
        (lambda: show.time_series(ss.simulate(PAPER.oscillator(0.3), 5), start=6), "start and stop"),
        (lambda: show.phase_plane(ss.simulate(PAPER.oscillator(0.3), 5), transient=1), "transient must lie"),
        (lambda: show.law_plot(ss.laws.Coulomb(1.0), units="cgs"), "units must be"),
    ],
)
def test_misuse_is_one_sentence(refused, call, sentence):
    refused(re.escape(sentence), call)


def test_sign_changes_cross_jumps_and_rests_at_zero():
    step = sign_changes(lambda t: np.where(t < np.pi, -1.0, np.where(t < 4, 0.0, 1.0)), np.linspace(0, 5, 11))
    assert step == pytest.approx([np.pi], abs=1e-9)
    assert sign_changes(np.zeros_like, np.linspace(0, 1, 5)).size == 0


def test_the_package_without_pictures_imports_no_matplotlib():
    code = "import sys, stickslip as ss; ss.paper.oscillator(0.3); sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
