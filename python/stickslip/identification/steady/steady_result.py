"""The result of `fit_steady`: the forms that were fitted, the chosen one, and the law in it.

The choice is made in `form_choice`, each form is fitted in `single_form_fit`, and the law is made in `law_of_form`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.units import unit_of
from stickslip.identification.estimator.result import Result, in_digits
from stickslip.identification.steady.curves import BY_SENSE, DIMENSIONS, OF_MOTION, SteadyFit
from stickslip.identification.steady.law_of_form import law_of_form
from stickslip.identification.steady.steady_notes import at_rest
from stickslip.laws import Law
from stickslip.laws.law import law_file
from stickslip.laws.numbers import pointers, units_of, value


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
    blur : standard error of the speed where that blurs the fall of the chosen form; else 0.
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
    blur: float = 0.0

    @property
    def at_rest(self) -> tuple[float, float, float]:
        """Friction at rest, which the break-away force of the law is: value, and the ends of what cannot be excluded.

        The value is that of the chosen form. The ends are those of all 95 % intervals of the forms that predict held-back
        rows as well, and of the `hidden` ones. Where the chosen form does not fall with the speed, or less than 70 % of
        its fall were measured, the upper end is infinite: a fall below the slowest speed would not be seen. Where the error
        of the speed blurs the fall, nothing is excluded: the ends are 0 and infinite.

        >>> import xarray as xr
        >>> w = np.geomspace(0.15, 1.5, 24)
        >>> f = 1.9 + 1.1 * np.exp(-((w / 0.12) ** 2)) + 0.6 * w + 0.02 * np.random.default_rng(0).standard_normal(24)
        >>> table = {"slip_velocity": ("row", w), "force": ("row", f), "force_error": ("row", np.full(24, 0.02))}
        >>> from stickslip.identification import fit_steady
        >>> value, low, high = fit_steady(xr.DataTree.from_dict({"/steady": xr.Dataset(table)})).at_rest
        >>> low <= 3.0 <= high
        True
        """
        slow = float(self.rows["slip_velocity"].abs().min())
        if self.blur:
            return self.best.at_rest(slow)[0], 0.0, math.inf
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
        return law_of_form(self.best, values, self.rows["slip_velocity"].abs().to_numpy())

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

    def plot(self, ax: Any = None) -> Any:
        """The points, the chosen curve with its 95 % interval and those that are as good; returns the Axes.

        Without `ax` a second panel shows low speeds, where friction falls, with medians of the points in bins of speed.
        Curves that lie on the chosen one are not drawn.
        """
        from stickslip.show.steady import plot_steady

        return plot_steady(self, ax)
