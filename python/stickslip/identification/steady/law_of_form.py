"""A form of friction over slip velocity as a law of the catalogue.

The form and its numbers come from `single_form_fit` by way of `steady_result`.
"""

from __future__ import annotations

import math

import numpy as np

from stickslip.files.arrays import Array
from stickslip.identification.steady.curves import SteadyFit
from stickslip.laws import Asymmetric, Coulomb, ExponentialStribeck, Law, PiecewiseLinear, PoppStelter, Tabulated

BEYOND = 1000.0
"""A logarithm goes on to so many times the fastest speed measured."""


def law_of_form(fit: SteadyFit, values: Array, speed: Array) -> Law:
    """The law of a form with these numbers instead of its own, where it was fitted at these slip speeds, > 0."""
    slow, top = float(speed.min()), float(speed.max())
    if not fit.by_sense:
        return _one_way(fit, values, 0.0, slow, top)
    forward, backward = (_one_way(fit, values, sense, slow, top) for sense in (1.0, -1.0))
    return Asymmetric(forward=forward, backward=backward)


def _one_way(fit: SteadyFit, values: Array, sense: float, slow: float, top: float) -> Law:
    """The law of slip in one sense, 1 or -1; 0: the mean of both."""
    at = fit.toward(values, sense)
    kinetic = at["kinetic"]
    if "scale" in at:
        return ExponentialStribeck(
            break_away=kinetic + at["weakening"],
            kinetic=kinetic,
            scale=at["scale"],
            viscous=at["viscous"],
            exponent=fit.curve.exponent,
        )
    if "viscous" in at:
        return PiecewiseLinear(nodes=((0.0, kinetic), (top, kinetic + at["viscous"] * top)), break_away=kinetic)
    if "quadratic" in at:
        return PoppStelter(break_away=kinetic, kinetic=kinetic, weakening=0.0, square=at["quadratic"])
    if "logarithm" in at:
        chosen = fit.toward(fit.vector, sense)
        used_up = fit.curve.reference * math.exp(min(max(-chosen["kinetic"] / chosen["logarithm"], -600.0), 600.0))
        w = np.geomspace(slow, min(BEYOND * top, used_up) if chosen["logarithm"] < 0 else BEYOND * top, 65)
        force = kinetic + at["logarithm"] * np.log(w / fit.curve.reference)
        force[-1] = max(force[-1], 0.0)
        nodes = ((0.0, float(force[0])), *zip(w.tolist(), force.tolist(), strict=True))
        return Tabulated(kinetic=nodes, break_away=float(force[0]))
    return Coulomb(kinetic=kinetic)
