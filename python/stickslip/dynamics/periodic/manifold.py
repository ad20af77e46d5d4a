"""Stable and unstable manifolds of a periodic orbit of saddle type, in a section."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip import _core
from stickslip.dynamics.periodic.derivatives import fundamental_matrix
from stickslip.dynamics.periodic.periodic_orbits import PeriodicOrbit, from_section
from stickslip.dynamics.sections import points_of
from stickslip.dynamics.surface import Surface
from stickslip.errors import InputError, number, positive
from stickslip.files.arrays import Array
from stickslip.files.equality import ByContent
from stickslip.files.notebook import InNotebook
from stickslip.model.drive import Drive
from stickslip.model.parameters import contact_of
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit
from stickslip.simulation.simulate import simulate

#: How far from the fixed point a manifold is taken for its tangent, relative to its extent.
_NEAR = 1e-6
#: The stable one is, as far as it takes to tell on which side of it an image lies.
_NEAR_STABLE = 1e-4
#: Two neighbours from starts that differ by no more, relative to the fundamental segment, lie on two sides of a jump.
_JUMP = 1e-11
#: A map is iterated so often at most, and until the curve grows by no more of the spacing: it has come to an attractor.
_ITERATES, _SETTLED = 200, 1e-2
#: The angles, rad, within which the curve goes on, and where it has a corner, as the map has where orbits graze; at how many
#: of them the map is asked at once, and how often.
_TURN, _CORNER, _ASKED, _ROUNDS = 0.6, 2.6, 17, 5
#: Steps are halved down to this part of the spacing where the curve turns.
_FINEST = 1e-3
#: How far from the curve, relative to a step, an image may lie to be on it.
_ON = 1e-3

#: The image of states in rows.
Map = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Manifold(ByContent, InNotebook):
    """One of the two manifolds of a saddle, in the section t = phase + n · period of the forcing.

    Without forcing the section is where the position of one mass is greatest. A state is n positions and n velocities.

    Attributes
    ----------
    side : ``"unstable"`` or ``"stable"``.
    fixed_point : the state of the orbit in the section; x and v of one mass.
    multiplier : of the direction along it, per period of the orbit.
    sides : a curve for each of the two sides, states from the fixed point outwards, shape (points, 2 n); a row of NaN where
        it jumps.
    ends : why each side ended: ``"length"``, ``"most"`` points, ``"settled"`` on an attractor, ``"iterates"``,
        ``"diverged"``; of the stable one ``"lost"`` where no state nearby is mapped onto it.
    """

    side: str
    fixed_point: tuple[float, ...]
    multiplier: float
    sides: tuple[Array, Array] = field(repr=False)
    ends: tuple[str, str]

    @property
    def points(self) -> Array:
        """Both sides as one curve through the fixed point, shape (points, 2 n)."""
        return np.vstack([self.sides[0][::-1], self.sides[1][1:]])

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        return {
            "side": self.side,
            "fixed point": self.fixed_point,
            "multiplier": self.multiplier,
            "points": [len(curve) for curve in self.sides],
            "ends": self.ends,
        }

    def __repr__(self) -> str:
        counts = " and ".join(f"{len(curve)} points ({end})" for curve, end in zip(self.sides, self.ends, strict=True))
        return f"<Manifold, {self.side}, multiplier {self.multiplier:.6g}: {counts}>"


def manifold(
    orbit: PeriodicOrbit,
    side: str = "unstable",
    *,
    length: float | None = None,
    spacing: float | None = None,
    phase: float = 0.0,
    contact: int = 0,
    most: int = 20_000,
) -> Manifold:
    """The stable or the unstable manifold of a periodic orbit of saddle type, where it meets a section.

    The section is the stroboscopic one; without forcing it is where the position of one mass is greatest. With the map P of
    the section over the period of the orbit (over two of them where a multiplier is negative) and its fixed point p: the
    unstable one is what a short segment of the tangent from p + ε e to P(p + ε e) becomes under P, P², …, starts being
    inserted where neighbours part. The stable one is the curve of states that P maps onto the part of the curve that is
    known: the next point lies on a circle around the last. P alone is asked, never its inverse: a stick forgets where it
    came from, so that there is none. Under a stick the multiplier along it is 0, and the curve is mapped onto p at once.

    Parameters
    ----------
    orbit : a closed orbit of one forced mass or of several masses, from :func:`stickslip.periodic_orbit`, with one
        multiplier outside the unit circle and the others inside it.
    side : ``"unstable"`` or, of one mass, ``"stable"``.
    length : of each of the two sides > 0, with v over the natural frequency; default five times the extent of the orbit.
    spacing : the greatest distance of neighbouring points > 0; default a two-hundredth of the extent of the orbit.
    phase : time of the section, in [0, period) of the forcing; that of :func:`stickslip.basins` and
        :func:`stickslip.section` is 0.
    contact : without forcing, the contact whose mass has its greatest position in the section.
    most : the most points of a side.

    Returns
    -------
    Manifold. :func:`stickslip.show.manifold_plot` draws it over basins or a section.

    Raises
    ------
    InputError
        for an orbit that is no saddle, one mass that nothing forces, the stable manifold of several masses (no curve), and
        a law that remembers more than the state (a static friction that grows at rest, a branch of friction).

    Limits: of a stable set that consists of several pieces only the one through p is found; it ends ``"lost"`` where the map
    jumps, and where states that stick are mapped as one (whole areas are then mapped onto the curve). Without forcing, P is
    the return after as many maxima as the orbit has, so that it jumps where a motion has a maximum more. Several masses
    take a run for each image of a point: some 0.1 ms an event.

    Source: You, Kostelich & Yorke, Int. J. Bifurcation Chaos 1 (1991) 605; Krauskopf & Osinga, J. Comput. Phys. 146 (1998)
    404; without an inverse: England, Krauskopf & Osinga, SIAM J. Appl. Dyn. Syst. 3 (2004) 161.

    >>> import stickslip as ss
    >>> belt = ss.Oscillator(0.0, 0.1, ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.8, 1.3))
    >>> (orbit,) = ss.periodic_orbits(ss.section(belt, t_end=4000), returns=4)
    >>> ss.manifold(orbit, length=3.0).ends
    ('length', 'length')
    """
    _checked(orbit, side)
    crossing = _strobe(orbit, phase) if orbit.forcing_periods else _maximum(orbit, phase, contact)
    system, state = crossing.system, crossing.state
    masses = len(state) // 2
    scales = np.repeat([1.0, 2 * math.pi / system.natural_period], masses)
    fixed = state / scales
    whole = orbit.period
    matrix = fundamental_matrix(simulate(system, whole, *_motion(system, state))) * scales / scales[:, None]
    multipliers, vectors = np.linalg.eig(matrix)
    order = np.argsort(-np.abs(multipliers))
    if not orbit.forcing_periods:
        # A disturbance along the motion shifts it in time: back to the section along it.
        along = int(np.argmin(np.abs(multipliers - 1)))
        flow, across = vectors[:, along], masses + crossing.mass
        vectors = vectors - np.outer(flow, vectors[across] / flow[across])
        order = order[order != along]
    sizes = np.abs(multipliers[order])
    if np.iscomplex(multipliers[order[0]]) or not sizes[0] > 1 > sizes[1]:
        raise InputError(
            "manifold: expected an orbit with one multiplier outside the unit circle and the others inside it, got "
            f"{', '.join(f'{value:.4g}' for value in multipliers[order])}; the manifold of another is no curve"
        )
    which = order[0 if side == "unstable" else 1]
    multiplier, tangent = float(multipliers[which].real), np.real(vectors[:, which])
    turns = 2 if (multipliers[order[:2]].real < 0).any() else 1
    sampled = np.column_stack(orbit.orbit.at(np.linspace(0.0, whole, 400))) / scales
    extent = float(np.ptp(sampled, axis=0).max())
    reach = positive("length", 5 * extent if length is None else length, "manifold")
    step = positive("spacing", extent / 200 if spacing is None else spacing, "manifold")
    section_map = crossing.map(turns, scales)
    curves, ends = [], []
    for sign in (-1.0, 1.0):
        if side == "unstable":
            grown = _unstable(section_map, fixed, sign * tangent, abs(multiplier) ** turns, extent, reach, step, most)
        else:
            grown = _stable(section_map, fixed, sign * tangent, extent, reach, step, most)
        curves.append(grown[0] * scales)
        ends.append(grown[1])
    point = tuple(float(value) for value in state)
    return Manifold(side, point, multiplier, (curves[0], curves[1]), (ends[0], ends[1]))


@dataclass(frozen=True)
class _Crossing:
    """Where an orbit meets a section: the system whose clock is 0 there, the state, and the map to the next such state.

    `mass` is the one whose position is greatest in the section, `map` takes turns and scales.
    """

    system: Oscillator | System
    state: Array
    mass: int
    map: Callable[[int, Array], Map]


def _strobe(orbit: PeriodicOrbit, phase: float) -> _Crossing:
    """The section at a time of the period of the forcing."""
    period, start = orbit.period / orbit.forcing_periods, number("phase", phase, "manifold")
    if not 0 <= start < period:
        raise InputError(f"manifold: phase must lie in [0, {period:g}), the period of the forcing, got {phase!r}")
    # The section of the orbit lies where its events do.
    state = np.hstack(orbit.orbit.at((start - orbit.state[0]) % orbit.period))
    system = from_section(orbit.system, start)

    def period_map(turns: int, scales: Array) -> Map:
        duration = turns * orbit.period
        if isinstance(system, Oscillator):
            return _map(system, duration, scales)

        def after(run: Orbit) -> Array | None:
            return np.concatenate(run.at(duration)) if run.stop == "t_end" else None

        return _by_runs(system, duration, after, scales)

    return _Crossing(system, _sticking(system, state), 0, period_map)


def _maximum(orbit: PeriodicOrbit, phase: float, contact: int) -> _Crossing:
    """The section where the position of the mass of a contact is greatest, at the greatest of the maxima of the orbit."""
    if phase != 0.0:
        raise InputError(
            f"manifold: phase is that of a forcing, and nothing forces this system; leave it out, got {phase!r}"
        )
    system = orbit.system
    assert isinstance(system, System)
    mass = system.contacts[contact_of(system, contact, "manifold")].mass
    surface = Surface(normal=(0.0, 1.0, 0.0), direction=-1)
    nearly = 1e-6 * orbit.period
    around = simulate(system, orbit.period + 2 * nearly, *_motion(system, np.hstack(orbit.orbit.at(0.0))))
    maxima = points_of(around, surface, nearly, contact)
    if not len(maxima):
        raise InputError(f"manifold: mass {mass} does not swing along this orbit; choose another contact")
    count = len(maxima)
    state = _sticking(system, np.hstack(around.at(maxima[np.argmax(maxima[:, 1]), 0])))
    state[system.masses + mass] = 0.0

    def return_map(turns: int, scales: Array) -> Map:
        def after(run: Orbit) -> Array | None:
            returns = points_of(run, surface, nearly, contact)
            if len(returns) < turns * count:
                return None
            image = np.hstack(run.at(returns[turns * count - 1, 0]))
            image[system.masses + mass] = 0.0
            return image

        # A motion apart from the orbit may take longer.
        return _by_runs(system, 3 * turns * orbit.period, after, scales)

    return _Crossing(system, state, mass, return_map)


def _by_runs(
    system: Oscillator | System, duration: float, after: Callable[[Orbit], Array | None], scales: Array
) -> Map:
    """The map by a run from each state; not a number where it does not come back."""

    def image(states: Array) -> Array:
        images = np.full(states.shape, np.nan)
        for row, state in enumerate(states):
            if np.isfinite(state).all():
                end = after(simulate(system, duration, *_motion(system, _sticking(system, state * scales))))
                images[row] = np.nan if end is None else end / scales
        return images

    return image


def _motion(system: Oscillator | System, state: Array) -> tuple[Any, Any]:
    """Positions and velocities for a run."""
    x, v = np.split(state, 2)
    return (x, v) if isinstance(system, System) else (float(x[0]), float(v[0]))


def _sticking(system: Oscillator | System, state: Array) -> Array:
    """A state whose velocities are those of the drives to the last bit where they are but for rounding: it sticks."""
    state = np.array(state, float)
    masses = len(state) // 2
    for contact in system.contacts:
        if contact.other is not None or isinstance(contact.drive_velocity, Drive):
            continue
        drive, velocity = contact.drive_velocity, masses + contact.mass
        if abs(state[velocity] - drive) < 1e-12 * max(1e-300, abs(drive)):
            state[velocity] = drive
    return state


def _checked(orbit: PeriodicOrbit, side: str) -> None:
    """Refuse what has no manifold that is a curve."""
    if side not in ("stable", "unstable"):
        raise InputError(f'manifold: side must be "stable" or "unstable", got {side!r}')
    if not isinstance(orbit, PeriodicOrbit):
        raise InputError(f"manifold: expected a periodic orbit, got {type(orbit).__name__}; find one by periodic_orbit")
    system = orbit.system
    if isinstance(system, Oscillator) and not orbit.forcing_periods:
        raise InputError(
            "manifold: nothing forces this oscillator, so its orbit is itself the boundary of basins; draw it by "
            "show.phase_plane(orbit)"
        )
    if isinstance(system, System) and system.masses > 1 and side == "stable":
        dimensions = 2 * system.masses - (1 if orbit.forcing_periods else 2)
        raise InputError(
            f"manifold: the stable manifold of an orbit of {system.masses} masses is no curve: it has {dimensions} "
            'dimensions in the section; take side="unstable", or find the basins that it bounds by basins'
        )
    for law in {contact.law for contact in system.contacts}:
        if np.ptp(law.break_away_force([0.0, 1.0, 1e6], [0.0, 1.0, 0.0])) > 0 or not _forgets(law):
            raise InputError(
                f"manifold: {type(law).__name__} remembers more than position and velocity, so its section has more "
                "dimensions; take a law with a constant static friction"
            )


def _forgets(law: Any) -> bool:
    """Whether the kinetic force is a function of the slip velocity."""
    return type(law).__name__ not in ("BogaczRyczek", "TwoBranch")


def _map(system: Oscillator, duration: float, scales: Array) -> Map:
    """The stroboscopic map over a duration; not a number where a run does not reach its end."""
    document = system.to_json()

    def image(states: Array) -> Array:
        rows = np.ascontiguousarray((states * scales).ravel())
        run = (duration, 0.0, 1_000_000)
        table = _core.batch(document, ["x0", "v0"], rows, run, None, 0, os.cpu_count() or 1, None, None)
        ended = np.asarray(table["stop"]) == _core.STOPS.index("t_end")
        ends = np.column_stack([np.ravel(table[name]) for name in "xv"]) / scales
        return np.where(ended[:, None], ends, np.nan)

    return image


def _unstable(
    image: Map,
    fixed: Array,
    tangent: Array,
    growth: float,
    extent: float,
    length: float,
    spacing: float,
    most: int,
) -> tuple[Array, str]:
    """The curve that the fundamental segment becomes, up to a length, and why it ended."""
    seed = _NEAR * extent * tangent / np.linalg.norm(tangent)

    def states(shares: Array) -> Array:
        return np.asarray(fixed + growth ** shares[:, None] * seed)

    curve = [fixed[None], states(np.array([0.0]))]
    run, count = float(np.linalg.norm(seed)), 2
    shares = np.linspace(0.0, 1.0, 9)
    now = states(shares)
    for _ in range(_ITERATES):
        # What the segment is by now, so fine that neighbours are near.
        shares, now = _refined(image, states, len(curve) - 2, shares, now, spacing, most - count)
        gaps = np.linalg.norm(np.diff(now, axis=0), axis=1)
        if not np.isfinite(now).all():
            return np.vstack([*curve, now[: int(np.argmin(np.isfinite(now).all(axis=1)))]]), "diverged"
        jumps = gaps > spacing
        passed = run + np.cumsum(np.where(jumps, 0.0, gaps))
        keep = int(np.searchsorted(passed, length)) + 1 if passed[-1] >= length else len(now)
        rows = now[1:keep]
        breaks = np.flatnonzero(jumps[: keep - 1])
        curve.append(np.insert(rows, breaks, np.nan, axis=0))
        count += len(rows)
        if passed[-1] >= length:
            return np.vstack(curve), "length"
        if count >= most:
            return np.vstack(curve), "most"
        if run > spacing and passed[-1] - run < _SETTLED * spacing:
            return np.vstack(curve), "settled"
        run = float(passed[-1])
        now = image(now)
    return np.vstack(curve), "iterates"


def _refined(
    image: Map,
    states: Callable[[Array], Array],
    iterate: int,
    shares: Array,
    now: Array,
    spacing: float,
    most: int,
) -> tuple[Array, Array]:
    """Starts inserted between those whose images are farther apart than the spacing."""
    while len(now) < most:
        wide = (np.linalg.norm(np.diff(now, axis=0), axis=1) > spacing) & (np.diff(shares) > _JUMP)
        apart = np.flatnonzero(wide)
        if not apart.size:
            break
        between = (shares[apart] + shares[apart + 1]) / 2
        new = states(between)
        for _ in range(iterate):
            new = image(new)
        shares, now = np.insert(shares, apart + 1, between), np.insert(now, apart + 1, new, axis=0)
    return shares, now


def _stable(
    image: Map, fixed: Array, tangent: Array, extent: float, length: float, spacing: float, most: int
) -> tuple[Array, str]:
    """The curve of states that are mapped onto it, from the fixed point outwards, and why it ended."""
    first = _NEAR_STABLE * extent * tangent / np.linalg.norm(tangent)
    # The other side belongs to what images may lie on where they come near the fixed point.
    curve = [fixed - first, fixed, fixed + first]
    run, step = float(np.linalg.norm(first)), min(spacing, float(np.linalg.norm(first)))
    while len(curve) < most + 1:
        way = curve[-1] - curve[-2]
        ahead = math.atan2(way[1], way[0])
        found = _next(image, np.array(curve), ahead, step, _TURN)
        if found is None or abs(_angle(found - curve[-1], way)) > _TURN / 2:
            if step > _FINEST * spacing:
                step /= 2
                continue
            found = _next(image, np.array(curve), ahead, step, _CORNER)
            if found is None:
                return np.array(curve[1:]), "lost"
        curve.append(found)
        run += step
        if run >= length:
            return np.array(curve[1:]), "length"
        step = min(2 * step, spacing)
    return np.array(curve[1:]), "most"


def _next(image: Map, curve: Array, ahead: float, step: float, turn: float) -> Array | None:
    """The state on a circle around the end of the curve, within angles, whose image lies on the curve; None without one."""
    low, high = -turn, turn
    for _ in range(_ROUNDS):
        angles = np.linspace(low, high, _ASKED)
        states = curve[-1] + step * np.column_stack([np.cos(ahead + angles), np.sin(ahead + angles)])
        offsets = _offsets(image(states), curve)
        changes = np.flatnonzero(offsets[:-1] * offsets[1:] <= 0)
        if not changes.size:
            return None
        nearest = changes[np.argmin(np.abs(angles[changes] + angles[changes + 1]))]
        low, high = angles[nearest], angles[nearest + 1]
    best = int(nearest if abs(offsets[nearest]) < abs(offsets[nearest + 1]) else nearest + 1)
    return np.asarray(states[best]) if abs(offsets[best]) < _ON * step else None


def _offsets(images: Array, curve: Array) -> Array:
    """How far each image lies from the curve, with the sign of its side; the tangent goes on beyond the ends."""
    begins, ways = curve[:-1], np.diff(curve, axis=0)
    squares = (ways**2).sum(axis=1)
    apart = images[:, None] - begins
    shares = (apart * ways).sum(axis=2) / squares
    bounded = np.clip(shares, 0.0, 1.0)
    bounded[:, 0], bounded[:, -1] = np.minimum(shares[:, 0], 1.0), np.maximum(shares[:, -1], 0.0)
    distances = np.linalg.norm(apart - bounded[:, :, None] * ways, axis=2)
    distances = np.where(np.isfinite(distances), distances, np.inf)
    nearest = np.argmin(distances, axis=1)
    rows = np.arange(len(images))
    way, gap = ways[nearest], apart[rows, nearest]
    return np.asarray((way[:, 0] * gap[:, 1] - way[:, 1] * gap[:, 0]) / np.sqrt(squares[nearest]))


def _angle(one: Array, other: Array) -> float:
    """From one direction to another."""
    return math.atan2(one[0] * other[1] - one[1] * other[0], float(one @ other))
