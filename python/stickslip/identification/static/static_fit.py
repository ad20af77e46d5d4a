"""Static friction f_s(t_s, δ) from the table of break-aways: the result, with the chosen form of `form_fit` and its notes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import tomli_w

from stickslip.errors import InputError
from stickslip.identification.estimator.result import Result, in_digits
from stickslip.identification.estimator.uncertainty import own_error
from stickslip.identification.records import read_records
from stickslip.identification.static.caveats import (
    notes_on_drift,
    notes_on_least_drop,
    notes_on_loading_line,
    notes_on_missing_growth,
    notes_on_ties,
    notes_on_undetermined,
    notes_on_unlike_records,
    notes_on_weakening,
    unit_behind,
)
from stickslip.identification.static.form_fit import NEAR, StaticFit, choose, fit_forms
from stickslip.identification.static.forms import ONSET, OWN_LEVEL
from stickslip.identification.static.rows import FEWEST_ROWS, break_away_rows, is_relative, on_loading_line

SHOWN = 3
"""Forms that a picture shows."""
WITHOUT_A_LAW = ("power", "Kato")
"""Forms that no law has, with a level of their own or without: `DwellTime` is Kato's with its exponent held."""
FAR_APART = 2
"""Forms that part by more than this factor at ten times the longest rest say nothing of it."""


@dataclass(frozen=True, repr=False, eq=False)
class StaticFrictionFit(Result):
    """Static friction over stick time, with the fits and the choice between them.

    Attributes
    ----------
    rows : the break-aways that were used, with the column ``level``: the kinetic force of the slip that followed; where
        `relative`, ``force_error`` is that of the force above it.
    relative : whether the force is fitted above the kinetic force of its own slip, as friction drifts along the record.
    level : what was added back then, the mean kinetic force.
    fits : by name of the form.
    chosen : the name of the chosen one.
    notes : plain sentences.
    """

    rows: pd.DataFrame
    relative: bool
    level: float
    fits: dict[str, StaticFit]
    chosen: str
    notes: list[str]

    @property
    def best(self) -> StaticFit:
        """The chosen fit."""
        return self.fits[self.chosen]

    def _units(self, dimension: str) -> str | None:
        # behind a number nothing stands where it is dimensionless; on an axis that is a word
        return unit_behind(self.rows, dimension).strip() or self.rows.attrs.get("units", {}).get("force")

    @property
    def alternatives(self) -> list[str]:
        """Forms that describe the break-aways about as well as the chosen one, the best first."""
        near = [
            fit for fit in self.fits.values() if fit.criterion < self.best.criterion + NEAR and not fit.undetermined
        ]
        return [fit.form for fit in sorted(near, key=lambda fit: fit.criterion) if fit is not self.best]

    def _as_good(self) -> list[str]:
        """The forms that these break-aways do not tell from the chosen one, and how far they go apart."""
        if not self.alternatives:
            return []
        longest = 10 * float(self.rows["stick_time"].max())
        forces = [float(self.fits[form](longest)) for form in (self.chosen, *self.alternatives)]
        alike = f"These break-aways do not separate the {self.chosen} form from: {', '.join(self.alternatives)}."
        if not 0 < max(forces) <= FAR_APART * min(forces):
            return [
                f"{alike} At ten times the longest rest they part by more than a factor of {FAR_APART:g}: none of them is to "
                "be extrapolated beyond the rests of the record; rests of other lengths separate them."
            ]
        return [
            f"{alike} After a rest of {longest:.3g}{unit_behind(self.rows, 'time')}, ten times the longest, they have with "
            f"their fitted numbers {min(forces):.4g} to {max(forces):.4g}{unit_behind(self.rows, 'force')}; rests of other "
            "lengths separate them."
        ]

    @property
    def of_a_law(self) -> StaticFrictionFit:
        """The same with the form, of those that laws have, that lies closest to these break-aways."""
        known = [form for form in self.fits if form.removesuffix(OWN_LEVEL) not in WITHOUT_A_LAW]
        determined = [form for form in known if not self.fits[form].undetermined] or known
        return replace(self, chosen=min(determined, key=lambda form: (form != self.chosen, self.fits[form].criterion)))

    @property
    def own_level(self) -> bool:
        """Whether the chosen form grows from a level of its own instead of from the kinetic force."""
        return self.chosen == ONSET or self.chosen.endswith(OWN_LEVEL)

    def plot_residuals(self) -> Any:
        """Residuals of the chosen form over stick time, over force rate and over time; returns the Axes.

        A slope in the last is a drift; a slope in another is what the form leaves out.
        """
        from stickslip.show.canvas import in_units, logarithmic_x, new_axes

        row = new_axes(1, 3, figsize=(9.6, 3.2))
        residuals = self.best.residuals
        columns = {
            "stick_time": ("stick time", "time"),
            "force_rate": ("force rate", "force time^-1"),
            "t": ("time of the break-away", "time"),
        }
        for axes, (column, (label, kind)) in zip(row, columns.items(), strict=True):
            axes.plot(self.rows[column], residuals, ".", color="0.4")
            axes.axhline(0, color="0.3", lw=0.8)
            axes.set_xlabel(label + in_units(self._units(kind)))
            axes.set_ylabel(f"force − {self.chosen} form" + in_units(self._units("force")))
            if column != "t":
                logarithmic_x(axes, self.rows[column])
            middle = abs(float(self.rows[column].median()))
            if np.ptp(self.rows[column]) < 1e-6 * middle:  # one value: its rounding is no axis
                axes.set_xlim(0.9 * middle, 1.1 * middle)
        return row

    def heading(self) -> list[str]:
        """How many break-aways, and the chosen form."""
        return [f"Static friction over stick time, {len(self.rows)} break-aways: {self.chosen}"]

    def estimates(self) -> pd.DataFrame:
        """The numbers of the chosen form."""
        return self.best.parameters

    def tables(self) -> list[str]:
        """The numbers of all forms."""
        tables = pd.concat({name: fit.parameters for name, fit in self.fits.items()}, names=["form", "parameter"])
        return [in_digits(tables).to_string()]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words: the chosen form, all forms with their parameters, notes."""
        forms = {name: {"formula": fit.formula, **fit.parameters.to_dict("index")} for name, fit in self.fits.items()}
        return {"chosen": self.chosen, "forms": forms, "break_aways": len(self.rows), "notes": self.notes}

    def to_toml(self) -> str:
        """The fits as a TOML document."""
        return tomli_w.dumps({"static_friction": self.to_dict()})

    def plot(self, ax: Any = None) -> Any:
        """Break-away force over stick time with the fits; returns the Axes."""
        from stickslip.show.canvas import ABOVE, axes, in_units, logarithmic_x

        ax = axes(ax)
        time, force = self.rows["stick_time"].to_numpy(), self.rows["used"].to_numpy()
        ax.plot(time, force, ".", color="0.6", label="break-aways")
        grid = np.geomspace(time.min(), time.max(), 200)
        order = sorted(self.fits, key=lambda name: (name != self.chosen, self.fits[name].criterion))
        for name in order[:SHOWN]:
            ax.plot(grid, self.fits[name](grid), lw=2.5 if name == self.chosen else 1.0, label=name)
        logarithmic_x(ax, time)
        ax.set_xlabel("stick time" + in_units(self._units("time")))
        above = " above that of its slip" if self.relative else ""
        ax.set_ylabel("break-away force" + above + in_units(self._units("force")))
        ax.legend(**ABOVE, ncols=2)
        return ax


def fit_static_friction(friction: Any) -> StaticFrictionFit:
    """Fit static friction over stick time to the break-aways of one or more records.

    The forms are those of :func:`stickslip.identification.static.forms.forms`: constant, logarithmic (with an onset and
    without), exponential, power and Kato's in t_s, which begin at the kinetic force or at a level f0 above it; and where the
    force rate varies freely one in δ, a fall of f_s(0, δ) with it, three in both, and a smooth surface. Each is a robust
    least-squares fit; its covariance is scaled by the scatter of the rows and their correlation from one to the next. Of
    the forms whose Akaike criterion is within 4 of the lowest the one with the fewest numbers is chosen.

    Parameters
    ----------
    friction : as for :func:`stickslip.identify`, or a pandas DataFrame of break-aways with the columns `stick_time` and
        `force`, and where they are known `force_rate`, `drop` and `force_error`.

    Returns
    -------
    StaticFrictionFit with all fits, the chosen one and the sentence that says why.

    Raises
    ------
    InputError
        for fewer than five break-aways with a known stick time.

    A stick that happens to hold more also lasts longer, along its loading line F = F_capture + δ t_s. What is minimised is
    therefore by how much each stick is stronger than the form, (F − f_s) / (1 − f_s′/δ), not the plain difference, which
    would show a growth near δ where there is none. Where friction drifts, so that break-aways are taken above the kinetic
    force of their slips, it is the plain difference, and a note says that the growth is an upper limit.

    Limits: where all records have one drive velocity, stick time and force rate are tied and `notes` says so; where all
    sticks begin at one force too, nothing is known of growth, and static friction is taken as constant.

    Source: Kato, Sato & Matsubayashi, Wear 20 (1972) 315; Dieterich, J. Geophys. Res. 77 (1972) 3690 (logarithm).

    >>> rng, t_s = np.random.default_rng(1), np.geomspace(0.1, 10, 60)
    >>> force = 0.6 + 0.05 * np.log10(t_s) + 0.002 * rng.standard_normal(60)
    >>> found = fit_static_friction(pd.DataFrame({"stick_time": t_s, "force": force, "force_rate": 1 / t_s}))
    >>> found.chosen, float(found.best.parameters.loc["slope", "value"].round(2))
    ('logarithmic', 0.05)
    """
    records = read_records(friction)
    rows = break_away_rows(records)
    if len(rows) < FEWEST_ROWS:
        raise InputError(
            f"static friction: expected at least {FEWEST_ROWS} break-aways with a known stick time, got {len(rows)}: "
            "take a longer record, or one that sticks"
        )
    relative, notes = is_relative(rows)
    level = float(np.mean(rows["level"])) if rows["level"].notna().any() else math.nan
    if not math.isfinite(level):
        sliding = np.concatenate([record.force[~record.stuck] for record in records])
        # nothing known of the slips: an undamped one falls as far below the kinetic force as it began above it
        falls = sliding if sliding.size else (rows["force"] - rows["drop"] / 2).dropna().to_numpy()
        level = float(np.median(falls)) if falls.size else math.nan
        if not falls.size:
            notes.append(
                "Nothing is known of the slips (no force while slipping, no drop), so the forms that begin at the kinetic "
                "force are left out; give the drop of each break-away."
            )
    rows = rows.assign(used=rows["force"] - rows["level"] + level if relative else rows["force"])
    zero = 0.0
    if relative:
        rows = rows[rows["level"].notna()]  # the slip of the last break-away may be cut off
        # an error of the zero is in a break-away and in its slip alike, and comes back with the level alone
        zero = math.sqrt(float(np.mean(rows.groupby("record")["common"].first() ** 2)) / rows["record"].nunique())
        rows = rows.assign(force_error=own_error(rows["force_error"], rows["common"]), common=0.0)
    constraints = notes_on_ties(rows)
    rows["on_line"] = False if relative else on_loading_line(rows)
    fits = fit_forms(rows, level, zero, rates_differ=not constraints)
    flat = ([] if relative else notes_on_missing_growth(rows)) or (
        notes_on_weakening(rows, fits) if constraints else []
    )
    chosen, sentence = ("constant", flat[0]) if flat else choose(fits)
    found = StaticFrictionFit(rows=rows, relative=relative, level=level, fits=fits, chosen=chosen, notes=[])
    notes = [
        *notes,
        sentence,
        *([] if flat else found._as_good()),
        *notes_on_unlike_records(rows, fits),
        *constraints,
        *(notes_on_loading_line(rows, fits) if relative else []),
        *notes_on_drift(rows, fits),
        *notes_on_least_drop(rows),
        *notes_on_undetermined(fits),
    ]
    return replace(found, notes=notes)
