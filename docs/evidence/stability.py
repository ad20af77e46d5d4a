"""The known numbers of stability, and their table: python docs/evidence/stability.py.

Each is a closed form, a published number, or a root of equations written down here that share nothing with the package: the
motion of x″ + d x′ + x = F cos Ωt + constant between two events is known, so an orbit with given events is a few equations.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

import stickslip as ss

PAGE = Path(__file__).with_suffix(".md")
BEGIN, END = "<!-- numbers: made by docs/evidence/stability.py -->", "<!-- end of numbers -->"
HEAD = "| quantity | source | expected | got | difference |\n|---|---|---|---|---|"


@dataclass(frozen=True)
class Row:
    """One line of the table; `digits` after the point that are known."""

    quantity: str
    source: str
    expected: float
    got: float
    digits: int

    @property
    def met(self) -> bool:
        """Whether it is right to the digits that are known."""
        return abs(self.got - self.expected) <= 10.0**-self.digits

    def __str__(self) -> str:
        shown = f"{self.expected:.{self.digits}f} | {self.got:.{self.digits}f} | < 1e-{self.digits}"
        return f"| {self.quantity} | {self.source} | {shown if self.met else shown + ' MISSED'} |"


CASES: list[Callable[[], list[Row]]] = []


def case(compute: Callable[[], list[Row]]) -> Callable[[], list[Row]]:
    """A case of the table."""
    kept = functools.cache(compute)
    CASES.append(kept)
    return kept


def den_hartog(omega: float, friction: float, damping: float = 0.0) -> ss.Oscillator:
    """x″ + d x′ + x = cos Ω t − S sgn x′."""
    return ss.Oscillator(damping, 0.0, ss.laws.Coulomb(friction), forcing=ss.Harmonic(1.0, omega))


def thomsen_fidlin(velocity: float, forcing: ss.Harmonic | None = None) -> ss.Oscillator:
    """Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389: β = 0.05, μ_s = 0.4, μ_m = 0.25, v_m = 0.5."""
    return ss.Oscillator(0.1, velocity, ss.laws.Cubic(0.4, 0.45, 0.6), forcing=forcing)


def slider(amplitude: float, frequency: float = 2.0) -> ss.Oscillator:
    """x″ + x = f + u cos Ω t on a belt of v = 0.3, f_s = 1, f_k = 0.4."""
    law = ss.laws.StaticKinetic(1.0, 0.4)
    return ss.Oscillator(0.0, 0.3, law, forcing=ss.Harmonic(amplitude, frequency))


@functools.cache
def specials(system: ss.Oscillator, parameter: str, bounds: tuple[float, float]) -> list[Any]:
    """The special points of the branch through the settled motion."""
    return ss.continuation(system, parameter, bounds, seeds=0).special_points


def special(system: ss.Oscillator, parameter: str, bounds: tuple[float, float], kind: str) -> float:
    """The parameter of the only point of a kind between bounds."""
    (value,) = [item.parameter for item in specials(system, parameter, bounds) if item.kind == kind]
    return value


def motion(
    t: float, start: tuple[float, float, float], constant: float, forcing: tuple[float, float], damping: float = 0.0
) -> tuple[float, float]:
    """x and v at t of x″ + d x′ + x = constant + F cos Ω t from (t₀, x₀, v₀)."""
    (t0, x0, v0), (force, omega) = start, forcing
    real, imaginary = 1 - omega**2, damping * omega
    share = force / (real**2 + imaginary**2)

    def wave(t: float) -> tuple[float, float]:
        cos, sin = math.cos(omega * t), math.sin(omega * t)
        return share * (real * cos + imaginary * sin), share * omega * (imaginary * cos - real * sin)

    a, b = x0 - constant - wave(t0)[0], v0 - wave(t0)[1]
    half = damping / 2
    rate = math.sqrt(1 - half**2)
    b = (b + half * a) / rate
    tau = t - t0
    decay, cos, sin = math.exp(-half * tau), math.cos(rate * tau), math.sin(rate * tau)
    x = decay * (a * cos + b * sin)
    v = decay * ((b * rate - half * a) * cos - (a * rate + half * b) * sin)
    return constant + wave(t)[0] + x, wave(t)[1] + v


def solved(equations: Callable[[np.ndarray], list[float]], guess: list[float]) -> np.ndarray:
    """A root, its residual checked."""
    root = fsolve(equations, guess, xtol=1e-13)
    assert np.abs(equations(root)).max() < 1e-12
    return root


@case
def multipliers() -> list[Row]:
    """Multipliers in closed form."""
    dwell = ss.periodic_orbit(ss.Oscillator(0.0, 0.3, ss.laws.DwellTime(0.5, 0.5, 0.4)))
    rows = [
        Row(
            "multiplier of stick-slip with dwell time",
            "q/(1 − q), closed form",
            0.5716763248216287,
            dwell.multipliers[1].real,
            11,
        )
    ]
    for omega, friction, size in ((0.7, 0.3, 0.50980108878881), (2.0, 0.2, 0.72824590374638)):
        got = float(np.abs(ss.periodic_orbit(den_hartog(omega, friction)).multipliers).max())
        name = f"size of both multipliers of motion without stops, Ω = {omega:g}, S = {friction:g}"
        rows.append(Row(name, "Den Hartog 1930, closed form", size, got, 12))
    sign = ss.laws.TwoBranch(rising=1.3, falling=0.7, break_away=1.3)
    cycle = ss.periodic_orbit(ss.Oscillator(0.0, 3.0, sign), guess=(2.0, 0.0))
    return [*rows, Row("period of x″ + x = 0.3 sgn w′, A = 1", "closed form", 7.997471021465301, cycle.period, 11)]


@case
def steady_slip() -> list[Row]:
    """Hopf points in closed form, the nonsmooth one of the paper included."""
    belt = ss.Oscillator(0.1, 1.1, ss.laws.ExponentialStribeck(1.0, 0.5, 0.5))
    hopf = special(belt, "drive_velocity", (1.05, 1.2), "hopf")
    rows = [Row("Hopf speed, exponential law", "½ ln 10", 0.5 * math.log(10), hopf, 12)]
    bounds = (0.39, 0.45)
    hopf, grazing = (
        special(thomsen_fidlin(0.43), "drive_velocity", bounds, kind) for kind in ("hopf", "grazing_sliding")
    )
    source = "Thomsen & Fidlin 2003, 12 digits"
    rows += [
        Row("Hopf speed, cubic law", source, 0.440958551844098, hopf, 12),
        Row("grazing-sliding speed, cubic law", source, 0.395790288797834, grazing, 11),
    ]
    for name in ("default", "one f_s(0)"):
        paper = ss.paper.calibration.CALIBRATIONS[name]
        bears = paper.law.break_away_force
        lies = brentq(lambda s, bears=bears: bears(0.0, s) - 3.41 * s + 0.28, 0.3, 0.5, xtol=1e-15)
        got = special(paper.oscillator(0.38), "drive_velocity", (0.3, 0.5), "nonsmooth_hopf")
        rows.append(Row(f"nonsmooth Hopf speed of the paper, {name}", "f_s(0, s) = 3.41 s − 0.28", lies, got, 10))
    return rows


@case
def sliding() -> list[Row]:
    """The four sliding bifurcations of the forced Coulomb oscillator (grazing-sliding: see the cubic law)."""
    rows = []
    for omega, friction in ((0.7, 0.7220709759221043), (2.0, 0.5962847939999439)):
        got = special(
            den_hartog(omega, friction - 0.05), "law.kinetic", (friction - 0.1, friction + 0.1), "crossing_sliding"
        )
        rows.append(Row(f"crossing-sliding, end of motion without stops, Ω = {omega:g}", "A Ω² = S", friction, got, 11))

    def adding(z: np.ndarray) -> list[float]:
        # Stuck at a = 1 − S, where the force is S at cos Ωt = 1; from −a it was released at cos Ωt₀ = S − a.
        friction, end = z
        a = 1 - friction
        begin = -math.acos(friction - a) / 0.2
        x, v = motion(end, (begin, -a, 0.0), -friction, (1.0, 0.2))
        return [x - a, v]

    friction = float(solved(adding, [0.43, -3.0])[0])
    source = "orbit whose stick touches its limit, closed form"
    for side, bounds in ((0.4, (0.38, 0.46)), (0.46, (0.38, 0.48))):
        got = special(den_hartog(0.2, side), "law.kinetic", bounds, "adding_sliding")
        rows.append(Row(f"adding-sliding, Ω = 0.2, from S = {side:g}", source, friction, got, 10))

    def switching(z: np.ndarray) -> list[float]:
        # From −a to rest at a, where the force that would hold it is −S.
        friction, begin, end = z
        a = friction - math.cos(0.4 * begin)
        x, v = motion(end, (begin, -a, 0.0), -friction, (1.0, 0.4), 0.1)
        return [x - a, v, x - math.cos(0.4 * end) - friction]

    friction = float(solved(switching, SWITCHING)[0])
    got = special(den_hartog(0.4, 0.25, 0.1), "law.kinetic", (0.1, 0.4), "switching_sliding")
    source = "orbit that stops where adhesion begins, closed form"
    return [*rows, Row("switching-sliding, Ω = 0.4, d = 0.1", source, friction, got, 9)]


#: Near S, release and stop.
SWITCHING = [0.17, -7.07, -0.8]


def release_map(begin: float, amplitude: float, omega: float) -> float:
    """From a release of the slider to the next one."""
    forcing = (amplitude, omega)
    start = (begin, 1.0 + amplitude * math.cos(omega * begin), 0.3)

    def first(function: Callable[[float], float], after: float) -> float:
        # Both rise from below: the speed of the mass to that of the belt, the force to what adhesion bears.
        times = after + np.linspace(1e-3, 12.0, 3000)
        values = [function(t) for t in times]
        i = next(i for i in range(1, len(values)) if values[i - 1] < 0 <= values[i])
        return brentq(function, times[i - 1], times[i], xtol=1e-15)

    end = first(lambda t: motion(t, start, 0.4, forcing)[1] - 0.3, begin)
    stuck = motion(end, start, 0.4, forcing)[0]
    return first(lambda t: stuck + 0.3 * (t - end) - amplitude * math.cos(omega * t) - 1.0, end)


@case
def by_multipliers() -> list[Row]:
    """Flips, folds and tori against maps and integrations of their own."""
    rows = []
    for kind, omega, periods, releases, near, guess, bounds in FLIPS_AND_FOLDS:
        cycle = ss.periodic_orbit(slider(near, omega), periods=periods)
        events = cycle.orbit.events
        begin = float(cycle.state[0] + events["t"][events["kind"] == "release"].iloc[0])

        def after(t: float, u: float, omega: float = omega, releases: int = releases) -> float:
            for _ in range(releases):
                t = release_map(t, u, omega)
            return t

        def equations(z: np.ndarray) -> list[float]:
            t, u = z
            one, two = (after(t + h, u) - after(t - h, u) for h in (1e-4, 2e-4))
            slope = (8 * one - two) / 12e-4
            return [after(t, u) - t - periods * 2 * math.pi / omega, slope + (1.0 if kind == "flip" else -1.0)]  # noqa: B023

        expected = float(fsolve(equations, [begin, guess], xtol=1e-9)[1])
        got = special(slider(near, omega), "forcing.amplitude", bounds, kind)
        name = f"{kind} of forced stick-slip, Ω = {omega:g}, {periods} periods"
        rows.append(Row(name, "map of releases, its slope", expected, got, 8))
    forced = thomsen_fidlin(0.43, ss.Harmonic(0.02, 1.05))
    got = special(forced, "forcing.amplitude", (0.01, 0.03), "neimark_sacker")
    size = abs(integrated(0.43, got, 1.05)[0])
    name = f"size of the multipliers at the Neimark–Sacker point, u = {got:.9f}"
    return [*rows, Row(name, "1; integrated by DOP853", 1.0, size, 8)]


#: Kind, Ω, periods of the forcing, releases in them, an amplitude near it and a guess of its own, bounds.
FLIPS_AND_FOLDS = [
    ("flip", 2.0, 5, 2, 0.2, 0.2207, (0.1, 0.23)),
    ("fold", 2.0, 5, 2, 0.2, 0.1128, (0.1, 0.23)),
    ("flip", 1.8, 2, 1, 0.35, 0.3989, (0.3, 0.42)),
]


def integrated(velocity: float, amplitude: float, frequency: float) -> np.ndarray:
    """The multipliers of the slip motion of period one, by a general integrator of the variational equation."""
    period = 2 * math.pi / frequency

    def flow(t: float, y: np.ndarray) -> list[float]:
        w = velocity - y[1]
        friction, slope = 0.4 - 0.45 * w + 0.6 * w**3, 0.45 - 1.8 * w**2
        acceleration = friction + amplitude * math.cos(frequency * t) - 0.1 * y[1] - y[0]
        return [y[1], acceleration, y[4], y[5], *(-y[2:4] + (slope - 0.1) * y[4:6])]

    start = np.array([0.3, 0.0])
    for _ in range(20):
        end = solve_ivp(flow, (0, period), [*start, 1, 0, 0, 1], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        matrix = end[2:].reshape(2, 2)
        step = np.linalg.solve(matrix - np.eye(2), end[:2] - start)
        start = start - step
        if np.abs(step).max() < 1e-12:
            break
    return np.linalg.eigvals(matrix)


def table() -> str:
    """The table as Markdown."""
    return "\n".join([BEGIN, HEAD, *(str(row) for compute in CASES for row in compute()), END])


def page() -> str:
    """The page with its table made anew."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    return before + table() + rest.partition(END)[2]


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
