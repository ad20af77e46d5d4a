"""Critical velocities of random chains against plain runs; writes their section of docs/evidence/critical-velocities.md.

    python docs/evidence/critical_chains.py [--keep RESULTS.jsonl] [--count N] [--first SEED]

Each chain is drawn from its own seed. The runs are those of `stickslip.simulate` and nothing of `stickslip.dynamics` looks at
them. Results are kept line by line: a run that was ended goes on where it was.
"""

from __future__ import annotations

import argparse
import itertools
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from critical_velocities import cases

import stickslip as ss

PAGE = Path(__file__).with_name("critical-velocities.md")
HEADING = "\n## Chains\n"
COUNT, SPEEDS = 24, 100
#: Cycles of the slowest mode: of a run at each speed, where two neighbours differ, and beside a reported velocity.
SHORT, LONGEST = 120, 3000
#: How far beside a reported velocity runs look at it, relative to it.
WIDTHS = (1e-3, 1e-2)
#: A smaller share of the time is no stick-slip: where slip is neutral masses stick now and then, ever more rarely.
LEAST_SHARE = 1e-4


def chain(seed: int) -> tuple[ss.System, tuple[float, float] | None]:
    """A random chain of 2 to 5 masses on one drive, half of them alike, a third undamped, and the bounds for its search."""
    rng = np.random.default_rng(seed)
    uniform = rng.uniform
    n = int(rng.integers(2, 6))
    alike = rng.random() < 0.5
    names = (
        "StaticKinetic",
        "Coulomb",
        "ExponentialStribeck",
        "Lorentzian",
        "PiecewiseLinear",
        "DwellTime",
        "Rational",
    )
    name = names[seed % len(names)]

    def law() -> ss.laws.Law:
        kinetic = uniform(0.4, 0.9)
        high, scale = kinetic + uniform(0.1, 0.6), uniform(0.1, 0.8)
        rising = uniform(0, 0.3) * (high - kinetic) / scale
        match name:
            case "StaticKinetic":
                return ss.laws.StaticKinetic(high, kinetic)
            case "Coulomb":
                return ss.laws.Coulomb(kinetic)
            case "ExponentialStribeck":
                return ss.laws.ExponentialStribeck(high, kinetic, scale, rising)
            case "Lorentzian":
                return ss.laws.Lorentzian(high, kinetic, scale, rising)
            case "DwellTime":
                return ss.laws.DwellTime(kinetic, high - kinetic, uniform(0.05, 0.5))
            case "Rational":
                return ss.laws.Rational(high, uniform(0.1, 2))
        nodes = [(0.0, high), (scale, kinetic), (2.5 * scale, kinetic + uniform(0.0, 0.3))]
        return ss.laws.PiecewiseLinear(nodes, high)

    first = law()
    laws = [first if alike else law() for _ in range(n)]
    damping = 0.0 if rng.random() < 1 / 3 else 10 ** uniform(-2.5, -0.5)
    system = ss.chain(n, laws, 0.3, coupling=10 ** uniform(-1, 0.7), damping=damping)
    if not alike:
        system = replace(system, mass=uniform(0.5, 2.0, n).tolist())
    low = 10 ** uniform(-1.5, -0.5)
    bounds = (low, low + uniform(0.5, 2))
    return system, bounds if rng.random() < 0.5 else None


def driven(system: ss.System, speed: float) -> ss.System:
    """The system at another drive velocity."""
    return replace(system, contacts=[replace(contact, drive_velocity=speed) for contact in system.contacts])


def slowest(system: ss.System) -> float:
    """The slowest natural period."""
    squares = np.linalg.eigvals(np.linalg.solve(np.array(system.mass), np.array(system.stiffness))).real
    return 2 * math.pi / math.sqrt(float(squares.min()))


def positions(system: ss.System) -> Any:
    """Where a run starts stuck: unlike positions of up to a tenth of what static friction displaces a mass alone."""
    reach = max(
        float(np.max(contact.law.break_away_force())) / system.stiffness[contact.mass][contact.mass]
        for contact in system.contacts
    )
    return 0.1 * reach * (np.arange(system.masses) * (math.sqrt(5) - 1) / 2 % 1)


def run(system: ss.System, speed: float, cycles: float, start: tuple[Any, Any] | None = None) -> tuple[bool, Any]:
    """Whether a run sticks until its end, and no less than before, and where it ends; default start: stuck."""
    system = driven(system, speed)
    slow = slowest(system)
    # Slow cycles load the springs by no more than twice the static friction.
    reach = 10 * positions(system).max() + 1
    t_end = cycles * slow + min(cycles, 30) * 2 * reach / speed
    orbit = ss.simulate(system, t_end, *(start or (positions(system), None)), max_events=20_000_000)
    when, kinds, held = (orbit.events[name].to_numpy() for name in ("t", "kind", "stick_time"))
    held = np.where(kinds == "release", held, 0.0) / (0.15 * t_end * len(system.contacts))
    shares = [held[(when > begin * t_end) & (when <= (begin + 0.15) * t_end)].sum() for begin in (0.5, 0.85)]
    return bool(shares[1] > max(0.5 * shares[0], LEAST_SHARE)), orbit.at(orbit.t_end)


def sticks(system: ss.System, speed: float, cycles: float) -> bool:
    """Whether a run from a stuck start sticks until its end."""
    return run(system, speed, cycles)[0]


def aside(system: ss.System, speed: float, share: float) -> tuple[Any, Any]:
    """A state beside steady slip."""
    force = np.zeros(system.masses)
    for contact in system.contacts:
        force[contact.mass] += float(contact.law.kinetic_force(speed))
    velocities = share * speed * np.cos(np.arange(system.masses) ** 2 + 0.5)
    return np.linalg.solve(np.array(system.stiffness), force), velocities


def attracts_on_one_side(system: ss.System, here: float, there: float) -> bool:
    """Whether a motion that sticks and goes on at one speed ceases to stick at the other."""
    for share in (1e-3, 0.1, 0.5, 1.0):
        _, end = run(system, here, LONGEST, aside(system, here, share))
        if run(system, here, LONGEST, end)[0] and not run(system, there, LONGEST, end)[0]:
            return True
    return False


def ends_followed(system: ss.System, here: float, there: float) -> bool:
    """Whether a motion that sticks from a stuck start, followed to a speed from afar, sticks on there and not beyond.

    It is followed from the nearest speeds at which there is one, by steps that are halved where they lose it: near its end
    the basin of a motion is small.
    """
    away = math.copysign(1.0, here - there)
    begins = [speed for speed in here * (1 + away * np.linspace(0.02, 0.4, 20)) if sticks(system, speed, SHORT)]
    for begin in begins[:6]:
        _, end = run(system, begin, SHORT)
        left, step = abs(begin - here), 0.02 * here
        while left > 0 and step > 1e-5 * here:
            goes_on, after = run(system, here + away * max(left - step, 0.0), SHORT, end)
            if goes_on:
                left, end = max(left - step, 0.0), after
            else:
                step /= 2
        if left == 0 and run(system, here, LONGEST, end)[0] and not run(system, there, LONGEST, end)[0]:
            return True
    return False


def growth(system: ss.System, speed: float, cycles: float, share: float = 1e-6) -> float:
    """What becomes of a small motion beside steady slip: ln of its size after so many slowest cycles, over that before.

    Before is half-way, when the modes that decay faster are gone; where the size has changed a thousandfold, the start.
    """
    system = driven(system, speed)
    slow = slowest(system)
    orbit = ss.simulate(system, cycles * slow, *aside(system, speed, share), max_events=20_000_000)
    windows = [np.linspace(begin, begin + 3 * slow, 300) for begin in (cycles / 2 * slow, (cycles - 3) * slow)]
    half, last = (max(float(np.ptp(orbit.at(window)[0], axis=0).max()), 1e-300) for window in windows)
    first = share * speed * slow / (2 * math.pi)
    return math.log(last / (half if 1e-3 < last / first < 1e3 else first))


@dataclass
class Case:
    """One chain: what was reported and not confirmed, and what runs do not show of it, and what was missed."""

    seed: int
    law: str
    masses: int
    reported: list[tuple[str, float]]
    brackets: list[tuple[str, float, float]]
    unconfirmed: list[tuple[str, float]] = field(default_factory=list)
    shown: int = 0
    bracketed: int = 0
    missed: list[tuple[str, float, float]] = field(default_factory=list)
    neutral: bool = False
    seconds: float = 0.0


def confirmed(system: ss.System, kind: str, value: float, others: list[float]) -> bool:
    """Whether runs on the two sides of a velocity end in different motions."""
    gap = min((abs(other - value) for other in others if abs(other - value) > 1e-6 * value), default=math.inf)
    for width in WIDTHS:
        step = min(width * value, gap / 3)
        if "hopf" in kind:
            for cycles in (300, 3000):
                low, high = sorted(growth(system, value + sign * step, cycles) for sign in (-1, 1))
                if low < -0.01 < 0.01 < high:
                    return True
        elif sticks(system, value - step, LONGEST) != sticks(system, value + step, LONGEST):
            return True
    sides = (value - step, value + step)
    # Another motion than that from a stuck start may be meant.
    return "hopf" not in kind and any(
        look(system, *pair) for look in (attracts_on_one_side, ends_followed) for pair in (sides, sides[::-1])
    )


def changes(system: ss.System, low: float, high: float) -> Iterator[tuple[str, float, float]]:
    """Between which speeds runs change: from a stuck start in whether they stick, beside steady slip in whether they grow."""
    speeds = np.linspace(low, high, SPEEDS).tolist()
    stuck = [sticks(system, speed, SHORT) for speed in speeds]
    # What still changes near a threshold is run on.
    known: set[int] = set()
    while doubtful := {i + j for i, (a, b) in enumerate(itertools.pairwise(stuck)) if a != b for j in (0, 1)} - known:
        stuck = [sticks(system, speeds[i], LONGEST) if i in doubtful else one for i, one in enumerate(stuck)]
        known |= doubtful
    for (a, one), (b, other) in itertools.pairwise(zip(speeds, stuck, strict=True)):
        if one != other:
            yield "sticking", a, b
    grown = [growth(system, speed, 150) for speed in speeds]
    for (a, one), (b, other) in itertools.pairwise(zip(speeds, grown, strict=True)):
        if one * other < 0 and min(abs(one), abs(other)) > 0.05:
            yield "steady slip", a, b


def case(seed: int) -> Case:
    """One chain."""
    system, bounds = chain(seed)
    begin = time.process_time()
    found = ss.critical_velocities(system, bounds)
    seconds = time.process_time() - begin
    name = type(system.contacts[0].law).__name__
    result = Case(seed, name, system.masses, list(found.all), list(found.brackets), seconds=seconds)
    result.neutral = bool(found.neutral)
    values = [value for _, value in found.all]
    result.unconfirmed = [item for item in found.all if not confirmed(system, *item, values)]
    low, high = bounds or found_bounds(system)
    edges = [edge for pair in found.neutral for edge in pair]
    for kind, a, b in changes(system, low, high):
        result.shown += 1
        slack = b - a
        if any(a - slack <= value <= b + slack for value in [*values, *edges]):
            continue
        if kind == "sticking" and any(one - slack <= b and a <= other + slack for _, one, other in found.brackets):
            result.bracketed += 1
        else:
            result.missed.append((kind, a, b))
    return result


def found_bounds(system: ss.System) -> tuple[float, float]:
    """The bounds that a search takes of itself: a hundredth of F_s/(m ω) to three times that."""
    slow = slowest(system)
    scale = max(
        float(np.max(contact.law.break_away_force())) / system.mass[contact.mass][contact.mass]
        for contact in system.contacts
    )
    scale *= slow / (2 * math.pi)
    return 0.01 * scale, 3 * scale


def section(found: list[Case]) -> str:
    """The section of the page: a row a law."""
    lines = [
        HEADING,
        f"{len(found)} random chains of 2 to 5 masses on one drive (seeds {found[0].seed} to {found[-1].seed}). Half of them",
        "have masses and laws that are alike, a third no damping. Each reported velocity is checked by plain runs of",
        f"3000 cycles on both sides of it. Runs at {SPEEDS} speeds show changes of two kinds: of sticking from a stuck",
        "start, and of the growth of a small motion beside steady slip. Each of them has to be reported. Open are changes",
        "that the search names as not confirmed, in `.brackets`.",
        "Written by `python docs/evidence/critical_chains.py`.",
        "",
        "| law | chains | neutral | reported | not shown by runs | changes in runs | open | not reported |",
        "|---|---|---|---|---|---|---|---|",
    ]
    groups: dict[str, list[Case]] = {}
    for item in found:
        groups.setdefault(item.law, []).append(item)
    for name, group in [*sorted(groups.items()), ("all", found)]:
        numbers = (
            len(group),
            sum(item.neutral for item in group),
            sum(len(item.reported) for item in group),
            sum(len(item.unconfirmed) for item in group),
            sum(item.shown for item in group),
            sum(item.bracketed for item in group),
            sum(len(item.missed) for item in group),
        )
        lines.append(f"| {name} | {' | '.join(map(str, numbers))} |")
    wrong = [item for item in found if item.unconfirmed or item.missed]
    if wrong:
        lines += ["", "| seed | law | masses | not shown by runs | not reported |", "|---|---|---|---|---|"]
    for item in wrong:
        extra = ", ".join(f"{kind} {value:.6g}" for kind, value in item.unconfirmed)
        lost = ", ".join(f"{kind} {low:.4g} to {high:.4g}" for kind, low, high in item.missed)
        lines.append(f"| {item.seed} | {item.law} | {item.masses} | {extra} | {lost} |")
    seconds = sorted(item.seconds for item in found)
    lines += [
        "",
        f"A search took {seconds[len(seconds) // 2]:.1f} s of the processor (median), {seconds[-1]:.0f} s at most.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--keep", type=Path, default=PAGE.with_name("critical-chains.jsonl"))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=COUNT)
    options = parser.parse_args()
    found = cases(range(options.first, options.first + options.count), options.keep, Case, case)
    PAGE.write_text(PAGE.read_text(encoding="utf-8").split(HEADING)[0] + section(found), encoding="utf-8")


if __name__ == "__main__":
    main()
