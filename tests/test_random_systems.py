"""Random systems: energy balances, no event is missed, adhesion bears what it holds, documents keep the bits."""

from __future__ import annotations

import json
import tomllib
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip.laws.state_law import StateLaw
from stickslip.model.system import system_from_dict

GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(12)


# --- draws --------------------------------------------------------------------------------------------------------


def table(random, first=None, low=0.2):
    """Nodes over slip speed, from zero on."""
    speeds = np.cumsum(random.uniform(0.05, 0.6, random.integers(1, 4)))
    forces = random.uniform(low, 1.2, speeds.size + 1)
    if first is not None:
        forces[0] = first
    return list(zip([0.0, *speeds], forces.tolist(), strict=True))


def piecewise_linear(random):
    nodes = table(random)
    # Friction that falls without end would feed a motion that grows without end.
    last = (nodes[-1][0] + 0.1, nodes[-1][1] + random.uniform(0, 0.1))
    return ss.laws.PiecewiseLinear([*nodes, last], nodes[0][1] + random.choice([0.0, 0.3]))


def two_branch(random):
    rising, falling = table(random), table(random)
    return ss.laws.TwoBranch(rising, falling, max(rising[0][1], falling[0][1]) + random.choice([0.0, 0.2]))


def tabulated(random):
    growth = np.cumsum([random.uniform(0.6, 1), *random.uniform(0, 0.2, 3)])
    times = np.cumsum([0.0, *random.uniform(0.2, 3, 3)])
    return ss.laws.Tabulated(table(random, first=growth[0] - 0.1), list(zip(times, growth, strict=True)))


def piecewise_polynomial(random):
    drop, scale, rise = random.uniform(0, 0.6), random.uniform(0.1, 0.6), random.uniform(0.05, 0.3)
    top, error = random.uniform(0.3, 2.0), random.choice([1e-13, 1e-4])
    f = lambda w: 0.4 + drop * np.exp(-w / scale) + rise * w  # noqa: E731
    return ss.laws.smooth_from_function(f, top, break_away=0.4 + drop + random.choice([0.0, 0.3]), error=error)


def asymmetric(random):
    sides = ["StaticKinetic", "DwellTime", "ForceRate", "ExponentialStribeck", "PiecewiseLinear"]
    return ss.laws.Asymmetric(*(LAWS[name](random) for name in random.choice(sides, 2)))


def combined(random):
    curve = LAWS[random.choice(["ExponentialStribeck", "PiecewiseLinear", "Rational"])](random)
    static = LAWS[random.choice(["DwellTime", "ForceRate", "LogarithmicDwell"])](random)
    return ss.laws.Combined(replace(static, kinetic=curve.break_away_force() + random.choice([0.0, 0.2])), curve)


def paper_law(random):
    law = ss.laws.BogaczRyczek()
    if random.random() < 0.5:
        return law
    surface = ss.laws.StaticFriction(
        initial=random.uniform(1.0, 1.1), limit=random.uniform(0, 0.3), rate=random.uniform(0.1, 2.0),
        force_rate_scale=random.choice([0.2, 0.5, 2.0]),
    )  # fmt: skip
    return ss.laws.BogaczRyczek(surface, beta=random.uniform(0.005, 0.02), alpha=random.uniform(0, 0.05))


def like_the_example(kind):
    """A law whose numbers are up to e times larger or smaller than those of its example."""

    def law(random):
        document = kind.example().to_dict()
        for _ in range(100):
            numbers = {
                name: random.choice(kind.PARAMETERS[name].choices)
                if kind.PARAMETERS[name].choices
                else value * np.exp(random.uniform(-1, 1))
                for name, value in document.items()
                if name != "type"
            }
            try:
                return kind(**numbers)
            except ss.InputError:
                continue  # such as a kinetic force above the break-away force
        raise AssertionError(f"no {kind.__name__} like its example makes sense")

    return law


LAWS = {name: like_the_example(kind) for name, kind in ss.laws.Law.ALL.items() if not issubclass(kind, StateLaw)} | {
    "PiecewiseLinear": piecewise_linear,
    "PiecewisePolynomial": piecewise_polynomial,
    "Asymmetric": asymmetric,
    "Combined": combined,
    "Tabulated": tabulated,
    "TwoBranch": two_branch,
    "BogaczRyczek": paper_law,
}


def random_drive(random):
    match random.integers(0, 6):
        case 0:
            return 0.0
        case 1:
            return ss.Drive.shaken(random.uniform(-0.5, 0.5), random.uniform(0.05, 0.4), random.uniform(0.5, 2))
        case 2:
            return ss.Drive.ramp(*random.uniform(-0.5, 0.5, 2), duration=random.uniform(5, 25))
        case 3:
            return ss.Drive.table(np.cumsum(random.uniform(1, 8, 4)), random.uniform(-0.5, 0.5, 4))
        case _:
            return random.uniform(-0.6, 0.6)


def random_oscillator(random, kind):
    law = LAWS[kind](random)
    forcing = [
        ss.Harmonic(random.uniform(0, 0.5), random.uniform(0.3, 2.5), random.uniform(0, 6))
        for _ in range(random.integers(0, 3))
    ]
    return ss.Oscillator(
        damping=random.choice([0.0, 0.05, 0.28]) + (1e-3 if forcing else 0.0),
        drive_velocity=random.uniform(-0.6, 0.6) if random.random() < 0.6 else random_drive(random),
        law=law,
        mass=random.choice([1.0, 0.5, 3.0]),
        stiffness=random.choice([1.0, 0.4, 5.0]),
        forcing=forcing or None,
    )


def random_system(random, kind):
    """Two to four masses, full symmetric matrices, one law of the kind and others."""
    n = int(random.integers(2, 5))

    def positive(size):
        root = random.normal(size=(n, n)) * size
        return root @ root.T

    mass, stiffness = np.diag(random.uniform(0.5, 2, n)), np.diag(random.uniform(0.2, 2, n)) + positive(0.3)
    if random.random() < 0.3:
        mass = mass + 0.1 * positive(0.5)
    contacts = [ss.Contact(int(random.integers(n)), LAWS[kind](random), random_drive(random))]
    for _ in range(int(random.integers(0, n + 1))):
        one, other = (int(i) for i in random.permutation(n)[:2])
        law = LAWS[random.choice(list(LAWS))](random)
        between = random.random() < 0.35
        contacts.append(ss.Contact(one, law, 0.0 if between else random_drive(random), other if between else None))
    forcing = [
        ss.Force(random.uniform(0, 0.5), random.uniform(0.3, 2.5), random.uniform(0, 6), int(random.integers(n)))
        for _ in range(random.integers(0, 3))
    ]
    return ss.System(mass, stiffness, positive(0.15) * random.choice([0.0, 1.0]), contacts, forcing)


def draw(kind, number):
    """A system with a law of the kind, and where it starts. The seed is the name's: a new law leaves those of others."""
    random = np.random.default_rng([zlib.crc32(kind.encode()), number])
    one = random.random() < 0.4
    system = random_oscillator(random, kind) if one else random_system(random, kind)
    n = 1 if one else system.masses
    x0, v0 = random.uniform(-2, 2, n), random.uniform(-1, 1, n)
    start = {} if random.random() < 0.3 else {"x0": x0[0] if one else x0}
    if start and random.random() < 0.5:
        start["v0"] = v0[0] if one else v0
    return system, start


# --- checks -------------------------------------------------------------------------------------------------------


def as_system(system):
    return system if isinstance(system, ss.System) else system.to_system()


def samples(orbit, most=120_000):
    """Gauss points and weights of every stretch of smooth motion, in parts that the fastest rate makes polynomials."""
    system = as_system(orbit.system)
    segments = orbit.segments
    ends = np.append(segments["t"].to_numpy(), orbit.t_end)
    slopes = np.abs(segments.filter(like="slope").to_numpy())
    steepest = np.where(np.isfinite(slopes), slopes, 0.0).max(initial=0.0)
    inverse = np.linalg.inv(np.array(system.mass))
    frequencies = [force.frequency for force in system.forcing]
    for contact in system.contacts:
        if isinstance(contact.drive_velocity, ss.Drive):
            frequencies += [harmonic.frequency for harmonic in contact.drive_velocity.harmonics]
            ends = np.append(ends, [node[0] for node in contact.drive_velocity.nodes if node[0] < orbit.t_end])
    ends = np.unique(ends)
    if ends.size < 2:
        return None
    rate = np.sqrt(np.linalg.norm(inverse @ system.stiffness, 2)) + np.linalg.norm(inverse, 2) * (
        np.linalg.norm(system.damping, 2) + steepest
    )
    rate += max(frequencies, default=0.0)
    widths = np.diff(ends)
    parts = np.maximum(1, np.ceil(widths * rate / 2)).astype(int)
    if parts.sum() * GAUSS.size > most:
        return None
    starts = np.concatenate(
        [start + width / k * np.arange(k) for start, width, k in zip(ends[:-1], widths, parts, strict=True)]
    )
    half = 0.5 * np.repeat(widths / parts, parts)
    times = (starts + half)[:, None] + half[:, None] * GAUSS
    return np.minimum(times.ravel(), orbit.t_end), (half[:, None] * WEIGHTS).ravel()


def motion(orbit, times):
    """x, v over masses; w, friction and adhesion over contacts; the drive velocities; for one mass the same."""
    data = orbit.to_xarray(times)
    columns = [data[name].to_numpy() for name in ("x", "v", "a", "slip_velocity", "force", "stuck")]
    columns = [column.reshape(times.size, -1) for column in columns]
    drives = [contact.drive_velocity for contact in as_system(orbit.system).contacts]
    speeds = [drive.at(times) if isinstance(drive, ss.Drive) else np.full(times.shape, drive) for drive in drives]
    return *columns, np.stack(speeds, axis=1)


def energy_error(orbit, times, weights):
    """Work of drives and forces minus what friction and damping take and what is stored, relative to the turnover."""
    system = as_system(orbit.system)
    mass, stiffness, damping = (np.array(matrix) for matrix in (system.mass, system.stiffness, system.damping))
    _, v, _, w, force, _, drive = motion(orbit, times)
    push = np.zeros_like(v)
    for item in system.forcing:
        push[:, item.mass] += item.amplitude * np.cos(item.frequency * times + item.phase)
    driven, rubbed = ((force * speed).sum(1) @ weights for speed in (drive, w))
    pushed, damped = (push * v).sum(1) @ weights, np.einsum("ti,ij,tj,t", v, damping, v, weights)
    first, last = (np.concatenate([np.atleast_1d(part) for part in orbit.at(t)]) for t in (0.0, orbit.t_end))
    n = system.masses

    def stored(state):
        return 0.5 * (state[n:] @ mass @ state[n:] + state[:n] @ stiffness @ state[:n])

    turnover = np.abs(force * drive).sum(1) @ weights + np.abs(force * w).sum(1) @ weights
    # What rests but for rounding has nothing to turn over.
    turnover += np.abs(push * v).sum(1) @ weights + damped + stored(first) + stored(last) + 1e-6
    error = abs(driven + pushed - rubbed - damped - stored(last) + stored(first))
    return error / turnover


def check_guards(orbit, times):
    """At dense times every contact is in the mode that it says: no release, capture or node was jumped over."""
    edges = np.append(orbit.segments["t"].to_numpy(), np.inf)
    following = np.searchsorted(edges, times, side="right")
    # Within rounding of an event a time is on either side of it.
    times = times[np.minimum(times - edges[following - 1], edges[following] - times) > 1e-9]
    system = as_system(orbit.system)
    *_, w, force, stuck, drive = motion(orbit, times)
    size = max(1.0, np.abs(w).max(), np.abs(drive).max())
    segments, events = orbit.segments, orbit.events
    index = np.searchsorted(segments["t"].to_numpy(), times, side="right") - 1
    for c, contact in enumerate(system.contacts):
        suffix = "" if isinstance(orbit.system, ss.Oscillator) else f"_{c}"
        direction = segments["direction" + suffix].to_numpy()[index]
        slope, law = segments["slope" + suffix].to_numpy()[index], contact.law
        sticks = stuck[:, c].astype(bool)
        assert (sticks == (direction == 0)).all()
        assert np.abs(w[sticks, c]).max(initial=0.0) <= 1e-9 * size
        # A slip keeps its sign until an event.
        assert (direction * w[:, c])[~sticks].min(initial=0.0) >= -1e-9 * size
        # Adhesion bears what holds the mass, with the stick time it has.
        mine = events[events["contact"] == c]
        captures = np.append(0.0, mine["t"][mine["kind"] == "capture"])
        rested = times - captures[np.searchsorted(captures, times, side="right") - 1]
        # So small a rate that only its direction counts.
        bears = np.atleast_1d(law.break_away_force(rested[sticks], 1e-300 * force[sticks, c]))
        assert (np.abs(force[sticks, c]) - bears).max(initial=-1.0) <= 1e-9, (orbit.system, c)
        release = mine[mine["kind"] == "release"]
        rates = np.maximum(np.abs(release["force_rate"].to_numpy()), 1e-300)
        reaches = law.break_away_force(
            release["stick_time"].to_numpy(), np.copysign(rates, release["force"].to_numpy())
        )
        assert np.abs(np.abs(release["force"]) - reaches).max() <= 1e-9 if len(release) else True
        # Slip produces what the law says at this slip speed.
        slips = ~sticks & np.isfinite(slope) & (np.abs(w[:, c]) > 1e-9 * size)
        if isinstance(law, ss.laws.TwoBranch):
            lines = [ss.laws.Tabulated(t, 9.0).kinetic_force(w[slips, c]) for t in (law.rising, law.falling)]
            off = np.min([np.abs(line - force[slips, c]) for line in lines], axis=0)
        elif isinstance(law, ss.laws.BogaczRyczek):
            off = np.minimum(0.0, force[slips, c] * w[slips, c])  # its branches remember
        else:
            off = np.abs(force[slips, c] - law.kinetic_force(w[slips, c]))
        assert off.max(initial=0.0) <= 1e-9 * size * (1 + np.abs(slope[slips]).max(initial=0.0)), (orbit.system, c)


def check(system, start, t_end=30.0):
    orbit = ss.simulate(system, t_end, **start, max_events=2000)
    assert orbit.stop in ("t_end", "max_events", "diverged", "accumulation")
    grid = samples(orbit)
    if grid is not None:
        times, weights = grid
        assert energy_error(orbit, times, weights) <= 1e-9
        check_guards(orbit, times)
    # The document is the system, and the system is the orbit: JSON and TOML keep every bit.
    for document in (json.loads(json.dumps(system.to_dict())), tomllib.loads(system.to_toml())):
        again = system_from_dict(document)
        assert again == system
        copy = ss.simulate(again, t_end, **start, max_events=2000)
        assert copy.segments.equals(orbit.segments)
        assert copy.events.equals(orbit.events)
    return orbit


# --- tests --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", LAWS)
def test_random_systems_balance_their_energy_and_miss_no_event(kind):
    orbits = [check(*draw(kind, number)) for number in range(10)]
    assert sum(len(orbit.events) for orbit in orbits) > 50
    # Contacts with two branches, several at a time, may go to and fro between them without end.
    assert sum(orbit.stop == "t_end" for orbit in orbits) >= 0.9 * len(orbits)


# Random systems on which an earlier version was wrong, each with what was wrong.
FOUND = json.loads(Path(__file__).with_name("found_systems.json").read_text())


@pytest.mark.parametrize("found", FOUND, ids=lambda found: found["fault"])
def test_systems_that_found_a_fault(found):
    orbit = check(system_from_dict(found["system"]), found["start"])
    assert orbit.stop == "t_end" or "redundant" not in found["fault"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", LAWS)
def test_ten_thousand_random_systems(kind):
    failures = {}
    for number in range(10, 10 + 10_000 // len(LAWS)):
        try:
            check(*draw(kind, number))
        except (AssertionError, ss.InputError) as error:
            failures[number] = str(error)[:200]
    assert not failures


def test_random_batches_have_the_same_bits_for_one_and_two_workers():
    for kind in LAWS:
        system, _ = draw(kind, 0)
        name = "damping" if isinstance(system, ss.Oscillator) else "damping.0.0"
        start = "x0" if isinstance(system, ss.Oscillator) else "x0.0"
        over = {name: [0.01, 0.2], start: [-0.5, 0.5]}
        one, two = (ss.simulate_many(system, over, 30.0, section="release", workers=n) for n in (1, 2))
        assert one.identical(two)
