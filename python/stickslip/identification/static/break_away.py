"""Static friction f_s(t_s, δ) from the table of break-aways: its forms fitted, one chosen, and what cannot be told."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import pandas as pd
import tomli_w

from stickslip.errors import InputError
from stickslip.files.disk import write_text
from stickslip.files.units import unit_of
from stickslip.identification.estimator.least_squares import OUTLIER, linear, minimize
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.identification.estimator.result import Result, in_digits
from stickslip.identification.estimator.uncertainty import correlated_covariance, estimate, own_error, robust_scale
from stickslip.identification.records import FrictionRecord, read_records
from stickslip.identification.static.forms import BY_RATIO, ONSET, OWN_LEVEL, Form, forms

Array = npt.NDArray[np.float64]

FEWEST_ROWS = 5
SHOWN = 3
"""Forms that a picture shows."""
WITHOUT_A_LAW = ("power", "Kato")
"""Forms that no law has, with a level of their own or without: `DwellTime` is Kato's with its exponent held."""
TOGETHER = 0.5
"""Correlation of stick time with time beyond which a drift may pass for growth."""
EQUAL = 0.01
"""Stick times that scatter by less than that many decades within each record are of one length."""
CROWDED = 1.25
"""Falls within this ratio of the smallest lie at the edge of what is seen."""
OF_STICK_TIME = (
    "constant",
    "logarithmic",
    ONSET,
    *(form + level for form in ("exponential", "power", "Kato") for level in ("", OWN_LEVEL)),
)
"""Forms in which the force rate does not stand."""
UNDETERMINED = 1e-5
"""Numbers of a form of which a combination changes the forces less than this part of what each does alone are not told."""
FAR_APART = 2
"""Forms that part by more than this factor at ten times the longest rest say nothing of it."""
NEAR = 4.0
"""Forms whose criterion is within this of the lowest do as well: the likelihoods differ by less than e² for one number."""
EVALUATIONS = 150
"""Most evaluations of a form in each of the four rounds of its fit, from each starting point."""
TOLERANCES = (1e-4, 1e-7, 1e-7, 1e-8)
"""Relative tolerances of the rounds: one that chooses the starting point, two that find the weights of the rows, the last."""
APPROACH = (0.02, 2.0)
"""Least and greatest approach of load and limit of a stick, over the rise of the load."""
LONGER = 1.1
"""Scatter of forces may make a stick that much longer than its load takes from -f to f."""
SAME_RATE = 1.5
"""Force rates within this ratio are one."""
ALIKE = 0.3
"""Sticks begin at one force where the forces there scatter by less than that part of those at their ends."""
NARROW = 1.25
"""Stick times (10th to 90th percentile) within this ratio say nothing about growth."""


@dataclass(frozen=True)
class StaticFit:
    """One form fitted to the break-aways.

    Attributes
    ----------
    form : its name; `formula` is written out.
    parameters : value, error, low and high of the 95 % interval, by name; infinite errors where the rows do not determine it.
    covariance : of the fitted numbers (the rate of the exponential by its logarithm), in the order of `parameters`.
    scatter : robust standard deviation of the residuals.
    criterion : Akaike's, corrected for few rows; the lower the better.
    residuals : measured minus fitted force, in the order of the rows.
    rate : the usual force rate.
    """

    form: str
    formula: str
    parameters: pd.DataFrame
    covariance: Array
    scatter: float
    criterion: float
    residuals: Array = field(repr=False)
    rate: float
    _at: Callable[[Array, Array], Array] = field(repr=False, compare=False)

    @property
    def undetermined(self) -> list[str]:
        """Names of the numbers of which the rows tell no more than a combination."""
        return [str(name) for name in self.parameters.index[np.isinf(self.parameters["error"])]]

    def __call__(self, stick_time: npt.ArrayLike, force_rate: npt.ArrayLike | None = None) -> Array:
        """The fitted force at these stick times and force rates, any shape; default the usual rate."""
        rate = self.rate if force_rate is None else force_rate
        time, rates = np.broadcast_arrays(np.asarray(stick_time, float), np.asarray(rate, float))
        return self._at(time.ravel(), rates.ravel()).reshape(time.shape)


@dataclass(frozen=True, repr=False, eq=False)
class StaticFriction(Result):
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
        return _unit(self.rows, dimension).strip() or None

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
        alike = f"These break-aways do not tell the {self.chosen} form from: {', '.join(self.alternatives)}."
        if not 0 < max(forces) <= FAR_APART * min(forces):
            return [
                f"{alike} At ten times the longest rest they part by more than a factor of {FAR_APART:g}: none of them is to "
                "be extrapolated beyond the rests of the record; rests of other lengths tell them apart."
            ]
        return [
            f"{alike} After a rest of {longest:.3g}{_unit(self.rows, 'time')}, ten times the longest, they have with their "
            f"fitted numbers {min(forces):.4g} to {max(forces):.4g}{_unit(self.rows, 'force')}; rests of other lengths tell "
            "them apart."
        ]

    @property
    def of_a_law(self) -> StaticFriction:
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
        from stickslip.show.canvas import in_units, new_axes

        row = new_axes(1, 3, figsize=(9.6, 3.2))
        rest = self.best.residuals
        columns = {
            "stick_time": ("stick time", "time"),
            "force_rate": ("force rate", "force time^-1"),
            "t": ("time of the break-away", "time"),
        }
        for axes, (column, (label, kind)) in zip(row, columns.items(), strict=True):
            axes.plot(self.rows[column], rest, ".", color="0.4")
            axes.axhline(0, color="0.3", lw=0.8)
            axes.set_xlabel(label + in_units(self._units(kind)))
            axes.set_ylabel(f"force − {self.chosen} form" + in_units(self._units("force")))
            axes.set_xscale("log" if column != "t" and _spans(self.rows[column]) else "linear")
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

    def save(self, path: str | Path) -> Path:
        """Write the fits as a TOML document."""
        text = tomli_w.dumps({"static_friction": self.to_dict()})
        return write_text(path, text, ".toml")

    def plot(self, ax: Any = None) -> Any:
        """Break-away force over stick time with the fits; returns the Axes."""
        from stickslip.show.canvas import ABOVE, in_units, new_axes

        axes = new_axes()[0] if ax is None else ax
        time, force = self.rows["stick_time"].to_numpy(), self.rows["used"].to_numpy()
        axes.plot(time, force, ".", color="0.6", label="break-aways")
        grid = np.geomspace(time.min(), time.max(), 200)
        order = sorted(self.fits, key=lambda name: (name != self.chosen, self.fits[name].criterion))
        for name in order[:SHOWN]:
            axes.plot(grid, self.fits[name](grid), lw=2.5 if name == self.chosen else 1.0, label=name)
        axes.set_xscale("log" if _spans(self.rows["stick_time"]) else "linear")
        axes.set_xlabel("stick time" + in_units(self._units("time")))
        above = " above that of its slip" if self.relative else ""
        axes.set_ylabel("break-away force" + above + in_units(self._units("force")))
        axes.legend(**ABOVE, ncols=2)
        return axes


def fit_static_friction(friction: Any) -> StaticFriction:
    """Fit static friction over stick time to the break-aways of one or more records.

    The forms are those of :func:`stickslip.identification.static.forms.forms`: constant, logarithmic (with an onset and
    without), exponential, power and Kato's in t_s, which begin at the kinetic force or at a level f0 above it; and where the
    force rate varies freely one in δ, a fall of f_s(0, δ) with it, three in both, and a smooth surface. Each is a robust
    least-squares fit; its covariance is scaled by the scatter of the rows and their correlation from one to the next. Of
    the forms whose Akaike criterion is within 4 of the lowest the one with the fewest numbers is chosen.

    Parameters
    ----------
    friction : as for :func:`stickslip.identify`.

    Returns
    -------
    StaticFriction with all fits, the chosen one and the sentence that says why.

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

    >>> import xarray as xr
    >>> rng, t_s = np.random.default_rng(1), np.geomspace(0.1, 10, 60)
    >>> rows = {"t": np.arange(60.0) + 1, "stick_time": t_s, "force_rate": 1 / t_s}
    >>> rows["force"] = 0.6 + 0.05 * np.log10(t_s) + 0.002 * rng.standard_normal(60)
    >>> root = {"time": np.arange(700) / 10, "slip_velocity": np.ones(700), "force": np.full(700, 0.5)}
    >>> table = xr.Dataset({name: ("event", column) for name, column in rows.items()})
    >>> data = xr.Dataset({k: ("time", v) for k, v in root.items() if k != "time"}, coords={"time": root["time"]})
    >>> found = fit_static_friction(xr.DataTree.from_dict({"/": data, "/break_away": table}))
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
    constraints = tied(rows)
    rows["on_line"] = False if relative else on_loading_line(rows)
    fits = _fits(rows, level, zero, rates_differ=not constraints)
    flat = ([] if relative else without_growth(rows)) or (weaker(rows, fits) if constraints else [])
    chosen, sentence = ("constant", flat[0]) if flat else _choose(fits)
    found = StaticFriction(rows=rows, relative=relative, level=level, fits=fits, chosen=chosen, notes=[])
    notes = [
        *notes,
        sentence,
        *([] if flat else found._as_good()),
        *_unlike(rows, fits),
        *constraints,
        *(loading_line(rows, fits) if relative else []),
        *drift(rows, fits),
        *threshold(rows),
        *_not_chosen(fits),
    ]
    return replace(found, notes=notes)


def _unit(rows: pd.DataFrame, dimension: str) -> str:
    """The unit of a force, a time or a force rate of these break-aways behind a number; nothing where it is not known."""
    units = rows.attrs.get("units", {})
    if "force" not in units or units["force"] == units.get("time", "1") == "1":
        return ""
    return f" {unit_of(dimension, units['force'], '1', units.get('time', '1'))}"


def _spans(values: pd.Series) -> bool:
    """Whether positive values span more than half a decade: a logarithmic axis of less has no whole power on it."""
    return bool((values > 0).all() and values.max() > 3 * values.min())


def _not_chosen(fits: dict[str, StaticFit]) -> list[str]:
    """The forms of which the break-aways do not tell every number."""
    named = [f"{fit.form} ({', '.join(fit.undetermined)})" for fit in fits.values() if fit.undetermined]
    if not named:
        return []
    return [
        f"Not chosen, as these break-aways tell only combinations of the numbers in brackets: {'; '.join(named)}. Rests of "
        "other lengths tell them apart."
    ]


def break_away_rows(records: list[FrictionRecord]) -> pd.DataFrame:
    """All break-aways with a known stick time, with its `record`, and `level` (kinetic force) and `sense` of its slip.

    Where the mass creeps, its force rates fall short of k V by its own creep, most in the shortest sticks; that is no rate at
    which it was loaded, and they are given as k V.
    """
    frames = []
    for number, record in enumerate(records):
        table = record.break_away.copy()
        if record.attrs.get("creeps") and {"stiffness", "drive_velocity"} <= set(record.constants):
            table["force_rate"] = record.constants["stiffness"] * record.constants["drive_velocity"]
        slips = record.own_slip()
        table["record"] = number
        table["late"] = record.constants.get("late", 0.0)
        table["common"] = record.constants.get("common", 0.0)
        table["level"] = [math.nan if slip is None else record.slip_level(*slip) for slip in slips]
        table["sense"] = [record.sense_of(slip) for slip in slips]
        frames.append(table[table["stick_time"].notna() & (table["stick_time"] > 0)])
    rows = pd.concat(frames, ignore_index=True)
    rows.attrs["units"] = dict(records[0].units)
    return rows


def common_error(rows: pd.DataFrame) -> Array:
    """Standard error in force that each break-away has in common with the others of its record: late, or of the zero."""
    late = np.asarray((rows["late"] * rows["force_rate"].abs()).fillna(0.0))
    return np.hypot(late, np.asarray(rows["common"])) if "common" in rows else late


def is_relative(rows: pd.DataFrame) -> tuple[bool, list[str]]:
    """Whether friction drifts along the records so much that each break-away must be compared with its own slip."""
    both = rows[rows["level"].notna()]
    if len(both) < FEWEST_ROWS:
        return False, []
    centred = both[["force", "level"]] - both.groupby("record")[["force", "level"]].transform("median")
    plain = robust_scale(centred["force"].to_numpy())
    above = robust_scale((centred["force"] - centred["level"]).to_numpy())
    if above > 0.7 * plain:
        return False, []
    return True, [
        f"Friction drifts along the record: break-away forces scatter by {plain:.3g}, but only by {above:.3g} "
        "above the kinetic force of the slip that follows each; static friction was fitted above that force."
    ]


def unlike(static: StaticFriction) -> bool:
    """Whether the records lie further from every law of stick time than the scatter within each lets expect."""
    return bool(_unlike(static.rows, static.fits))


def _unlike(rows: pd.DataFrame, fits: dict[str, StaticFit]) -> list[str]:
    """A sentence where the records lie further from the fit to all of them than the scatter within each lets expect.

    Such a fit is a compromise; its intervals hold the scatter within the records and not what sets them apart.
    """
    fit = min((fits[name] for name in OF_STICK_TIME if name in fits), key=lambda fit: fit.criterion)
    rest = pd.Series(fit.residuals, index=rows.index)
    parts = [part.to_numpy() for _, part in rest.groupby(rows["record"]) if len(part) >= FEWEST_ROWS]
    if len(parts) < 2:
        return []
    middle = np.array([float(np.median(part)) for part in parts])
    error = np.array([1.2533 * robust_scale(part - np.median(part)) / math.sqrt(len(part)) for part in parts])
    late = common_error(rows)
    error = np.hypot(
        error,
        [float(np.median(late[part.index])) for _, part in rest.groupby(rows["record"]) if len(part) >= FEWEST_ROWS],
    )
    if float(np.sum((middle / np.maximum(error, 1e-300)) ** 2)) < 10 * len(parts):
        return []
    apart = ", ".join(f"{value:.2g} ± {spread:.1g}" for value, spread in zip(middle, error, strict=True))
    return [
        f"The records differ from one law of stick time: their break-away forces lie {apart} off the {fit.form} form. It is "
        f"a compromise, and a further run may lie {float(np.sqrt(np.mean(middle**2))):.2g} aside."
    ]


def one_rate(rows: pd.DataFrame) -> bool:
    """Whether all break-aways with a force rate come at nearly one, as from one drive velocity."""
    rate = np.log(rows["force_rate"].abs()[rows["force_rate"].abs() > 0].to_numpy())
    return bool(rate.size and np.subtract(*np.quantile(rate, [0.9, 0.1])) < math.log(SAME_RATE))


def tied(rows: pd.DataFrame) -> list[str]:
    """A sentence where stick time and force rate cannot be told apart, else nothing."""
    known = rows[rows["force_rate"].notna() & (rows["force_rate"].abs() > 0)]
    if len(known) < 2:
        return ["No force rate is known, so static friction is taken to depend on the stick time alone."]
    if len(known) < len(rows):
        return [
            f"{len(rows) - len(known)} of {len(rows)} break-aways have no force rate, so static friction is taken to depend "
            "on the stick time alone; give the missing rates, or leave these rows out."
        ]
    rate = np.log(known["force_rate"].abs().to_numpy())
    time = np.log(known["stick_time"].to_numpy())
    if one_rate(known):
        return [
            f"All break-aways come at nearly one force rate ({math.exp(float(np.median(rate))):.3g}"
            f"{_unit(rows, 'force time^-1')}, one drive velocity): stick time and force rate cannot be told "
            "apart, and the growth holds at that rate only."
        ]
    correlation = float(np.corrcoef(time, rate)[0, 1])
    if abs(correlation) > 0.9:
        return [
            f"Stick time and force rate are tied in these records (correlation of their logarithms {correlation:.2f}): "
            "what is given as growth with stick time may be an effect of the force rate; vary the stiffness as well."
        ]
    return []


def without_growth(rows: pd.DataFrame) -> list[str]:
    """A sentence where sticks of one force rate are of one length, or begin at one force, and so say nothing of growth."""
    known = rows[rows["force_rate"].notna()]
    if len(known) < 2 or not one_rate(known):
        return []
    low, high = np.quantile(known["stick_time"], [0.1, 0.9])
    if high < NARROW * low:
        return [
            f"Nearly all sticks last from {low:.4g} to {high:.4g}, which says nothing about growth with rest: static "
            "friction is taken as constant. Records at other drive velocities tell."
        ]
    begun, held = (
        robust_scale((part - part.median()).to_numpy())
        for part in (known["force"] - known["force_rate"].abs() * known["stick_time"], known["force"])
    )
    if begun > ALIKE * held:
        return []
    return [
        f"All sticks begin at nearly one force (they scatter by {begun:.2g} there and by {held:.2g} at the break-away), so "
        "they lie on one loading line, and a stick that happens to hold more also lasts longer: growth with rest cannot be "
        "told from that, and static friction is taken as constant. Records at other drive velocities tell."
    ]


def weaker(rows: pd.DataFrame, fits: dict[str, StaticFit]) -> list[str]:
    """A sentence where static friction falls with stick time from record to record, each at a force rate of its own."""
    if rows["force_rate"].isna().any() or one_rate(rows):
        return []
    shortest, longest = fits[_choose(fits)[0]](np.array([rows["stick_time"].min(), rows["stick_time"].max()]))
    if longest >= shortest:
        return []
    return [
        f"Break-away forces fall by {shortest - longest:.2g}{_unit(rows, 'force')} from the shortest stick to the longest. "
        "Rest makes nothing weaker: it is the force rate, or something else that differs between the records, and static "
        "friction is taken as constant. Records in which stick time and force rate differ apart from each other tell."
    ]


def loading_line(rows: pd.DataFrame, fits: dict[str, StaticFit]) -> list[str]:
    """A sentence where the scatter of friction along a track on which it drifts may be what looks like growth."""
    if len(set(rows["record"])) > 1 or rows["force_rate"].isna().all():
        return []
    rate = float(np.nanmedian(np.abs(rows["force_rate"].to_numpy())))
    log = fits["logarithmic"]
    middle = float(np.median(rows["stick_time"]))
    slope = float(log.parameters["value"].to_numpy()[1]) / (math.log(10) * middle)
    if slope < 0.1 * rate or log.scatter < 0.1 * rate * float(np.std(rows["stick_time"])):
        return []
    return [
        f"Within one record break-aways lie on the loading line (force = force at capture + {rate:.3g} × stick time), "
        f"so scatter along the track alone would look like growth of {rate / 2:.3g} per unit time, where "
        f"{slope:.3g} was found: take the growth as an upper limit until records at other drive velocities confirm it."
    ]


def drift(rows: pd.DataFrame, fits: dict[str, StaticFit]) -> list[str]:
    """A sentence where a drift in time may be what looks like growth with stick time, or the other way round."""
    found = fits["logarithmic"]
    time, log = rows["t"] - rows.groupby("record")["t"].transform("mean"), np.log10(rows["stick_time"])
    log = log - log.groupby(rows["record"]).transform("mean")
    # Sticks of one length in each record show no growth within it; a table made by hand may have no times at all.
    if not time.std() > 0 or log.std() < EQUAL or not abs(float(np.corrcoef(time, log)[0, 1])) >= TOGETHER:
        return []
    slope, error = (float(found.parameters[column]["slope"]) for column in ("value", "error"))
    whole = found.residuals + slope * log
    columns = np.stack([np.ones(len(rows)), log, time / time.std()], axis=1)
    numbers = linear(columns, whole)
    if abs(numbers[1] - slope) < 2 * error:
        return []
    return [
        f"Stick times change along the record, and so may friction: with a drift in time beside it the slope over stick time "
        f"is {numbers[1]:.3g} per decade instead of {slope:.3g}; a drift and growth with rest cannot be told apart here."
    ]


def threshold(rows: pd.DataFrame) -> list[str]:
    """A sentence where falls of the force crowd at the smallest that was seen: those below it are missing."""
    drop = rows["drop"].dropna().to_numpy()
    if drop.size < 20 or not (drop > 0).all():
        return []
    low, tenth, high = np.quantile(drop, [0.0, 0.1, 0.9])
    if tenth > CROWDED * low or high < 2 * tenth:
        return []
    return [
        f"A tenth of the break-aways fall by {low:.3g} to {tenth:.3g}, at the edge of what is taken for a slip: smaller ones "
        "are missing, their sticks are counted into the next, and long sticks with high forces are picked out, which looks "
        "like growth with stick time."
    ]


def _fits(rows: pd.DataFrame, level: float, zero: float, rates_differ: bool) -> dict[str, StaticFit]:
    columns = (rows[name].to_numpy() for name in ("stick_time", "force_rate", "used"))
    time, rate, force = columns
    return {form.name: _fit(rows, form, zero) for form in forms(time, np.abs(rate), force, level, rates_differ)}


def _fit(rows: pd.DataFrame, form: Form, zero: float) -> StaticFit:
    """A form fitted; `zero` is the standard error of all forces together, which moves its level and nothing else."""
    time, force = rows["stick_time"].to_numpy(), rows["used"].to_numpy()
    rate = rows["force_rate"].abs().to_numpy()
    late = common_error(rows)
    stated = own_error(rows["force_error"].fillna(0.0), late)
    # one column for each record: its break-away forces are high or low together
    together = late[:, None] * (rows["record"].to_numpy()[:, None] == rows["record"].unique())
    starts = [np.array(start) for start in (form.start, *form.others)]
    on_line = rows["on_line"].to_numpy()
    aside = np.minimum(_aside_of_the_line(rows), stated)
    beside = Beside.of(time, rate)

    def in_errors(numbers: Array, sigma: Array) -> Array:
        limit, nearing = beside.approach(partial(form.at, numbers))
        along = np.where(on_line, nearing, 1.0) * np.sqrt(np.maximum(sigma**2 - aside**2, 0.0))
        return np.asarray((force - limit) / np.hypot(along, aside))

    least = 1e-12 * float(np.abs(force).max()) or 1.0
    sigma = np.full(len(force), max(robust_scale(force - np.median(force)), least))
    for tolerance in TOLERANCES:
        columns = together / sigma[:, None]
        share = _shares(columns)

        def misfit(numbers: Array, sigma: Array = sigma, columns: Array = columns, share: Array = share) -> Array:
            rest = in_errors(numbers, sigma)
            high = share @ rest
            return np.concatenate([rest - columns @ high, high])

        found = minimize(misfit, starts, outlier=OUTLIER, evaluations=EVALUATIONS, tolerance=tolerance)
        starts = [found.vector]
        off = in_errors(found.vector, sigma)
        high = share @ off
        own = sigma * off - together @ high
        inner = math.sqrt(max(robust_scale(own) ** 2 - float(np.median(stated**2)), 0.0))
        sigma = np.maximum(np.hypot(stated, inner), least)
    residuals = force - form.at(found.vector, time, rate)
    count, free = len(force), len(form.names)
    variance = robust_scale(own / sigma) ** 2 * count / max(count - free, 1)
    order = np.argsort(rows["t"].to_numpy() + 1e9 * rows["record"].to_numpy(), kind="stable")
    order = np.append(order, np.arange(count, count + len(high)))
    # What the scatter says of the errors is said of those that each has alone: what is common to them is known beforehand.
    scale = math.sqrt(max(variance, 1e-24))
    jacobian, rest = (_with_errors(of, columns, scale) for of in (found.jacobian, found.residuals))
    covariance, freedom = correlated_covariance(jacobian[order], rest[order], 1.0)
    covariance[np.diag_indices(free)] += np.where(_undetermined(found.jacobian), math.inf, 0.0)
    if form.names[0] == "f0":
        covariance[0, 0] += zero**2
    numbers = Parameters([Parameter(name, logarithmic=name in BY_RATIO) for name in form.names])
    table, _ = estimate(numbers, found.vector, covariance, freedom)
    squares = (own / sigma) ** 2
    cut = np.minimum(squares, (3 * max(robust_scale(own / sigma), 1e-300)) ** 2)
    penalty = 2 * (free + 1) * count / max(count - free - 2, 1)
    deviance = (
        count * math.log(max(float(np.mean(cut)), 1e-300)) + 2 * float(np.sum(np.log(sigma))) + float(high @ high)
    )
    usual = float(np.nanmedian(rate)) if np.isfinite(rate).any() else math.nan
    return StaticFit(
        form.name,
        form.formula,
        table,
        covariance,
        robust_scale(residuals - together @ high),
        deviance + penalty,
        residuals,
        usual,
        partial(form.at, found.vector),
    )


def on_loading_line(rows: pd.DataFrame) -> pd.Series[bool]:
    """Which sticks were loaded steadily, at the one rate of their record, so that where each ends follows from its chance.

    A stick that began at -f and is loaded to f cannot have lasted longer; one that did, by `LONGER`, was a rest of the drive.
    """
    rate = rows["force_rate"].abs()
    each = rate.groupby(rows["record"])
    one = each.transform("max") < SAME_RATE * each.transform("min")
    return one & (rate * rows["stick_time"] <= 2 * LONGER * rows["force"].abs())


def _aside_of_the_line(rows: pd.DataFrame) -> Array:
    """The part of the stated errors of force that is no error of the time at which the stick ends."""
    stated, end = (rows[name].fillna(0.0) if name in rows else 0.0 for name in ("force_error", "t_error"))
    square = stated**2 - (rows["force_rate"].abs().fillna(0.0) * end) ** 2
    return np.asarray(np.sqrt(square.clip(lower=0.0)), float)


@dataclass(frozen=True)
class Beside:
    """Sticks at their stick times t_s and a little beside them, for the slope of a limit; shapes (3, n) and (n,)."""

    time: Array
    rate: Array

    @classmethod
    def of(cls, time: Array, rate: Array) -> Self:
        """Of stick times and force rates, shape (n,)."""
        return cls(np.stack([time, time + 1e-3 * time, time - 1e-3 * time]), rate)

    def approach(self, limit: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
        """f_s(t_s, δ), and how fast the load of a stick nears it over how fast it rises: 1 − f_s′/δ, within `APPROACH`.

        A stick that is stronger by r, or is seen to end too late by r/δ, breaks away r / (1 − f_s′/δ) higher up its loading
        line, as the limit grows while the load goes on to meet it. 1 where no rate is known.
        """
        here, after, before = limit(self.time.ravel(), np.tile(self.rate, 3)).reshape(3, -1)
        slope = (after - before) / (2e-3 * self.time[0])
        with np.errstate(over="ignore"):  # it is cut off
            nearing = np.clip(1 - slope / np.maximum(self.rate, 1e-300), *APPROACH)
        return here, np.where(np.isnan(nearing), 1.0, nearing)


def _shares(together: Array) -> Array:
    """Of residuals of unit variance, how much of each column is likeliest in them, each beforehand 0 ± 1: (columns, n)."""
    return np.asarray(np.linalg.solve(together.T @ together + np.eye(together.shape[1]), together.T))


def _with_errors(rows: Array, columns: Array, scale: float) -> Array:
    """The rows of a misfit with columns in common, `scale` times as large an error of each row alone."""
    count = len(columns)
    alone = (rows[:count] + columns @ rows[count:]) / scale
    columns = columns / scale
    high = _shares(columns) @ alone
    return np.concatenate([alone - columns @ high, high])


def _undetermined(jacobian: Array) -> npt.NDArray[np.bool_]:
    """Which numbers the rows do not determine: those without effect, and those of a combination without effect."""
    size = np.linalg.norm(jacobian, axis=0)
    silent = size <= 1e-12 * float(size.max())
    _, singular, right = np.linalg.svd(jacobian / np.where(silent, 1.0, size), full_matrices=False)
    weak = right[singular < UNDETERMINED * singular[0]]
    return np.asarray(silent | (np.abs(weak) > 0.1).any(axis=0))


def _choose(fits: dict[str, StaticFit]) -> tuple[str, str]:
    # A form whose numbers are not determined is one of fewer numbers that is among them too.
    order = sorted(fits.values(), key=lambda fit: (len(fit.undetermined) > 0, fit.criterion))
    near = [fit for fit in order if fit.criterion - order[0].criterion < NEAR and not fit.undetermined]
    best = min(near, key=lambda fit: (len(fit.parameters), fit.criterion))
    second = next(fit for fit in order if fit is not best)
    lead = second.criterion - best.criterion
    simplest = fits["constant"]
    slope = fits["logarithmic"].parameters.loc["slope"]
    growth = f"its slope is {slope['value']:.3g} per decade (95 %: {slope['low']:.3g} to {slope['high']:.3g})"
    if best is simplest:
        return best.form, (
            "Static friction is best described as constant: growth with stick time does not pay for its parameter; "
            f"on the logarithmic form {growth}."
        )
    strength = "clearly" if lead > 6 else "only slightly" if lead > 2 else "not decisively"
    why = (
        "as Akaike's criterion is lowest"
        if best is order[0]
        else "the simplest of those whose Akaike criterion is near the lowest"
    )
    return best.form, (
        f"Static friction over stick time: the {best.form} form is chosen, {why} "
        f"({strength}: by {lead:.1f} against the {second.form} form, by "
        f"{simplest.criterion - best.criterion:.1f} against a constant); on the logarithmic form {growth}."
    )
