"""Derivatives through events and periodic orbits, against closed forms, published numbers and differences of exact orbits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from evidence import script

import stickslip as ss
from stickslip.dynamics.periodic import derivatives

numbers = script("stability")
den_hartog, thomsen_fidlin = numbers.den_hartog, numbers.thomsen_fidlin

# shared/validation/cases.json: closed forms or 14 digits of independent integrations.
S15 = ss.Oscillator(damping=0.0, drive_velocity=0.3, law=ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.4))


def test_the_multiplier_of_dwell_time_stick_slip_is_q_over_one_minus_q() -> None:
    cycle = ss.periodic_orbit(S15)
    assert cycle.period == pytest.approx(6.501489987952009, abs=1e-13)
    assert cycle.multipliers == pytest.approx([1.0, 0.5716763248216287], abs=1e-11)
    assert cycle.stable
    assert cycle.sticks
    assert cycle.residual < 1e-14
    assert cycle.events == ("release", "capture")


@pytest.mark.parametrize(
    ("omega", "friction", "amplitude", "size"),
    [(0.7, 0.3, 1.885699850414254, 0.50980108878881), (2.0, 0.2, 0.3179797338056485, 0.72824590374638)],
)
def test_the_multipliers_of_motion_without_stops(omega: float, friction: float, amplitude: float, size: float) -> None:
    cycle = ss.periodic_orbit(den_hartog(omega, friction))
    assert np.abs(cycle.multipliers) == pytest.approx([size, size], abs=1e-12)
    assert abs(cycle.state[1]) == pytest.approx(amplitude, abs=1e-12)
    assert cycle.period == pytest.approx(2 * np.pi / omega, abs=1e-12)


def test_periods_of_other_laws_and_the_zero_of_a_stick() -> None:
    # S11 (Hong & Liu), S5 (Leine 1998), S16, S20 of the validation cases.
    forced = ss.periodic_orbit(den_hartog(0.2, 0.4))
    assert forced.multipliers[1] == 0.0
    assert forced.events.count("release") == 4
    leine = ss.periodic_orbit(ss.Oscillator(0.0, 0.2, ss.laws.Rational(1.0, 3.0)))
    assert leine.period == pytest.approx(12.00103129483058, abs=5e-12)
    assert leine.multipliers.tolist() == [1.0, 0.0]
    table = ss.laws.PiecewiseLinear([(0.0, 1.0), (0.2, 0.6), (1.2, 0.7)], 1.0)
    assert ss.periodic_orbit(ss.Oscillator(0.05, 0.3, table)).period == pytest.approx(7.297709176592689, abs=1e-13)
    sign = ss.laws.TwoBranch(rising=1.3, falling=0.7, break_away=1.3)  # x is shifted by the mean, 1
    accelerated = ss.periodic_orbit(ss.Oscillator(0.0, 3.0, sign), guess=(2.0, 0.0))
    assert accelerated.period == pytest.approx(7.997471021465301, abs=1e-12)


def test_orbit_of_a_cycle_is_the_cycle() -> None:
    for system in (ss.paper.oscillator(0.3), S15, den_hartog(0.7, 0.3), thomsen_fidlin(0.43)):
        cycle = ss.periodic_orbit(system)
        start, end = (np.array(cycle.orbit.at(t)) for t in (0.0, cycle.period))
        assert start == pytest.approx(end, abs=1e-11)


CASES = [
    *(ss.laws.Coulomb(0.5), ss.laws.StaticKinetic(1.0, 0.6), ss.laws.DwellTime(0.5, 0.5, 0.4)),
    *(ss.laws.ForceRate(0.5, 0.5, 0.4, 0.5), ss.laws.PiecewiseLinear([(0.0, 1.0), (0.2, 0.6), (1.2, 0.7)], 1.0)),
    *(ss.laws.BogaczRyczek(), ss.laws.Rational(1.0, 3.0), ss.laws.PoppStelter(1.0, 0.5, 1.4, 0.1)),
    *(ss.laws.TwoBranch(0.5, 0.7, 1.0), ss.laws.TwoBranch(0.8, 0.6, 1.0)),
]


#: Steps of a fourth-order difference, and its weights.
STEPS, WEIGHTS = (-2.0, -1.0, 1.0, 2.0), (1 / 12, -8 / 12, 8 / 12, -1 / 12)


def signature(orbit: ss.Orbit, t: float) -> list[tuple[str, int]]:
    """The events before a time."""
    events = orbit.events[orbit.events["t"] < t]
    contacts = events.get("contact", np.zeros(len(events)))
    return list(zip(events["kind"].astype(str), contacts, strict=True))


def differenced(orbit: ss.Orbit, t: float, relative: float) -> np.ndarray:
    """The fundamental matrix as a difference of exact orbits with one event sequence."""
    start = np.concatenate([np.atleast_1d(part) for part in orbit.at(0.0)])
    motion = orbit.to_xarray()
    sizes = np.concatenate([np.atleast_1d(np.abs(motion[name].to_numpy()).max(axis=0)) for name in ("x", "v")])
    columns = []
    for column in range(start.size):
        step = relative * max(float(sizes[column]), 1e-12)
        for _ in range(12):
            ends = [_moved(orbit, start, column, steps * step, t) for steps in STEPS]
            if all(end is not None for end in ends):
                break
            step /= 4
        columns.append(sum(weight * end for weight, end in zip(WEIGHTS, ends, strict=True)) / step)
    return np.stack(columns, axis=-1)


def _moved(orbit: ss.Orbit, start: np.ndarray, column: int, step: float, t: float) -> np.ndarray | None:
    moved = start.copy()
    moved[column] += step
    x0, v0 = moved.reshape(2, -1) if moved.size > 2 else moved
    other = ss.simulate(orbit.system, t, x0=x0, v0=v0)
    if signature(other, t) != signature(orbit, t):
        return None
    return np.concatenate([np.atleast_1d(part) for part in other.at(t)])


@pytest.mark.parametrize("law", CASES, ids=lambda law: type(law).__name__)
def test_fundamental_matrices_are_differences_of_exact_orbits(law: ss.laws.Law) -> None:
    rng = np.random.default_rng(7)
    for forced in (False, True, True):
        system = ss.Oscillator(
            damping=rng.uniform(0.0, 0.3),
            drive_velocity=rng.uniform(0.1, 0.5),
            law=law,
            mass=rng.uniform(0.5, 2.0),
            stiffness=rng.uniform(0.5, 2.0),
            forcing=ss.Harmonic(rng.uniform(0.05, 0.4), rng.uniform(0.5, 2.0), rng.uniform(0.0, 6.0))
            if forced
            else None,
        )
        orbit = ss.simulate(system, 20.0, x0=rng.uniform(-1, 1), v0=rng.uniform(-1, 0.05))
        exact = derivatives.fundamental_matrix(orbit)
        # Coarse to fine: the finest step that rounding leaves room for tells.
        errors = [np.abs(differenced(orbit, 20.0, step) - exact).max() for step in (1e-3, 1e-4, 1e-5)]
        assert min(errors) < 1e-6 * max(np.abs(exact).max(), 1e-2)


def test_fundamental_matrix_of_masses_forgets_what_a_stick_forgets() -> None:
    system = ss.chain(2, ss.laws.StaticKinetic(1.0, 0.6), 0.2, coupling=0.7)
    orbit = ss.simulate(system, 12.0, x0=[0.3, -0.2], v0=[0.0, 0.1])
    matrix = derivatives.fundamental_matrix(orbit)
    assert (orbit.events["kind"] == "capture").any()
    assert matrix.shape == (4, 4)
    assert abs(np.linalg.det(matrix)) < 1e-8


def sides(system: Any, name: str, end: float, **start: Any) -> tuple[ss.Orbit, ss.Orbit, float]:
    """Runs with a number of the system a little lower and higher, and how far these lie apart."""
    value = system.core.number("/" + name.replace(".", "/"))
    step = 1e-6 * value
    low, high = (ss.simulate(system.with_number(name, value + h), end, **start) for h in (-step, step))
    return low, high, 2 * step


def test_sensitivities_are_differences_of_events() -> None:
    system = ss.Oscillator(0.05, 0.3, ss.laws.BogaczRyczek(), forcing=ss.Harmonic(0.1, 1.25))
    names = ["drive_velocity", "damping", "forcing.0.amplitude", "forcing.0.frequency", "law.psi"]
    exact = derivatives.sensitivities(ss.simulate(system, 30.0), names)
    for name in names:
        low, high, apart = sides(system, name, 30.0)
        difference = (high.events["t"] - low.events["t"]).to_numpy() / apart
        assert exact["t"].sel(parameter=name).to_numpy() == pytest.approx(difference, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("law", "names"),
    [
        (ss.laws.StaticKinetic(1.0, 0.6), ["law.kinetic", "damping"]),
        (ss.laws.DwellTime(0.5, 0.4, 0.3), ["law.kinetic", "law.limit"]),
        (ss.laws.ForceRate(0.5, 0.4, 0.3, 0.5), ["law.kinetic", "drive_velocity"]),
        (ss.laws.PiecewiseLinear([(0.0, 1.0), (0.3, 0.6), (2.0, 0.8)], 1.1), ["law.nodes.0.1", "law.nodes.1.1"]),
        (ss.laws.BogaczRyczek(), ["law.static_friction.initial", "law.psi", "stiffness"]),
        (ss.laws.ExponentialStribeck(1.0, 0.6, 0.5), ["law.kinetic", "law.scale"]),
    ],
)
@pytest.mark.parametrize(("x0", "v0"), [(-1.0, 0.5), (0.0, -0.5), (2.0, None)])
def test_friction_at_a_slipping_start_moves_with_the_law(
    law: Any, names: list[str], x0: float, v0: float | None
) -> None:
    system = ss.Oscillator(0.05, 0.2, law)
    orbit = ss.simulate(system, 8.0, x0=x0, v0=v0)
    exact = derivatives.sensitivities(orbit, names)
    for name in names:
        low, high, apart = sides(system, name, 8.0, x0=x0, v0=v0)
        # Two orbits do not tell what an event beside does to them.
        assert len(low.events) == len(high.events) == len(orbit.events)
        difference = (high.at(8.0)[0] - low.at(8.0)[0]) / apart
        assert float(exact["x_end"].sel(parameter=name)) == pytest.approx(difference, rel=1e-5, abs=1e-7)
        events = (high.events["t"] - low.events["t"]).to_numpy() / apart
        assert exact["t"].sel(parameter=name).to_numpy() == pytest.approx(events, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: ss.periodic_orbit(ss.laws.Coulomb(1.0)), "expected an Oscillator or a System"),
        (
            lambda: ss.periodic_orbit(ss.chain(2, ss.laws.Coulomb(1.0), 0.1, damping=0.2)),
            "comes to rest or slips steadily",
        ),
        (lambda: ss.periodic_orbit(S15, guess="there"), "guess must be"),
        (lambda: ss.periodic_orbit(S15, periods=0), "periods must be"),
        (lambda: ss.periodic_orbit(ss.paper.oscillator(0.5)), "no two returns|periodic"),
        (lambda: derivatives.fundamental_matrix(ss.simulate(S15, 5.0), 6.0), "t must lie"),
        (lambda: derivatives.sensitivities(ss.simulate(S15, 5.0), ["law.kinetc"]), "did you mean 'kinetic'"),
    ],
)
def test_refusals(call: object, sentence: str) -> None:
    with pytest.raises(ss.InputError, match=sentence):
        call()  # type: ignore[operator]
