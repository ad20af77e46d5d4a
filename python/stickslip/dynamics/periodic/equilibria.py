"""Steady slip: its place, what becomes of small disturbances, and where that changes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.periodic.event_sequence import STATE, EventSequence, one_phase, with_number
from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.model.drive import NormalForce
from stickslip.model.system import Oscillator, System

#: The damping, in units of √(k m), that rounding leaves where there is none; the growth, in units of the fastest frequency,
#: that the eigenvalues of several masses leave.
_NEUTRAL, _NEUTRAL_MODE = 1e-12, 1e-11
#: How far beside a slip velocity friction is looked at, in parts of it, to see how it changes about there.
_BESIDE = 1e-6
#: In so many parts of a range changes of steady slip are looked for.
_SCAN = 400
#: Modes that the damping couples by no more of it are not coupled: rounding leaves as much.
_UNCOUPLED = 1e-14


@dataclass(frozen=True)
class SteadySlip:
    """The masses at rest while the drive slips under them.

    Attributes
    ----------
    x : where friction and spring balance, of several masses shape (n,).
    damping : D + dF/du, the damping that small disturbances feel; of several masses −2 `growth`, that of a single mass of 1.
    growth : their rate of growth, the largest real part of the exponents.
    neutral : whether they neither grow nor decay: that damping is zero to 1e-12 of √(k m), of several masses the growth to
        1e-11 of the fastest frequency.
    mode : velocities of the disturbance that grows the most, the largest 1; `displacement` its positions at that time.
    frequency : at which it swings, rad per unit of time; 0 where it creeps.
    """

    x: Any
    damping: float
    growth: float
    neutral: bool
    mode: Any = 1.0
    displacement: Any = 0.0
    frequency: float = math.nan


def fastest_drive(system: Oscillator | System) -> float:
    """The largest speed of the drives of its contacts, all constant."""
    return max(abs(float(contact.drive_velocity)) for contact in system.contacts)


def steady_slip(system: Oscillator | System) -> SteadySlip | None:
    """The steady slip of an oscillator, or of masses, on which nothing swings.

    None where the drive rests, where the spring does not hold the mass or the bodies are apart, and where friction has
    branches by the sense of ẇ.

    The slope of friction is read off the fundamental matrix of the motion beside it: det Φ(τ) = exp(−(D + F′) τ/m).

    >>> from stickslip.laws import ExponentialStribeck
    >>> state = steady_slip(Oscillator(0.1, 1.0, ExponentialStribeck(1.0, 0.5, 0.5)))
    >>> round(state.damping, 12) == round(0.1 - math.exp(-2.0), 12)
    True
    """
    if isinstance(system, System):
        return _of_masses(system)
    drive = system.drive_velocity
    if drive == 0 or not isinstance(drive, float) or system.swings or system.springs:
        return None
    friction, beside = system.law.kinetic_force(drive * np.array([1.0, 1.0 + _BESIDE])).tolist()
    pressed = system.normal_force or NormalForce()
    # Friction that grows with x is a spring that pushes.
    stiffness = system.stiffness - pressed.position * friction
    n = pressed.constant + sum(item.amplitude * math.cos(item.phase) for item in pressed.harmonics)
    x = (n * friction + sum(item.amplitude * math.cos(item.phase) for item in system.harmonics)) / (
        stiffness or math.inf
    )
    if pressed.at(0.0, x) <= 0 or stiffness <= 0:
        return None
    # Over a long time heavy damping leaves a determinant that is the rounding of its two products.
    longest = 0.1 * system.natural_period
    light = 0.3 * system.mass / longest
    seems = system.damping + n * (beside - friction) / (_BESIDE * drive)
    damping = _damping(system, x, longest) if abs(seems) <= light else math.inf
    if abs(damping) > light:
        rough = _damping(system, x, 1e-6 * longest)
        safe = min(longest, 0.3 * system.mass / max(abs(rough), 1e-300))
        damping = rough if math.isnan(rough) else _damping(system, x, safe)
    if math.isnan(damping):
        return None
    half = damping / (2 * system.mass)
    square = half * half - stiffness / system.mass
    growth = -half + (math.sqrt(square) if square > 0 else 0.0)
    return SteadySlip(x, damping, growth, abs(damping) < _NEUTRAL * math.sqrt(system.stiffness * system.mass))


def _of_masses(system: System) -> SteadySlip | None:
    """The eigenvalues of small disturbances of steady slip, and the mode that grows the most."""
    linear = _linearized(system)
    if linear is None:
        return None
    mass, stiffness, damping, force = linear
    n = len(mass)
    exponents, modes = np.linalg.eig(_first_order(mass, stiffness, damping))
    which = int(np.argmax(exponents.real))
    velocities = modes[n:, which]
    mode = modes[:, which] / velocities[np.argmax(np.abs(velocities))]
    growth = float(exponents[which].real)
    return SteadySlip(
        x=np.linalg.solve(stiffness, force),
        damping=-2 * growth,
        growth=growth,
        neutral=_neutral(exponents),
        mode=mode[n:].real,
        displacement=mode[:n].real,
        frequency=abs(float(exponents[which].imag)),
    )


def _neutral(exponents: NDArray[np.complex128]) -> bool:
    """Whether what rounding leaves of the greatest growth is nothing."""
    return bool(abs(exponents.real.max()) < _NEUTRAL_MODE * np.abs(exponents).max())


def _first_order(mass: Array, stiffness: Array, damping: Array) -> Array:
    """The matrix A of (x, v)˙ = A (x, v)."""
    n = len(mass)
    matrix = np.zeros((2 * n, 2 * n))
    matrix[:n, n:] = np.eye(n)
    matrix[n:, :n], matrix[n:, n:] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
    return matrix


def _exponents(mass: Array, stiffness: Array, damping: Array) -> NDArray[np.complex128]:
    """Its eigenvalues; where the damping couples no modes of symmetric matrices those of each, λ² + c λ + ω² = 0."""
    if (mass == mass.T).all() and (stiffness == stiffness.T).all():
        root = np.linalg.inv(np.linalg.cholesky(mass))
        squares, modes = np.linalg.eigh(root @ stiffness @ root.T)
        modal = modes.T @ (root @ damping @ root.T) @ modes
        own = np.diag(modal)
        if np.abs(modal - np.diag(own)).max() <= _UNCOUPLED * np.abs(own).max():
            split = np.sqrt(own * own / 4 - squares + 0j)
            return np.concatenate([-own / 2 + split, -own / 2 - split])
    return np.asarray(np.linalg.eigvals(_first_order(mass, stiffness, damping)), complex)


def _linearized(system: System) -> tuple[Array, Array, Array, Array] | None:
    """M, K, the damping and the force of M ẍ + (D + Σ F_c′(s_c) b bᵀ) ẋ + K x = Σ F_c(s_c) b beside steady slip."""
    if system.swings or system.springs:
        return None
    mass, stiffness, damping = (np.array(matrix) for matrix in (system.mass, system.stiffness, system.damping))
    n = system.masses
    force = np.zeros(n)
    for item in system.forcing:
        force[item.mass] += item.amplitude * math.cos(item.phase)
    slopes: dict[Any, float] = {}
    for contact in system.contacts:
        drive = contact.drive_velocity
        if not isinstance(drive, float) or drive == 0 or contact.normal_force is not None:
            return None
        if (contact.law, drive) not in slopes:
            # Alone, without a damper, the slope is all the damping that there is.
            own = (contact.mass, contact.mass)
            one = steady_slip(Oscillator(0.0, drive, contact.law, float(mass[own]), max(float(stiffness[own]), 1e-300)))
            if one is None:
                return None
            slopes[contact.law, drive] = one.damping
        b = np.zeros(n)
        b[contact.mass] = 1.0
        if contact.other is not None:
            b[contact.other] = -1.0
        force += float(contact.law.kinetic_force(drive)) * b
        damping = damping + slopes[contact.law, drive] * np.outer(b, b)
    if np.linalg.matrix_rank(stiffness) < n:
        return None
    return mass, stiffness, damping, force


def stability(system: Oscillator | System) -> tuple[float, bool]:
    """`damping` and `neutral` of :func:`steady_slip` without its modes; NaN where it is None."""
    if isinstance(system, System):
        linear = _linearized(system)
        if linear is None:
            return math.nan, False
        exponents = _exponents(*linear[:3])
        return -2 * float(exponents.real.max()), _neutral(exponents)
    state = steady_slip(system)
    return (math.nan, False) if state is None else (state.damping, state.neutral)


def _damping(system: Oscillator, x: float, tau: float) -> float:
    """The damping of small disturbances, from what becomes of them in a time; NaN where the law follows the sense of ẇ."""
    sequence, kinds, _ = EventSequence.of_run(system, tau, x, 0.0)
    # The second flag: whether it does.
    if sequence.start[len(STATE) + 1]:
        return math.nan
    if kinds:
        # Rounding has set off an event at once: the line of friction it starts on says all the same.
        sequence = replace(sequence, phases=one_phase(sequence.modes[0], tau))
    matrix = sequence.follow(keep="last").rates[-1][1:3, 1:3]
    return -system.mass * math.log(max(float(np.linalg.det(matrix)), 1e-300)) / tau


def hopf_points(system: Oscillator | System, path: str, bounds: tuple[float, float]) -> list[tuple[str, float]]:
    """Where the damping of steady slip changes its sign over a parameter.

    Through zero it is a ``"hopf"`` point, by a jump at a corner of the law a ``"nonsmooth_hopf"`` point, also where the
    damping jumps to or from zero, as it does without damping at the ends of a level piece of the law.

    >>> from stickslip.laws import ExponentialStribeck
    >>> belt = Oscillator(0.1, 1.0, ExponentialStribeck(1.0, 0.5, 0.5))
    >>> [(kind, round(value, 12)) for kind, value in hopf_points(belt, "/drive_velocity", (0.1, 2.0))]
    [('hopf', 1.151292546497)]
    """
    return steady_changes(system, path, bounds)[0]


def steady_changes(
    system: Oscillator | System,
    path: str,
    bounds: tuple[float, float],
    keep: Callable[[], Any] = lambda: None,
) -> tuple[list[tuple[str, float]], list[tuple[float, float]]]:
    """The Hopf points of steady slip (:func:`hopf_points`), and the ranges of the parameter in which it is neutral.

    `keep` is called before each look at one value: what it raises ends the search.

    >>> from stickslip.laws import Coulomb
    >>> steady_changes(Oscillator(0.0, 1.0, Coulomb(0.5)), "/drive_velocity", (0.1, 2.0))
    ([], [(0.1, 2.0)])
    """

    def damping(value: float, exact: bool = False) -> float:
        keep()
        try:
            damping, neutral = stability(with_number(system, path, value))
        except InputError:
            return math.nan
        return 0.0 if neutral and not exact else damping

    values = np.linspace(*bounds, _SCAN + 1)
    samples = np.array([damping(float(value)) for value in values])
    signs = np.sign(samples)
    scale = np.abs(samples[np.isfinite(samples)]).max(initial=0.0)
    points: list[tuple[str, float]] = []
    neutral: list[tuple[float, float]] = []
    begin = bounds[0] if signs[0] == 0 else None
    for index in np.flatnonzero(np.isfinite(np.diff(signs)) & (np.diff(signs) != 0)):
        low, high = float(values[index]), float(values[index + 1])
        f_low, f_high = float(samples[index]), float(samples[index + 1])
        # A zero that is passed is found exactly; the end of a neutral range is where the damping is not zero any more.
        exact = f_low * f_high != 0
        for _ in range(200):
            # Bisection with the secant's guess: a jump converges as surely as a zero.
            guess = (low * f_high - high * f_low) / (f_high - f_low)
            for middle in (guess, (low + high) / 2):
                if not low < middle < high:
                    continue
                f = damping(middle, exact)
                if np.sign(f) == np.sign(f_low):
                    low, f_low = middle, f
                else:
                    high, f_high = middle, f
            if high - low <= 4e-16 * max(abs(low), abs(high)) or f_low == f_high:
                break
        small, large = sorted((abs(f_low), abs(f_high)))
        root = low if abs(f_low) < abs(f_high) else high
        if not exact and f_low == 0:
            neutral.append((bounds[0] if begin is None else begin, low))
            begin = None
        elif not exact:
            begin = high
        # Where the damping only fades away there is no speed at which it ends.
        if exact or large > 1e-9 * scale:
            points.append(("hopf" if exact and small < 1e-9 * scale else "nonsmooth_hopf", root))
    if begin is not None:
        last = np.flatnonzero(signs == 0)[-1]
        neutral.append((begin, float(values[last])))
    return points, neutral


def criticality(system: Oscillator | System, path: str, value: float) -> str:
    """Whether the cycle born at a smooth Hopf point is stable, by the sign of the first Lyapunov coefficient.

    Of one mass, with N = n(x), p = ∂n/∂x, q = ∂n/∂ẋ and K = k − p F at steady slip, the cycle is ``"supercritical"``,
    stable, where N F‴ − 3 q F″ + p F′ (N F″ − 2 q F′)/K > 0, under a constant normal force where F‴ > 0; else
    ``"subcritical"``. Where all of it vanishes, to a millionth of its terms, it is ``"degenerate"``; ``"undetermined"`` where
    differences do not tell F″ and F‴, as at a corner of F′, and where two pairs of exponents cross together.

    Parameters
    ----------
    system : one mass or several, slipping steadily (:func:`steady_slip`).
    path, value : the number of the document that makes the Hopf point.

    Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), eq. (5.34), of one mass Guckenheimer & Holmes (1983),
    eq. (3.4.11).

    >>> from stickslip.laws import ExponentialStribeck
    >>> belt = Oscillator(0.1, 1.0, ExponentialStribeck(1.0, 0.5, 0.5))
    >>> criticality(belt, "/drive_velocity", 1.151292546497023)
    'subcritical'
    """
    at_point = with_number(system, path, value)
    state = steady_slip(at_point)
    if state is None:
        return "undetermined"
    several = at_point.to_system()
    n = several.masses
    mass, stiffness, damping = (np.array(each) for each in (several.mass, several.stiffness, several.damping))
    terms: list[tuple[Array, Array, float, tuple[float, float, float]]] = []
    known: dict[Any, tuple[float, float, float] | None] = {}
    for contact in several.contacts:
        b = np.zeros(n)
        b[contact.mass] = 1.0
        if contact.other is not None:
            b[contact.other] = -1.0
        pressed, drive = contact.normal_force or NormalForce(), float(contact.drive_velocity)
        if (contact.law, drive) not in known:
            known[contact.law, drive] = _derivatives(contact.law, drive)
        derivatives = known[contact.law, drive]
        if derivatives is None:
            return "undetermined"
        slope = derivatives[0]
        force = float(contact.law.kinetic_force(drive))
        n0 = float(pressed.at(0.0, b @ np.atleast_1d(state.x)))
        damping = damping + (n0 * slope - pressed.velocity * force) * np.outer(b, b)
        stiffness = stiffness - pressed.position * force * np.outer(b, b)
        terms.append((b, np.concatenate([pressed.position * b, pressed.velocity * b]), n0, derivatives))
    found = _first_lyapunov(mass, damping, stiffness, terms)
    if found is None:
        return "undetermined"
    coefficient, size = found
    if abs(coefficient) <= 1e-6 * size:
        return "degenerate"
    return "supercritical" if coefficient < 0 else "subcritical"


def _derivatives(law: Any, speed: float) -> tuple[float, float, float] | None:
    """F′, F″ and F‴ at a slip velocity, by differences of the slope of friction; None where no step of them tells.

    Steps are halved and extrapolated to none (Ridders' method) until rounding grows.
    """

    def slope(w: float) -> float:
        state = steady_slip(Oscillator(0.0, w, law))
        return math.nan if state is None else state.damping

    here = slope(speed)
    before: list[Array] = []
    best, error = np.full(2, math.nan), np.full(2, math.inf)
    for halving in range(12):
        h = 0.1 * speed * 0.5**halving
        above, below = slope(speed + h), slope(speed - h)
        row = [np.array([(above - below) / (2 * h), (above - 2 * here + below) / (h * h)])]
        for order, coarse in enumerate(before, 1):
            row.append(row[-1] + (row[-1] - coarse) / (4.0**order - 1))
            change = np.maximum(np.abs(row[-1] - row[-2]), np.abs(row[-1] - coarse))
            best, error = np.where(change < error, row[-1], best), np.fmin(change, error)
        before = row
    # A derivative that vanishes is known to a part of what it would be on the scale of the speed.
    known = error <= 1e-3 * np.abs(best) + 1e-7 * abs(here) / np.array([abs(speed), speed * speed])
    return (here, float(best[0]), float(best[1])) if known.all() else None


def _first_lyapunov(
    mass: Array,
    damping: Array,
    stiffness: Array,
    terms: list[tuple[Array, Array, float, tuple[float, float, float]]],
) -> tuple[float, float] | None:
    """2 ω times the first Lyapunov coefficient of M ẍ + D ẋ + K x = Σ b F_c, and the size of its terms.

    None where it is not one pair of exponents that crosses.

    A contact is (b, ∂n/∂(x, ẋ), n, (F′, F″, F‴)), with n F(s − b·ẋ) along b.
    """
    n = len(mass)
    matrix = _first_order(mass, stiffness, damping)
    exponents, modes = np.linalg.eig(matrix)
    scale = np.abs(exponents).max()
    neutral = np.flatnonzero((np.abs(exponents.real) < 1e-7 * scale) & (exponents.imag > 0))
    if len(neutral) != 1 or (exponents.real > 1e-7 * scale).any():
        return None
    rate = exponents[neutral[0]]
    q = modes[:, neutral[0]]
    left, adjoint = np.linalg.eig(matrix.T)
    p = adjoint[:, np.argmin(np.abs(left - rate))]
    p = p / (p @ q)

    def pushed(force: Callable[[Any, Any, Any, Any, Any, Any], Any]) -> Any:
        total = sum(force(b, gradient, n0, *slopes) * b for b, gradient, n0, slopes in terms)
        return np.concatenate([np.zeros(n), np.linalg.solve(mass, total)])

    def second(u: Any, w: Any) -> Any:
        def force(b: Any, gradient: Any, n0: Any, f1: Any, f2: Any, _: Any) -> Any:
            one, other = b @ u[n:], b @ w[n:]
            return n0 * f2 * one * other - f1 * ((gradient @ u) * other + (gradient @ w) * one)

        return pushed(force)

    def third(b: Any, gradient: Any, n0: Any, _: Any, f2: Any, f3: Any) -> Any:
        one, conjugate = b @ q[n:], b @ q[n:].conj()
        grown = 2 * (gradient @ q) * one * conjugate + (gradient @ q.conj()) * one * one
        return -n0 * f3 * one * one * conjugate + f2 * grown

    still = np.linalg.solve(matrix, second(q, q.conj()))
    twice = np.linalg.solve(2j * rate.imag * np.eye(2 * n) - matrix, second(q, q))
    parts = [p @ part for part in (pushed(third), -2 * second(q, still), second(q.conj(), twice))]
    return float(sum(parts).real), float(max(map(abs, parts)))
