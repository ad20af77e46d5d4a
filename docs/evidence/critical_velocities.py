"""Critical velocities of random oscillators against plain runs; writes docs/evidence/critical-velocities.md.

    python docs/evidence/critical_velocities.py [--keep RESULTS.jsonl] [--count N] [--first SEED]

Each oscillator is drawn from its own seed. Every reported velocity has to be shown by runs on both sides of it, and every
change that runs at 200 speeds show has to be reported. The runs are those of `stickslip.simulate` and nothing of
`stickslip.dynamics` looks at them. Results are kept line by line: a run that was ended goes on where it was.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import stickslip as ss

PAGE = Path(__file__).with_name("critical-velocities.md")
COUNT, SPEEDS = 1000, 200
#: Seeds for a short look.
FEW = (3,)
#: How much a small motion beside steady slip changes over 150 cycles, as a logarithm, to grow or to decay.
GROWS = 0.05
#: Cycles of a run at each of the speeds, and where the motion does not repeat or die away by then.
SHORT, LONG = 30, 150
#: A stick of a smaller share of a natural period is none.
LEAST_STICK = 1e-5
#: Starts where runs look for what attracts: beside steady slip, velocities over the drive's, and on the drive, positions over
#: what adhesion holds.
FEW_STARTS = ((1e-4, 0.3, 1.0), ())
MANY_STARTS = ((1e-4, *np.linspace(0.05, 1.0, 20).tolist()), tuple(np.linspace(-1.0, 1.0, 21).tolist()))
#: Seconds of the processor after which an oscillator is given up.
LONGEST = 100


def oscillator(seed: int) -> tuple[ss.Oscillator, tuple[float, float] | None]:
    """A random oscillator without damping or with little, and the bounds for its search."""
    rng = np.random.default_rng(seed)
    uniform, force = rng.uniform, 10 ** rng.uniform(-1, 1)
    mass, stiffness = 10 ** rng.uniform(-1, 1, 2)
    period = 2 * math.pi * math.sqrt(mass / stiffness)
    speed = force / math.sqrt(mass * stiffness)
    kinetic = force * uniform(0.3, 1.0)
    excess = force * uniform(0.05, 0.6)
    rate = uniform(0.1, 3) / period
    high, low = kinetic + excess, kinetic
    scale = speed * uniform(0.1, 1)
    rest = np.cumsum(uniform(0.2, 2, 3)) * period
    ages = [(0.0, low), *zip(rest, low + excess * np.cumsum([0.5, 0.3, 0.2]), strict=True)]
    slips = np.cumsum(uniform(0.1, 0.6, 3)) * speed
    table = [(0.0, high), *zip(slips, high * uniform(0.5, 1.0, 3), strict=True)]
    rising = uniform(0, 0.3) * (high - low) / scale
    laws: dict[str, Callable[[], ss.laws.Law]] = {
        "Coulomb": lambda: ss.laws.Coulomb(kinetic),
        "StaticKinetic": lambda: ss.laws.StaticKinetic(high, low),
        "LogarithmicDwell": lambda: ss.laws.LogarithmicDwell(kinetic, excess / 3, 1 / rate),
        "DwellTime": lambda: ss.laws.DwellTime(kinetic, excess, rate),
        "DwellTime, other exponents": lambda: ss.laws.DwellTime(kinetic, excess, rate, uniform(0.4, 1.6)),
        "ForceRate": lambda: ss.laws.ForceRate(kinetic, excess, rate, force / period * uniform(0.3, 3)),
        "Tabulated, level in slip": lambda: ss.laws.Tabulated(low, ages),
        "Tabulated": lambda: ss.laws.Tabulated([(0.0, low), *((w, f * low / high) for w, f in table[1:])], ages),
        "PiecewiseLinear": lambda: ss.laws.PiecewiseLinear(table, high),
        "PiecewiseLinear, level beyond": lambda: ss.laws.PiecewiseLinear(
            [(0.0, high), (slips[0], low), (slips[2], low)], high
        ),
        "Rational": lambda: ss.laws.Rational(high, uniform(0.1, 2) / speed),
        "Cubic": lambda: ss.laws.Cubic(high, 1.5 * excess / scale, 0.5 * excess / scale**3),
        "ExponentialStribeck": lambda: ss.laws.ExponentialStribeck(high, low, scale, rising),
        "Lorentzian": lambda: ss.laws.Lorentzian(high, low, scale, rising),
        "PoppStelter": lambda: ss.laws.PoppStelter(high, low, 1 / scale, rising / speed),
    }
    damping = 0.0 if rng.random() < 0.5 else 10 ** uniform(-3.5, -1) * 2 * math.sqrt(mass * stiffness)
    law = list(laws.values())[seed % (len(laws) + 1)]() if seed % (len(laws) + 1) < len(laws) else None
    if law is None:
        # The paper's law, its oscillator; the damping is that of the slope of its branches, and some more or less.
        return replace(ss.paper.oscillator(0.3), damping=uniform(0.25, 0.45)), (0.05, 0.7)
    bounds = None
    if rng.random() < 0.5:
        start = speed * 10 ** uniform(-1.5, -0.3)
        bounds = (start, start + speed * uniform(0.3, 2))
    return ss.Oscillator(damping, speed, law, mass=mass, stiffness=stiffness), bounds


@dataclass(frozen=True)
class Look:
    """The end of one run.

    Attributes
    ----------
    sticks : whether it sticks, and `crossings` whether the slip velocity changes its sign without a stick.
    size : the range of the position, and `settled` whether it was the same before.
    decided : whether a longer run shows the same: sticks of one length follow each other, or a motion without sticks does not
        grow. Under a law without memory of slip such a motion never comes back to them, as its curves in the plane of x and v
        do not cross.
    held : the mean stick time over a period, and `captures` their number in a period.
    end : where it ends; of a motion that sticks at the last capture, as nothing before that is remembered.
    """

    sticks: bool
    crossings: bool
    size: float
    settled: bool
    decided: bool
    held: float
    captures: float
    end: tuple[float, float]


def look(system: ss.Oscillator, speed: float, cycles: float, x0: float | None = None, v0: float | None = None) -> Look:
    """One run."""
    system = replace(system, drive_velocity=speed)
    period = system.natural_period
    # Slow cycles load the spring by no more than twice the break-away force.
    t_end = cycles * period + min(cycles, 30) * 2 * system.law.break_away_force() / (system.stiffness * speed)
    orbit = ss.simulate(system, t_end, x0, v0, max_events=int(200 * cycles))
    # As arrays: asking the table again and again takes longer than the run.
    when, kinds, held = (orbit.events[name].to_numpy() for name in ("t", "kind", "stick_time"))
    released, crossed = (when[kinds == kind] for kind in ("release", "crossing"))
    held = held[kinds == "release"]
    means = []
    for begin in (0.4, 0.6, 0.8):
        within = held[(released > begin * orbit.t_end) & (released <= (begin + 0.2) * orbit.t_end)]
        means.append(float(within.mean()) if within.size else 0.0)
    # Sticks that become ever shorter, by a fixed part in each window, vanish.
    fades = all(after < 0.97 * before for before, after in itertools.pairwise(means))
    sticks = means[-1] > LEAST_STICK * period and not fades
    crossings = bool((crossed > 0.8 * orbit.t_end).any())
    count = int(30 * np.clip(0.2 * t_end / period, 2, 40))
    windows = np.add.outer((0.6, 0.8), np.linspace(0.0, 0.2, count)) * orbit.t_end
    before, size = np.maximum(np.ptp(orbit.at(np.minimum(windows, orbit.t_end))[0], axis=1), 1e-300).tolist()
    late = held[released > 0.6 * orbit.t_end]
    if late.size:
        decided = late.size > 3 and bool(np.ptp(late) < 1e-9 * late.max())
    else:
        decided = size < (1 + 1e-9) * before and not remembers_slip(system.law)
    captures = when[(kinds == "capture") & (when > 0.8 * orbit.t_end)]
    end = orbit.at(captures[-1] if captures.size else orbit.t_end)
    settled = abs(size - before) <= 0.02 * size
    often = captures.size * period / (0.2 * orbit.t_end) if sticks else 0.0
    return Look(sticks, crossings, size, settled, decided, means[-1] / period, often, end)


def aside(system: ss.Oscillator, speed: float, share: float = 1e-4) -> tuple[float, float]:
    """A state beside steady slip."""
    return float(system.law.kinetic_force(speed)) / system.stiffness, share * speed


def remembers_slip(law: ss.laws.Law) -> bool:
    """Whether what a law says in slip depends on more than the slip velocity."""
    return type(law).__name__ in ("BogaczRyczek", "TwoBranch")


def growth(system: ss.Oscillator, speed: float, cycles: float = SHORT) -> float:
    """The logarithm of what becomes of a small motion beside steady slip over 150 cycles, from a run of so many."""
    system = replace(system, drive_velocity=speed)
    orbit = ss.simulate(system, cycles * system.natural_period, *aside(system, speed), max_events=int(200 * cycles))
    # Many samples: the ranges of the first and of the last cycle are compared.
    cycle = np.linspace(0.0, system.natural_period, 400)
    first, last = (float(np.ptp(orbit.at(cycle + begin)[0])) for begin in (0.0, orbit.t_end - cycle[-1]))
    # What grows without oscillation has left the neighbourhood within the first cycle.
    begun = 2.0 * aside(system, speed)[1] * system.natural_period / (2 * math.pi)
    first = begun if first > 10 * begun else first
    return math.log(max(last, 1e-300) / first) * LONG / (cycles - 1)


def nature(found: float) -> int:
    """1: beside steady slip the motion grows, −1: it decays, 0: neither."""
    return 0 if abs(found) < GROWS else int(math.copysign(1, found))


def changes(system: ss.Oscillator, low: float, high: float, count: int = SPEEDS) -> Iterator[tuple[str, float, float]]:
    """Between which speeds runs change: from rest in whether they stick, beside steady slip in whether they grow."""
    speeds = np.linspace(low, high, count).tolist()
    rest = [look(system, speed, SHORT) for speed in speeds]
    rest = [one if one.decided else look(system, speed, LONG) for one, speed in zip(rest, speeds, strict=True)]
    for (a, one), (b, other) in itertools.pairwise(zip(speeds, rest, strict=True)):
        # Sticks that go below what counts as one, at no speed in particular, do not end there.
        if one.sticks != other.sticks and max(one.held, other.held) > 10 * LEAST_STICK:
            yield "stick-slip from rest", a, b
    if remembers_slip(system.law):
        return
    beside = [growth(system, speed) for speed in speeds]
    # Where growth fades away there is no speed at which it ends: it must be well above what counts as growth.
    kinds = [nature(found) for found in beside]
    marks = [i for i, found in enumerate(beside) if kinds[i] == 0 or abs(found) > 4 * GROWS]
    for i, j in itertools.pairwise(marks):
        if (kinds[i] != kinds[j] and j - i <= 1) or kinds[i] * kinds[j] < 0:
            yield "steady slip", speeds[i], speeds[j]


def differ(one: Look, other: Look) -> bool:
    """Whether the ends of two runs are motions of different kinds."""
    sizes, often = sorted((one.size, other.size)), sorted((one.captures, other.captures))
    kinds = one.sticks != other.sticks or one.crossings != other.crossings
    return kinds or sizes[1] > 1.2 * sizes[0] or often[1] > 1.2 * often[0]


def confirmed(system: ss.Oscillator, kind: str, value: float, gap: float) -> bool:
    """Whether runs below and above a speed differ: what they show from rest, or a motion that attracts on one side alone.

    That a start leads elsewhere is no change by itself, except from rest: it may have left the basin of one motion for that
    of another, which both go on. So all settled ends are asked whether there is one like it on the other side.
    """
    reach = system.law.break_away_force() / system.stiffness
    for width, cycles, (shares, places) in (
        (1e-3, 300, FEW_STARTS),
        (1e-3, 2000, FEW_STARTS),
        (1e-3, 500, MANY_STARTS),
        (1e-2, 500, MANY_STARTS),
        (1e-4, 3000, FEW_STARTS),
    ):
        step = min(width * value, gap / 3)
        speeds = (value - step, value + step)
        slow = cycles * (1 if system.law.SMOOTH else 3)
        if "hopf" in kind:
            decays, grows = sorted(growth(system, speed, slow) * slow / LONG for speed in speeds)
            if decays < -0.01 and grows > 0.01:
                return True
        rest = [look(system, speed, slow) for speed in speeds]
        if kind in ("end_of_stick_slip", "onset_of_stick_slip") and differ(*rest):
            return True
        ends = [[one] for one in rest]
        for share in (*shares, 1e-2 * step / value):
            for found, speed in zip(ends, speeds, strict=True):
                found.append(look(system, speed, slow, *aside(system, speed, share)))
        for place in places:
            for found, speed in zip(ends, speeds, strict=True):
                found.append(look(system, speed, slow, place * reach))
        # Each end goes on on the other side too, so that what attracts on both is seen on both.
        crossed = [[look(system, speed, slow, *one.end) for one in ends[1 - i]] for i, speed in enumerate(speeds)]
        below, above = ([one for one in [*a, *b] if one.settled] for a, b in zip(ends, crossed, strict=True))
        for here, there in ((below, above), (above, below)):
            if any(all(differ(one, other) for other in there) for one in here):
                return True
    return False


@dataclass
class Case:
    """One oscillator: what was reported, and what of it runs do not show, and what was missed."""

    seed: int
    law: str
    damped: bool
    reported: list[tuple[str, float]]
    unconfirmed: list[tuple[str, float]] = field(default_factory=list)
    shown: int = 0
    missed: list[tuple[str, float, float]] = field(default_factory=list)
    neutral: bool = False
    late: bool = False
    seconds: float = 0.0

    @property
    def wrong(self) -> bool:
        """Whether anything is not as it should be."""
        return bool(self.unconfirmed or self.missed or self.late)


def case(seed: int, speeds: int = SPEEDS) -> Case:
    """One oscillator."""
    system, bounds = oscillator(seed)
    found = ss.critical_velocities(system, bounds)
    scale = system.law.break_away_force() / math.sqrt(system.stiffness * system.mass)
    low, high = bounds or (0.01 * scale, 3 * scale)
    edges = [edge for pair in found.neutral for edge in pair]
    name = type(system.law).__name__
    result = Case(seed, name, system.damping > 0, list(found.all), neutral=bool(found.neutral))
    values = [value for _, value in found.all]
    for kind, value in found.all:
        gap = min((abs(other - value) for other in values if abs(other - value) > 1e-6 * value), default=math.inf)
        if not confirmed(system, kind, value, gap):
            result.unconfirmed.append((kind, value))
    for kind, a, b in changes(system, low, high, speeds):
        result.shown += 1
        slack = b - a
        if not any(a - slack <= value <= b + slack for value in [*values, *edges]):
            result.missed.append((kind, a, b))
    return result


def bounded(seed: int) -> Case:
    """One oscillator, given up after a time that none should take."""

    def late(*_: object) -> None:
        raise TimeoutError

    # Time of the processor: a busy machine is no hang.
    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    begin = time.process_time()
    try:
        found = case(seed)
    except TimeoutError:
        system, _ = oscillator(seed)
        found = Case(seed, type(system.law).__name__, system.damping > 0, [], late=True)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    return replace(found, seconds=time.process_time() - begin)


def cases(seeds: range, keep: Path, kind: type[Any] = Case, look: Callable[[int], Any] = bounded) -> list[Any]:
    """All of a kind that are in the file, after those that are not yet there were looked at."""
    lines = keep.read_text(encoding="utf-8").splitlines() if keep.exists() else []
    found = {item["seed"]: kind(**item) for item in map(json.loads, lines)}
    with keep.open("a", encoding="utf-8") as file:
        for seed in seeds:
            if seed not in found:
                found[seed] = look(seed)
                file.write(json.dumps(asdict(found[seed])) + "\n")
                file.flush()
                print(seed, found[seed], flush=True)
    return [found[seed] for seed in sorted(found)]


def ranges(seeds: list[int]) -> str:
    """Numbers in order as ranges.

    >>> ranges([0, 1, 2, 5, 6, 9])
    '0 to 2, 5 to 6, 9'
    """
    starts = [i for i, seed in enumerate(seeds) if i == 0 or seed != seeds[i - 1] + 1]
    parts = [seeds[i:j] for i, j in itertools.pairwise([*starts, len(seeds)])]
    return ", ".join(str(part[0]) if len(part) == 1 else f"{part[0]} to {part[-1]}" for part in parts)


def page(found: list[Case]) -> str:
    """The table: a row a law."""
    lines = [
        "# Critical velocities of random oscillators",
        "",
        f"{len(found)} oscillators (seeds {ranges([item.seed for item in found])}), half of them undamped. The others have",
        "0.03 to 10 % of critical damping (more with the paper's law). Each reported velocity is checked by plain runs on",
        "both sides of it. Runs at 200 speeds between the bounds show changes of two kinds: of stick-slip from rest, and",
        "of the growth of a small motion beside steady slip. Each of them has to be reported. In neutral slip small",
        "disturbances neither grow nor decay.",
        "Written by `python docs/evidence/critical_velocities.py`.",
        "",
        "| law | oscillators | undamped | neutral | reported | not shown by runs | changes in runs | not reported |",
        "|---|---|---|---|---|---|---|---|",
    ]
    groups: dict[str, list[Case]] = {}
    for item in found:
        groups.setdefault(item.law, []).append(item)
    for name, group in [*groups.items(), ("all", found)]:
        numbers = (
            len(group),
            sum(not item.damped for item in group),
            sum(item.neutral for item in group),
            sum(len(item.reported) for item in group),
            sum(len(item.unconfirmed) for item in group),
            sum(item.shown for item in group),
            sum(len(item.missed) for item in group),
        )
        lines.append(f"| {name} | {' | '.join(map(str, numbers))} |")
    wrong = [item for item in found if item.wrong]
    if wrong:
        lines += ["", "| seed | law | not shown by runs | not reported |", "|---|---|---|---|"]
    for item in wrong:
        extra = ", ".join(f"{kind} {value:.6g}" for kind, value in item.unconfirmed)
        lost = ", ".join(f"{kind} {low:.4g} to {high:.4g}" for kind, low, high in item.missed)
        lines.append(f"| {item.seed} | {item.law} | {extra} | {lost} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--keep", type=Path, default=PAGE.with_suffix(".jsonl"), help="where the results go line by line"
    )
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=COUNT)
    options = parser.parse_args()
    found = cases(range(options.first, options.first + options.count), options.keep)
    options.keep.with_suffix(".md").write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
