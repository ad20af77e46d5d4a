"""The cases with known numbers, and the page docs/evidence/validation.md made from them: python docs/evidence/validation.py.

To add a case: a function that returns what the package gets, under a decorator that says what is known and from where.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.optimize import brentq

import stickslip as ss

PAGE = Path(__file__).with_suffix(".md")

INTRODUCTION = """# Known numbers

Every number below was known before: from a closed form, in 30 to 60 digits, or from independent integrators; those of
the cases P come from files and papers of others, to the digits that these have. The public functions of the package meet
all to their digits, less one; where they do not, the last column says why. The tests compute the table anew, and
`python docs/evidence/validation.py` writes it.

Unless units are given the motion is x″ + d x′ + x = f(w), w = v − x′, with the velocity v of the belt.

| case | source | quantity | expected | got | relative error | met |
|---|---|---|---|---|---|---|
"""

Results = dict[str, float]


@dataclass(frozen=True, eq=False)
class Case:
    """What is known: `expected` by quantity, to so many significant `digits`; `missed` says why a quantity is not met."""

    name: str
    source: str
    digits: int
    expected: Results
    compute: Callable[[], Results]
    missed: dict[str, str]


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    case: str
    source: str
    quantity: str
    expected: float
    got: float
    digits: int
    missed: str

    @property
    def error(self) -> float:
        """Relative to what is expected."""
        return abs(self.got - self.expected) / abs(self.expected)

    @property
    def met(self) -> bool:
        """Whether all digits but the last agree."""
        return self.error <= 10.0 ** (1 - self.digits)


CASES: list[Case] = []


def case(
    name: str, source: str, digits: int, *, missed: dict[str, str] | None = None, **expected: float
) -> Callable[[Callable[[], Results]], Callable[[], Results]]:
    """Enter a case; the names of its quantities are words joined by underscores."""

    def enter(compute: Callable[[], Results]) -> Callable[[], Results]:
        CASES.append(Case(name, source, digits, expected, compute, missed or {}))
        return compute

    return enter


def spoken(name: str) -> str:
    """A quantity in words: ``period_at_v_1p5`` is "period at v 1.5"."""
    return re.sub(r"(\d)p(\d)", r"\1.\2", name).replace("_", " ")


@functools.cache
def rows(of: Case) -> list[Row]:
    """Compute a case, once."""
    got = of.compute()
    assert got.keys() == of.expected.keys(), f"{of.name}: {got.keys() ^ of.expected.keys()}"
    return [
        Row(of.name, of.source, spoken(name), expected, float(got[name]), of.digits, of.missed.get(name, ""))
        for name, expected in of.expected.items()
    ]


def table(of: Case) -> str:
    """The rows of a case on the page; its name and source stand in the first."""
    lines = []
    for i, row in enumerate(rows(of)):
        name = (row.case, row.source) if i == 0 else ("", "")
        shown = f"{row.expected:.{row.digits}g}", f"{row.got:.{row.digits}g}", f"{row.error:.0e}"
        met = "yes" if row.met else f"no: {row.missed}"
        lines.append("| " + " | ".join((*name, row.quantity, *shown, met)) + " |\n")
    return "".join(lines)


def page() -> str:
    """The page, computed anew."""
    return INTRODUCTION + "".join(table(one) for one in CASES)


# --- what the cases have in common --------------------------------------------------------------------------------


def belt(law: ss.laws.Law, damping: float, velocity: float, t_end: float = 60.0) -> ss.Orbit:
    """A block on a belt, from x = 0 at the velocity of the belt."""
    return ss.simulate(ss.Oscillator(damping, velocity, law), t_end)


def cycle(orbit: ss.Orbit) -> Results:
    """The last stick-slip cycle."""
    events = orbit.events
    first, last = events[events["kind"] == "release"].iloc[-2:].to_dict("records")
    capture = events[(events["kind"] == "capture") & (events["t"] > first["t"])].iloc[0]
    return {
        "start": first["t"],
        "slip_time": capture["t"] - first["t"],
        "x_at_capture": capture["x"],
        "stick_time": last["stick_time"],
        "period": last["t"] - first["t"],
        "break_away": last["force"],
    }


def extremes(orbit: ss.Orbit, start: float, end: float, of: str = "x") -> tuple[float, float]:
    """The least and the largest x or v within a time: roots of its derivative between samples."""
    times = np.linspace(start, end, 2000)
    rate = {"x": "v", "v": "a"}[of]
    slopes = orbit.to_xarray(times)[rate].to_numpy()
    roots = [
        brentq(lambda t: float(orbit.to_xarray([t])[rate][0]), times[i], times[i + 1], xtol=1e-14)
        for i in np.flatnonzero(slopes[:-1] * slopes[1:] < 0)
    ]
    found = orbit.to_xarray([start, *roots, end])[of]
    return float(found.min()), float(found.max())


def slope(function: Callable[[float], float], at: float, radius: float, nodes: int = 25) -> float:
    """The derivative of a smooth function, by Chebyshev interpolation around a point."""
    near = Chebyshev.interpolate(np.vectorize(function, otypes=[float]), nodes, [at - radius, at + radius])
    return float(near.deriv()(at))


def bisect(holds: Callable[[float], bool], low: float, high: float, steps: int = 50) -> float:
    """Where a property that holds at `low` and not at `high` ends."""
    for _ in range(steps):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return 0.5 * (low + high)


def upcrossings(orbit: ss.Orbit, w: float) -> list[float]:
    """When the slip velocity rises through w."""

    def over(t: float) -> float:
        return float(orbit.system.drive_velocity - orbit.at(t)[1] - w)

    times = np.linspace(0, orbit.t_end, 40_001)
    above = orbit.system.drive_velocity - orbit.at(times)[1] >= w
    rises = np.flatnonzero(~above[:-1] & above[1:])
    return [brentq(over, times[i], times[i + 1], xtol=1e-13) for i in rises]


# --- decay and belts ----------------------------------------------------------------------------------------------

ANDRONOV = "Andronov, Vitt & Khaikin, Theory of Oscillators (1937)"


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
    orbit = belt(ss.laws.StaticKinetic(1.0, 0.6), 0.0, 0.2)
    last = cycle(orbit)
    span = last["start"], last["start"] + last["period"]
    (least, most), (slowest, _) = extremes(orbit, *span), extremes(orbit, *span, of="v")
    picked = {name: last[name] for name in ("slip_time", "stick_time", "period")}
    return {**picked, "largest_x": most, "least_x": least, "least_v": slowest}


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
    last = cycle(orbit)
    span = last["start"], last["start"] + last["period"]
    (least, most), (slowest, _) = extremes(orbit, *span), extremes(orbit, *span, of="v")
    picked = {name: last[name] for name in ("slip_time", "x_at_capture", "stick_time", "period")}
    return {**picked, "largest_x": most, "least_x": least, "least_v": slowest}


@case(
    "S6 the same with (2/π) arctan(ε w) for the sign", "two implicit integrators", 8,
    period_at_1e2=9.70968083, period_at_1e3=11.29815066, period_at_1e4=11.80799363, period_at_1e5=11.95188006,
    period_at_1e6=11.98920011, largest_x_at_1e2=0.91023681, largest_x_at_1e3=1.06707951, largest_x_at_1e4=1.1158706,
    largest_x_at_1e5=1.12938134, largest_x_at_1e6=1.13285054,
)  # fmt: skip
def regularised_leine() -> Results:
    got = {}
    for power in range(2, 7):
        law = ss.laws.Regularised(ss.laws.Rational(1.0, 3.0), width=10.0**-power)
        orbit = ss.integrate(ss.Oscillator(0.0, 0.2, law), 70, tolerance=1e-12)
        tops = orbit.events.query("kind == 'turn' and x > 0.8")
        got[f"period_at_1e{power}"] = tops["t"].diff().iloc[-1]
        got[f"largest_x_at_1e{power}"] = tops["x"].iloc[-1]
    return got


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


# --- forced oscillators -------------------------------------------------------------------------------------------


def forced(frequency: float, friction: float, damping: float = 0.0, t_end: float = 20_000.0) -> ss.Orbit:
    """x″ + d x′ + x = cos Ωt − S sgn x′."""
    return ss.simulate(
        ss.Oscillator(damping, 0.0, ss.laws.Coulomb(friction), forcing=ss.Harmonic(1.0, frequency)), t_end
    )


def amplitude(orbit: ss.Orbit) -> float:
    """The largest |x| where the mass turns or stops, late in the run."""
    late = orbit.events[orbit.events["t"] > 0.95 * orbit.t_end]
    return float(late["x"].abs().max())


def turn_ratio(orbit: ss.Orbit, frequency: float) -> float:
    """The acceleration after a turn over that before it: the determinant of the map of half a period."""
    turn = orbit.events.iloc[-2]
    after = float(orbit.to_xarray([turn["t"]])["a"][0])
    return after / (turn["force"] + math.cos(frequency * turn["t"]) - turn["x"])


@case(
    "S10 cos Ωt against Coulomb friction S, no sticking", "closed form: Den Hartog, Trans. ASME 53 (1931) 107", 14,
    amplitude_at_0p7_S_0p3=1.885699850414254, determinant_at_0p7_S_0p3=0.50980108878881,
    amplitude_at_2_S_0p2=0.3179797338056485, determinant_at_2_S_0p2=0.72824590374638,
    sticking_from_S_at_0p7=0.7220709759221043, sticking_from_S_at_2=0.5962847939999439,
    amplitude_at_0p7_S_0p3_d_0p2=1.63078609579815,
)  # fmt: skip
def den_hartog() -> Results:
    low, high = forced(0.7, 0.3), forced(2.0, 0.2)

    def slips(frequency: float) -> Callable[[float], bool]:
        def without_stick(friction: float) -> bool:
            events = forced(frequency, friction, t_end=4000).events
            return not (events["kind"].iloc[-100:] == "capture").any()

        return without_stick

    return {
        "amplitude_at_0p7_S_0p3": amplitude(low),
        "determinant_at_0p7_S_0p3": turn_ratio(low, 0.7),
        "amplitude_at_2_S_0p2": amplitude(high),
        "determinant_at_2_S_0p2": turn_ratio(high, 2.0),
        "sticking_from_S_at_0p7": bisect(slips(0.7), 0.7, 0.75),
        "sticking_from_S_at_2": bisect(slips(2.0), 0.58, 0.62),
        "amplitude_at_0p7_S_0p3_d_0p2": amplitude(forced(0.7, 0.3, 0.2)),
    }


@case(
    "S11 the same with stops", "Hong & Liu, J. Sound Vib. 229 (2000) 1171; 30 digits", 12,
    amplitude_at_0p5_S_0p8=1.0207851736111622, stick_time_at_0p5_S_0p8=1.8763013669687993,
    outer_stop_at_0p2_S_0p4=0.652046061392, inner_stop_at_0p2_S_0p4=0.528984961496,
)  # fmt: skip
def hong_liu() -> Results:
    two, four = forced(0.5, 0.8, t_end=2000), forced(0.2, 0.4, t_end=3000)
    stops = four.events.query("kind == 'capture'")["x"].abs().iloc[-4:]
    return {
        "amplitude_at_0p5_S_0p8": amplitude(two),
        "stick_time_at_0p5_S_0p8": two.events["stick_time"].dropna().iloc[-1],
        "outer_stop_at_0p2_S_0p4": stops.max(),
        "inner_stop_at_0p2_S_0p4": stops.min(),
    }


# --- files and results of others ------------------------------------------------------------------------------------


@case(
    "B1 a rotor at 3 that a pulsed brake stops, x″ = −0.6 (1 + 0.5 cos 2t)", "closed form", 14,
    stop_time=5.209615162895713, distance=7.370946284427328,
)  # fmt: skip
def pulsed_brake() -> Results:
    pulsed = ss.NormalForce(harmonics=ss.Harmonic(0.5, 2.0))
    rotor = ss.System(1.0, 0.0, 0.0, ss.Contact(0, ss.laws.Coulomb(0.6), normal_force=pulsed))
    orbit = ss.simulate(rotor, 10.0, 0.0, 3.0)
    return {"stop_time": orbit.events["t"].iloc[0], "distance": orbit.at(10.0)[0].item()}


@case(
    "B2 belt, v = 0.2, friction (1, 0.6) under N = 1 + 0.5 sin 1.3t", "closed form", 13,
    first_release=3.0869191113757912, first_capture=5.998846288446435, x_there=0.4356293884630826,
)  # fmt: skip
def brake_on_a_belt() -> Results:
    pressed = ss.NormalForce(harmonics=ss.Harmonic(0.5, 1.3, -math.pi / 2))
    events = ss.simulate(ss.Oscillator(0.0, 0.2, ss.laws.StaticKinetic(1.0, 0.6), normal_force=pressed), 7.0).events
    (release, capture), x = events["t"].iloc[:2], events["x"].iloc[1]
    return {"first_release": release, "first_capture": capture, "x_there": x}


def feeny_moon(x: float, periods: int, phase: float = 5 * math.pi / 8) -> ss.Orbit:
    """x″ + x = −(1 + 1.5 x) sgn x′ + 1.9 cos(1.25 t + phase), the normal force never below 0."""
    pressed = ss.NormalForce(position=1.5)
    system = ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(1.0), forcing=ss.Harmonic(1.9, 1.25, phase), normal_force=pressed)
    return ss.simulate(system, 2 * math.pi / 1.25 * periods, x, 0.0)


@case(
    "F1 1.9 cos 1.25t against friction 1 + 1.5 x ≥ 0: where a mass stuck at 5/16 of a period sticks a period later",
    "the oscillator of Feeny & Moon, J. Sound Vib. 170 (1994) 303, as we know it from others; another integrator", 10,
    from_0p4=1.1637290460412, from_0p6=0.6497595903184, from_0p8=0.3321630223808, from_1=0.7077803756014,
    from_1p2=1.0439067686478,
)  # fmt: skip
def feeny_moon_map() -> Results:
    images = {x: feeny_moon(x, 1).at(2 * math.pi / 1.25)[0] for x in (0.4, 0.6, 0.8, 1.0, 1.2)}
    return {f"from_{x:g}".replace(".", "p"): image for x, image in images.items()}


def bowed_string(at: int, force: float, masses: int = 39, periods: int = 30) -> tuple[float, float]:
    """Releases in a period of the string, and the share of a period for which the bow holds, in its last ten periods.

    A string of equal masses under unit tension, bowed at speed 1 on the mass number `at`, from the motion of an ideal string.
    """
    ends = np.diff(np.eye(masses + 2), axis=0)[:, 1:-1]
    tension = ends.T @ ends
    law = ss.laws.ExponentialStribeck(0.8 * force, 0.3 * force, 0.5)
    bowed = ss.System(np.ones(masses), tension, 0.005 * np.eye(masses) + 0.05 * tension, ss.Contact(at - 1, law, 1.0))
    # The corner has just left the bow for the far end: two straight lines, and the velocities of both.
    length, place = masses + 1, np.arange(1, masses + 1)
    near = place <= at
    x = np.where(near, place * (length - at), at * (length - place)) / at
    v = np.where(near, place, place - length) / at
    period = 2 * length
    events = ss.simulate(bowed, periods * period, x, v).events
    late = events[(events["t"] > (periods - 10) * period) & (events["kind"] == "release")]
    return len(late) / 10, late["stick_time"].sum() / 10 / period


@case(
    "W1 a string of 39 masses, bowed at β of its length: the motion of Helmholtz",
    "ideal string: one slip a period, the bow holds for 1 − β of it (Schelleng, J. Acoust. Soc. Am. 53 (1973) 26)", 2,
    slips_a_period_at_0p1=1.0, share_of_holding_at_0p1=0.9, slips_a_period_at_0p2=1.0, share_of_holding_at_0p2=0.8,
)  # fmt: skip
def helmholtz() -> Results:
    (slips, share), (more, less) = bowed_string(4, 24.0), bowed_string(8, 12.0)
    return {
        "slips_a_period_at_0p1": slips, "share_of_holding_at_0p1": share,
        "slips_a_period_at_0p2": more, "share_of_holding_at_0p2": less,
    }  # fmt: skip


@case(
    "P1 x″ + x = −sgn x′ from (12, 6)",
    "Siconos, examples/mechanics/FrictionOscillator/FrictionOscillator.ref: steps of 0.01 of a scheme with θ = 1/2", 4,
    missed={"v_at_0p7": "the turn at 0.4324 falls within a step of the file, which loses 0.003 of the velocity there"},
    largest_x=13.31777943672665, x_at_0p4=13.31030142940808, v_at_0p4=0.4639752142966954, x_at_0p7=12.88073364825603,
    v_at_0p7=-3.252237726902930,
)  # fmt: skip
def siconos() -> Results:
    orbit = ss.simulate(ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(1.0)), 1.0, 12.0, 6.0)
    (x, v), (later, slower) = orbit.at(0.4), orbit.at(0.7)
    return {"largest_x": orbit.events["x"].iloc[0], "x_at_0p4": x, "v_at_0p4": v, "x_at_0p7": later, "v_at_0p7": slower}


@case("P2 the same to its end", "Siconos, as P1: its steps have lost a digit by then", 3, rests_at=0.6820441351954105)
def siconos_rest() -> Results:
    return {"rests_at": ss.simulate(ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(1.0)), 100.0, 12.0, 6.0).at(100.0)[0]}


@case(
    "P3 f = 0.5 + 0.5 exp(−2w), d = 0.1, starts in [−2, 2] × [0, 2]",
    "bSTAB, case_friction: Stender & Hoffmann, Nonlinear Dyn. 107 (2022) 1451; of 5000 random starts, ± 0.007", 2,
    share_of_stick_slip_at_v_1p4=0.787, share_of_stick_slip_at_v_1p55=0.6456, share_of_stick_slip_at_v_1p7=0.5078,
)  # fmt: skip
def basin_shares() -> Results:
    law, starts = ss.laws.ExponentialStribeck(1.0, 0.5, 0.5), (np.arange(16) + 0.5) / 16

    def share(velocity: float) -> float:
        system = ss.Oscillator(0.1, velocity, law)
        found = ss.basins(system, x=4 * starts - 2, v=2 * starts, transient=30, window=4)
        return float(found["fraction"][found["attractor_regime"] == "stick_slip"].sum())

    return {f"share_of_stick_slip_at_v_1p{tail}": share(float(f"1.{tail}")) for tail in ("4", "55", "7")}


@case(
    "P4 1.5 cos ωt against Coulomb friction 1, d = 0.1, ω falling from 0.9",
    "PWS-DDE-CONT, dry friction oscillator demo: the end of its branch of orbits without sticks", 3,
    period_at_which_sticks_begin=8.7036,
)  # fmt: skip
def end_of_crossings() -> Results:
    swing = ss.Oscillator(0.1, 0.0, ss.laws.Coulomb(1.0), forcing=ss.Harmonic(1.5, 0.9))
    points = ss.continuation(swing, "forcing.frequency", (0.71, 0.91), guess=(0.0, 5.0), seeds=0).special_points
    (frequency,) = (point.parameter for point in points if point.kind == "crossing_sliding")
    return {"period_at_which_sticks_begin": 2 * math.pi / frequency}


@case(
    "P5 cos t/2 against Coulomb friction 0.2, no damping",
    "a continuum of marginal orbits: Csernák, Stépán & Shaw, Nonlinear Dyn. 50 (2007) 93", 10,
    multiplier_from_1p3=1.0, multiplier_from_1p35=1.0, periods_of_the_forcing=1.0,
)  # fmt: skip
def continuum() -> Results:
    swing = ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(0.2), forcing=ss.Harmonic(1.0, 0.5))
    first, second = (ss.periodic_orbit(swing, (x, 0.0)) for x in (1.3, 1.35))
    assert abs(first.state[1]) != abs(second.state[1])
    return {
        "multiplier_from_1p3": first.largest,
        "multiplier_from_1p35": second.largest,
        "periods_of_the_forcing": float(first.forcing_periods),
    }


MODELICA = "Modelica Association, MAP-LIB_ReferenceResults (Dymola 2020x, tolerance 1e-6)"


@case(
    "P9 x″ + x′ = 25 sin(π t/2) − (5 + 10 exp(−2 abs x′)) sgn x′ from rest",
    f"{MODELICA}: Mechanics.Translational.Examples.Friction, stop1", 5,
    x_at_5=1.76846282132044, v_at_5=6.86485858981257,
)  # fmt: skip
def modelica_friction() -> Results:
    contact = ss.Contact(mass=0, law=ss.laws.ExponentialStribeck(15.0, 5.0, 0.5))
    force = ss.Force(25.0, 0.5 * math.pi, phase=-0.5 * math.pi)
    orbit = ss.simulate(ss.System([1.0], [0.0], contacts=[contact], damping=[1.0], forcing=[force]), 5.0)
    x, v = orbit.at(5.0)
    return {"x_at_5": x[0], "v_at_5": v[0]}


@case(
    "P10 x″ + x′ + 500 (x + 0.25) = −(3 + 5 exp(−2 abs x′)) sgn x′ from (0, −5), caught by a stop at −0.4",
    f"{MODELICA}: Mechanics.Translational.Examples.Friction, stop2", 6,
    v_before_the_stop=-6.10568215752555, rests_at=-0.247515847991475,
)  # fmt: skip
def modelica_stop() -> Results:
    block = ss.Oscillator(1.0, 0.0, ss.laws.ExponentialStribeck(8.0, 3.0, 0.5), stiffness=500.0)
    arrives = 0.0605969540580153
    # The stop itself is no part of the system: what follows it starts from it, at rest.
    return {
        "v_before_the_stop": ss.simulate(block, arrives, x0=0.25, v0=-5.0).at(arrives)[1],
        "rests_at": ss.simulate(block, 5.0 - arrives, x0=-0.15, v0=0.0).at(5.0 - arrives)[0] - 0.25,
    }


@case(
    "P11 drive train of three inertias with a clutch of 80 N m and, from 0.5 s on, a brake of 800 N m",
    f"{MODELICA}: Mechanics.Rotational.Examples.Friction", 5,
    clutch_locks_at=0.0067797089998355, clutch_opens_at=0.0593397659130555, speed_there=96.6432003611788,
    angle_at_3=101.564999390897, speed_at_3=2.28989099827674, twist_at_3=0.195985155867467,
)  # fmt: skip
def modelica_drive_train() -> Results:
    train = {
        "mass": [1.0, 0.05, 1.0],
        "stiffness": [[0, 0, 0], [0, 160, -160], [0, -160, 160]],
        "damping": [[0, 0, 0], [0, 1, -1], [0, -1, 1]],
    }
    clutch = ss.Contact(mass=0, other=1, law=ss.laws.Coulomb(80.0))
    brake = ss.Contact(mass=2, law=ss.laws.Coulomb(800.0))
    motor = ss.Force(200.0, 100.0, phase=-0.5 * math.pi, mass=0)
    driven = ss.simulate(ss.System(**train, contacts=[clutch], forcing=[motor]), 0.5, v0=[100, 90, 90])
    locks, opens = driven.events["t"].iloc[:2]
    braked = ss.simulate(ss.System(**train, contacts=[clutch, brake]), 2.5, *driven.at(0.5))
    x, v = braked.at(2.5)
    return {
        "clutch_locks_at": locks, "clutch_opens_at": opens, "speed_there": driven.at(opens)[1][0],
        "angle_at_3": x[0], "speed_at_3": v[0], "twist_at_3": x[2] - x[1],
    }  # fmt: skip


# --- laws with an internal state ----------------------------------------------------------------------------------

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


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
