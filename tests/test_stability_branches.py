"""Critical velocities, branches and exponents against published numbers and independent computations."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest
from evidence import script
from scipy.optimize import brentq

import stickslip as ss
from stickslip.cli.main import main

den_hartog = script("stability").den_hartog


def kinds(result: object) -> dict[str, float]:
    return {item.kind: item.parameter for item in result.special_points}  # type: ignore[attr-defined]


@pytest.mark.slow
def test_critical_velocities_of_the_exponential_law() -> None:
    # Validation case S7: closed form of the Hopf speed, v0 ln(μ_d (μ_sd − 1)/(2 ξ v0)).
    found = ss.critical_velocities(ss.Oscillator(0.1, 1.0, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5)))
    assert found["hopf"] == pytest.approx(0.5 * math.log(10.0), abs=1e-12)
    assert found.criticality == "subcritical"
    # Beyond it a run from stick-slip ends in steady slip, below it does not.
    for velocity, sticks in ((found["nonsmooth_fold"] - 1e-4, True), (found["nonsmooth_fold"] + 1e-4, False)):
        law = ss.laws.ExponentialStribeck(1.0, 0.5, 0.5)
        orbit = ss.simulate(ss.Oscillator(0.1, velocity, law), 2000.0)
        assert bool((orbit.events["t"] > 1900).any()) is sticks


@pytest.mark.parametrize(
    ("calibration", "bounds"),
    [("default", (0.2, 0.6)), pytest.param("one f_s(0)", (0.02, 0.6), marks=pytest.mark.slow)],
)
def test_critical_velocities_of_the_paper(calibration: str, bounds: tuple[float, float]) -> None:
    paper = ss.paper.calibration.CALIBRATIONS[calibration]
    found = ss.critical_velocities(paper.oscillator(0.3), bounds)
    # The cycle shrinks to a point where the line of corners, 3.41 s − 0.28, meets f_s(0, δ = s) (docs/paper-law.md).
    bears = paper.law.break_away_force
    lies = brentq(lambda s: bears(0.0, s) - 3.41 * s + 0.28, 0.3, 0.5, xtol=1e-15)
    assert found["nonsmooth_hopf"] == pytest.approx(lies, abs=1e-10)
    end = found["end_of_stick_slip"]
    assert end == pytest.approx(0.25, abs=0.01)
    # A stick-slip cycle exists just below its end and none just above.
    for velocity, sticks in ((end - 1e-6, True), (end + 1e-6, False)):
        orbit = ss.simulate(paper.oscillator(velocity), 12_000.0)
        assert bool((orbit.events["kind"][orbit.events["t"] > 11_900] == "release").any()) is sticks


def test_branches_can_be_saved_and_drawn() -> None:
    result = ss.continuation(den_hartog(0.7, 0.7), "law.kinetic", (0.65, 0.75), seeds=0)
    dataset = result.to_xarray()
    assert dataset["law.kinetic"].dims == ("branch", "point")
    assert "crossing_sliding" in dataset["special_kind"].to_numpy()
    ax = ss.show.branches_plot(result)
    assert ax.get_xlim() == (0.65, 0.75)
    assert "CS" in [text.get_text() for text in ax.texts]
    curve = ss.locus(result.special_points[0], ("law.kinetic", "forcing.frequency"), ((0.6, 0.8), (0.69, 0.71)))
    plane = ss.show.loci_plot([curve])
    assert plane.lines[0].get_xydata() == pytest.approx(curve.values)
    assert set(curve.to_xarray()) == {"law.kinetic", "forcing.frequency", "x_min", "x_max"}
    with pytest.raises(ss.InputError, match="no branch begins at a fold"):
        ss.switch_branch(result, dataclasses.replace(result.special_points[0], kind="fold", label=None))
    circle = ss.show.multipliers_plot(ss.periodic_orbit(den_hartog(0.7, 0.3)))
    assert len(circle.lines[1].get_xdata()) == 2  # type: ignore[arg-type]
    with pytest.raises(ss.InputError, match="as many as cycles, got 2 for 1"):
        ss.show.multipliers_plot([ss.periodic_orbit(den_hartog(0.7, 0.3))], values=[0.1, 0.2])


@pytest.mark.parametrize("guess", [(1.49, 0.0), (1.45, 0.05)])
def test_an_orbit_that_repels_is_found_from_a_state_near_it(guess: tuple[float, float]) -> None:
    """Disturbances of the slip cycle grow 3.6 times a period: in 30 periods a run from any guess is elsewhere."""
    cycle = ss.periodic_orbit(own_law(1.15), guess)
    assert not cycle.sticks
    assert cycle.stable is False
    assert 3 < cycle.largest < 4
    # The motion from there comes back.
    _, x, v = cycle.state
    assert ss.simulate(own_law(1.15), cycle.period, x, v).at(cycle.period) == pytest.approx((x, v), abs=1e-8)


def test_lyapunov_exponents_of_regular_motion_are_those_of_the_multipliers() -> None:
    cycle = ss.periodic_orbit(den_hartog(0.7, 0.3))
    spectrum = ss.lyapunov(den_hartog(0.7, 0.3), 2000.0)
    assert spectrum.exponents == pytest.approx(np.log(np.abs(cycle.multipliers)) / cycle.period, abs=2e-3)
    stuck = ss.lyapunov(den_hartog(0.5, 0.8), 1000.0)
    assert stuck.exponents[1] == -math.inf


@pytest.mark.slow
def test_lyapunov_exponent_of_chaotic_stick_slip_is_the_average_of_its_map() -> None:
    system = ss.Oscillator(0.0, 0.3, ss.laws.StaticKinetic(1.0, 0.4), forcing=ss.Harmonic(0.6, 2.0))
    spectrum = ss.lyapunov(system, 4000.0)
    assert spectrum.exponents[1] == -math.inf
    assert spectrum.exponents[0] == pytest.approx(_map_average(system), abs=0.02)
    # The two averages are of two motions: they part by no more than their errors say.
    assert spectrum.running[-1] == pytest.approx(spectrum.exponents)
    assert abs(spectrum.exponents[0] - _map_average(system)) < 4 * spectrum.errors[0] < 0.1
    assert np.isnan(spectrum.errors[1])
    ax = ss.show.lyapunov_plot(spectrum)
    assert [text.get_text().split(" ")[-1] for text in ax.get_legend().get_texts()][1] == "−∞"


def test_lyapunov_exponents_are_drawn_once_a_period() -> None:
    """Damping 0.3, forced: a periodic stick-slip whose averages swing within a period and hardly from one to the next."""
    belt = ss.Oscillator(0.1, 0.3, ss.laws.StaticKinetic(1.0, 0.4), forcing=ss.Harmonic(0.2, 1.0))
    spectrum = ss.lyapunov(belt, 400.0, transient=0.25)
    ax = ss.show.lyapunov_plot(spectrum)
    (curve,) = (line for line in ax.lines if "±" in str(line.get_label()))
    assert curve.get_xdata() == pytest.approx(2 * np.pi * np.arange(1, int(spectrum.t / (2 * np.pi)) + 1))
    late = curve.get_ydata()[10:]
    assert np.ptp(late) < 0.1 * np.ptp(spectrum.running[spectrum.times > 20 * np.pi, 0])
    handles, texts = ax.get_legend_handles_labels()
    (lost,) = (handle for handle, text in zip(handles, texts, strict=True) if text.endswith("−∞"))
    assert lost.get_linestyle() == "None"


def test_a_return_map_of_phases_ends_at_two_pi() -> None:
    belt = ss.Oscillator(0.0, 0.3, ss.laws.StaticKinetic(1.0, 0.4), forcing=ss.Harmonic(0.2, 2.0))
    ax = ss.show.return_map_plot(ss.release_map(belt, np.linspace(0.1, 6.2, 12)))
    ax.figure.canvas.draw()
    assert ax.get_xlim() == ax.get_ylim() == (0, 2 * np.pi)


def _map_average(system: ss.Oscillator) -> float:
    """⟨ln |φ′|⟩ over the mean return time of the map from release phase to release phase."""
    orbit = ss.simulate(system, 4000.0)
    events = orbit.events
    releases = events[(events["kind"] == "release") & (events["t"] > 400.0)].iloc[:1500]
    law, forcing = system.law, system.harmonics[0]
    total = 0.0
    step = 1e-7
    times = releases["t"].to_numpy()
    for t, after in itertools.pairwise(times):
        ends = []
        for shift in (-step, step):
            # A stick that breaks at t + shift: k x = F_s + forcing there; it is started a little before, stuck.
            begin = t + shift - 1e-3
            x = 1.0 + forcing.amplitude * math.cos(forcing.frequency * (t + shift)) - system.drive_velocity * 1e-3
            phase = forcing.frequency * begin
            moved = ss.Oscillator(0.0, system.drive_velocity, law, forcing=ss.Harmonic(0.6, 2.0, phase))
            later = ss.simulate(moved, (after - t) + 0.5, x0=x).events
            found = later[later["kind"] == "release"]["t"].to_numpy()
            ends.append(begin + found[1] if len(found) > 1 else math.nan)
        slope = (ends[1] - ends[0]) / (2 * step)
        total += math.log(abs(slope)) if math.isfinite(slope) and 1e-6 < abs(slope) < 1e4 else 0.0
    return total / float(times[-1] - times[0])


def test_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    system = tmp_path / "system.toml"
    system.write_text(den_hartog(0.7, 0.7).to_toml())
    output, plot = tmp_path / "branches.nc", tmp_path / "branches.png"
    over = ["--over", "law.kinetic=0.68:0.74"]
    assert main(["continue", str(system), *over, "-o", str(output), "--plot", str(plot), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["special_points"]
    assert found[0]["kind"] == "crossing_sliding"
    assert output.exists()
    assert plot.stat().st_size > 5000
    assert main(["continue", str(system), *over, "--and", "forcing.frequency=0.68:0.72", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["over"] == ["law.kinetic", "forcing.frequency"]
    # A Ω² = S on the boundary of Den Hartog's motion without stops.
    assert said["loci"][0]["kind"] == "crossing_sliding"
    values = said["loci"][0]["values"]
    # It leaves through a bound of either number.
    assert [max(row[0] for row in values), min(row[1] for row in values)] == [0.74, 0.68]
    assert main(["continue", str(system), *over, "--and", "forcing.frequency=0.8:0.9"]) == 2
    assert "must hold the value of the point" in capsys.readouterr().err
    assert main(["continue", str(system), "--over", "law.kinetic"]) == 2
    assert "NAME=LO:HI" in capsys.readouterr().err
    assert main(["critical", str(system)]) == 2
    assert "forced" in capsys.readouterr().err
    table = ss.laws.PiecewiseLinear([(0.0, 1.0), (0.2, 0.6), (1.2, 0.7)], 1.0)
    system.write_text(ss.Oscillator(0.05, 0.3, table).to_toml())
    assert main(["critical", str(system), "--between", "0.1:0.25"]) == 0
    assert "nonsmooth hopf      0.2\n" in capsys.readouterr().out


def own_law(break_away: float | None) -> ss.Oscillator:
    """f(w) = 0.3 + 0.7 exp(−w/0.35) + 0.1 w² with static friction of its own; f(0) = 1."""
    law = ss.laws.smooth_from_function(
        lambda w: 0.3 + 0.7 * np.exp(-np.asarray(w) / 0.35) + 0.1 * np.asarray(w) ** 2,
        w_max=4.0,
        derivative=lambda w: -2 * np.exp(-np.asarray(w) / 0.35) + 0.2 * np.asarray(w),
        break_away=break_away,
    )
    return ss.Oscillator(damping=0.16, drive_velocity=0.84, law=law)


#: From scipy's DOP853 at 1e-12: where the slip cycle of the Hopf point grazes w = 0, where the motion from the release does.
SLIP_GRAZES, STICK_SLIP_GRAZES = 0.855099474268, 0.8638564134765


@pytest.mark.slow
def test_stick_slip_and_the_slip_cycle_from_the_hopf_point_are_two_branches_where_they_do_not_meet() -> None:
    """With static friction above f(0) an orbit that grazes is thrown far away: those on both sides have no common limit."""
    result = ss.continuation(own_law(1.15), "drive_velocity", (0.8, 0.9), seeds=0)
    (stick_slip,) = (branch for branch in result.branches if branch.kind == "cycle")
    assert [(p.kind, round(p.parameter, 10)) for p in stick_slip.special_points] == [
        ("grazing_sliding", round(STICK_SLIP_GRAZES, 10))
    ]
    assert all(stick_slip.sticks)


@pytest.mark.slow
@pytest.mark.parametrize("start", [0.5, 0.84])
def test_the_branches_do_not_depend_on_where_the_continuation_starts(start: float) -> None:
    system = dataclasses.replace(own_law(1.15), drive_velocity=start)
    result = ss.continuation(system, "drive_velocity", (0.45, 1.1), seeds=0)
    assert [branch.kind for branch in result.branches] == ["steady_slip", "cycle", "cycle"]
    assert [point.kind for point in result.special_points] == ["hopf", "grazing_sliding", "grazing_sliding"]
    hopf, slip, stick_slip = (point.parameter for point in result.special_points)
    assert hopf == pytest.approx(0.6708585784952, abs=1e-12)
    assert slip == pytest.approx(SLIP_GRAZES, abs=1e-11)
    assert stick_slip == pytest.approx(STICK_SLIP_GRAZES, abs=1e-11)
    unstable = result.branches[2]
    assert not any(unstable.sticks)
    assert unstable.stable.count(True) == 0


@pytest.mark.long
def test_two_branches_that_meet_at_the_boundary_are_one_with_a_nonsmooth_fold() -> None:
    """Static friction of f(0): stick-slip and the slip cycle graze w = 0 with one orbit."""
    result = ss.continuation(own_law(None), "drive_velocity", (0.84, 0.87), seeds=0)
    (branch,) = (branch for branch in result.branches if branch.kind == "cycle")
    (fold,) = (point for point in branch.special_points if point.kind == "nonsmooth_fold")
    assert fold.parameter == pytest.approx(SLIP_GRAZES, abs=1e-11)
    assert (branch.sticks[0], branch.stable[0]) == (True, True)
    assert (branch.sticks[-1], branch.stable[-1]) == (False, False)
    # Orbits of one branch follow each other without a leap.
    assert np.abs(np.diff(branch.period)).max() < 0.005


def test_the_cycle_that_repels_is_followed_from_its_hopf_point() -> None:
    """x″ + 0.1 x′ + x under the exponential law: subcritical (see the critical velocities), so no run settles on it."""
    belt = ss.Oscillator(0.1, 1.2, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5))
    result = ss.continuation(belt, "drive_velocity", (1.1, 1.25), seeds=0)
    branch = max(result.branches, key=lambda item: item.kind == "cycle" and not any(item.sticks))
    assert min(branch.values) == pytest.approx(1.151292546497, abs=1e-4)
    assert set(branch.stable) == {False}
    # Amplitude over parameter as at a Hopf point: its square grows linearly.
    size, past = np.subtract(branch.x_max, branch.x_min), np.asarray(branch.values) - 1.151292546497
    near = (past > 1e-4) & (past < 3e-3)
    assert np.ptp(np.log(size[near] ** 2 / past[near])) < 0.02


@pytest.mark.slow
def test_critical_velocities_name_where_the_cycle_that_repels_ends() -> None:
    found = ss.critical_velocities(own_law(1.15), (0.6, 1.0))
    assert found["end_of_stick_slip"] == pytest.approx(STICK_SLIP_GRAZES, abs=1e-11)
    assert found["grazing_sliding"] == found["end_of_stick_slip"]
    (ends,) = found.not_shown
    assert (ends.kind, ends.parameter) == ("grazing_sliding", pytest.approx(SLIP_GRAZES, abs=1e-11))
    assert f"grazing_sliding {ends.parameter:.12g} on a cycle" in repr(found)


@pytest.mark.parametrize(
    ("law", "damping", "bounds", "hopf", "grazing"),
    [
        (ss.laws.Lorentzian(1.0, 0.4, 0.2, viscous=0.12), 0.08, (0.005, 0.9), [0.0066816, 0.5760367], 0.0066928),
        (ss.laws.ExponentialStribeck(1.0, 0.4, 0.2, exponent=2), 0.2, (0.005, 0.5), [0.0066741, 0.4053452], 0.0066797),
    ],
)
def test_no_branch_goes_on_through_a_point_or_past_a_grazing_of_wide_bounds(law, damping, bounds, hopf, grazing):
    """Both sides of a Hopf point are one curve of cycles, and steps are measured by bounds that are 10⁵ times as wide."""
    stiffness = 1.5 if isinstance(law, ss.laws.Lorentzian) else 1.0
    system = ss.Oscillator(damping, 0.5, law, mass=1.0, stiffness=stiffness)
    found = ss.continuation(system, "drive_velocity", bounds, seeds=0)
    special = sorted((point.kind, point.parameter) for point in found.special_points)
    assert [kind for kind, _ in special] == ["grazing_sliding", "grazing_sliding", "hopf", "hopf"]
    assert [value for _, value in special] == pytest.approx([grazing, grazing, *hopf], abs=1e-7)
    cycles = [branch for branch in found.branches if branch.kind == "cycle"]
    assert len(cycles) == 3
    assert not any(branch.closed for branch in cycles)
    for branch in cycles:
        for index in range(0, len(branch.values), 5):
            cycle = branch.orbit(index)
            x, v = (float(number) for number in cycle.orbit.at(0.3 * cycle.period))
            again = ss.simulate(cycle.system, cycle.period, x0=x, v0=v)
            assert np.hypot(*np.subtract(again.at(cycle.period), (x, v))) < 1e-6 * (1 + cycle.largest)
