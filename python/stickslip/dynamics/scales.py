"""The scales of a system on a drive: its speed, how far static friction pulls it, its slowest period."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.model.system import Oscillator, System


def drive_of(system: Oscillator | System) -> float:
    """The speed of the drive."""
    speed = system.drive_velocity
    assert isinstance(speed, float)
    return abs(speed)


def fastest_drive(system: Oscillator | System) -> float:
    """The largest speed of the drives of its contacts, all constant."""
    return max(abs(float(contact.drive_velocity)) for contact in system.contacts)


def reach(system: Oscillator | System) -> NDArray[np.float64]:
    """How far static friction displaces each mass alone, shape (n,)."""
    if isinstance(system, Oscillator):
        return np.array([system.law.break_away_force() / system.stiffness])
    forces = np.zeros(system.masses)
    for contact in system.contacts:
        forces[contact.mass] += float(np.max(contact.law.break_away_force()))
    return forces / np.abs(np.diag(np.array(system.stiffness)))


def speed_scale(system: Oscillator | System) -> float:
    """What drive velocities are measured by: F_s/(m ω), of each mass alone at the lowest frequency, the greatest."""
    if isinstance(system, Oscillator):
        return float(system.law.break_away_force() / (system.stiffness * system.mass) ** 0.5)
    forces = reach(system) * np.abs(np.diag(np.array(system.stiffness)))
    return float((forces / np.diag(np.array(system.mass))).max()) * slowest_period(system) / (2 * math.pi)


def slowest_period(system: Oscillator | System) -> float:
    """2π over the lowest natural frequency of the undamped masses."""
    if isinstance(system, Oscillator):
        return system.natural_period
    squares = np.linalg.eigvals(np.linalg.solve(np.array(system.mass), np.array(system.stiffness)))
    return 2 * math.pi / math.sqrt(float(np.abs(squares).min()))
