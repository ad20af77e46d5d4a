"""Whether the cycle that is born at a Hopf point is stable: the first Lyapunov coefficient."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from stickslip.dynamics.equilibria.steady_slip import first_order, steady_slip
from stickslip.dynamics.periodic.event_sequence import with_number
from stickslip.files.arrays import Array
from stickslip.model.drive import NormalForce
from stickslip.model.system import Oscillator, System


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
    matrix = first_order(mass, stiffness, damping)
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
