"""Friction over slip velocity alone: the forms that such a curve may have, laid beside each other, offset and all."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.checks import did_you_mean
from stickslip.files.disk import write_text
from stickslip.files.units import unit_of
from stickslip.identification.estimator.result import Result, in_digits
from stickslip.identification.estimator.threads import one_thread
from stickslip.identification.records import check_same_units, opened
from stickslip.identification.steady.curve_fit import fit_form
from stickslip.identification.steady.curves import (
    BLOCKS,
    BY_SENSE,
    DIMENSIONS,
    OF_MOTION,
    ONE_SPEED,
    SHAPES,
    Rows,
    SteadyFit,
    forms_of,
)
from stickslip.identification.steady.misfit import behind, widened
from stickslip.identification.steady.steady_notes import at_rest, between_records, choice, disagreement, flat
from stickslip.identification.steady.steady_rows import joined, rows_of, said_left_out
from stickslip.laws import Asymmetric, Coulomb, ExponentialStribeck, Law, PiecewiseLinear, PoppStelter, Tabulated
from stickslip.laws.law import law_file
from stickslip.laws.numbers import pointers, units_of, value
from stickslip.measurement.result import stated_notes

Array = npt.NDArray[np.float64]

TIED = 0.9
"""Correlation of load and logarithm of the speed from which on no form that has both is chosen: one stands for the other."""
BEYOND = 1000.0
"""A logarithm goes on to so many times the fastest speed measured."""

VISIBLE = 0.01
"""Curves within this part of the range of forces of the chosen one are not drawn beside it."""

OF_LAW = {
    "Coulomb": ("Coulomb",),
    "ExponentialStribeck": ("Stribeck", "Gaussian Stribeck", "Coulomb + viscous"),
    "Asymmetric": tuple(SHAPES),
}
"""Shapes that are a law of the catalogue; of Asymmetric with numbers of their own for each sense of the slip."""


@dataclass(frozen=True, repr=False, eq=False)
class SteadyFriction(Result):
    """Friction over slip velocity: all forms, the chosen one, and the law in it.

    Attributes
    ----------
    rows : DataFrame of the points: slip_velocity, force, force_error (NaN where none is stated), source, and motion_force,
        what of the force is gravity, a spring or inertia by the chosen form.
    fits : by name of the form, the best prediction of held-back rows first.
    chosen : name of the chosen form.
    undecided : names of forms that predict held-back rows as well, within one standard error.
    hidden : forms by whose fall of friction the rows are predicted as well, but which falls below the slowest speed: they say
        nothing of what was measured, and that nothing is known of rest.
    notes : plain sentences.
    command : what to type to do it again.
    stated : units of force and slip velocity.
    valid : whether intervals and asymmetry hold: not where the force follows position or time as no form does, which is
        the first of the notes.
    """

    rows: pd.DataFrame
    fits: dict[str, SteadyFit]
    chosen: str
    undecided: list[str]
    notes: list[str]
    command: str
    stated: Mapping[str, str] = field(default_factory=dict)
    valid: bool = True
    hidden: dict[str, SteadyFit] = field(default_factory=dict)

    @property
    def at_rest(self) -> tuple[float, float, float]:
        """Friction at rest, which the break-away force of the law is: value, and the ends of what cannot be excluded.

        The value is that of the chosen form. The ends are those of all 95 % intervals of the forms that predict held-back
        rows as well, and of the `hidden` ones. Where the chosen form does not fall with the speed, or less than 70 % of
        its fall were measured, the upper end is infinite: a fall below the slowest speed would not be seen.

        >>> import xarray as xr
        >>> w = np.geomspace(0.15, 1.5, 24)
        >>> f = 1.9 + 1.1 * np.exp(-((w / 0.12) ** 2)) + 0.6 * w + 0.02 * np.random.default_rng(0).standard_normal(24)
        >>> table = {"slip_velocity": ("row", w), "force": ("row", f), "force_error": ("row", np.full(24, 0.02))}
        >>> value, low, high = fit_steady(xr.DataTree.from_dict({"/steady": xr.Dataset(table)})).at_rest
        >>> low <= 3.0 <= high
        True
        """
        slow = float(self.rows["slip_velocity"].abs().min())
        return at_rest(slow, [self.fits[name] for name in (self.chosen, *self.undecided)], self.hidden.values())

    @property
    def best(self) -> SteadyFit:
        """The chosen fit."""
        return self.fits[self.chosen]

    @property
    def parameters(self) -> pd.DataFrame:
        """Of the chosen form: value, error, low and high by name."""
        return self.best.parameters

    @property
    def beside(self) -> dict[str, float]:
        """What of the measured force is no friction, by name; `position` is where a spring (`restoring`) pushes nothing."""
        values = self.parameters["value"]
        found = {name: float(values[name]) for name in ("offset", *OF_MOTION) if name in values.index}
        return found | ({"position": self.best.curve.middle[1]} if "restoring" in found else {})

    @property
    def law(self) -> Law | None:
        """The chosen form as a law, without offset and drift, at the mean load.

        `Asymmetric` where friction differs by the sense of the slip. None where friction would be negative; :meth:`save`
        says so. All forms are laws of the catalogue but the logarithm, which has no end at w = 0: it is `Tabulated`,
        constant below the slowest speed and beyond a thousand times the fastest.
        """
        try:
            return self.checked_law()
        except InputError:
            return None

    def checked_law(self) -> Law:
        """The law with its covariance; an InputError where friction would be negative."""
        return self._of_friction().with_covariance(self.covariance)

    def _of_friction(self) -> Law:
        """The law, refused where friction is negative."""
        law = self._law(self.best.vector)
        w = self.rows["slip_velocity"].to_numpy()
        force = np.sign(w) * law.kinetic_force(w)
        if force.min() < 0:
            raise InputError(f"friction would be {force.min():.3g} at w = {w[np.argmin(force)]:.3g}")
        return law

    def _law(self, values: Array) -> Law:
        """The law of the chosen form with these numbers."""
        if not self.best.by_sense:
            return self._one_way(values, 0.0)
        return Asymmetric(forward=self._one_way(values, 1.0), backward=self._one_way(values, -1.0))

    def _one_way(self, values: Array, sense: float) -> Law:
        """The law of slip in one sense, 1 or -1; 0: the mean of both."""
        at = self.best.toward(values, sense)
        kinetic, top = at["kinetic"], float(self.rows["slip_velocity"].abs().max())
        if "scale" in at:
            return ExponentialStribeck(
                break_away=kinetic + at["weakening"],
                kinetic=kinetic,
                scale=at["scale"],
                viscous=at["viscous"],
                exponent=self.best.curve.exponent,
            )
        if "viscous" in at:
            return PiecewiseLinear(nodes=((0.0, kinetic), (top, kinetic + at["viscous"] * top)), break_away=kinetic)
        if "quadratic" in at:
            return PoppStelter(break_away=kinetic, kinetic=kinetic, weakening=0.0, square=at["quadratic"])
        if "logarithm" in at:
            fit, slow = self.best, float(self.rows["slip_velocity"].abs().min())
            chosen = fit.toward(fit.vector, sense)
            used_up = fit.curve.reference * math.exp(min(max(-chosen["kinetic"] / chosen["logarithm"], -600.0), 600.0))
            w = np.geomspace(slow, min(BEYOND * top, used_up) if chosen["logarithm"] < 0 else BEYOND * top, 65)
            force = kinetic + at["logarithm"] * np.log(w / fit.curve.reference)
            force[-1] = max(force[-1], 0.0)
            nodes = ((0.0, float(force[0])), *zip(w.tolist(), force.tolist(), strict=True))
            return Tabulated(kinetic=nodes, break_away=float(force[0]))
        return Coulomb(kinetic=kinetic)

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of each number, where the records state those of force and slip velocity."""
        if not {"force", "slip_velocity"} <= set(self.stated):
            return {}
        force, length, time = self._units
        terms = {str(name): str(name).removesuffix(BY_SENSE) for name in self.parameters.index}
        return {name: unit_of(DIMENSIONS[of], force, length, time) for name, of in terms.items() if of in DIMENSIONS}

    @property
    def _units(self) -> tuple[str, str, str]:
        """Units of force, length and time, "1" where they are not stated."""
        length, _, time = self.stated.get("slip_velocity", "1").partition("/")
        return self.stated.get("force", "1"), length, time or "1"

    @property
    def covariance(self) -> pd.DataFrame:
        """Of the numbers of the law, by their names; an InputError where there is no law."""
        values, law = self.best.vector, self._of_friction()
        names = [*pointers(law)]
        # numbers of the law are sums of those of the form, so a difference of any size is their slope
        steps = 1e-6 * np.maximum(np.abs(values), 1e-3 * np.abs(values).max())
        moved = [self._law(values + step) for step in np.diag(steps)]
        slopes = np.array([[value(one, name) - value(law, name) for one in moved] for name in names]) / steps
        decided = np.abs(slopes).max(axis=1) > 0
        names = [name for name, one in zip(names, decided, strict=True) if one]
        return pd.DataFrame(slopes[decided] @ self.best.covariance @ slopes[decided].T, index=names, columns=names)

    def table(self) -> pd.DataFrame:
        """One line for each form: numbers, rms, rms of held-back rows, and whether it was chosen or ties with the chosen."""
        rows = {
            name: {
                "numbers": len(fit.parameters),
                "rms": fit.rms,
                "held_back": fit.held_back,
                "verdict": "chosen" if name == self.chosen else "as good" if name in self.undecided else "",
            }
            for name, fit in self.fits.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("form")

    def heading(self) -> list[str]:
        """The chosen form and its formula."""
        units = [f"{name} in {unit}" for name, unit in self.stated.items() if unit != "1"]
        words = f" ({', '.join(units).replace('_', ' ')})" if units else ""
        doubt = (
            [] if self.valid else ["Intervals and differences by the sense of slip are NOT valid: see the first note."]
        )
        return [f"Friction over slip velocity: {self.chosen}{words}", self.best.formula, *doubt]

    def estimates(self) -> pd.DataFrame:
        """The numbers of the chosen form."""
        return self.parameters

    def tables(self) -> list[str]:
        """The numbers of the chosen form, and the forms beside one another."""
        shown = self.table()
        shown = shown[shown["verdict"] != ""].iloc[:12] if len(shown) > 12 else shown
        numbers = in_digits(self.shown()).to_string()
        return [numbers, shown.to_string(float_format=lambda number: f"{number:.4g}")]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words: form, parameters, the table of forms, the law where there is one, notes."""
        law = self.law
        return {
            "form": self.chosen,
            "formula": self.best.formula,
            "parameters": self.parameters.to_dict("index"),
            "valid": self.valid,
            "forms": self.table().to_dict("index"),
            "law": None if law is None else law.to_dict(),
            "notes": self.notes,
        }

    def to_toml(self) -> str:
        """The law file: [law], [uncertainty] and [covariance] of its numbers, [source] with the form and all of its own.

        Raises
        ------
        InputError
            where friction of the chosen form is negative, so that it is no law.
        """
        try:
            law, covariance = self._of_friction(), self.covariance
        except InputError as error:
            raise InputError(
                f"identify: {self.chosen} with these numbers is no law of friction ({error}): leave -o out, or ask for "
                "another form with --law"
            ) from None
        plain = self.to_dict()
        source = {
            "command": self.command,
            "records": sorted(set(self.rows["source"])),
            "form": self.chosen,
            "formula": plain["formula"],
            "values": {name: row["value"] for name, row in plain["parameters"].items()},
            "intervals": {name: [row["low"], row["high"]] for name, row in plain["parameters"].items()},
            **({"beside_friction": self.beside} if self.beside else {}),
            **({"units": dict(self.stated)} if self.stated else {}),
            "rms": self.best.rms,
            "intervals_valid": self.valid,
            "notes": self.notes,
        }
        return law_file(law, covariance, source, units_of(law, *self._units))

    def save(self, path: str | Path) -> Path:
        """Write the law file; :func:`stickslip.load_law` and :func:`stickslip.laws.load_covariance` read it back."""
        text = self.to_toml()
        return write_text(path, text, ".toml")

    def plot(self, ax: Any = None) -> Any:
        """The points, the chosen curve with its 95 % interval and those that are as good; returns the Axes.

        Without `ax` a second panel shows low speeds, where friction falls, with medians of the points in bins of speed.
        Curves that lie on the chosen one are not drawn.
        """
        from stickslip.show.canvas import ABOVE, in_units, new_axes

        reach = self._low_speeds() if ax is None else 0.0
        panels = new_axes(1, 2, figsize=(7.2, 3.6)) if reach else [new_axes()[0] if ax is None else ax]
        for panel, most in zip(panels, (math.inf, reach), strict=False):
            self._draw(panel, most)
            panel.set_xlabel("slip velocity w" + in_units(self.stated.get("slip_velocity")))
            panel.locator_params(axis="x", nbins=5 if reach else 8)
        panels[0].set_ylabel("friction force f" + in_units(self.stated.get("force")))
        if ax is None:
            panels[0].figure.legend(
                *panels[-1].get_legend_handles_labels(), loc="outside lower left", ncols=2, frameon=False, fontsize=8
            )
        else:
            ax.legend(**ABOVE)
        return panels[0]

    def _low_speeds(self) -> float:
        """Up to where low speeds have their own panel: the fall of friction, or a tenth of all; 0 where they need none."""
        speed = self.rows["slip_velocity"].abs().to_numpy()
        fall = self.parameters["value"].get("scale")
        reach = 0.1 * float(speed.max()) if fall is None else 4 * float(fall)
        return reach if reach < 0.5 * speed.max() and np.count_nonzero(speed < reach) >= BLOCKS else 0.0

    def _draw(self, axes: Any, most: float) -> None:
        """Points and curves at speeds up to `most`, with medians of many points where that is finite."""
        from stickslip.show.canvas import OKABE_ITO

        names = ("slip_velocity", "force", "force_error", "motion_force")
        w, force, error, other = (self.rows[name].to_numpy() for name in names)
        force = force - other
        shown = np.abs(w) <= most
        w, force, error = w[shown], force[shown], error[shown]
        if len(w) > 500:
            axes.plot(w, force, ".", ms=1.5, alpha=0.2, color="0.5", rasterized=True)
            axes.plot([], [], ".", color="0.5", label="measured")  # a point of the cloud is too faint for a legend
        else:
            axes.errorbar(w, force, error, fmt="o", ms=3, color="0.4", label="measured")
        named: set[str] = set()

        def line(name: str, grid: Array, style: str, **look: Any) -> None:
            axes.plot(grid, self.fits[name](grid), style, label=None if name in named else name, **look)
            named.add(name)

        for side in (1.0, -1.0):
            inside = np.abs(w[w * side > 0])
            if not len(inside):
                continue
            grid = side * np.linspace(inside.min(), inside.max(), 200)
            line(self.chosen, grid, "-", color=OKABE_ITO["blue"], zorder=3)
            axes.fill_between(grid, *self.best.interval(grid), color=OKABE_ITO["blue"], alpha=0.25, lw=0)
            colours = (OKABE_ITO[name] for name in ("vermilion", "green", "purple"))
            for name, colour in zip(self.undecided, colours, strict=False):
                if np.abs(self.fits[name](grid) - self.best(grid)).max() > VISIBLE * np.ptp(self.rows["force"]):
                    line(name, grid, "--", lw=1, color=colour)
            if math.isfinite(most) and len(w) > 500:
                bins = np.array_split(np.argsort(inside), 12)
                own = force[w * side > 0]
                middle = [side * float(np.median(inside[part])) for part in bins]
                medians = [float(np.median(own[part])) for part in bins]
                label = "medians in bins of speed" if "medians" not in named else None
                axes.plot(middle, medians, "o", ms=3.5, mfc="white", color=OKABE_ITO["black"], label=label, zorder=4)
                named.add("medians")


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
    items = list(friction) if isinstance(friction, list | tuple) else [friction]
    parts, names, units, left, notes, measured_so = [], [], [], [], [], []
    for number, item in enumerate(items, start=1):
        name = str(item) if isinstance(item, str | Path) else f"record {number}"
        tree = opened(Path(item)) if isinstance(item, str | Path) else item
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
    if not parts:
        raise InputError("identify: expected at least one friction record, got none: give a file, a DataTree or a list")
    check_same_units(units)
    notes += said_left_out(left)
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
    if fits and between_records(rows, next(iter(fits.values()))) > 0:
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
            f"{law} was asked for; {chosen}, its limit, predicts held-back rows as well or is all that can be fitted."
        )
    fits[chosen], missed, valid = widened(rows, fits[chosen])
    hidden = _hidden(rows, fits[chosen], shapes, each_way)
    notes = [
        *missed,
        *disagreement(rows, fits[chosen]),
        *notes,
        *choice(rows, fits, chosen, undecided, hidden),
        *measured_so,
    ]
    error = measured.error if measured.stated else np.full(len(rows), math.nan)
    data = {"slip_velocity": rows.w, "force": rows.force, "force_error": error, "source": rows.source}
    data["motion_force"] = fits[chosen].of_motion(rows)
    command = shlex.join(["stickslip", "identify", *names, "--steady", *(["--law", law] if law else [])])
    return SteadyFriction(pd.DataFrame(data), fits, chosen, undecided, notes, command, units[0][1], valid, hidden)


def _fits(rows: Rows, shapes: Iterable[str], each_way: bool) -> dict[str, SteadyFit]:
    """All forms of these shapes, or those with numbers for each sense, that can be fitted, the best prediction first."""
    forms = [item for item in forms_of(rows, shapes) if not each_way or "asymmetric" in item[0]]
    fits = {form: fit_form(rows, form, terms) for form, terms in forms}
    found = {form: fit for form, fit in fits.items() if fit is not None}
    return dict(sorted(found.items(), key=lambda item: item[1].held_back))


def _choose(rows: Rows, fits: dict[str, SteadyFit]) -> tuple[str, list[str]]:
    """The simplest form whose loss on held-back rows lies within one standard error of the best, and its equals."""
    if abs(rows.tie) > TIED:
        apart = {form: fit for form, fit in fits.items() if "load" not in fit.parameters.index or flat(form)}
        fits = apart or fits
    best = min(fits.values(), key=lambda fit: float(fit.losses.mean()))
    equals = [fit for fit in fits.values() if fit is best or not behind(rows, fit.losses, best.losses)]

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
    return {form: fit for form, fit in fits.items() if fit is not None and behind(rows, best.losses, fit.losses)}
