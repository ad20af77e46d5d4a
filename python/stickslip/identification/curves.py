"""Forms of friction over slip velocity, each a sum of terms, and their fit by least squares."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, combinations
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import minimize_scalar

from stickslip.identification.uncertainty import half_width, recurrence, worth

Array = npt.NDArray[np.float64]

BLOCKS = 8
"""Stretches of a record that are held back in turn; of a table with few rows each row is."""
FEW = 40
ONE_SPEED = 1.05
"""Speeds within this ratio are one, and show no curve."""

SHAPES: dict[str, tuple[str, ...]] = {
    "Coulomb": ("kinetic",),
    "Coulomb + viscous": ("kinetic", "viscous"),
    "Coulomb + quadratic": ("kinetic", "quadratic"),
    "logarithmic": ("kinetic", "logarithm"),
    "Stribeck": ("kinetic", "weakening", "viscous"),
}
"""What friction may be over |w|, as terms; `EXTRAS` may come with each."""
EXTRAS = ("offset", "restoring", "load", "drift")
COLUMNS = ("w", "force", "error", "load", "place", "source")
FORMULAS = {
    "kinetic": "kinetic",
    "viscous": "viscous * |w|",
    "quadratic": "quadratic * w^2",
    "logarithm": "logarithm * ln(|w| / {reference:.3g})",
    "weakening": "weakening * exp(-|w| / scale)",
    "load": "load * (N - {load:.4g})",
    "drift": "drift * (x - {place:.4g})",
    "restoring": "restoring * (x - {place:.4g})",
}


@dataclass(frozen=True)
class Rows:
    """Points of friction over slip velocity, in the order of the record; NaN columns are not known."""

    w: Array
    force: Array
    error: Array
    load: Array
    place: Array
    source: npt.NDArray[np.str_]
    series: bool

    def __len__(self) -> int:
        return len(self.w)

    def take(self, which: Any) -> Rows:
        """Some of the rows."""
        return replace(self, **{name: getattr(self, name)[which] for name in COLUMNS})

    @cached_property
    def known(self) -> bool:
        """Whether the errors are stated, so that they mean something by themselves."""
        return not self.series and not bool((self.error == 1).all())

    @cached_property
    def reference(self) -> float:
        """Geometric mean of the slip speeds."""
        return float(np.exp(np.mean(np.log(np.abs(self.w)))))

    @cached_property
    def middle(self) -> tuple[float, float]:
        """Means of load and place."""
        return float(np.mean(self.load)), float(np.mean(self.place))


def _design(rows: Rows, terms: tuple[str, ...], scale: float, reference: float, middle: tuple[float, float]) -> Array:
    sense, speed = np.sign(rows.w), np.abs(rows.w)
    columns = {
        "kinetic": sense,
        "viscous": rows.w,
        "quadratic": rows.w * speed,
        "logarithm": sense * np.log(np.maximum(speed, 1e-300) / reference),
        "weakening": sense * np.exp(-speed / scale) if scale > 0 else sense,
        "offset": np.ones(len(rows)),
        "restoring": rows.place - middle[1],
        "load": sense * (rows.load - middle[0]),
        "drift": sense * (rows.place - middle[1]),
    }
    return np.stack([columns[term] for term in terms], axis=1)


@dataclass(frozen=True)
class Curve:
    """Columns of a form, with its scale found by least squares where it has one."""

    terms: tuple[str, ...]
    reference: float
    middle: tuple[float, float]
    scale: float = math.nan

    def columns(self, rows: Rows) -> Array:
        """One column for each term, shape (rows, terms)."""
        return _design(rows, self.terms, self.scale, self.reference, self.middle)

    def solve(self, rows: Rows) -> tuple[Curve, Array, Array]:
        """Curve, numbers of the linear terms, residuals."""
        curve = self
        if "weakening" in self.terms:
            speed = np.abs(rows.w)
            low, high = math.log(float(speed.min()) / 3), math.log(float(speed.max()))

            def misfit(log_scale: float) -> float:
                rest = replace(self, scale=math.exp(log_scale)).linear(rows)[1]
                return float(np.sum((rest / rows.error) ** 2))

            grid = np.linspace(low, high, 13)
            best = int(np.argmin([misfit(float(place)) for place in grid]))
            around = (float(grid[max(best - 1, 0)]), float(grid[min(best + 1, 12)]))
            found = minimize_scalar(misfit, bounds=around, method="bounded", options={"xatol": 1e-3})
            curve = replace(self, scale=math.exp(float(found.x)))
        return curve, *curve.linear(rows)

    def jacobian(self, rows: Rows, numbers: Array) -> Array:
        """Change of the curve with each of its numbers, the scale among them where it has one."""
        columns = self.columns(rows)
        if "weakening" not in self.terms:
            return columns
        at = self.terms.index("weakening")
        slope = columns[:, at] * numbers[at] * np.abs(rows.w) / self.scale**2
        return np.insert(columns, at + 1, slope, axis=1)

    def linear(self, rows: Rows) -> tuple[Array, Array]:
        """Numbers of the terms at this scale by weighted least squares, and the residuals."""
        columns = self.columns(rows)
        size = np.linalg.norm(columns, axis=0)
        size[size == 0] = 1.0
        weighted = columns / size / rows.error[:, None]
        numbers = np.linalg.lstsq(weighted, rows.force / rows.error, rcond=None)[0] / size
        return numbers, rows.force - columns @ numbers


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
        self, slip_velocity: npt.ArrayLike, load: npt.ArrayLike | None = None, place: npt.ArrayLike | None = None
    ) -> Array:
        """Friction at these slip velocities, any shape; load and place at their means where they are not given."""
        w = np.asarray(slip_velocity, dtype=float)
        return np.asarray(self.curve.columns(self._at(w, load, place)) @ self.numbers).reshape(w.shape)

    def interval(
        self,
        slip_velocity: npt.ArrayLike,
        load: npt.ArrayLike | None = None,
        place: npt.ArrayLike | None = None,
        *,
        single: bool = False,
    ) -> tuple[Array, Array]:
        """Lower and upper end of the 95 % interval of the curve at these slip velocities, or of a `single` measurement.

        A single measurement is one more row (of a series: one more sample), so its scatter, the rms of the fit, is in it.
        """
        w = np.asarray(slip_velocity, dtype=float)
        columns = self.curve.jacobian(self._at(w, load, place), self.numbers)
        variance = np.einsum("ni,ij,nj->n", columns, self.covariance, columns).reshape(w.shape)
        half = np.sqrt(variance + self.rms**2 * single) * half_width(1.0, self.freedom)
        middle = self(w, load, place)
        return middle - half, middle + half

    def _at(self, w: Array, load: npt.ArrayLike | None, place: npt.ArrayLike | None) -> Rows:
        unknown = np.zeros(w.size)
        given = zip((load, place), self.curve.middle, strict=True)
        beside = [
            np.broadcast_to(mean if value is None else value, w.shape).astype(float).ravel() for value, mean in given
        ]
        return Rows(w.ravel(), unknown, unknown, beside[0], beside[1], np.full(w.size, ""), False)


def forms_of(rows: Rows, shapes: Iterable[str]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Names and terms of all forms that these rows could tell apart at all."""
    speed = np.abs(rows.w)
    varied = float(speed.max() / speed.min())
    both_ways = bool((rows.w > 0).any() and (rows.w < 0).any())
    extras = []
    if both_ways:
        extras.append("offset")
    if np.isfinite(rows.load).all() and float(np.ptp(rows.load)) > 0.05 * abs(float(rows.load.mean())):
        extras.append("load")
    if np.isfinite(rows.place).all() and float(np.ptp(rows.place)) > 0:
        # to and fro a force of the place (gravity, a spring) shows; one way only, friction that changes along the path
        extras.append("restoring" if both_ways else "drift")
    subsets = list(chain.from_iterable(combinations(extras, n) for n in range(len(extras) + 1)))
    for shape in shapes:
        if shape != "Coulomb" and varied < ONE_SPEED:
            continue
        for subset in subsets:
            yield ", ".join([shape, *subset]), (*SHAPES[shape], *subset)


def fit_form(rows: Rows, form: str, terms: tuple[str, ...]) -> SteadyFit | None:
    """Fit one form; None where there are too few rows for it, or where two of its numbers do the same on these rows."""
    names = list(terms)
    if "weakening" in terms:
        names.insert(names.index("weakening") + 1, "scale")
    if len(rows) < len(names) + 2:
        return None
    blank = Curve(terms, rows.reference, rows.middle)
    curve, numbers, rest = blank.solve(rows)
    if "scale" in names and (min(numbers[:2]) < 0 or curve.scale > 0.5 * float(np.abs(rows.w).max())):
        return None  # bent over all speeds: a polynomial by another name, and no Stribeck curve
    jacobian = curve.jacobian(rows, numbers)
    values = numbers.tolist()
    if "scale" in names:
        values.insert(names.index("scale"), curve.scale)
    size = np.linalg.norm(jacobian / rows.error[:, None], axis=0)
    if not (size > 0).all():
        return None
    scaled = jacobian / rows.error[:, None] / size
    singular = np.linalg.svd(scaled, compute_uv=False)
    if singular[-1] < 1e-6 * singular[0]:
        return None  # two of its terms are one and the same on these rows
    z = rest / rows.error
    inverse = np.linalg.inv(scaled.T @ scaled)
    inflate = np.ones(len(names))
    if len(rows) > FEW:
        period = recurrence(rows.w) if rows.series else 0
        most = len(rows) / (len(names) + 2)
        inflate = np.array([min(worth(pulls, period), most) for pulls in (scaled @ inverse * z[:, None]).T])
    freedom = max(len(rows) / float(inflate.max()) - len(names), 1.0)
    chi = float(np.sum(z**2)) / (len(rows) - len(names))
    # stated errors are believed unless the scatter is larger
    spread = np.sqrt(inflate * (max(chi, 1.0) if rows.known else chi)) / size
    covariance = inverse * np.outer(spread, spread)
    errors = np.sqrt(np.diag(covariance))
    half = [half_width(float(error), freedom) for error in errors]
    table = pd.DataFrame(
        {"value": values, "error": errors, "low": np.subtract(values, half), "high": np.add(values, half)},
        index=pd.Index(names, name="parameter"),
    )
    losses = _held_back(rows, blank)
    if losses is None:
        return None
    plain = losses * rows.error**2
    marks = {"reference": rows.reference, "load": rows.middle[0], "place": rows.middle[1]}
    side = " + ".join(FORMULAS[term].format(**marks) for term in terms if term != "offset")
    return SteadyFit(
        form=form,
        formula=f"f(w > 0) = {side}" + (" + offset" if "offset" in terms else ""),
        parameters=table,
        covariance=covariance,
        rms=float(np.sqrt(np.mean(rest**2))),
        held_back=float(np.sqrt(np.average(plain, weights=1 / rows.error**2))),
        losses=losses,
        freedom=freedom,
        curve=curve,
        numbers=numbers,
    )


def _held_back(rows: Rows, blank: Curve) -> Array | None:
    """Weighted squared misfit of every row, predicted by a fit to the others."""
    parts = np.array_split(np.arange(len(rows)), len(rows) if len(rows) <= FEW else BLOCKS)
    losses = np.zeros(len(rows))
    for part in parts:
        others = np.ones(len(rows), dtype=bool)
        others[part] = False
        if not {-1.0, 1.0} & set(np.sign(rows.w[others])):
            return None
        curve, numbers, _ = blank.solve(rows.take(others))
        aside = rows.take(part)
        losses[part] = ((aside.force - curve.columns(aside) @ numbers) / aside.error) ** 2
    return losses
