"""The Poincaré map of an event sequence, differentiated: a period of a cycle, Floquet multipliers, and Newton's method."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.periodic.event_sequence import BOUNDARIES, EventSequence, Table, layout_of, read
from stickslip.dynamics.periodic.newton_iteration import newton
from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.model.drive import Drive
from stickslip.model.system import Oscillator, System

_T = 0
#: Below this share of the largest a multiplier is the zero that an event brings.
_NOTHING = 1e-11
#: Below it a size only stands for that of a zero.
_NO_SIZE = 1e-290
#: What rounding leaves of a derivative of the return map that is zero, in sizes of the numbers of the state.
_ROUNDING = 1e-13
#: Below this share of the period there is no stick: one that has vanished closes to rounding where slip is neutral.
_NO_STICK = 1e-7
#: Events of two contacts may come together, as of masses in step: closer than this share of the period, rounding orders them.
_TOGETHER = 1e-12
#: What no step takes away of a defect is a drift of the motion where it is more than this part of it.
_DRIFT = 1e-10
#: The largest step of Newton's method, in sizes of the motion, and the most rounds of it.
_REACH, _ROUNDS = 0.2, 40
#: Below this a step is rounding, and below the other where rounding holds it up.
_EXACT, _HELD_UP = 1e-14, 1e-9
#: What rounding leaves of the defect of a closed orbit, in sizes of the motion.
_UNKNOWN = 1e-14
#: Rounding leaves a double root undecided by its root, of which this is four times; so many slow steps down to it show one.
_DOUBLE, _SLOW = 4 * np.finfo(float).eps ** 0.5, 9


def forcing_period(system: Oscillator | System) -> float | None:
    """The period of the forcing; None without one.

    Raises
    ------
    InputError
        where several frequencies have no common period of at most 100 of the slowest.
    """
    frequencies = [harmonic.frequency for harmonic in system.swings]
    if not frequencies:
        return None
    slowest = min(frequencies)
    for count in range(1, 101):
        periods = np.array(frequencies) / slowest * count
        if np.abs(periods - np.round(periods)).max() < 1e-9:
            return 2 * math.pi / slowest * count
    raise InputError(
        f"the forcing has no common period of at most 100 of its slowest, its frequencies are {frequencies}; expected ratios "
        "of whole numbers"
    )


@dataclass(frozen=True)
class Return:
    """One period of a cycle: the return map at its start, differentiated.

    Attributes
    ----------
    defect : the end minus the start, over `coordinates`.
    map_jacobian : of the return map over `coordinates`.
    parameter : derivative of the end with respect to the parameter, over `coordinates`; zero where none was asked for.
    tests : the test functions, as in :class:`Followed`; `test_rates` their derivatives over `coordinates` and the parameter.
    fixed : what the orbit writes whatever the start was, such as the velocity of the drive where it is reached;
        `fixed_parameter` its derivatives with respect to the parameter.
    """

    sequence: EventSequence
    forcing_periods: int
    coordinates: NDArray[np.int64]
    end: Array
    defect: Array
    map_jacobian: Array
    parameter: Array
    tests: Table
    test_rates: Array
    durations: Array
    fixed: NDArray[np.int64]
    fixed_parameter: Array

    @property
    def period(self) -> float:
        """How long it took."""
        return float(self.durations.sum())

    @property
    def settled(self) -> bool:
        """Whether what the orbit writes whatever the start was stands at its start too."""
        return np.array_equal(self.end[self.fixed], self.sequence.start[self.fixed])

    @property
    def sizes(self) -> Array:
        """What counts as large in each of `coordinates`."""
        return size_of(self.sequence.system, self.sequence.start, self.coordinates)


def coordinates_of(system: Oscillator | System, start: Array) -> NDArray[np.int64]:
    """The numbers of the state that make the return map: all that are finite; time only where something else keeps time."""
    first = _T if forcing_period(system) is not None else _T + 1
    return np.array(
        [coordinate for coordinate in range(first, layout_of(system).width) if np.isfinite(start[coordinate])]
    )


def return_of(sequence: EventSequence, forcing_periods: int, path: str | None = None, *, tests: bool = False) -> Return:
    """Follow one period; `forcing_periods` periods of the forcing."""
    period = forcing_period(sequence.system)
    followed = sequence.follow(*([] if path is None else [path]), keep="last", tests=tests)
    coordinates = coordinates_of(sequence.system, sequence.start)
    end, rates = followed.states[-1], followed.rates[-1]
    # What nothing along the orbit reads or writes is no part of the map, and what it writes whatever the start was is known.
    within = rates[np.ix_(coordinates, coordinates)]
    sizes = size_of(sequence.system, sequence.start, coordinates)
    # A number that has no size, such as the slope of a level line, leaves no rounding either.
    sized = np.logical_and.outer(sizes > _NO_SIZE, sizes > _NO_SIZE)
    depends = np.where(sized, np.abs(within) * sizes > _ROUNDING * sizes[:, None], within != 0)
    unit = np.eye(len(coordinates), dtype=bool)
    alone = ~(depends & ~unit).any(axis=1) & ~(depends & ~unit).any(axis=0)
    idle = alone & (np.diag(within) == 1)
    # The line of friction of a contact that has no events is that of the law, and no unknown.
    lines = sequence.layout.contact_coordinates(["offset", "slope"])
    given = np.isin(coordinates, lines) & ~(depends & ~unit).any(axis=1) & (np.diag(within) == 1) & ~idle
    for contact in np.flatnonzero(np.isin(lines, coordinates[given]).any(axis=1)):
        if path is not None and path.startswith(("/law/", f"/contacts/{contact}/law/")):
            raise InputError(
                f"continuation: contact {contact} slips without events, and nothing passes a change of its law on: continue "
                "over a number of the drive, the forcing or the structure, or look for the orbit anew at each value"
            )
    idle |= given
    # Where forcing keeps time the orbit closes in time, too.
    written = ~depends.any(axis=1) & (coordinates != _T)
    fixed, coordinates = coordinates[written], coordinates[~idle & ~written]
    defect = end[coordinates] - sequence.start[coordinates]
    # They move with the parameter, and what depends on them with them.
    parameter = rates[coordinates, -1] + rates[np.ix_(coordinates, fixed)] @ rates[fixed, -1]
    if period is not None:
        at = int(np.flatnonzero(coordinates == _T)[0])
        defect[at] -= forcing_periods * period
        if path is not None and path.endswith("/frequency"):
            # With several frequencies none can move alone: the period is that of one.
            parameter[at] += forcing_periods * period / read(sequence.system, path)
    test_rates = followed.test_rates
    return Return(
        sequence=sequence.lasting(followed.durations),
        forcing_periods=forcing_periods,
        coordinates=coordinates,
        end=end,
        defect=defect,
        map_jacobian=rates[np.ix_(coordinates, coordinates)],
        parameter=parameter,
        tests=followed.tests,
        test_rates=np.column_stack(
            [test_rates[:, coordinates], test_rates[:, -1] + test_rates[:, fixed] @ rates[fixed, -1]]
        ),
        fixed=fixed,
        fixed_parameter=rates[fixed, -1],
        durations=followed.durations,
    )


def moved(here: Return, step: Array) -> EventSequence:
    """The sequence from a start moved by `step` over its coordinates; what is written along the way is taken from its end."""
    start = here.sequence.start.copy()
    start[here.coordinates] += step
    start[here.fixed] = here.end[here.fixed]
    return replace(here.sequence, start=start)


def size_of(system: Oscillator | System, start: Array, coordinates: NDArray[np.int64]) -> Array:
    """What counts as large in each number of the state."""
    layout = layout_of(system)
    time = system.natural_period / (2 * math.pi)
    drives = [contact.drive_velocity for contact in system.contacts]
    speeds = [abs(drive.velocity if isinstance(drive, Drive) else drive) for drive in drives]
    length = max(np.abs(start[layout.x]).max(), time * np.abs(start[layout.v]).max(), time * max(speeds), 1e-300)
    sizes = np.maximum(np.abs(start[: layout.width]), 1e-300)
    sizes[_T], sizes[layout.x], sizes[layout.v] = time, length, length / time
    sizes[layout.ages] = np.maximum(sizes[layout.ages], time)
    # A number of the line or the memory that passes zero is no smaller a part of the law than the others of its dimension.
    for columns in (layout.speeds, layout.forces):
        alike = sizes[columns]
        sizes[columns] = np.where(np.isfinite(alike), alike, 0.0).max(axis=1, keepdims=True)
    return np.asarray(sizes[coordinates], float)


def close(
    sequence: EventSequence, forcing_periods: int, progress: Callable[[], Any] = lambda: None
) -> tuple[Return, int]:
    """Newton's method on the return map, `progress` called before each round; the closed orbit and the rounds it took.

    Raises
    ------
    InputError
        where it does not converge.
    """

    def at(sequence: EventSequence) -> tuple[tuple[Return, Array, Array], Array, float]:
        here = return_of(sequence, forcing_periods)
        size = here.sizes
        jacobian = np.eye(len(here.coordinates)) - here.map_jacobian
        step = np.asarray(np.linalg.lstsq(jacobian, here.defect, rcond=1e-14)[0], float)
        return (here, jacobian @ step, size), step, float(np.abs(step / size).max(initial=0.0))

    small = 0
    for done in newton(at, lambda found, step: moved(found[0], step), sequence, _REACH, _ROUNDS, progress):
        here, within, size = done.here
        # Around a centre every state closes, and a step would be the quotient of two roundings. What the orbit writes
        # whatever the start was is right from the second round on.
        known = here.settled or len(done.errors) > 1
        if known and np.abs(here.defect / size).max(initial=0.0) < np.finfo(float).eps:
            return here, len(done.errors)
        small += done.converged(_EXACT, _HELD_UP)
        if small and (here.settled or small > 2):
            return without_drift(here, within, size), len(done.errors)
        if done.error < _DOUBLE and slow(done.errors):
            return without_drift(here, within, size), len(done.errors)
    raise InputError(
        f"periodic_orbit: no periodic orbit of this event sequence near the guess (the last step is {done.error:.1e} of the "
        "motion): give another guess or simulate longer first"
    )


def without_drift(here: Return, within: Array, size: Array) -> Return:
    """What Newton's method has settled on; `within` is the part of its defect that steps can take away.

    Raises
    ------
    InputError
        where more is left: between masses whose slips never overlap nothing holds a phase, and where their periods differ
        each return lies as far from the one before.
    """
    drift = float((np.abs(here.defect - within) / size).max(initial=0.0))
    if drift > _DRIFT:
        raise InputError(
            f"periodic_orbit: the motion drifts by {drift:.1e} of its size a period in a direction in which nothing draws it "
            "back, so no motion of this event sequence closes; simulate until the drift has led to other events, and take "
            "the end as the guess"
        )
    return here


def slow(errors: Sequence[float]) -> bool:
    """Whether Newton's method converges as towards a root of order m: each step is 1 − 1/m of the one before.

    >>> slow([2e-3 / 2**i for i in range(12)]), slow([1e-1, 1e-2, 1e-4, 1e-8, 1e-15])
    (True, False)
    """
    steps = np.asarray(errors[-_SLOW:])
    rates = steps[1:] / steps[:-1]
    return len(steps) == _SLOW and bool(((rates > 0.4) & (rates < 0.9)).all())


def once(closed: Return) -> Return:
    """The orbit taken once: near a flip a run that is not quite settled returns sooner after two periods than after one."""
    phases = closed.sequence.phases
    for count in range(len(phases), 1, -1):
        if len(phases) % count or closed.forcing_periods % count:
            continue
        parts = phases.reshape(count, -1)
        same = all((parts[name] == parts[name][0]).all() for name in ("mode", "ending", "contact"))
        if same and np.ptp(closed.durations.reshape(count, -1), axis=0).max() < 1e-7 * closed.period:
            sequence = replace(closed.sequence, phases=parts[0], last=phases["mode"][0].copy())
            return close(sequence, closed.forcing_periods // count)[0]
    return closed


def inconsistency(here: Return) -> str | None:
    """Why the real motion does not follow the event sequence; None where it does."""
    stuck = here.sequence.stuck.any(axis=1)
    together = _TOGETHER * here.period if here.sequence.stuck.shape[1] > 1 else 0.0
    if (here.durations <= -together).any() or (stuck.any() and here.durations[stuck].sum() < _NO_STICK * here.period):
        return f"phase {int(np.argmin(here.durations))} would take no time"
    tests = here.tests[np.isfinite(here.tests["value"])]
    scale = 1e-9 * np.abs(tests["value"]).max(initial=1e-300)
    for boundary, _, phase, _, _, value in tests:
        if value < -scale:
            return f"the test function {BOUNDARIES[boundary]} of phase {phase} is {value:.2e}"
    return None


def eigenvalues(matrix: Array) -> NDArray[np.complex128]:
    """Those of a matrix, the largest first."""
    values = np.linalg.eigvals(matrix).astype(complex)
    return np.asarray(values[np.argsort(-np.abs(values), kind="stable")], complex)


def undecided(here: Return) -> bool:
    """Whether rounding hides on which side of 1 the largest multiplier lies, as where the orbit is a multiple root.

    The orbit is known only as well as its defect: moved by as much, along the direction in which that says least, it would
    have a multiplier as far from its own as 1 is.
    """
    sizes = here.sizes
    _, values, rows = np.linalg.svd((np.eye(len(sizes)) - here.map_jacobian) * sizes / sizes[:, None])
    unknown = max(float(np.abs(here.defect / sizes).max()), _UNKNOWN) / max(values[-1], _UNKNOWN)
    largest = abs(eigenvalues(here.map_jacobian)[0])
    try:
        beside = return_of(moved(here, min(unknown, _REACH) * rows[-1] * sizes), here.forcing_periods)
    except InputError:
        return True
    return bool(abs(abs(eigenvalues(beside.map_jacobian)[0]) - largest) > abs(largest - 1))


def multipliers_of(here: Return) -> NDArray[np.complex128]:
    """Floquet multipliers, the largest first: the 1 of an autonomous cycle, and zero where an event loses a direction."""
    values = eigenvalues(here.map_jacobian)
    values[np.abs(values) < _NOTHING * max(1.0, float(np.abs(values).max(initial=0.0)))] = 0.0
    if forcing_period(here.sequence.system) is None:
        values = np.concatenate([[1.0 + 0.0j], values])
    most = 2 * here.sequence.layout.masses
    values = np.append(values, np.zeros(most))
    count = max(most, int((values != 0).sum()))
    return np.asarray(values[:count], complex)
