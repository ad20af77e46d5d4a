"""Forms of static friction f_s(t_s, δ) that are fitted to break-aways."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from stickslip.files.arrays import Array
from stickslip.laws.static_surface import static_surface

#: Positive numbers, fitted by their logarithm.
BY_RATIO = ("rate", "exponent", "scale", "onset")
OWN_LEVEL = " above f0"
"""Ends the name of a form that begins at a level f0 of its own instead of at the kinetic force."""
ONSET = "logarithmic with onset"
"""The form of :class:`stickslip.laws.LogarithmicDwell`, with a level of its own."""


@dataclass(frozen=True)
class Form:
    """A form of f_s over stick time t and force rate δ.

    Attributes
    ----------
    name : what it is called.
    formula : written out, in t_s and delta.
    names, start : of its numbers, and where their fit begins (ratios by their logarithm).
    others : further places where it may begin; the best of all is taken.
    level : the kinetic force.
    from_level : whether it begins at the kinetic force.
    """

    name: str
    formula: str
    names: tuple[str, ...]
    start: tuple[float, ...]
    level: float
    others: tuple[tuple[float, ...], ...] = ()
    from_level: bool = False

    def at(self, numbers: Array, time: Array, rate: Array) -> Array:
        """Force from the numbers, t and δ."""
        if self.name.endswith(OWN_LEVEL):
            return np.asarray(numbers[0] + FORCE[self.name.removesuffix(OWN_LEVEL)](numbers[1:], time, rate))
        return FORCE[self.name](numbers, time, rate) + (self.level if self.from_level else 0.0)


def forms(time: Array, rate: Array, force: Array, level: float, rates_differ: bool) -> list[Form]:
    """The forms that rows of this size and spread could tell apart, the simplest first.

    Parameters
    ----------
    time, rate, force : stick time, force rate and force of each break-away, shape (n,); what is not known of the rate is NaN.
    level : the kinetic force, where growth with rest may begin; NaN where it is not known, which leaves out the forms that
        begin there. Each form of growth also comes with a level f0 of its own, as static friction may jump above the
        kinetic force at once.
    rates_differ : whether stick time and force rate are free of each other.

    Sources: Kato, Sato & Matsubayashi, Wear 20 (1972) 315 (exponential, with an exponent); Dieterich, J. Geophys. Res. 77
    (1972) 3690 (logarithm); Johannes, Green & Brockley, Wear 24 (1973) 381 (that f_s falls with the rate; the forms of the
    fall and the surface are our own).
    """
    known = math.isfinite(level)
    middle, typical = float(np.median(force)), float(np.median(time))
    grown = max(middle - level, 1e-3 * abs(middle)) if known else 0.1 * abs(middle)
    start_rate = -math.log(typical / 1.5)
    base = f"{level:.6g}"

    found = [
        Form("constant", "f0", ("f0",), (middle,), level),
        Form(
            "logarithmic",
            "f0 + slope * log10(t_s)",
            ("f0", "slope"),
            (middle, 0.1 * grown),
            level,
        ),
        Form(
            "exponential",
            f"{base} + limit * (1 - exp(-rate * t_s))",
            ("limit", "rate"),
            (1.3 * grown, start_rate),
            level,
            from_level=True,
        ),
    ]
    if len(time) >= 8:
        lowest, spread = float(force.min()), max(float(np.ptp(force)), 1e-6 * abs(middle))
        decades = max(math.log(float(time.max() / time.min())), 1e-3)
        found += [
            Form(
                "power",
                f"{base} + growth * t_s^exponent",
                ("growth", "exponent"),
                (grown / typical**0.3, math.log(0.3)),
                level,
                from_level=True,
            ),
            Form(
                "Kato",
                f"{base} + limit * (1 - exp(-rate * t_s^exponent))",
                ("limit", "rate", "exponent"),
                (1.3 * grown, start_rate, 0.0),
                level,
                from_level=True,
            ),
        ]
        typical_time = math.log(typical)
        found += [
            *(_above_own_level(form, lowest, spread) for form in found if form.from_level),
            Form(
                ONSET,
                "f0 + growth * ln(1 + t_s / onset)",
                ("f0", "growth", "onset"),
                (lowest, spread / decades, typical_time),
                level,
                ((lowest, spread / decades, typical_time - 3.0),),
            ),
        ]
    if not rates_differ or len(time) < 12:
        return [form for form in found if known or not form.from_level]
    typical_rate = math.log(float(np.median(rate)))
    found += [
        Form(
            "force rate",
            "f0 + rate_slope * log10(delta)",
            ("f0", "rate_slope"),
            (middle, -0.1 * grown),
            level,
        ),
        Form(
            "stick time and force rate",
            "f0 + slope * log10(t_s) + rate_slope * log10(delta)",
            ("f0", "slope", "rate_slope"),
            (middle, 0.1 * grown, -0.1 * grown),
            level,
        ),
        Form(
            "exponential over force rate",
            f"{base} + limit * (1 - exp(-rate * t_s)) / (1 + delta / scale)",
            ("limit", "rate", "scale"),
            (2.0 * grown, start_rate, typical_rate),
            level,
            from_level=True,
        ),
        *_falls(level, rate, grown, start_rate),
        Form(
            "surface",
            "f0 + a * T + b * D + aa * T^2 + ab * T * D + bb * D^2, T = log10(t_s), D = log10(delta)",
            ("f0", "a", "b", "aa", "ab", "bb"),
            (middle, 0.1 * grown, -0.1 * grown, 0.0, 0.0, 0.0),
            level,
        ),
    ]
    return [form for form in found if known or not form.from_level]


def _above_own_level(form: Form, lowest: float, spread: float) -> Form:
    """The form that begins at a level f0 of its own; its fit begins where the form's does, and at the lowest force."""
    ratios = form.start[1:]
    return replace(
        form,
        name=form.name + OWN_LEVEL,
        formula=form.formula.replace(f"{form.level:.6g}", "f0", 1),
        names=("f0", *form.names),
        start=(lowest, spread, *ratios),
        others=((lowest, 5 * spread, ratios[0] - 2.0, *ratios[1:]),),
        from_level=False,
    )


def _falls(level: float, rate: Array, grown: float, start_rate: float) -> list[Form]:
    """Forms in which f_s(0, δ) itself falls with the force rate, as in the paper's law."""
    # Where and how sharply it falls has several nearly good answers: the fit begins at each of them.
    scales = np.log(np.quantile(rate, [0.5, 0.25, 0.75]))
    begins = [(float(scale), math.log(sharp)) for sharp in (2.0, 8.0) for scale in scales]

    plain = [(grown, grown, *begin) for begin in begins]
    both = [(grown, *begin, grown, start_rate) for begin in begins]
    return [
        Form(
            "fall with force rate",
            "f0 + drop / (1 + (delta / scale)^exponent)",
            ("f0", "drop", "scale", "exponent"),
            plain[0],
            level,
            tuple(plain[1:]),
        ),
        Form(
            "exponential and fall with force rate",
            f"{level:.6g} + drop / (1 + (delta / scale)^exponent) + limit * (1 - exp(-rate * t_s))",
            ("drop", "scale", "exponent", "limit", "rate"),
            both[0],
            level,
            tuple(both[1:]),
            from_level=True,
        ),
    ]


def _static(time: Array, rate: Array, *, growth: Array | None = None, fall: Array | None = None) -> Array:
    """The core's Δ∞ (1 − exp(−γ t^m))/(1 + δ/δ₀) + Δ₀/(1 + (δ/δ₁)^p), from (Δ∞, ln γ, ln m, ln δ₀) and (Δ₀, ln δ₁, ln p).

    Of the growth the last numbers may be missing: m = 1 and no dependence on the force rate.
    """
    limit, *ratios = (0.0,) if growth is None else growth
    bounded = [
        math.exp(max(min(ratio, high), low))
        for ratio, (low, high) in zip(ratios, ((-50, 50), (-20, 3), (-50, 50)), strict=False)
    ]
    gamma = bounded[0] if bounded else 1.0
    exponent = bounded[1] if len(bounded) > 1 else 1.0
    scale = bounded[2] if len(bounded) > 2 else None
    drop, fall_scale, steep = (0.0, 0.0, 0.0) if fall is None else fall
    falls = (float(drop), math.exp(max(min(fall_scale, 50), -50)), math.exp(max(min(steep, 5), -3)))
    return static_surface(time, rate, (float(limit), gamma, exponent), scale, falls)


def _surface(p: Array, time: Array, rate: Array) -> Array:
    t, d = np.log10(time), np.log10(rate)
    return np.asarray(p[0] + p[1] * t + p[2] * d + p[3] * t**2 + p[4] * t * d + p[5] * d**2)


FORCE: dict[str, Callable[[Array, Array, Array], Array]] = {
    "constant": lambda p, t, _: np.full(len(t), p[0]),
    "logarithmic": lambda p, t, _: p[0] + p[1] * np.log10(t),
    "exponential": lambda p, t, d: _static(t, d, growth=p),
    ONSET: lambda p, t, _: p[0] + p[1] * np.log1p(t / np.exp(np.clip(p[2], -50, 50))),
    "power": lambda p, t, _: p[0] * t ** np.exp(np.clip(p[1], -20, 3)),
    "Kato": lambda p, t, d: _static(t, d, growth=p),
    "force rate": lambda p, _, d: p[0] + p[1] * np.log10(d),
    "stick time and force rate": lambda p, t, d: p[0] + p[1] * np.log10(t) + p[2] * np.log10(d),
    "exponential over force rate": lambda p, t, d: _static(t, d, growth=np.insert(p, 2, 0.0)),
    "surface": _surface,
    "fall with force rate": lambda p, t, d: p[0] + _static(t, d, fall=p[1:]),
    "exponential and fall with force rate": lambda p, t, d: _static(t, d, growth=p[3:], fall=p[:3]),
}
"""Force, above the kinetic force where the form begins there, from the numbers, t and δ, by the name of the form."""
