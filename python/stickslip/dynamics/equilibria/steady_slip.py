"""Steady slip: where it is, and whether small disturbances of it grow or decay."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.dynamics.periodic.event_sequence import STATE, EventSequence, one_phase
from stickslip.files.arrays import Array
from stickslip.model.drive import NormalForce
from stickslip.model.system import Oscillator, System

#: The damping, in units of √(k m), that rounding leaves where there is none; the growth, in units of the fastest frequency,
#: that the eigenvalues of several masses leave.
_NEUTRAL, _NEUTRAL_MODE = 1e-12, 1e-11
#: How far beside a slip velocity friction is looked at, in parts of it, to see how it changes about there.
_BESIDE = 1e-6
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
    exponents, modes = np.linalg.eig(first_order(mass, stiffness, damping))
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


def first_order(mass: Array, stiffness: Array, damping: Array) -> Array:
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
    return np.asarray(np.linalg.eigvals(first_order(mass, stiffness, damping)), complex)


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
