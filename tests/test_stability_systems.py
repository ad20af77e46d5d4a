"""Derivatives through the events of several masses, and Lyapunov exponents against averages of the map of stick-slip."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stickslip as ss
from stickslip.dynamics.periodic import derivatives, lyapunov_exponents
from stickslip.dynamics.periodic.event_sequence import EventSequence
from stickslip.dynamics.periodic.periodic_orbits import from_section

#: Steps of a fourth-order difference, and its weights.
STEPS, WEIGHTS = (-2.0, -1.0, 1.0, 2.0), (1 / 12, -8 / 12, 8 / 12, -1 / 12)

TWO = ss.System(
    [1, 1],
    [[1.7, -0.7], [-0.7, 1.9]],
    0.05,
    [ss.Contact(0, ss.laws.StaticKinetic(1.0, 0.6), 0.2), ss.Contact(1, ss.laws.Rational(0.8, 2.0), 0.2)],
)


def differenced(orbit: ss.Orbit, t: float, columns: range) -> np.ndarray:
    """Columns of the fundamental matrix as differences of exact orbits with the same events."""
    start, step = np.concatenate(orbit.at(0.0)), 1e-5
    kinds = list(orbit.events["kind"][orbit.events["t"] < t])
    result = []
    for column in columns:
        ends = []
        for steps in STEPS:
            x0, v0 = (start + steps * step * np.eye(start.size)[column]).reshape(2, -1)
            other = ss.simulate(orbit.system, t, x0=x0, v0=v0)
            assert list(other.events["kind"][other.events["t"] < t]) == kinds
            ends.append(np.concatenate(other.at(t)))
        result.append(sum(weight * end for weight, end in zip(WEIGHTS, ends, strict=True)) / step)
    return np.stack(result, axis=-1)


@pytest.mark.parametrize(
    "law",
    [
        *(ss.laws.StaticKinetic(1.0, 0.6), ss.laws.DwellTime(0.5, 0.5, 0.4), ss.laws.ForceRate(0.5, 0.5, 0.4, 0.5)),
        *(ss.laws.BogaczRyczek(), ss.laws.Rational(1.0, 3.0), ss.laws.TwoBranch(0.8, 0.6, 1.0)),
    ],
    ids=lambda law: type(law).__name__,
)
def test_fundamental_matrices_of_two_masses_are_differences_of_exact_orbits(law: ss.laws.Law) -> None:
    system = ss.chain(2, law, 0.2, coupling=0.7)
    orbit = ss.simulate(system, 12.0, x0=[0.31, -0.23], v0=[0.2, 0.2])
    assert len(orbit.events) >= 3
    # Both start stuck: what they do if they do not is another event sequence.
    difference = differenced(orbit, 12.0, range(2))
    assert derivatives.fundamental_matrix(orbit)[:, :2] == pytest.approx(difference, abs=1e-8)


def test_a_system_of_one_mass_is_the_oscillator() -> None:
    one = ss.Oscillator(0.0, 0.3, ss.laws.DwellTime(0.5, 0.5, 0.4))
    cycles = [ss.periodic_orbit(system) for system in (one, one.to_system())]
    assert cycles[1].period == pytest.approx(cycles[0].period, abs=1e-12)
    assert cycles[1].multipliers == pytest.approx(cycles[0].multipliers, abs=1e-10)


def test_a_cycle_of_two_masses_its_multipliers_exponents_and_branch() -> None:
    cycle = ss.periodic_orbit(TWO)
    assert cycle.residual < 1e-13
    start, end = (np.concatenate(cycle.orbit.at(t)) for t in (0.0, cycle.period))
    assert end == pytest.approx(start, abs=1e-11)
    sizes = np.abs(cycle.multipliers)
    assert sizes[0] == 1.0
    assert sizes[3] == 0.0
    # The derivative over one period from a moment at which both slip.
    times = np.linspace(0.0, cycle.period, 400, endpoint=False)
    slips = ~cycle.orbit.to_xarray(times)["stuck"].to_numpy().any(axis=1)
    x, v = cycle.orbit.at(times[slips][slips.sum() // 2])
    monodromy = differenced(ss.simulate(TWO, cycle.period, x0=x, v0=v), cycle.period, range(4))
    found = np.linalg.eigvals(monodromy)
    assert found[np.argsort(-np.abs(found))] == pytest.approx(cycle.multipliers, abs=1e-7)
    spectrum = ss.lyapunov(TWO, 2000.0)
    assert spectrum.exponents[3] == -math.inf
    assert spectrum.exponents[:3] == pytest.approx(np.log(sizes[:3]) / cycle.period, abs=2e-3)
    steady, branch = ss.continuation(TWO, "contacts.1.law.weakening", (1.9, 2.1), seeds=0).branches
    assert (steady.kind, any(steady.stable)) == ("steady_slip", False)
    assert branch.values[0] == pytest.approx(1.9)
    assert branch.values[-1] == pytest.approx(2.1)
    assert all(branch.stable)


def test_exponents_of_a_slipping_chain_are_half_its_damping() -> None:
    chain = ss.chain(12, ss.laws.Coulomb(0.5), 5.0, coupling=1.2, damping=0.1)
    spectrum = ss.lyapunov(chain, 300.0, x0=np.linspace(0.3, 0.7, 12), v0=np.zeros(12), transient=0.0)
    assert spectrum.events == 0
    assert spectrum.exponents == pytest.approx(np.full(24, -0.05), abs=4 / 300)


def rates_of(mass: list[float], damping: float, stiffness: list[list[float]]) -> np.ndarray:
    """Real parts of the eigenvalues of M ẍ + D ẋ + K x = 0 with the same damping at each mass, the largest first."""
    n = len(mass)
    inverse = np.diag(1 / np.array(mass))
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -damping * inverse]])
    return np.sort(np.linalg.eigvals(matrix).real)[::-1]


@pytest.mark.parametrize(
    ("damping", "drive", "law", "slope", "transient"),
    [
        (0.1, 0.5, ss.laws.Coulomb(0.5), 0.0, 0.1),
        (0.1, 0.5, ss.laws.Coulomb(0.5), 0.0, 0.0),
        # Slip begins at the start, and creeps.
        (3.0, 0.5, ss.laws.Coulomb(0.5), 0.0, 0.1),
        (3.0, 0.1, ss.laws.Coulomb(0.5), 0.0, 0.1),
        # F = 0.5 + 0.5 exp(−u/0.1) + 0.1 u
        (0.3, 1.0, ss.laws.ExponentialStribeck(1.0, 0.5, 0.1, 0.1), 0.1 - 5 * math.exp(-10.0), 0.1),
    ],
)
def test_exponents_of_steady_slip_are_its_eigenvalues_however_it_begins(
    damping: float, drive: float, law: ss.laws.Law, slope: float, transient: float
) -> None:
    spectrum = ss.lyapunov(ss.Oscillator(damping, drive, law), 400.0, transient=transient)
    assert spectrum.events == 0
    # Within a period the growth of a direction swings by a factor of about 2, and directions turn at first.
    assert spectrum.exponents == pytest.approx(rates_of([1.0], damping + slope, [[1.0]]), abs=2e-3)
    assert spectrum.errors.max() < 2e-2


@pytest.mark.parametrize("damping", [3.0, 20.0])
def test_exponents_of_two_slipping_masses_are_their_eigenvalues(damping: float) -> None:
    stiffness = [[2.0, -1.0], [-1.0, 2.0]]
    contacts = [ss.Contact(0, ss.laws.Coulomb(0.2), 0.5), ss.Contact(1, ss.laws.Coulomb(0.3), 0.5)]
    pair = ss.System([1.0, 2.0], stiffness, [damping, damping], contacts)
    spectrum = ss.lyapunov(pair, 200.0, x0=[0.0, 0.0], v0=[0.0, 0.0])
    # Disturbances of the two slow modes part slowly.
    assert spectrum.exponents == pytest.approx(rates_of([1.0, 2.0], damping, stiffness), abs=6e-3)


def test_exponents_of_masses_that_do_not_know_of_each_other_are_those_of_each():
    stuck, forced = ss.Contact(0, ss.laws.Coulomb(3.0), 0.0), ss.Contact(1, ss.laws.StaticKinetic(0.4, 0.3), 0.0)
    pair = ss.System([1.0, 1.0], [1.0, 1.0], 0.1, (stuck, forced), ss.Force(0.6, 0.9, mass=1))
    zero, *pull, lost = ss.lyapunov(pair, 2000.0).exponents
    alone = ss.lyapunov(ss.Oscillator(0.1, 0.0, forced.law, forcing=ss.Harmonic(0.6, 0.9)), 2000.0).exponents
    assert abs(zero) < 1e-12
    assert lost == -math.inf
    assert pull == pytest.approx(alone, rel=2e-3)
    # One in stick-slip, of which only a shift in time stays, and one that rests where it was put.
    belt = ss.Contact(0, ss.laws.StaticKinetic(1.0, 0.5), 0.3)
    rests = ss.Contact(1, ss.laws.Coulomb(3.0), 0.0)
    found = ss.lyapunov(ss.System([1.0, 1.0], [1.0, 1.0], 0.1, (belt, rests)), 300.0).exponents
    assert found == pytest.approx([0.0, 0.0, -math.inf, -math.inf], abs=1e-12)


@pytest.mark.parametrize("damping", [3.0, 40.0])
def test_heavy_damping_forgets_fast_but_not_at_once(damping: float) -> None:
    system = ss.Oscillator(damping, 5.0, ss.laws.Coulomb(1.0), forcing=ss.Harmonic(0.3, 1.0))
    spectrum = ss.lyapunov(system, 60.0, x0=0.5, v0=0.01)
    assert spectrum.exponents == pytest.approx(rates_of([1.0], damping, [[1.0]]), rel=1e-3)


@pytest.mark.parametrize(
    ("mass", "stiffness", "force"), [(1.15951, 3.79602, 7.42112), (0.0128895, 5855.52, 4.11557), (1e-12, 1.0, 1e-9)]
)
@pytest.mark.parametrize("forcing", [0.0, 0.5])
def test_exponents_of_stick_slip_are_the_same_in_any_unit(
    mass: float, stiffness: float, force: float, forcing: float
) -> None:
    """Every stick forgets one direction; without forcing that is the only one beside the shift in time."""

    def exponents(mass: float, stiffness: float, force: float) -> np.ndarray:
        rate, speed = (stiffness / mass) ** 0.5, force / (mass * stiffness) ** 0.5
        system = ss.Oscillator(
            *(0.06 * (mass * stiffness) ** 0.5, 0.2 * speed, ss.laws.StaticKinetic(force, 0.6 * force)),
            mass=mass,
            stiffness=stiffness,
            forcing=ss.Harmonic(forcing * force, 1.3 * rate) if forcing else None,
        )
        return np.asarray(ss.lyapunov(system, 200.0 / rate).exponents / rate)

    found = exponents(mass, stiffness, force)
    assert found[1] == -math.inf
    if forcing:
        # Units of length count in the last of the growth.
        assert found[0] == pytest.approx(exponents(1.0, 1.0, 1.0)[0], abs=0.02)
    else:
        assert found[0] == 0.0


def test_a_stick_of_one_mass_forgets_everything_however_its_numbers_are_rounded() -> None:
    """Rounding may leave something of the one direction there is, or nothing."""
    rng = np.random.default_rng(1)
    for _ in range(8):
        mass, stiffness, force = 10 ** rng.uniform(-2, 2), 10 ** rng.uniform(0, 5), 10 ** rng.uniform(-1, 2)
        time, length = (mass / stiffness) ** 0.5, force / stiffness
        law, drive = ss.laws.StaticKinetic(force, 0.6 * force), 0.2 * (length / time)
        system = ss.Oscillator(0.06 * (mass * stiffness) ** 0.5, drive, law, mass=mass, stiffness=stiffness)
        assert ss.lyapunov(system, 200 * time).exponents.tolist() == [0.0, -math.inf]


def test_a_mass_at_rest_keeps_its_place_and_forgets_its_velocity() -> None:
    spectrum = ss.lyapunov(ss.Oscillator(0.1, 0.0, ss.laws.StaticKinetic(1.0, 0.5)), 200.0, x0=0.3, v0=0.0)
    assert spectrum.exponents.tolist() == [0.0, -math.inf]


def test_exponents_do_not_depend_on_how_many_derivatives_are_held_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    chain = ss.chain(3, ss.laws.StaticKinetic(1.0, 0.6), 0.2, coupling=1.2, damping=0.1)
    whole, few = (
        (monkeypatch.setattr(lyapunov_exponents, "_MOST_NUMBERS", most), ss.lyapunov(chain, 200.0, x0=[0.0, 0.1, 0.3]))[
            1
        ]
        for most in (20_000_000, 4000)
    )
    assert few.events == whole.events > 50
    finite = np.isfinite(whole.exponents)
    assert few.exponents[finite] == pytest.approx(whole.exponents[finite], abs=1e-9)


@pytest.mark.parametrize("masses", [2, 3])
def test_the_motion_of_equal_masses_is_found_without_a_guess(masses: int) -> None:
    """From rest all of them stick and break away at one time; a disturbance leads to another motion, and that is meant."""
    chain = ss.chain(masses, ss.laws.StaticKinetic(1.0, 0.6), 0.2, damping=0.05)
    cycle = ss.periodic_orbit(chain)
    assert cycle.stable
    # A long run from elsewhere comes back after the same time.
    run = ss.simulate(chain, 3000.0, x0=np.linspace(0.5, 0.0, masses))
    times = run.t_end - cycle.period * np.arange(4)
    x, _ = run.at(times)
    np.testing.assert_allclose(x, np.broadcast_to(x[0], x.shape), atol=1e-6)


def test_events_of_equal_masses_at_one_time_are_refused() -> None:
    with pytest.raises(ss.InputError, match="events at one time"):
        ss.lyapunov(ss.chain(2, ss.laws.Coulomb(1.0), 0.1), 100.0, x0=[0.0, 0.0])


def test_exponents_of_equal_masses_are_found_without_a_start() -> None:
    chain = ss.chain(2, ss.laws.StaticKinetic(1.0, 0.6), 0.2, damping=0.05)
    cycle = ss.periodic_orbit(chain)
    known = np.log(np.abs(cycle.multipliers[:3])) / cycle.period
    for seed in range(4):
        # Both masses stick at one time until t = 306: what that forgets is left out with the transient.
        spectrum = ss.lyapunov(chain, 1000.0, transient=0.5, seed=seed)
        assert spectrum.exponents[:3] == pytest.approx(known, abs=2e-3)
        assert spectrum.exponents[3] == -math.inf


@pytest.mark.parametrize(("damping", "stiffness"), [(1e6, 1.0), (1e8, 1e6)])
def test_derivatives_under_heavy_damping_are_differences_of_exact_orbits(damping: float, stiffness: float) -> None:
    """Steps as short as the damping would be two million and two hundred million."""
    law = ss.laws.StaticKinetic(damping, 0.6 * damping)
    matrix = [[2 * stiffness, -stiffness], [-stiffness, 2 * stiffness]]
    forcing = [ss.Force(1.9 * damping, 0.9), ss.Force(1.5 * damping, 0.9, 1.0, 1)]
    pair = ss.System([1, 2], matrix, [damping, damping], [ss.Contact(i, law, 0.5) for i in range(2)], forcing)
    start = np.array([0.3, -0.2, 0.1, 0.2])
    orbit = ss.simulate(pair, 8.0, x0=start[:2], v0=start[2:])
    assert len(orbit.events) == 11
    assert orbit.work.evaluations < 200
    ends = [
        [np.concatenate(ss.simulate(pair, 8.0, *(start + step * unit).reshape(2, 2)).at(8.0)) for unit in np.eye(4)]
        for step in (-1e-5, 1e-5)
    ]
    # The last digits of a velocity are those of a force over the damping.
    np.testing.assert_allclose(
        derivatives.fundamental_matrix(orbit, 8.0), ((np.array(ends[1]) - ends[0]) / 2e-5).T, rtol=0, atol=2e-8
    )


def test_an_orbit_of_masses_so_light_that_they_creep_has_the_multipliers_of_differences() -> None:
    def pair(mass: float) -> ss.System:
        contacts = [ss.Contact(i, ss.laws.StaticKinetic(1.0, 0.6), 0.1) for i in range(2)]
        forcing = [ss.Force(1.9, 0.9), ss.Force(1.5, 0.9, 1.0, 1)]
        return ss.System([mass, 2 * mass], [[2, -1], [-1, 2]], [1.0, 1.0], contacts, forcing)

    light = ss.periodic_orbit(pair(1e-9), t_end=100.0)
    assert light.period == pytest.approx(2 * math.pi / 0.9, rel=1e-12)
    # As those of masses that count little.
    heavier = ss.periodic_orbit(pair(1e-3), t_end=100.0)
    np.testing.assert_allclose(abs(light.multipliers), abs(heavier.multipliers), atol=1e-3)
    differences = multipliers_by_differences(light, 1e-4)
    known = light.multipliers[np.abs(light.multipliers) > 1e-4]
    assert len(known) == 1
    assert max(np.abs(value - differences).min() for value in known) < 1e-7


def test_derivatives_under_heavy_damping_without_modes_are_refused_in_one_sentence() -> None:
    law = ss.laws.StaticKinetic(1.0, 0.6)
    contacts = [ss.Contact(i, law, 3e-7) for i in range(2)]
    pair = ss.System([1, 1], [[2, -1], [-1, 2]], [[1e6, 1.0], [0.0, 1e6]], contacts, ss.Force(1.9, 0.9))
    for ask in (ss.periodic_orbit, lambda system: ss.lyapunov(system, 50.0)):
        with pytest.raises(
            ss.InputError, match=r"under damping 5.8e\+05 times as fast .* whose matrix is not symmetric"
        ):
            ask(pair)


@pytest.mark.long
def test_exponent_of_strong_chaos_is_the_average_of_the_release_map() -> None:
    # No published set: of 288 sets that were tried the one with the largest exponent, 0.3 a period.
    frequency = 1.3
    law, forcing = ss.laws.StaticKinetic(1.0, 0.5), ss.Harmonic(0.8, frequency)
    belt = ss.Oscillator(0.0, 0.1, law, forcing=forcing)
    period = 2 * math.pi / frequency
    spectrum = ss.lyapunov(belt, 1500 * period)
    assert spectrum.exponents[1] == -math.inf
    assert spectrum.exponents[0] * period > 0.2
    releases = ss.section(belt, "release", t_end=1500 * period, transient=0.1)
    times, phases = releases["t"].to_numpy(), releases["phase"].to_numpy()
    sides = np.sign(releases["force"].to_numpy())
    step = 1e-7
    logs = []
    for side in (-1, 1):
        here = phases[:-1][sides[:-1] == side]
        if here.size:
            ends = [ss.release_map(belt, here + sign * step, side=side)["image"].to_numpy() for sign in (-1, 1)]
            gap = np.angle(np.exp(1j * (ends[1] - ends[0])))
            logs.append(np.log(np.abs(gap / (2 * step))))
    average = np.concatenate(logs).sum() / (times[-1] - times[0])
    assert spectrum.exponents[0] * period == pytest.approx(average * period, abs=0.02)


def two_blocks(asymmetry: float, coupling: float) -> ss.System:
    """Two blocks pulled slowly: static over kinetic friction 1.25, that of the second block `asymmetry` times the first's.

    Huang & Turcotte, Nature 348 (1990) 234, and Pure Appl. Geophys. 138 (1992) 569.
    """
    laws = [ss.laws.StaticKinetic(1.25 * size, size) for size in (1.0, asymmetry)]
    return ss.chain(2, laws, 1e-3, coupling=coupling)


@pytest.mark.slow
def test_two_equal_blocks_are_neutral_and_unequal_ones_can_be_chaotic() -> None:
    # "The orbits are periodic in the symmetrical case but the orbit the system evolves to depends on the initial
    # conditions" (Narkounskaia & Turcotte, Geophys. J. Int. 111 (1992) 250): on the periodic orbit no disturbance decays. On
    # the way to it distances change once, by a factor that has no part in the average: from here that way ends at t = 1855.
    block, start, settled = two_blocks(1.0, 1.2), [0.3, 0.1], 2000.0
    events = ss.simulate(block, 10_000.0, x0=start).events.query("kind == 'release'")
    periods = [np.diff(events["t"][(events["contact"] == i) & (events["t"] > settled)]) for i in (0, 1)]
    assert np.concatenate(periods) == pytest.approx(periods[0][0], abs=1e-9)
    equal = ss.lyapunov(block, 10_000.0, x0=start, transient=0.2)
    assert abs(equal.exponents[:2]).max() < 1e-12
    # With any asymmetry there are chaotic motions, and periodic ones for other couplings.
    chaotic = ss.lyapunov(two_blocks(2.25, 0.8), 100_000.0, x0=[0.3, 0.1])
    assert chaotic.exponents[0] > 2 * chaotic.errors[0]
    regular = ss.lyapunov(two_blocks(2.25, 1.4), 50_000.0, x0=[0.3, 0.1])
    assert regular.exponents[1] < -1e-3


def test_derivatives_that_are_not_kept_change_nothing() -> None:
    """Of a hundred masses those of one phase take 11 MB: only what is read is kept."""
    law = ss.laws.ExponentialStribeck(1.0, 0.5, 0.3)
    for system in (
        ss.chain(3, [law, ss.laws.StaticKinetic(1.3, 0.6), ss.laws.Coulomb(0.7)], 0.3, coupling=0.8),
        ss.Oscillator(0.1, 0.3, law),
    ):
        sequence, kinds, _ = EventSequence.of_run(system, 30.0)
        assert len(kinds) > 5
        kept = {keep: sequence.follow(keep=keep) for keep in ("all", "last", "nothing")}
        width = sequence.layout.width
        assert [followed.rates.shape for followed in kept.values()] == [
            (count, width, width + 1) for count in (len(sequence.phases), 1, 0)
        ]
        assert np.array_equal(kept["last"].rates[0], kept["all"].rates[-1])
        for followed in kept.values():
            np.testing.assert_allclose(followed.states, kept["all"].states, rtol=1e-11, atol=1e-11)


@pytest.mark.slow
def test_a_hundred_masses_have_a_periodic_orbit() -> None:
    """Without coupling that of each of them; the derivatives of its whole run would take more than 4 GiB."""
    law = ss.laws.StaticKinetic(1.0, 0.6)
    many = ss.periodic_orbit(ss.chain(100, law, 0.3, coupling=0.0, damping=0.05), t_end=40.0)
    one = ss.periodic_orbit(ss.Oscillator(0.05, 0.3, law))
    assert len(many.events) == 200
    assert many.period == pytest.approx(one.period, rel=1e-12)


def settled(system: ss.System, t_end: float) -> ss.Orbit:
    """A long run from positions that are all unlike."""
    return ss.simulate(system, t_end, x0=0.3 * (np.arange(system.masses) * 0.618034 % 1.0))


def shaken(masses: int) -> ss.System:
    """A chain whose masses are forced at phases that are all unlike."""
    chain = ss.chain(masses, ss.laws.StaticKinetic(1.0, 0.6), 0.1, coupling=1.0, damping=0.1)
    angles = 2 * math.pi * (np.arange(masses) * 0.618034 % 1.0)
    forcing = [ss.Force(0.6, 1.3, float(angle), mass) for mass, angle in enumerate(angles)]
    return ss.System(chain.mass, chain.stiffness, chain.damping, chain.contacts, forcing)


def multipliers_by_differences(cycle: ss.PeriodicOrbit, step: float) -> np.ndarray:
    """Of the flow over one period from the middle of its longest phase, where a stuck mass can be moved, not sped up."""
    durations, stuck = cycle.closed.durations, cycle.closed.sequence.stuck
    phase = int(np.argmax(durations))
    t0 = durations[: phase + 1].sum() - durations[phase] / 2
    system, start = from_section(cycle.system, cycle.state[0] + t0), np.concatenate(cycle.orbit.at(t0))
    masses = start.size // 2
    free = np.concatenate([np.arange(masses), masses + np.flatnonzero(~stuck[phase])])
    columns = []
    for coordinate in free:
        ends = []
        for steps in STEPS:
            x0, v0 = (start + steps * step * np.eye(start.size)[coordinate]).reshape(2, -1)
            other = ss.simulate(system, cycle.period, x0=x0, v0=v0)
            assert len(other.events) == len(cycle.events)
            ends.append(np.concatenate(other.at(cycle.period))[free])
        columns.append(sum(weight * end for weight, end in zip(WEIGHTS, ends, strict=True)) / step)
    return np.linalg.eigvals(np.stack(columns, axis=-1))


@pytest.mark.parametrize(
    ("system", "t_end", "step"),
    [
        pytest.param(
            ss.chain(20, ss.laws.ExponentialStribeck(1.0, 0.9, 0.1, 0.3), 0.0178, coupling=3.0, damping=0.3),
            6000.0,
            1e-6,
            marks=pytest.mark.slow,
        ),
        (ss.chain(20, ss.laws.StaticKinetic(1.0, 0.5), 0.0506, coupling=0.3), 4000.0, 1e-5),
        (shaken(20), 400 * 2 * math.pi / 1.3, 1e-5),
        pytest.param(shaken(100), 400 * 2 * math.pi / 1.3, 1e-6, marks=pytest.mark.slow),
    ],
    ids=["twenty by turns", "twenty of static and kinetic friction", "twenty shaken", "a hundred shaken"],
)
def test_multipliers_of_coupled_chains_are_those_of_differences_of_runs(
    system: ss.System, t_end: float, step: float
) -> None:
    run = settled(system, t_end)
    cycle = ss.periodic_orbit(system, run.at(t_end), t_end=16.0 if system.forcing else 40.0)
    # Every mass slips.
    assert cycle.closed.sequence.modes.any(axis=0).all()
    assert cycle.stable
    assert cycle.residual < 1e-12
    # It is a motion of the system.
    again = ss.simulate(from_section(system, cycle.state[0]), cycle.period, *cycle.orbit.at(0.0))
    assert np.concatenate(again.at(cycle.period)) == pytest.approx(np.concatenate(cycle.orbit.at(0.0)), abs=1e-10)
    differences = multipliers_by_differences(cycle, step)
    known = cycle.multipliers[np.abs(cycle.multipliers) > 1e-2]
    assert len(known) >= system.masses
    assert max(np.abs(value - differences).min() for value in known) < 1e-7
    assert max(np.abs(value - known).min() for value in differences[np.abs(differences) > 2e-2]) < 1e-7


@pytest.mark.long
def test_a_chain_that_drifts_is_no_periodic_orbit() -> None:
    """The slips of its masses hardly overlap: one phase keeps its distance to a return, 2.7e-4 a period, for any start."""
    system = ss.chain(20, ss.laws.StaticKinetic(1.0, 0.5), 0.0274, coupling=0.3, damping=0.02)
    run = settled(system, 12_000.0)
    with pytest.raises(ss.InputError, match=r"the motion drifts by 2\.7e-04 of its size a period"):
        ss.periodic_orbit(system, run)


@pytest.mark.parametrize(
    ("law", "forcing"),
    [
        (ss.laws.StaticKinetic(1.0, 0.9), ()),
        (ss.laws.PiecewiseLinear(((0.0, 0.9), (2.0, 0.82)), 1.0), ()),
        (ss.laws.StaticKinetic(1.0, 0.9), ss.Force(0.2, 1.3, mass=1)),
    ],
    ids=["level", "falling", "forced"],
)
def test_a_mass_that_slips_for_ever_keeps_the_friction_of_its_law(law: ss.laws.Law, forcing: object) -> None:
    contacts = [ss.Contact(0, ss.laws.StaticKinetic(1.0, 0.4), 0.3), ss.Contact(1, law, 0.3)]
    system = ss.System([1, 1], [[2.5, -1.5], [-1.5, 2.5]], 0.1, contacts, forcing)
    run = ss.simulate(system, 40 * 2 * math.pi / 1.3 * 6)
    assert set(run.events["contact"][-20:]) == {0}
    cycle = ss.periodic_orbit(system)
    again = ss.simulate(from_section(system, cycle.state[0]), cycle.period, *cycle.orbit.at(0.0))
    assert np.concatenate(again.at(cycle.period)) == pytest.approx(np.concatenate(cycle.orbit.at(0.0)), abs=1e-10)
    # The run settles on the same motion.
    times = run.t_end - np.linspace(0, 3 * cycle.period, 400)
    assert np.ptp(run.at(times)[0][:, 0]) == pytest.approx(
        np.ptp(again.at(np.linspace(0, cycle.period, 400))[0][:, 0]), rel=1e-3
    )
    differences = multipliers_by_differences(cycle, 1e-6)
    known = cycle.multipliers[np.abs(cycle.multipliers) > 1e-2]
    assert max(np.abs(value - differences).min() for value in known) < 1e-6
    assert np.sum(np.abs(known - 1) < 1e-6) == (0 if forcing else 1)


def test_masses_that_leave_at_one_time_are_followed_from_a_start_beside_theirs() -> None:
    contacts = [
        ss.Contact(0, ss.laws.StaticKinetic(1.0, 0.69), 0.47),
        ss.Contact(1, ss.laws.StaticKinetic(1.0, 0.4), 0.47),
    ]
    system = ss.System([1, 1], [[1.4, -0.4], [-0.4, 1.4]], 0.043, contacts)
    # Steady slip attracts, too; a start far from rest leads there.
    cycle, exponents = ss.periodic_orbit(system), ss.lyapunov(system, 2000.0)
    assert set(ss.simulate(system, 500.0).events["contact"][-8:]) == {0, 1}
    assert exponents.exponents[:2] == pytest.approx([0.0, math.log(abs(cycle.multipliers[1])) / cycle.period], abs=1e-3)


def test_masses_in_step_whose_events_come_together_close_as_one_mass_does():
    law = ss.laws.ExponentialStribeck(1.0, 0.7, 0.3, 0.1)
    pair = ss.chain(2, law, 0.3, coupling=2.0, damping=0.05)
    one = ss.Oscillator(0.05, 0.3, law)
    # Nearly in step at the end: rounding orders their events.
    settled = ss.simulate(pair, 800.0, [1.2, 1.2], [0.05, 0.0])
    alone = ss.periodic_orbit(one, ss.simulate(one, 200.0))
    found = ss.periodic_orbit(pair, settled)
    assert found.period == pytest.approx(alone.period, rel=1e-10)
    assert found.stable
