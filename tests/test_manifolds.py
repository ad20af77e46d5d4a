"""Manifolds of periodic orbits: maps with known ones, invariance under the map, the boundary of basins, refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import stickslip as ss
from stickslip.dynamics.periodic.manifold import Manifold, _stable, _unstable

SMOOTH = ss.Oscillator(
    0.1, 1.0, ss.laws.ExponentialStribeck(1.0, 0.5, 0.3, 0.1), forcing=ss.Harmonic(0.1, 0.9411525256534148)
)
PERIOD = 2 * math.pi / 0.9411525256534148
STICKING = ss.Oscillator(0.0, 0.1, ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.8, 1.3))


@pytest.fixture(scope="module")
def saddle():
    """Between steady forced slip and stick-slip, which both attract."""
    orbit = ss.periodic_orbit(SMOOTH, guess=(1.82055313, 0.13246406))
    assert orbit.multipliers.real == pytest.approx([3.5622, 0.9546], abs=1e-3)
    return orbit


@pytest.fixture(scope="module")
def curves(saddle):
    return {side: ss.manifold(saddle, side, length=2.0, spacing=0.05) for side in ("stable", "unstable")}


def mapped(system, point, periods):
    return np.array(ss.simulate(system, periods, x0=point[0], v0=point[1]).at(periods))


def distance(point, curve):
    """From a point to a curve of straight pieces."""
    begins, ways = curve[:-1], np.diff(curve, axis=0)
    shares = np.clip(((point - begins) * ways).sum(axis=1) / np.maximum((ways**2).sum(axis=1), 1e-300), 0, 1)
    return np.linalg.norm(point - begins - shares[:, None] * ways, axis=1).min()


@pytest.mark.parametrize("contraction", [0.5, 0.0])
def test_the_unstable_manifold_of_a_map_with_a_known_one(contraction):
    # (x, y) → (2 x, μ y + x²) keeps the parabola y = x²/(4 − μ); with μ = 0 it has no inverse.
    def image(states):
        return np.column_stack([2 * states[:, 0], contraction * states[:, 1] + states[:, 0] ** 2])

    for sign in (-1.0, 1.0):
        curve, end = _unstable(image, np.zeros(2), np.array([sign, 0.0]), 2.0, 1.0, 5.0, 0.01, 10_000)
        assert end == "length"
        assert curve[-1, 0] * sign > 2
        assert np.abs(curve[:, 1] - curve[:, 0] ** 2 / (4 - contraction)).max() < 1e-5
        assert np.linalg.norm(np.diff(curve, axis=0), axis=1).max() <= 0.01


@pytest.mark.parametrize("contraction", [0.5, 0.0])
def test_the_stable_manifold_of_a_map_with_a_known_one(contraction):
    # (x, y) → (2 x + y², μ y) keeps the parabola x = −y²/(2 − μ²).
    def image(states):
        return np.column_stack([2 * states[:, 0] + states[:, 1] ** 2, contraction * states[:, 1]])

    for sign in (-1.0, 1.0):
        curve, end = _stable(image, np.zeros(2), np.array([0.0, sign]), 1.0, 3.0, 0.02, 10_000)
        assert end == "length"
        assert curve[-1, 1] * sign > 1.5
        assert np.abs(curve[:, 0] + curve[:, 1] ** 2 / (2 - contraction**2)).max() < 1e-4


def test_a_jump_of_the_map_breaks_the_unstable_manifold_and_ends_the_stable_one():
    def image(states):
        beyond = states[:, :1] > 1.0
        return np.where(beyond, [7.0, 7.0], states * [2.0, 0.5])

    curve, _ = _unstable(image, np.zeros(2), np.array([1.0, 0.0]), 2.0, 1.0, 1.9, 0.05, 10_000)
    assert np.nanmax(np.linalg.norm(np.diff(curve, axis=0), axis=1)) <= 0.05
    curve, end = _stable(
        lambda s: np.where(np.abs(s[:, 1:]) > 0.5, np.nan, s * [2.0, 0.5]),
        np.zeros(2),
        np.array([0.0, 1.0]),
        1.0,
        3.0,
        0.05,
        100,
    )
    assert end == "lost"
    assert 0.45 < curve[-1, 1] < 0.5001


@pytest.mark.long
def test_the_unstable_manifold_is_mapped_onto_itself(saddle, curves):
    found = ss.manifold(saddle, length=2.0, spacing=0.005)
    for curve in curves["unstable"].sides:
        for point in curve[:: max(1, len(curve) // 8)][:6]:
            image = mapped(SMOOTH, point, PERIOD)
            if np.linalg.norm(image - found.fixed_point) < 1.0:
                assert distance(image, found.points) < 2e-4


def test_the_stable_manifold_leads_to_the_orbit_and_bounds_the_basins(curves):
    found = curves["stable"]
    assert found.ends == ("length", "length")
    for curve in found.sides:
        point = curve[len(curve) // 2]
        gaps = [np.linalg.norm(mapped(SMOOTH, point, n * PERIOD) - found.fixed_point) for n in (1, 3, 5)]
        assert gaps[0] > gaps[1] > gaps[2]
        way = np.diff(curve[len(curve) // 2 :][:2], axis=0)[0]
        across = 0.02 * np.array([-way[1], way[0]]) / np.linalg.norm(way)
        kinds = []
        for start in (point - across, point + across):
            orbit = ss.simulate(SMOOTH, 200 * PERIOD, x0=start[0], v0=start[1])
            events = orbit.events
            kinds.append(bool(((events["kind"] == "capture") & (events["t"] > 100 * PERIOD)).any()))
        assert sorted(kinds) == [False, True]


def test_under_a_stick_the_stable_manifold_is_mapped_onto_the_orbit_at_once():
    (orbit,) = ss.periodic_orbits(ss.section(STICKING, t_end=4000), returns=4)
    found = ss.manifold(orbit, "stable", length=0.5, spacing=0.05)
    assert found.multiplier == pytest.approx(0.0, abs=1e-9)
    period = 8 * 2 * math.pi / 1.3  # twice that of the orbit, whose other multiplier is negative
    for curve in found.sides:
        for point in curve[:: max(1, len(curve) // 4)]:
            assert mapped(STICKING, point, period) == pytest.approx(found.fixed_point, abs=2e-3)
    # The other phase of the orbit has its own.
    later = ss.manifold(orbit, "stable", length=0.1, spacing=0.05, phase=1.0)
    moved = mapped(STICKING, found.fixed_point, 1.0)
    assert later.fixed_point == pytest.approx(tuple(moved), abs=1e-6)


def test_it_is_drawn_over_basins_with_their_legend(curves):
    result = ss.basins(SMOOTH, x=np.linspace(1.0, 2.0, 5), v=np.linspace(-0.5, 0.5, 5), transient=40, tolerance=1e-3)
    ax = ss.show.basins_plot(result)
    names = [text.get_text() for text in ax.get_legend().get_texts()]
    limits = ax.axis()
    ss.show.manifold_plot(list(curves.values()), ax)
    assert ax.axis() == limits
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [*names, "stable manifold", "unstable manifold"]
    line = next(line for line in ax.get_lines() if line.get_label() == "stable manifold")
    assert np.array_equal(np.column_stack(line.get_data()), curves["stable"].points)
    assert ss.show.manifold_plot(curves["stable"]).get_xlabel() == "position x"


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"side": "center"}, 'side must be "stable" or "unstable", got \'center\''),
        ({"length": 0.0}, "length must be greater than 0"),
        ({"spacing": -1.0}, "spacing must be greater than 0"),
        ({"phase": 10.0}, r"phase must lie in \[0, 6.676"),
    ],
)
def test_values_that_make_no_sense_are_refused(saddle, change, sentence):
    with pytest.raises(ss.InputError, match=sentence):
        ss.manifold(saddle, **change)


def test_orbits_without_a_manifold_that_is_a_curve_are_refused():
    free = ss.periodic_orbit(ss.Oscillator(0.0, 0.2, ss.laws.StaticKinetic(1.0, 0.6)))
    with pytest.raises(ss.InputError, match=r"nothing forces this oscillator.*show\.phase_plane"):
        ss.manifold(free)
    stable = ss.periodic_orbit(replace(SMOOTH, drive_velocity=3.0))
    with pytest.raises(ss.InputError, match="one multiplier outside the unit circle and the others inside it, got 0"):
        ss.manifold(stable)
    with pytest.raises(ss.InputError, match="expected a periodic orbit, got Orbit"):
        ss.manifold(ss.simulate(SMOOTH, 10.0))
    ageing = ss.Oscillator(0.1, 0.3, ss.laws.DwellTime(0.5, 0.5, 0.4), forcing=ss.Harmonic(0.1, 1.0))
    with pytest.raises(ss.InputError, match="DwellTime remembers more than position and velocity"):
        ss.manifold(ss.periodic_orbit(ageing))


def test_the_manifold_of_a_mass_that_another_does_not_touch_is_that_of_one_mass(curves):
    alone = [[1.0, 0.0], [0.0, 1.5]]
    pair = ss.System(
        [1, 1],
        alone,
        [[0.1, 0.0], [0.0, 0.6]],
        [ss.Contact(0, SMOOTH.law, 1.0)],
        forcing=ss.Force(0.1, 2 * math.pi / PERIOD),
    )
    found = ss.manifold(ss.periodic_orbit(pair, ([1.82055313, 0.0], [0.13246406, 0.0])), length=2.0, spacing=0.05)
    assert found.multiplier == pytest.approx(curves["unstable"].multiplier, rel=1e-9)
    known = curves["unstable"].points
    for point in found.points[::20]:
        assert distance(point[[0, 2]], known) < 2e-4
        assert point[[1, 3]] == pytest.approx(0.0, abs=1e-12)


@pytest.fixture(scope="module")
def two_cycles():
    """An unstable cycle of two masses, 1 behind 0, between one nearly in unison and one of turns."""
    system = ss.chain(2, ss.laws.ExponentialStribeck(1.0, 0.7, 0.3, 0.1), 0.3, coupling=2.0, damping=0.05)
    orbit = ss.periodic_orbit(system, ([-0.7822, 0.4504], [-0.0923, 0.162]))
    return orbit, ss.manifold(orbit, length=0.8, spacing=0.05)


@pytest.mark.slow
def test_the_unstable_manifold_of_a_cycle_leads_to_the_attractors_on_both_sides(two_cycles):
    orbit, found = two_cycles
    assert found.multiplier == pytest.approx(1.2433042, abs=1e-6)
    assert found.multiplier == pytest.approx(float(orbit.multipliers[1].real), rel=1e-9)
    periods = []
    for curve in found.sides:
        assert not np.nan_to_num(curve[:, 2]).any()
        # Far along each side, and as near to the cycle as a start can tell it.
        for start in (curve[-1], curve[5]):
            settled = ss.simulate(orbit.system, 800.0, x0=start[:2], v0=start[2:])
            periods.append(ss.periodic_orbit(orbit.system, settled).period)
    assert periods[0] == pytest.approx(periods[1], rel=1e-9)
    assert periods[2] == pytest.approx(periods[3], rel=1e-9)
    starts = ([1.2, 1.2], [0.05, 0.0]), ([0.8, -0.4], [0.0, 0.0])
    known = [ss.periodic_orbit(orbit.system, ss.simulate(orbit.system, 800.0, *start)) for start in starts]
    assert all(cycle.stable for cycle in known)
    assert sorted(periods[::2]) == pytest.approx(sorted(cycle.period for cycle in known), rel=1e-9)


@pytest.mark.slow
def test_the_unstable_manifold_of_a_cycle_is_mapped_onto_itself(two_cycles):
    orbit, found = two_cycles
    for curve in found.sides:
        known = curve[np.isfinite(curve).all(axis=1)]
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(known, axis=0), axis=1))])
        for point in known[(arc > 0.02) & (arc < 0.3)][::3]:
            run = ss.simulate(orbit.system, 1.5 * orbit.period, x0=point[:2], v0=point[2:])
            times = np.linspace(0.1, 1.5 * orbit.period, 4001)
            speeds = run.at(times)[1][:, 0]
            falls = np.flatnonzero((speeds[:-1] > 0) & (speeds[1:] <= 0))
            ends = times[falls[0]], times[falls[0] + 1]
            at = brentq(lambda t, run=run: run.at(t)[1][0], *ends, xtol=1e-13)
            assert distance(np.hstack(run.at(at)), known) < 1e-3


@pytest.mark.long
def test_what_several_masses_have_no_curve_of_is_refused(two_cycles):
    orbit, _ = two_cycles
    with pytest.raises(ss.InputError, match=r"no curve: it has 2 dimensions in the section; take side=\"unstable\""):
        ss.manifold(orbit, "stable")
    with pytest.raises(ss.InputError, match="phase is that of a forcing, and nothing forces this system"):
        ss.manifold(orbit, phase=0.5)
    with pytest.raises(ss.InputError, match="contact must be a whole number from 0 to 1, got 2"):
        ss.manifold(orbit, contact=2)


def test_it_says_what_it_is(curves):
    assert isinstance(curves["stable"], Manifold)
    assert repr(curves["stable"]).startswith("<Manifold, stable, multiplier 0.95460")
    assert curves["stable"].facts()["side"] == "stable"
