"""Forms of friction over slip velocity, each a sum of terms, the rows they are fitted to, and what a fit gives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, combinations

import numpy as np
import numpy.typing as npt
import pandas as pd

from stickslip.files.arrays import Array, Indices
from stickslip.identification.estimator.hat_functions import hats_at
from stickslip.identification.estimator.parameters import Parameter, Parameters
from stickslip.identification.estimator.uncertainty import estimate, half_width

BLOCKS = 8
"""Stretches of a record that are held back in turn; of a table with few rows each row is."""
BEYOND = 0.1
"""Speeds that one stretch alone holds are predicted by the others up to that part of the range of all."""
FEW_ROWS = 40
WHOLE = 3
"""With so many records that lie apart, whole records are held back."""
ONE_SPEED = 1.05
"""Speeds within this ratio are one, and show no curve."""

SHAPES: dict[str, tuple[str, ...]] = {
    "Coulomb": ("kinetic",),
    "Coulomb + viscous": ("kinetic", "viscous"),
    "Coulomb + quadratic": ("kinetic", "quadratic"),
    "logarithmic": ("kinetic", "logarithm"),
    "Stribeck": ("kinetic", "weakening", "viscous"),
    "Gaussian Stribeck": ("kinetic", "weakening", "viscous"),
}
"""What friction may be over |w|, as terms."""
EXPONENTS = {"Gaussian Stribeck": 2.0}
"""Of |w| / scale in the fall of friction, where it is not 1."""
BY_SENSE = "_by_sense"
"""Ending of a term that keeps its sign when the slip turns: half of what its number differs by between the two senses."""
TIED = 0.95
"""Correlation of load and logarithm of the speed from which on no form may have both: their numbers would mean nothing."""
FORMULAS = {
    "kinetic": "kinetic",
    "viscous": "viscous * |w|",
    "quadratic": "quadratic * w^2",
    "logarithm": "logarithm * ln(|w| / {reference:.3g})",
    "weakening": "weakening * exp(-{power})",
    "load": "load * (N - {load:.4g})",
    "drift": "drift * (x - {position:.4g})",
    "restoring": "restoring * (x - {position:.4g})",
    "gravity_sine": "gravity_sine * sin(x)",
    "gravity_cosine": "gravity_cosine * cos(x)",
    "inertia": "inertia * dw/dt",
    "offset": "offset",
}
DIMENSIONS = {
    "kinetic": "force",
    "viscous": "force velocity^-1",
    "quadratic": "force velocity^-2",
    "logarithm": "force",
    "weakening": "force",
    "scale": "velocity",
    "gravity_sine": "force",
    "gravity_cosine": "force",
    "inertia": "force time^2 length^-1",
    "offset": "force",
}
"""Of the numbers of a form, as :func:`~stickslip.files.units.unit_of` reads them; records lack what the others need."""
GRAVITY = ("gravity_sine", "gravity_cosine")
"""Torque of a weight on an arm that turns by the angle x; it has no constant, so that a constant is friction or an offset."""
OF_MOTION = ("restoring", *GRAVITY, "inertia")
"""Terms that are no friction: they keep their sign when the slip turns."""


@dataclass(frozen=True)
class Rows:
    """Points of friction over slip velocity, in the order of the record; NaN columns are not known.

    `source` names the record of each, `acceleration` is given where the record contradicts the inertia of its rig. Where
    records differ by more than chance they lie `apart`, and each counts as one. `turning`: the position is an angle in rad.
    `blur` is the standard error of w, 0 where it is not known.
    """

    w: Array
    force: Array
    error: Array
    load: Array
    position: Array
    source: npt.NDArray[np.str_]
    series: bool
    apart: bool = False
    acceleration: Array | None = None
    turning: bool = False
    blur: float = 0.0

    def __len__(self) -> int:
        return len(self.w)

    @cached_property
    def stated(self) -> bool:
        """Whether the errors are stated; else each of them is 1."""
        return not self.series and not bool((self.error == 1).all())

    @cached_property
    def known(self) -> bool:
        """Whether the errors are stated and mean something by themselves."""
        return self.stated and not self.apart

    @cached_property
    def records(self) -> list[Indices]:
        """Rows of each record."""
        return [np.flatnonzero(self.source == name) for name in dict.fromkeys(self.source.tolist())]

    @cached_property
    def parts(self) -> list[Indices]:
        """What is held back in turn: records that lie apart, else stretches, and where rows are few each of them.

        Where one stretch alone holds the slowest or fastest slip, as of a single run-up, the others would have to predict
        what they never saw. Stretches are then shorter, and every eighth of them is held back.
        """
        if self.apart and len(self.records) >= WHOLE:
            return self.records
        if len(self) <= FEW_ROWS:
            return np.array_split(np.arange(len(self)), len(self))
        stretches = np.array_split(np.arange(len(self)), BLOCKS)
        speed = np.abs(self.w)
        # the extremes of each, but for single samples far out, and how far they reach beyond those of all others
        low, high = np.array([np.quantile(speed[part], [0.02, 0.98]) for part in stretches]).T
        alone = max(float(np.diff(np.sort(low)[:2])[0]), float(np.diff(np.sort(high)[-2:])[0]))
        if alone <= BEYOND * float(high.max() - low.min()):
            return stretches
        shorter = np.array_split(np.arange(len(self)), BLOCKS**2)
        return [np.concatenate(shorter[first::BLOCKS]) for first in range(BLOCKS)]

    def set_apart(self) -> Rows:
        """The same rows, each record of which counts as one."""
        error = self.error.copy()
        for part in self.records:
            error[part] *= np.sqrt(np.sum(1 / self.error[part] ** 2))
        return replace(self, apart=True, error=error)

    @property
    def tie(self) -> float:
        """Correlation of load and logarithm of the speed, 0 where the load is not known or does not change."""
        if not np.isfinite(self.load).all() or len(self) < 4 or min(np.ptp(self.load), np.ptp(np.abs(self.w))) == 0:
            return 0.0
        return float(np.corrcoef(np.log(np.abs(self.w)), self.load)[0, 1])

    @cached_property
    def reference(self) -> float:
        """Geometric mean of the slip speeds."""
        return float(np.exp(np.mean(np.log(np.abs(self.w)))))

    @cached_property
    def middle(self) -> tuple[float, float]:
        """Means of load and place."""
        return float(np.mean(self.load)), float(np.mean(self.position))


@dataclass(frozen=True)
class Curve:
    """Columns of a form, with its scale found by least squares where it has one."""

    terms: tuple[str, ...]
    reference: float
    middle: tuple[float, float]
    exponent: float = 1.0
    scale: float = math.nan

    def columns(self, rows: Rows) -> Array:
        """One column for each term, shape (rows, terms)."""
        columns: dict[str, Array] = {}
        for term in self.terms:
            plain = term.removesuffix(BY_SENSE)
            column = columns[plain] if plain in columns else self._column(plain, rows)
            columns[term] = column if term == plain else np.sign(rows.w) * column
        return np.stack(list(columns.values()), axis=1)

    def _column(self, term: str, rows: Rows) -> Array:
        sense, speed = np.sign(rows.w), np.abs(rows.w)
        match term:
            case "viscous":
                return rows.w
            case "quadratic":
                return rows.w * speed
            case "logarithm":
                return np.asarray(sense * np.log(np.maximum(speed, 1e-300) / self.reference))
            case "weakening":
                return np.asarray(sense * np.exp(-((speed / self.scale) ** self.exponent)))
            case "offset":
                return np.ones(len(rows))
            case "inertia":
                return np.zeros(len(rows)) if rows.acceleration is None else rows.acceleration
            case "restoring":
                return rows.position - self.middle[1]
            case "gravity_sine" | "gravity_cosine":
                turn = np.sin if term == "gravity_sine" else np.cos
                return np.asarray(turn(rows.position)) if rows.turning else np.zeros(len(rows))
            case "load":
                return np.asarray(sense * (rows.load - self.middle[0]))
            case "drift":
                return np.asarray(sense * (rows.position - self.middle[1]))
        return sense  # kinetic

    def jacobian(self, rows: Rows, numbers: Array) -> Array:
        """Change of the curve with each of its numbers, the scale among them where it has one."""
        columns = self.columns(rows)
        if "weakening" not in self.terms:
            return columns
        falls = [i for i, term in enumerate(self.terms) if term.startswith("weakening")]
        steep = self.exponent / self.scale * (np.abs(rows.w) / self.scale) ** self.exponent
        return np.insert(
            columns, self.terms.index("weakening") + 1, steep * (columns[:, falls] @ numbers[falls]), axis=1
        )


@dataclass(frozen=True)
class FreeCurve:
    """Straight pieces on either side, with the terms of a form that are none of the speed: what forms are measured by."""

    beside: Curve
    nodes: Array

    @classmethod
    def of(cls, rows: Rows, count: int, form: Curve) -> FreeCurve:
        """With so many nodes on either side, as many rows between any two."""
        kept = tuple(term for term in form.terms if term in ("load", "drift", *OF_MOTION))
        return cls(replace(form, terms=kept), np.unique(np.quantile(np.abs(rows.w), np.linspace(0, 1, count))))

    @property
    def count(self) -> int:
        """How many numbers it has."""
        return 2 * len(self.nodes) + len(self.beside.terms)

    def columns(self, rows: Rows) -> Array:
        """Hats over the speed, for either sense of the slip, and the other terms."""
        hats = hats_at(np.abs(rows.w), self.nodes)
        forward = (rows.w > 0)[:, None]
        both = [hats * forward, hats * ~forward]
        return np.concatenate([*both, self.beside.columns(rows)] if self.beside.terms else both, axis=1)


@dataclass(frozen=True)
class SteadyFit:
    """One form of friction over slip velocity, fitted.

    Attributes
    ----------
    form : its name; `formula` is written out, for the side w > 0.
    parameters : DataFrame over the names of the numbers: value, error (standard error), low and high (95 %).
    covariance : of these numbers.
    rms : root mean square of measured minus fitted.
    held_back : the same for rows that were held back from the fit.
    losses : squared misfit of each held-back row, weighted by its error.
    freedom : independent rows less numbers.
    curve, numbers : the terms, and what each is multiplied with.
    """

    form: str
    formula: str
    parameters: pd.DataFrame
    covariance: Array
    rms: float
    held_back: float
    losses: Array
    freedom: float
    curve: Curve = field(repr=False)
    numbers: Array = field(repr=False)

    def __call__(
        self, slip_velocity: npt.ArrayLike, load: npt.ArrayLike | None = None, position: npt.ArrayLike | None = None
    ) -> Array:
        """Friction and offset at these slip velocities, any shape; load and place at their means where they are not given.

        Gravity of an arm is left out unless the position is given.
        """
        w = np.asarray(slip_velocity, dtype=float)
        return np.asarray(self.curve.columns(self._at(w, load, position)) @ self.numbers).reshape(w.shape)

    def interval(
        self,
        slip_velocity: npt.ArrayLike,
        load: npt.ArrayLike | None = None,
        position: npt.ArrayLike | None = None,
        *,
        single: bool = False,
    ) -> tuple[Array, Array]:
        """Lower and upper end of the 95 % interval of the curve at these slip velocities, or of a `single` measurement.

        A single measurement is one more row (of a series: one more sample), so its scatter, the rms of the fit, is in it.
        """
        w = np.asarray(slip_velocity, dtype=float)
        columns = self.curve.jacobian(self._at(w, load, position), self.numbers)
        variance = np.einsum("ni,ij,nj->n", columns, self.covariance, columns).reshape(w.shape)
        half = np.sqrt(variance + self.rms**2 * single) * half_width(1.0, self.freedom)
        middle = self(w, load, position)
        return middle - half, middle + half

    def of_motion(self, rows: Rows) -> Array:
        """What of the force is none of friction: gravity, a spring, inertia."""
        others = [term in OF_MOTION for term in self.curve.terms]
        return np.asarray(self.curve.columns(rows)[:, others] @ self.numbers[others])

    @property
    def vector(self) -> Array:
        """The numbers, the scale among them, in the order of `parameters`."""
        return self.parameters["value"].to_numpy()

    @property
    def by_sense(self) -> bool:
        """Whether its numbers differ by the sense of the slip."""
        return any(name.endswith(BY_SENSE) for name in self.parameters.index)

    def toward(self, values: Array, sense: float) -> dict[str, float]:
        """Numbers of slip in one sense, 1 or -1, by name, from `values` in the order of `parameters`; 0: the mean of both."""
        at = dict(zip(self.parameters.index, values.tolist(), strict=True))
        own = {name: number for name, number in at.items() if not name.endswith(BY_SENSE)}
        return {name: number + sense * at.get(name + BY_SENSE, 0.0) for name, number in own.items()}

    def with_covariance(self, covariance: Array, freedom: float) -> SteadyFit:
        """The same fit with other intervals."""
        table = table_of(list(self.parameters.index), self.vector, covariance, freedom)
        return replace(self, parameters=table, covariance=covariance, freedom=freedom)

    def at_rest(self, slow: float, w: float = 0.0) -> tuple[float, float, float]:
        """Friction at rest, or at this speed, the mean of both ways and without offset: value and ends of its 95 % interval.

        A logarithm has no end there: it is taken at the slowest speed.
        """
        at = max(w, slow) if "logarithm" in self.curve.terms else max(w, 1e-9 * slow)
        columns = self.curve.jacobian(self._at(np.array([at, -at]), None, None), self.numbers)
        mean = (columns[0] - columns[1]) / 2
        plain = self.curve.columns(self._at(np.array([at, -at]), None, None)) @ self.numbers
        value = float(plain[0] - plain[1]) / 2
        half = half_width(math.sqrt(float(mean @ self.covariance @ mean)), self.freedom)
        return value, value - half, value + half

    def _at(self, w: Array, load: npt.ArrayLike | None, position: npt.ArrayLike | None) -> Rows:
        unknown = np.zeros(w.size)
        given = zip((load, position), self.curve.middle, strict=True)
        beside = [
            np.broadcast_to(mean if value is None else value, w.shape).astype(float).ravel() for value, mean in given
        ]
        none = np.full(w.size, "")
        return Rows(w.ravel(), unknown, unknown, beside[0], beside[1], none, False, turning=position is not None)


def forms_of(rows: Rows, shapes: Iterable[str]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Names and terms of all forms that these rows could tell apart at all."""
    speed = np.abs(rows.w)
    varied = float(speed.max() / speed.min())
    both_ways = bool((rows.w > 0).any() and (rows.w < 0).any())
    loads = np.isfinite(rows.load).all() and float(np.ptp(rows.load)) > 0.05 * abs(float(rows.load.mean()))
    extras: dict[str, tuple[str, ...]] = {"load": ("load",)} if loads else {}
    if np.isfinite(rows.position).all() and float(np.ptp(rows.position)) > 0:
        # to and fro a force of the place (gravity, a spring) shows; one way only, friction that changes along the path
        of_position = "restoring" if both_ways else "drift"
        extras[of_position] = (of_position,)
        if both_ways and rows.turning:
            extras["gravity"] = GRAVITY
    if rows.acceleration is not None:
        extras["inertia"] = ("inertia",)
    subsets = [
        subset
        for subset in chain.from_iterable(combinations(extras, n) for n in range(len(extras) + 1))
        if not {"restoring", "gravity"} <= set(subset)  # over a small angle the one is the other
    ]
    for shape in shapes:
        if shape != "Coulomb" and varied < ONE_SPEED:
            continue
        for subset in subsets:
            more = tuple(chain.from_iterable(extras[name] for name in subset))
            yield ", ".join([shape, *subset]), (terms := (*SHAPES[shape], *more))
            if both_ways:
                yield ", ".join([shape, "offset", *subset]), (*SHAPES[shape], "offset", *more)
                friction = [term for term in terms if term not in OF_MOTION]
                if len(friction) > 1:  # a kinetic force that differs by the sense is an offset
                    yield ", ".join([shape, "asymmetric", *subset]), (*terms, *(term + BY_SENSE for term in friction))


def table_of(names: list[str], values: Array, covariance: Array, freedom: float) -> pd.DataFrame:
    """Value, error and interval by name."""
    return estimate(Parameters([Parameter(name) for name in names]), values, covariance, freedom)[0]
