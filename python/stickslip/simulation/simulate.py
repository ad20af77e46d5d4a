"""From a system to its motion."""

from __future__ import annotations

from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.errors import InputError, number, time_limit, whole_number
from stickslip.model.parameters import initial_state
from stickslip.model.system import Oscillator, System
from stickslip.simulation.orbit import Orbit


def simulate(
    system: Oscillator | System,
    t_end: float,
    x0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    max_events: int = 10_000_000,
    max_seconds: float | None = None,
) -> Orbit:
    """Simulate from event to event, each mode in closed form, or by Taylor series.

    These carry smooth laws, drives that vary, many masses, and one mass whose forcing meets a resonance with hardly any
    damping (|k − mΩ² + icΩ| < 10⁻³ k on a piece of friction), where a closed form would lose digits.

    Parameters
    ----------
    system : an oscillator, or a system of n masses.
    t_end : time to run > 0, in the system's unit of time.
    x0 : position at t = 0, for a system shape (n,); default 0.
    v0 : velocity at t = 0, same shape; default that of the drive, so that a mass starts stuck where adhesion can hold it.
    max_events : the run ends there at the latest, with ``orbit.stop == "max_events"``.
    max_seconds : time on the clock > 0 after which the run ends where it is, with ``orbit.stop == "max_seconds"``; default
        none. Asked every thousand events, every thousand evaluations within one phase, and every 64 Taylor steps.

    Returns
    -------
    Orbit, exact at any time in [0, t_end].

    Raises
    ------
    InputError
        for a value that makes no sense, or a resonance that a law with memory meets on the way: a piece of friction that
        falls by as much as the damper takes up.
    KeyboardInterrupt
        by Ctrl-C, at once; the orbit so far is lost.

    Limits: an orbit takes at most 1 GiB of memory (8 million events, 16 million Taylor steps of one mass); it ends there with
    ``orbit.stop == "memory"``. Where the numbers leave the range of double precision it ends with ``"not_a_number"``.

    >>> from stickslip.laws import StaticKinetic
    >>> orbit = simulate(Oscillator(damping=0.0, drive_velocity=0.2, law=StaticKinetic(1.0, 0.6)), t_end=100)
    >>> round(float(orbit.events["stick_time"].dropna().iloc[-1]), 12)
    4.0
    """
    whole_number("max_events", max_events, "simulate")
    time_limit(max_seconds, "simulate")
    if system.integrated:
        from stickslip.simulation.integration import integrate

        return integrate(system, t_end, x0, v0, max_events, max_seconds=max_seconds)
    run = (*initial_state(system, x0, v0, "simulate"), number("t_end", t_end, "simulate"), max_events)
    try:
        core = _core.Orbit.simulate(system.core, run, max_seconds)
    except ValueError as error:
        raise InputError(f"simulate: {error}") from None
    return Orbit(system, core)
