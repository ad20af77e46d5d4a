"""Every event is one: what is left of its guard is rounding, and none is found where the equations of motion have none.

What is compared with comes from these equations, written down here or integrated by scipy, never from the engine.
"""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.optimize import brentq

import stickslip as ss
from stickslip import laws


def off_the_limit(orbit: ss.Orbit, limit: float) -> float:
    """The largest distance between the holding force at a release and the constant limit of adhesion."""
    o, releases = orbit.system, orbit.events.query("kind == 'release'")
    held = o.stiffness * releases["x"] + o.damping * o.drive_velocity
    if o.forcing:
        held -= o.forcing.amplitude * np.cos(o.forcing.frequency * releases["t"] + o.forcing.phase)
    return float((held.abs() - limit).abs().max())


def test_a_forced_stick_breaks_where_its_holding_force_reaches_the_limit() -> None:
    # Householder's step vanishes by chance at t = 662.216, where the holding force is 0.729.
    oscillator = ss.Oscillator(0.05, 0.3, laws.StaticKinetic(1, 0.5), forcing=ss.Harmonic(0.5, 0.2 + 1.8 * 892 / 999))
    orbit = ss.simulate(oscillator, 700.0, x0=0.0, v0=0.0)
    assert off_the_limit(orbit, 1.0) < 1e-11
    releases = orbit.events.query("kind == 'release'")["t"]
    assert releases[releases > 660].iloc[0] == pytest.approx(664.884007, abs=1e-6)


def test_slip_that_never_reaches_the_drive_velocity_does_not_stick() -> None:
    oscillator = ss.Oscillator(
        0.1602323854603304,
        0.3881264101277576,
        laws.StaticKinetic(1.0, 0.8038301257308814),
        stiffness=1.498080404075711,
    )
    # After the release: friction 0.8038 and a free decay whose first crest of ẋ, in closed form, stays below the drive.
    orbit = ss.simulate(oscillator, 200.0, x0=-0.128)
    assert list(orbit.events["kind"]) == ["release"]
    gamma, k = 0.5 * oscillator.damping, oscillator.stiffness
    t = np.linspace(1e-6, 60.0, 600_001)
    omega, x0, v0 = np.sqrt(k - gamma**2), orbit.events["x"].iloc[0], oscillator.drive_velocity
    a = x0 - oscillator.law.kinetic / k
    b = (v0 + gamma * a) / omega
    rate = (-gamma * a + omega * b) * np.cos(omega * t) - (gamma * b + omega * a) * np.sin(omega * t)
    assert (np.exp(-gamma * t) * rate < v0).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_stick_that_cannot_break_never_breaks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cases = [(0.9, 1.0)] if seed == 0 else [(rng.uniform(0.1, 0.999), rng.uniform(0.05, 5.0)) for _ in range(20)]
    for amplitude, frequency in cases:
        oscillator = ss.Oscillator(0.1, 0.0, laws.Coulomb(1.0), forcing=ss.Harmonic(amplitude, frequency))
        orbit = ss.simulate(oscillator, 7000.0 / frequency)
        assert orbit.events.empty, (amplitude, frequency)


def test_a_table_of_break_away_forces_breaks_on_its_lines() -> None:
    table = [(0, 0.9), (1, 1.0), (2, 1.05), (3, 1.25)]
    times, forces = zip(*table, strict=True)
    s, x0 = 0.3502047364722288, 0.497391655159628
    truth = brentq(lambda t: np.interp(t, times, forces) - (x0 + s * t), 0.0, 3.0, xtol=1e-15)
    orbit = ss.simulate(ss.Oscillator(0.0, s, laws.Tabulated(0.9, table)), 3.0, x0=x0)
    release = orbit.events.iloc[0]
    assert release["t"] == pytest.approx(truth, abs=1e-14)
    assert release["force"] == pytest.approx(x0 + s * release["t"], abs=1e-15)


def test_tables_break_away_where_the_holding_force_first_meets_them() -> None:
    rng = np.random.default_rng(20)
    checked = 0
    for _ in range(500):
        times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.5, 5))])
        forces = 0.9 + np.concatenate([[0.0], np.cumsum(rng.exponential(0.1, 5) * rng.integers(0, 2, 5))])
        s, x0 = rng.uniform(0.05, 0.6), rng.uniform(-0.9, 0.9)
        law = laws.Tabulated(0.9, [*zip(times.tolist(), forces.tolist(), strict=True)])
        orbit = ss.simulate(ss.Oscillator(0.0, s, law), 12.0, x0=x0, max_events=1)
        # The margin is linear between the nodes, so its first root is beside the first node at which it is not positive.
        nodes = np.concatenate([times, [12.0]])
        margin = np.interp(nodes, times, forces) - (x0 + s * nodes)
        below = np.flatnonzero(margin <= 0)
        if below.size == 0:
            assert orbit.events.empty
            continue
        i = below[0]
        truth = nodes[i - 1] + (nodes[i] - nodes[i - 1]) * margin[i - 1] / (margin[i - 1] - margin[i])
        assert orbit.events["t"].iloc[0] == pytest.approx(truth, abs=1e-12)
        checked += 1
    assert checked > 350


def free_motion(mass: float, stiffness: float, damping: float, t: float) -> list[list[float]]:
    """exp(A t) of x' = v, m v' = −k x − D v, from its power series in 80 digits, scaled and squared."""

    def product(a: list[list[Decimal]], b: list[list[Decimal]]) -> list[list[Decimal]]:
        return [[sum(a[i][k] * b[k][j] for k in (0, 1)) for j in (0, 1)] for i in (0, 1)]

    with localcontext(prec=80):
        m, k, d, tau = Decimal(mass), Decimal(stiffness), Decimal(damping), Decimal(t) / 2**24
        step = [[Decimal(0), tau], [-k / m * tau, -d / m * tau]]
        term = total = [[Decimal(1), Decimal(0)], [Decimal(0), Decimal(1)]]
        for n in range(1, 40):
            term = [[value / n for value in row] for row in product(term, step)]
            total = [[total[i][j] + term[i][j] for j in (0, 1)] for i in (0, 1)]
        for _ in range(24):
            total = product(total, total)
        return [[float(value) for value in row] for row in total]


@pytest.mark.parametrize(
    ("mass", "stiffness", "damping"),
    [
        (1.6426293561589156, 0.3133020584340581, 1.4347671010011345),  # critical but for an ulp
        (1.0, 1.0, 2.0),
        (1.0, 1.0, 2.0 + 1e-8),
        (1.0, 1.0, 2.0 - 1e-8),
        (1.0, 1.0, 2.01),
        (1.0, 1.0, 2.02),
        (1.0, 1e-9, 1e4),
        (1.0, 1e-4, 1e4),
        (1e-3, 0.1, 50.0),
    ],
)
def test_heavily_damped_slip_keeps_its_digits(mass: float, stiffness: float, damping: float) -> None:
    oscillator = ss.Oscillator(damping, -1.0, laws.Coulomb(0.0), mass=mass, stiffness=stiffness)
    x0, v0 = 0.7, 1e-4
    times = np.array([0.0, 1e-6, 1e-3, 0.1, 1.0, 5.0])
    x, v = ss.simulate(oscillator, 5.0, x0=x0, v0=v0).at(times)
    assert (x[0], v[0]) == (x0, v0)
    for t, got_x, got_v in zip(times[1:].tolist(), x[1:], v[1:], strict=True):
        moved = free_motion(mass, stiffness, damping, t)
        assert got_x == pytest.approx(moved[0][0] * x0 + moved[0][1] * v0, rel=4e-15)
        assert got_v == pytest.approx(moved[1][0] * x0 + moved[1][1] * v0, rel=1e-13, abs=1e-15 * stiffness / damping)
