"""The choice of a form of friction over slip velocity: all forms fitted, compared, and the simplest of the best taken.

The fit of one form is in `single_form_fit`, the result in `steady_result`, its law in `law_of_form`.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from stickslip.errors import InputError, did_you_mean
from stickslip.identification.estimator.threads import one_thread
from stickslip.identification.records import check_same_units, some_of, tree_of
from stickslip.identification.steady.curves import ONE_SPEED, SHAPES, Rows, SteadyFit, forms_of
from stickslip.identification.steady.misfit import is_blurred, predicts_worse, widened, with_speed_error
from stickslip.identification.steady.single_form_fit import fit_form
from stickslip.identification.steady.steady_notes import (
    is_constant,
    notes_on_choice,
    notes_on_disagreement,
    scatter_between_records,
)
from stickslip.identification.steady.steady_result import SteadyFriction
from stickslip.identification.steady.steady_rows import joined, notes_on_left_out, rows_of
from stickslip.laws import Asymmetric
from stickslip.measurement.result import stated_notes

TIED = 0.9
"""Correlation of load and logarithm of the speed from which on no form that has both is chosen: one stands for the other."""

OF_LAW = {
    "Coulomb": ("Coulomb",),
    "ExponentialStribeck": ("Stribeck", "Gaussian Stribeck", "Coulomb + viscous"),
    "Asymmetric": tuple(SHAPES),
}
"""Shapes that are a law of the catalogue; of Asymmetric with numbers of their own for each sense of the slip."""


@one_thread
def fit_steady(friction: Any, law: str | None = None) -> SteadyFriction:
    """Fit friction over slip velocity and compare the forms that such a curve may have.

    On the side w > 0 friction is one of the shapes: f_k (Coulomb), f_k + b w, f_k + q w², f_k + a ln(w / w₀) (steady
    rate-and-state friction) or f_k + Δ exp(−(w / w_s)ⁿ) + b w with n = 1 (Stribeck) or 2 (Gaussian Stribeck), turned over
    for w < 0. Each is also tried with an offset that keeps its sign (an instrument's zero, gravity), with every number of its
    own on either side (asymmetric), with a term in the load where that was varied, and with one in the place where the record
    tells it: to and fro a force that keeps its sign too (a spring; of an angle q gravity, a sin q + b cos q), one way only a
    drift of the friction. All are fitted by least squares and judged by rows that were held back from the fit; the simplest
    form within one standard error of the best is chosen. Where records lie further apart than chance makes them, each counts
    as one, whole records are held back, and what sets them apart is in the intervals.

    Parameters
    ----------
    friction : a friction DataTree or file with the table ``steady`` or a direct force over slip velocity; or a list.
    law : name of a law whose shape is to be fitted; default: all shapes compete.

    Returns
    -------
    SteadyFriction.

    Raises
    ------
    InputError
        for records without friction over slip velocity, or too few rows for the law asked for.

    Limits: no memory and no acceleration; what is so near a turn of the slip that friction builds up is left out, any other
    loop becomes its middle, and the intervals hold its width only as scatter. An offset shows only where the record slides
    both ways. Intervals count correlated rows as fewer and stated errors that are too small as larger; they are those of the
    chosen form, and `notes` say where others that predict as well differ.
    Where a free curve over speed, position or time predicts held-back rows better than the form, the first notes say so and
    the intervals are widened; after one of position or time `valid` is False.

    Source: the choice is the one-standard-error rule of Breiman, Friedman, Olshen & Stone, Classification and Regression
    Trees (1984), Section 3.4.3; records that differ as in Paule & Mandel, J. Res. Natl. Bur. Stand. 87 (1982) 377.

    >>> import xarray as xr
    >>> w = np.concatenate([np.linspace(0.1, 1, 10), -np.linspace(0.1, 1, 10)])
    >>> f = 0.4 * np.sign(w) + 0.2 * w - 0.17 + 0.003 * np.random.default_rng(0).standard_normal(20)
    >>> table = {"slip_velocity": ("row", w), "force": ("row", f), "force_error": ("row", np.full(20, 0.003))}
    >>> found = fit_steady(xr.DataTree.from_dict({"/steady": xr.Dataset(table)}))
    >>> found.chosen, found.parameters["value"].round(2).to_dict()
    ('Coulomb + viscous, offset', {'kinetic': 0.4, 'viscous': 0.2, 'offset': -0.17})
    """
    parts, names, units, left, notes, measured_so = [], [], [], [], [], []
    for number, item in enumerate(some_of(friction), start=1):
        name = str(item) if isinstance(item, str | Path) else f"record {number}"
        tree = tree_of(item)
        rows, stated, missing, said = rows_of(tree, name)
        left.append(missing)
        notes += said
        measured_so += [f"{name}: {note}" for note in stated_notes(tree.attrs)]
        if steps := tree["step"].sizes["step"] if "step" in tree.children else 0:
            notes.append(
                f"{name} holds {steps} step{'s' * (steps != 1)} of the drive velocity, of which only the levels between them "
                "are used here: --law RateState (fit_velocity_steps) fits a, b and D_c of rate-and-state friction to how "
                "friction settles after them."
            )
        parts.append(rows)
        units.append((name, stated))
        names.append(name)
    check_same_units(units)
    notes += notes_on_left_out(left)
    measured = rows = joined(parts)
    if float(np.sum(rows.force * np.sign(rows.w))) < 0:
        measured = rows = replace(rows, force=-rows.force)
        notes.append(
            "The force is counted against the motion in these records; it was turned over, so that friction is > 0."
        )
    if law is not None and law not in OF_LAW:
        raise InputError(
            f"identify: {law} is not a curve over slip velocity alone{did_you_mean(law, OF_LAW)}; such are "
            f"{', '.join(OF_LAW)}, or leave --law out to compare all forms"
        )
    shapes, each_way = SHAPES if law is None else OF_LAW[law], law == Asymmetric.__name__
    if each_way and len(set(np.sign(rows.w))) == 1:
        raise InputError("identify: Asymmetric needs slip in both senses, and all slip is one way; leave the law out")
    fits = _fits(rows, shapes, each_way)
    if fits and scatter_between_records(rows, next(iter(fits.values()))) > 0:
        rows = rows.set_apart()
        fits = _fits(rows, shapes, each_way)
    if not fits:
        speed = np.abs(rows.w)
        alike = len(rows) > 2 and float(speed.max()) < ONE_SPEED * float(speed.min())
        raise InputError(
            f"identify: {len(rows)} points at the one slip velocity of {speed.mean():.4g} show no curve of {law}; "
            "measure other speeds"
            if alike
            else f"identify: {len(rows)} point{'s' * (len(rows) != 1)} of friction over slip velocity "
            f"{'are' if len(rows) != 1 else 'is'} too few for {law or 'any form'}; measure more speeds"
        )
    chosen, undecided = _choose(rows, fits)
    if law is not None and not each_way and OF_LAW[law][0] not in chosen:
        notes.append(
            f"{law} was requested; {chosen}, its limit, predicts held-back rows as well or is all that can be fitted."
        )
    fits[chosen], missed, valid = widened(rows, fits[chosen])
    hidden = _hidden(rows, fits[chosen], shapes, each_way)
    blur = rows.blur if is_blurred(rows, fits[chosen]) else 0.0
    fits[chosen], blurred = with_speed_error(rows, fits[chosen], _other_falls(rows, fits[chosen]) if blur else [])
    notes = [
        *missed,
        *blurred,
        *notes_on_disagreement(rows, fits[chosen]),
        *notes,
        *notes_on_choice(rows, fits, chosen, undecided, hidden),
        *measured_so,
    ]
    error = measured.error if measured.stated else np.full(len(rows), math.nan)
    data = {"slip_velocity": rows.w, "force": rows.force, "force_error": error, "source": rows.source}
    data["motion_force"] = fits[chosen].of_motion(rows)
    command = shlex.join(["stickslip", "identify", *names, "--steady", *(["--law", law] if law else [])])
    stated = units[0][1]
    return SteadyFriction(pd.DataFrame(data), fits, chosen, undecided, notes, command, stated, valid, hidden, blur)


def _fits(rows: Rows, shapes: Iterable[str], each_way: bool) -> dict[str, SteadyFit]:
    """All forms of these shapes, or those with numbers for each sense, that can be fitted, the best prediction first."""
    forms = [item for item in forms_of(rows, shapes) if not each_way or "asymmetric" in item[0]]
    fits = {form: fit_form(rows, form, terms) for form, terms in forms}
    found = {form: fit for form, fit in fits.items() if fit is not None}
    return dict(sorted(found.items(), key=lambda item: item[1].held_back))


def _choose(rows: Rows, fits: dict[str, SteadyFit]) -> tuple[str, list[str]]:
    """The simplest form whose loss on held-back rows lies within one standard error of the best, and its equals."""
    if abs(rows.tie) > TIED:
        apart = {form: fit for form, fit in fits.items() if "load" not in fit.parameters.index or is_constant(form)}
        fits = apart or fits
    best = min(fits.values(), key=lambda fit: float(fit.losses.mean()))
    equals = [fit for fit in fits.values() if fit is best or not predicts_worse(rows, fit.losses, best.losses)]

    def cost(fit: SteadyFit) -> tuple[int, bool, float]:
        # without an offset the angle at which a spring pushes nothing is a number that is missing: no simpler than gravity
        names = set(fit.parameters.index)
        rest = rows.turning and "restoring" in names and "offset" not in names
        return len(fit.parameters) + rest, not fit.form.startswith("Coulomb,"), float(fit.losses.mean())

    chosen = min(equals, key=cost)
    return chosen.form, [fit.form for fit in equals if fit is not chosen]


def _hidden(rows: Rows, best: SteadyFit, shapes: Iterable[str], each_way: bool) -> dict[str, SteadyFit]:
    """Forms whose friction falls below the slowest speed and that predict held-back rows better than the chosen one."""
    falling = [shape for shape in shapes if "weakening" in SHAPES[shape]]
    forms = [item for item in forms_of(rows, falling) if not each_way or "asymmetric" in item[0]]
    fits = {form: fit_form(rows, form, terms, hidden=True) for form, terms in forms}
    return {
        form: fit for form, fit in fits.items() if fit is not None and predicts_worse(rows, best.losses, fit.losses)
    }


def _other_falls(rows: Rows, best: SteadyFit) -> list[SteadyFit]:
    """The other falls of friction with the same numbers as the chosen form, over measured speeds or below them."""
    shape, *more = best.form.split(", ")
    others = [name for name, terms in SHAPES.items() if "weakening" in terms and name != shape]
    tried = [
        fit_form(rows, ", ".join([name, *more]), best.curve.terms, hidden=hidden)
        for name in others
        for hidden in (False, True)
    ]
    return [fit for fit in tried if fit is not None]
