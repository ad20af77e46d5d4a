"""Known numbers of decay and of blocks on belts."""

from __future__ import annotations

import math

import numpy as np
from known.case import Results, belt, bisect, case, cycle, extremes, slope
from numpy.polynomial import Chebyshev
from scipy.optimize import brentq

import stickslip as ss

ANDRONOV = "Andronov, Vitt & Khaikin, Theory of Oscillators (1937)"


def cycle_with_extremes(orbit: ss.Orbit, *names: str) -> Results:
    """These numbers of the last cycle of an orbit, and its extreme positions and least velocity."""
    last = cycle(orbit)
    span = last["start"], last["start"] + last["period"]
    (least, most), (slowest, _) = extremes(orbit, *span), extremes(orbit, *span, of="v")
    return {**{name: last[name] for name in names}, "largest_x": most, "least_x": least, "least_v": slowest}


def decay(damping: float) -> Results:
    orbit = ss.simulate(ss.Oscillator(damping, 0.0, ss.laws.Coulomb(0.5)), 100, x0=5.3, v0=0.0)
    turns = {f"turn_{i}": x for i, x in enumerate(orbit.events["x"], 1)}
    return {**turns, "half_cycles": len(orbit.events), "stop_time": orbit.events["t"].iloc[-1]}


@case(
    "S1 Coulomb decay, friction 0.5, from 5.3", "closed form: Den Hartog, Trans. ASME 53 (1931) 107", 15,
    turn_1=-4.3, turn_2=3.3, turn_3=-2.3, turn_4=1.3, turn_5=-0.3, half_cycles=5, stop_time=15.707963267948966,
)  # fmt: skip
def coulomb_decay() -> Results:
    return decay(0.0)


@case(
    "S2 the same with d = 0.1", "closed form", 13,
    turn_1=-3.6014458864324, turn_2=2.1500859318544, turn_3=-0.90994544947171, turn_4=-0.1497147755422,
    half_cycles=4, stop_time=12.582108091552007,
)  # fmt: skip
def damped_coulomb_decay() -> Results:
    return decay(0.1)


@case(
    "S3 belt, f_s = 1, f_k = 0.6, v = 0.2", f"closed form: {ANDRONOV}", 15,
    slip_time=4.068887871591405, stick_time=4.0, period=8.068887871591405,
    largest_x=1.047213595499958, least_x=0.15278640450004205, least_v=-0.4472135954999579,
)  # fmt: skip
def static_kinetic_belt() -> Results:
    return cycle_with_extremes(belt(ss.laws.StaticKinetic(1.0, 0.6), 0.0, 0.2), "slip_time", "stick_time", "period")


@case(
    "S3 with ten such blocks in a row, in unison", f"closed form: {ANDRONOV}", 15,
    slip_time=4.068887871591405, stick_time=4.0, period=8.068887871591405,
)  # fmt: skip
def ten_blocks_in_unison() -> Results:
    # The unison is unstable: rounding grows by half in each of its cycles, so few are looked at.
    orbit = ss.simulate(ss.chain(10, ss.laws.StaticKinetic(1.0, 0.6), 0.2, coupling=1.2), 50)
    orbit.events = orbit.events[orbit.events["contact"] == 7]
    return {name: value for name, value in cycle(orbit).items() if name in ("slip_time", "stick_time", "period")}


@case(
    "S3b the same with d = 0.1", "closed form", 14,
    slip_time=4.218101414516002, x_at_capture=0.2967000831884159, stick_time=3.416499584057921, period=7.634600998573922,
)  # fmt: skip
def damped_static_kinetic_belt() -> Results:
    last = cycle(belt(ss.laws.StaticKinetic(1.0, 0.6), 0.1, 0.2))
    return {name: last[name] for name in ("slip_time", "x_at_capture", "stick_time", "period")}


@case(
    "S5 f = 1/(1 + 3w), v = 0.2",
    "Leine, van Campen, de Kraker & van den Steen, Nonlinear Dyn. 16 (1998) 41; 60 digits", 12,
    slip_time=4.295999525480155, x_at_capture=-0.541006353870085, stick_time=7.70503176935042, period=12.00103129483058,
    largest_x=1.133944676442, least_x=-0.55543269006, least_v=-0.839902049281,
)  # fmt: skip
def leine() -> Results:
    orbit = belt(ss.laws.Rational(1.0, 3.0), 0.0, 0.2)
    return cycle_with_extremes(orbit, "slip_time", "x_at_capture", "stick_time", "period")


@case(
    "S6 the same with (2/π) arctan(ε w) for the sign", "two implicit integrators", 8,
    period_at_1e2=9.70968083, period_at_1e3=11.29815066, period_at_1e4=11.80799363, period_at_1e5=11.95188006,
    period_at_1e6=11.98920011, largest_x_at_1e2=0.91023681, largest_x_at_1e3=1.06707951, largest_x_at_1e4=1.1158706,
    largest_x_at_1e5=1.12938134, largest_x_at_1e6=1.13285054,
)  # fmt: skip
def regularised_leine() -> Results:
    got = {}
    for power in range(2, 7):
        got[f"period_at_1e{power}"], got[f"largest_x_at_1e{power}"] = regularised(power)
    return got


def regularised(power: int) -> tuple[float, float]:
    """The period and the largest x with ε = 10^power."""
    law = ss.laws.Regularised(ss.laws.Rational(1.0, 3.0), width=10.0**-power)
    orbit = ss.integrate(ss.Oscillator(0.0, 0.2, law), 70, tolerance=1e-12)
    tops = orbit.events.query("kind == 'turn' and x > 0.8")
    return tops["t"].diff().iloc[-1], tops["x"].iloc[-1]


@case(
    "P14 the same, ε = 1000",
    "R. I. Leine, Keynote_Nonsmooth_Dynamics_ENOC2024, stickslip_system/script.m: start and time of its closed curve", 4,
    period=11.30, largest_x=1.067,
)  # fmt: skip
def leine_of_the_keynote() -> Results:
    period, largest = regularised(3)
    return {"period": period, "largest_x": largest}


@case(
    "S7 f = 0.5 + 0.5 exp(−2w), d = 0.1", "Papangelo, Ciavarella & Hoffmann, Nonlinear Dyn. 90 (2017) 2037", 11,
    hopf_velocity=1.151292546497023, period_at_v_1p5=6.316306357891, stick_time_at_v_1p5=0.505485542354,
    largest_x_at_v_1p5=2.20649613015, least_x_at_v_1p5=-0.952825782649,
)  # fmt: skip
def exponential_weakening() -> Results:
    law = ss.laws.ExponentialStribeck(break_away=1.0, kinetic=0.5, scale=0.5)
    orbit = belt(law, 0.1, 1.5)
    last = cycle(orbit)
    least, most = extremes(orbit, last["start"], last["start"] + last["period"])
    return {
        # Steady slip loses its damping where d + f′(v) = 0.
        "hopf_velocity": brentq(lambda v: 0.1 + slope(law.kinetic_force, v, 0.3), 1.0, 1.3, xtol=1e-14),
        "period_at_v_1p5": last["period"],
        "stick_time_at_v_1p5": last["stick_time"],
        "largest_x_at_v_1p5": most,
        "least_x_at_v_1p5": least,
    }


@case(
    "S8 f = 0.4 − 0.45w + 0.6w³, d = 0.1", "Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389; 30 digits", 11,
    hopf_velocity=0.440958551844098, end_of_stick_slip=0.395790288797834, its_estimate_by_averaging=0.394405318873308,
    slip_amplitude_at_v_0p43=0.196716470765, period_at_v_0p1=7.209296758701, stick_time_at_v_0p1=2.148884511447,
    largest_x_at_v_0p1=0.483161521397, least_x_at_v_0p1=0.151840125188,
)  # fmt: skip
def cubic_friction() -> Results:
    law = ss.laws.Cubic(static=0.4, linear=0.45, cubic=0.6)
    hopf = brentq(lambda v: 0.1 + slope(law.kinetic_force, v, 0.1), 0.4, 0.5, xtol=1e-14)
    orbit = belt(law, 0.1, 0.1)
    last = cycle(orbit)
    least, most = extremes(orbit, last["start"], last["start"] + last["period"])
    slipping = belt(law, 0.1, 0.43, 8000)

    def sticks_again(v: float) -> bool:
        # From the point where adhesion breaks; at the end of stick-slip the orbit comes back to it and grazes.
        orbit = ss.simulate(ss.Oscillator(0.1, v, law), 9, x0=0.4 - 0.1 * v)
        return bool((orbit.events["kind"] == "capture").any())

    low, high = extremes(slipping, 7990, 8000)
    return {
        "hopf_velocity": hopf,
        "end_of_stick_slip": bisect(sticks_again, 0.38, 0.41),
        "its_estimate_by_averaging": math.sqrt(0.8) * hopf,
        "slip_amplitude_at_v_0p43": 0.5 * (high - low),
        "period_at_v_0p1": last["period"],
        "stick_time_at_v_0p1": last["stick_time"],
        "largest_x_at_v_0p1": most,
        "least_x_at_v_0p1": least,
    }


@case(
    "S12 f = 1.5 − 1.5w + 0.45w³, v = 1, forcing 0.1 cos ωt",
    "di Bernardo, Kowalczyk & Nordmark, Int. J. Bifurcation Chaos 13 (2003) 2935", 8,
    grazing_frequency=1.7077997,
)  # fmt: skip
def yoshitake() -> Results:
    law = ss.laws.Cubic(static=1.5, linear=1.5, cubic=0.45)

    def sticks(frequency: float) -> bool:
        orbit = ss.simulate(ss.Oscillator(0.0, 1.0, law, forcing=ss.Harmonic(0.1, frequency)), 2000)
        return bool((orbit.events["t"] > 1500).any())

    return {"grazing_frequency": bisect(sticks, 1.70, 1.72, steps=30)}


@case(
    "S15 f_s = 0.5 + 0.5 (1 − exp(−0.4 t)), f_k = 0.5", "map of the break-away force: Brockley, Cameron & Potter (1967)", 14,
    growth_at_v_0p3=0.2271974917196251, stick_time_at_v_0p3=1.514649944797501, period_at_v_0p3=6.501489987952009,
    multiplier_at_v_0p3=0.5716763248216287, critical_velocity=0.4,
)  # fmt: skip
def dwell_time() -> Results:
    law = ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.4)
    last = cycle(belt(law, 0.0, 0.3, 2000))
    growth = last["break_away"] - 0.5

    def following(before: float) -> float:
        # Undamped slip ends as far below f_k as it began above.
        events = ss.simulate(ss.Oscillator(0.0, 0.3, law), 20, x0=0.5 - before).events
        return float(events["force"].iloc[0]) - 0.5

    # Runs below it: the velocity over the stick time they settle on, where that vanishes.
    speeds = 0.3175 + 0.0675 * np.cos(math.pi * (np.arange(20) + 0.5) / 20)
    times = [cycle(belt(law, 0.0, speed, 6000))["stick_time"] for speed in speeds]
    return {
        "growth_at_v_0p3": growth,
        "stick_time_at_v_0p3": last["stick_time"],
        "period_at_v_0p3": last["period"],
        "multiplier_at_v_0p3": slope(following, growth, 0.15),
        # 2 γ Δ∞: the multiplier q/(1 − q), q = f_s′(t)/v, is 1 there for vanishing rest.
        "critical_velocity": float(Chebyshev.fit(times, speeds, 10)(0.0)),
    }


@case(
    "S16 f = 1 − 2w below w = 0.2, 0.6 + 0.1 (w − 0.2) above, d = 0.05, v = 0.3", "closed form per piece", 15,
    first_piece=0.8649705038849538, second_piece=3.536793957955501, third_piece=0.3375326825628589,
    slip_time=4.739297144403314, x_at_capture=0.21747639034318725, stick_time=2.5584120321893757, period=7.297709176592689,
)  # fmt: skip
def piecewise_linear_belt() -> Results:
    orbit = belt(ss.laws.PiecewiseLinear([(0, 1), (0.2, 0.6), (0.3, 0.61)], break_away=1.0), 0.05, 0.3)
    last = cycle(orbit)
    release = last["start"]
    nodes = orbit.events.query("kind == 'node' and t > @release")["t"].to_numpy()[:2]
    picked = {name: last[name] for name in ("slip_time", "x_at_capture", "stick_time", "period")}
    end = release + last["slip_time"]
    return {
        "first_piece": nodes[0] - release, "second_piece": nodes[1] - nodes[0], "third_piece": end - nodes[1], **picked,
    }  # fmt: skip


@case(
    "S20 friction 0.3 sgn w′ beside a constant, amplitude 1", "closed form: 2π + 4h/(A − h), set-valued", 10,
    period=7.997471021465301,
)  # fmt: skip
def sign_of_acceleration() -> Results:
    law = ss.laws.TwoBranch(rising=1.3, falling=0.7, break_away=1.3)
    orbit = ss.simulate(ss.Oscillator(0.0, 2.0, law), 500, x0=2.0, v0=0.0)
    hold = orbit.events.query("kind == 'hold'")["t"]
    return {"period": hold.iloc[-1] - hold.iloc[-3]}
