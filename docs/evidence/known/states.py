"""Known numbers of laws with an internal state."""

from __future__ import annotations

import functools
import math

import numpy as np
from known.case import Results, case, cycle, slope, upcrossings
from scipy.optimize import brentq

import stickslip as ss

ROCK = {"normal_force": 1e7, "a": 0.01, "b": 0.015, "length": 1e-5, "reference_velocity": 1e-6}


def critical_stiffness(mass: float) -> tuple[float, float]:
    """Stiffness and angular frequency at which steady slip at 1 µm/s loses stability under the aging law."""
    law = ss.laws.RateState(**ROCK)
    v, psi = 1e-6, law.steady_state(1e-6)
    by_w = [slope(lambda w, i=i: float(law.rates(w, psi)[i]), v, 0.5 * v) for i in (0, 1)]
    by_psi = [slope(lambda z, i=i: float(law.rates(v, z)[i]), psi, 0.5) for i in (0, 1)]

    def eigenvalues(stiffness: float) -> np.ndarray:
        # ẋ = v − w, m ẇ = k x − F, ψ̇.
        rows = [[0, -1, 0], [stiffness / mass, -by_w[0] / mass, -by_psi[0] / mass], [0, by_w[1], by_psi[1]]]
        return np.linalg.eigvals(np.array(rows))

    def growth(stiffness: float) -> float:
        pairs = eigenvalues(stiffness)
        return float(pairs[np.abs(pairs.imag) > 0].real.max())

    critical = brentq(growth, 4e9, 2e10, rtol=1e-14)
    return critical, float(np.abs(eigenvalues(critical).imag).max())


def quasi_static(law: str, phi: float, t_end: float, mass: float = 10.0) -> ss.Orbit:
    """At the critical stiffness from w = V₀ e^φ and θ = L/V₀; the mass is too small to matter."""
    friction = ss.laws.RateState(**ROCK, law=law)
    w = 1e-6 * math.exp(phi)
    oscillator = ss.Oscillator(0.0, 1e-6, friction, mass=mass, stiffness=5e9)
    x = float(friction.rates(w, 0.0)[0]) / 5e9
    return ss.integrate(oscillator, t_end, x0=x, v0=1e-6 - w, state=0.0, tolerance=1e-9, method="Radau")


def slip_period(law: str, phi: float) -> float:
    turns = quasi_static(law, phi, 250).events.query("kind == 'turn'")["t"].to_numpy()
    return float((turns[-1] - turns[-3]) / 10.0)


def separatrix() -> float:
    """The start φ₀ beyond which the slip law runs away, ψ = 0.

    With u = φ + ψ the quasi-static slip law has the invariant line u = 1 − (1 − a/b) e^(−φ), beyond which u grows without
    bound. That friction along it obeys the law is checked here with the law's own rates.
    """
    law = ss.laws.RateState(**ROCK, law="slip")

    def line(phi: float) -> float:
        return 1.0 - math.exp(-phi) / 3.0

    for phi in (0.5, 2.0, 5.0):
        psi, w = line(phi) - phi, 1e-6 * math.exp(phi)
        psi_rate = float(law.rates(w, psi)[1]) * 10.0
        phi_rate = (5e9 * 1e-5 * (1.0 - math.exp(phi)) / 1e7 - 0.015 * psi_rate) / 0.01
        assert math.isclose(psi_rate / phi_rate, math.exp(-phi) / 3.0 - 1.0, rel_tol=1e-9)
    return brentq(lambda phi: phi - line(phi), 0.5, 1.5, xtol=1e-15)


@case(
    "S17 rate and state, N = 10 MPa, a = 0.01, b = 0.015, L = 10 µm, V₀ = 1 µm/s",
    "linear stability: Ruina, J. Geophys. Res. 88 (1983) 10359; periods from two integrators", 8,
    missed={
        "run_away_of_the_slip_law_from": "the invariant line of the equations lies at 0.858774; the peak slip velocity "
        "passes e¹² V₀ from 0.85742664 on, and integrators that look for it at their steps only say 0.8574265 to 0.8574297"
    },
    critical_stiffness=5e9, its_angular_frequency=0.07071067811865475, its_period=88.85765876316732,
    critical_stiffness_with_1e12_kg=1e10, period_of_the_aging_law_from_1=10.54048576,
    period_of_the_slip_law_from_0p5=9.57708105, run_away_of_the_slip_law_from=0.85742749,
)  # fmt: skip
def rate_and_state() -> Results:
    stiffness, frequency = critical_stiffness(1e-3)
    return {
        "critical_stiffness": stiffness,
        "its_angular_frequency": frequency,
        "its_period": 2 * math.pi / frequency,
        "critical_stiffness_with_1e12_kg": critical_stiffness(1e12)[0],
        "period_of_the_aging_law_from_1": slip_period("aging", 1.0),
        "period_of_the_slip_law_from_0p5": slip_period("slip", 0.5),
        "run_away_of_the_slip_law_from": separatrix(),
    }


@case(
    "P6 the same with a mass: (b − a) N/L (1 + m V²/(a N L))", "Roy & Marone, J. Geophys. Res. 101 (1996) 13919", 9,
    critical_stiffness_with_1e11_kg=5.5e9, critical_stiffness_with_5e11_kg=7.5e9,
)  # fmt: skip
def stiffness_with_mass() -> Results:
    return {f"critical_stiffness_with_{m}_kg": critical_stiffness(float(m))[0] for m in ("1e11", "5e11")}


@case(
    "P7 the same along given motions",
    "velocity step (a − b) ln 10 and growth b ln(1 + V₀ t/L) in a hold: Dieterich, J. Geophys. Res. 84 (1979) 2161; Ruina, "
    "ibid. 88 (1983) 10359", 9,
    change_of_friction_by_a_tenfold_speed=-0.011512925464970228, growth_of_the_state_in_9990_s=6.907755278982137,
)  # fmt: skip
def velocity_step_and_hold() -> Results:
    law = ss.laws.RateState(**ROCK)
    steady = [float(law.rates(w, law.steady_state(w))[0]) / 1e7 for w in (1e-6, 1e-5)]
    # V₀ t/L = 999 in 9990 s.
    _, held = law.follow(np.array([0.0, 9990.0]), np.zeros(2), state=0.0)
    return {
        "change_of_friction_by_a_tenfold_speed": steady[1] - steady[0],
        "growth_of_the_state_in_9990_s": float(held[-1]),
    }


@functools.cache
def tenfold_speed() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Friction, slip velocity and θ every 0.01 s after a step of the load from 1 to 10 µm/s (length in µm, N = 1)."""
    law = ss.laws.RateState(1.0, 0.005, 0.01, 10.0, 1.0)
    # The mass is too small to matter, and the codes have none.
    slider = ss.Oscillator(0.0, 10.0, law, mass=1e-12, stiffness=1e-3)
    orbit = ss.integrate(slider, 30.0, x0=600.0, v0=9.0, state=0.0, tolerance=1e-11, method="Radau")
    times = 0.01 * np.arange(3001)
    x, v = orbit.at(times)
    return 1e-3 * x, 10.0 - v, 10.0 * np.exp(orbit.state(times))


@case(
    "P12 quasi-static slider, aging law, load from V₀ to 10 V₀, b/a = 2, k = 2 k_c",
    "rsfmodel, tests/rsf_tests.py (Leeman): values of its solution every 0.01 s and every s after the step", 8,
    largest_friction=0.60784356, least_friction=0.58362349, largest_velocity=35.2686933, least_state=0.51710192,
    friction_after_1=0.60720485, friction_after_2=0.60186637, friction_after_3=0.5840091, friction_after_5=0.58899543,
    friction_after_10=0.58858313, friction_after_30=0.58848708,
)  # fmt: skip
def velocity_step() -> Results:
    friction, velocity, theta = tenfold_speed()
    after = {f"friction_after_{t}": friction[100 * t] for t in (1, 2, 3, 5, 10, 30)}
    return {
        "largest_friction": friction.max(), "least_friction": friction.min(), "largest_velocity": velocity.max(),
        "least_state": theta.min(), **after,
    }  # fmt: skip


@case(
    "P13 the same by another code",
    "rsfmodel, cjm_model_comparison/cjm_model.vel: the model of C. J. Marone in steps of its own", 7,
    largest_friction=0.607843651, least_friction=0.583623493, largest_ln_velocity=3.562995695,
)  # fmt: skip
def velocity_step_of_marone() -> Results:
    friction, velocity, _ = tenfold_speed()
    return {
        "largest_friction": friction.max(), "least_friction": friction.min(), "largest_ln_velocity": np.log(velocity.max()),
    }  # fmt: skip


@case(
    "P8 Bouc–Wen, A = 1, β = 8, γ = 4, n = 2: k (A/(β + γ))^(1/n)",
    "Ikhouane & Rodellar, Systems with Hysteresis (2007), ch. 2", 9,
    largest_force=1.1547005383792515,
)  # fmt: skip
def bouc_wen() -> Results:
    law = ss.laws.BoucWen(stiffness=4.0, beta=8.0, gamma=4.0, exponent=2.0, amplitude=1.0)
    t = np.linspace(0.0, 20.0, 2001)
    return {"largest_force": float(np.max(ss.force_along(law, t, np.ones_like(t))))}


@case(
    "S18 LuGre block on a spring, k = 2, v = 0.1",
    "Canudas de Wit, Olsson, Åström & Lischinsky, IEEE TAC 40 (1995) 419; two implicit integrators", 8,
    first_rise_through_0p05=7.54039746, spring_force_there=1.50276511, period=6.36271982,
    period_in_the_limit_of_stiff_bristles=6.453932708291305,
)  # fmt: skip
def lugre() -> Results:
    law = ss.laws.LuGre(1e5, 316.22776601683796, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3)
    orbit = ss.integrate(ss.Oscillator(0.0, 0.1, law, stiffness=2.0), 40, tolerance=1e-12)
    slips = upcrossings(orbit, 0.05)
    # σ₀ → ∞, w_s → 0: break-away 1.5, then F = 1 + 0.4 w.
    sharp = ss.laws.PiecewiseLinear([(0, 1.0), (1, 1.4)], break_away=1.5)
    limit = ss.simulate(ss.Oscillator(0.0, 0.1, sharp, stiffness=2.0), 200)
    return {
        "first_rise_through_0p05": slips[0],
        "spring_force_there": 2.0 * float(orbit.at(slips[0])[0]),
        "period": slips[-1] - slips[-2],
        "period_in_the_limit_of_stiff_bristles": cycle(limit)["period"],
    }


@case(
    "S19 Dahl loop between ±a, f_k = 1, σ = 2", "closed form: turning force tanh(σ a/f_k)", 12,
    turning_force_at_0p25=0.4621171572600098, work_at_0p25=0.07576568547998049, turning_force_at_1=0.9640275800758169,
    work_at_1=2.071944839848366, turning_force_at_3=0.9999877116507956, work_at_3=10.00002457669841,
)  # fmt: skip
def dahl_loop() -> Results:
    law, got = ss.laws.Dahl(stiffness=2.0, kinetic=1.0), {}
    for a in (0.25, 1, 3):
        name = str(a).replace(".", "p")
        ends = np.cumsum([a] + [2 * a] * 59)
        times = np.concatenate([np.linspace(end - 2 * a, end, 4001) for end in ends])
        w = np.repeat(np.where(np.arange(60) % 2, -1.0, 1.0), 4001)
        force = ss.force_along(law, np.maximum(times, 0.0), w).reshape(60, 4001)
        simpson = a / 6000 * (force[:, 0] + force[:, -1] + 4 * force[:, 1:-1:2].sum(1) + 2 * force[:, 2:-1:2].sum(1))
        got |= {f"turning_force_at_{name}": abs(force[-1, -1]), f"work_at_{name}": simpson[-2] - simpson[-1]}
    return got
