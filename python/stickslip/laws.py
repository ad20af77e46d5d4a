"""Friction laws: immutable data, checked and evaluated by the core.

Every law answers two questions: what force adhesion can bear (:meth:`Law.break_away_force`) and what force slip produces
(:meth:`Law.kinetic_force`, :func:`force_along`). Friction on the mass has the sign of the slip velocity w.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from stickslip.bogacz_ryczek import BogaczRyczek as BogaczRyczek
from stickslip.bogacz_ryczek import StaticFriction as StaticFriction
from stickslip.law import Law as Law
from stickslip.law import Point
from stickslip.law import force_along as force_along
from stickslip.law import load_covariance as load_covariance
from stickslip.law import load_law as load_law
from stickslip.state_laws import BoucWen as BoucWen
from stickslip.state_laws import Dahl as Dahl
from stickslip.state_laws import ElastoPlastic as ElastoPlastic
from stickslip.state_laws import LuGre as LuGre
from stickslip.state_laws import RateState as RateState
from stickslip.state_laws import Regularised as Regularised
from stickslip.tabulation import from_function as from_function


@dataclass(frozen=True)
class Coulomb(Law):
    """|F| ≤ f_k at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    kinetic : friction force f_k ≥ 0.

    Source: Coulomb (1785); Den Hartog, Trans. ASME 53 (1931) 107.

    >>> Coulomb(kinetic=0.5).break_away_force()
    0.5
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"kinetic": 0.6}
    UNITS: ClassVar[dict[str, str]] = {"kinetic": "force"}

    kinetic: float


@dataclass(frozen=True)
class StaticKinetic(Law):
    """|F| ≤ f_s at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    break_away : break-away force f_s ≥ f_k.
    kinetic : kinetic force f_k ≥ 0.

    With f_s > f_k the motion at the onset of slip is not unique: the automaton chooses adhesion wherever adhesion can bear
    the force.

    >>> StaticKinetic(break_away=0.5, kinetic=0.6)
    Traceback (most recent call last):
    ...
    stickslip.errors.InputError: StaticKinetic: break-away force must be at least the kinetic force at zero slip velocity
    (0.6), got 0.5: raise the break-away force or lower the kinetic one
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"break_away": 1.0, "kinetic": 0.6}
    UNITS: ClassVar[dict[str, str]] = {"break_away": "force", "kinetic": "force"}

    break_away: float
    kinetic: float


@dataclass(frozen=True)
class PiecewiseLinear(Law):
    """F(|w|) linear between nodes (w_i, f_i), the last slope going on beyond the last; |F| ≤ f_s at rest.

    Parameters
    ----------
    nodes : two or more pairs (slip speed, force), the first at slip speed 0, slip speeds increasing.
    break_away : break-away force f_s ≥ f_0.

    >>> PiecewiseLinear(nodes=[(0, 1), (0.2, 0.6), (0.3, 0.61)], break_away=1).kinetic_force([0.1, 0.5])
    array([0.8 , 0.63])
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"nodes": [(0, 0.9), (0.2, 0.6), (0.6, 0.7)], "break_away": 1.0}
    UNITS: ClassVar[dict[str, str]] = {"nodes": "velocity, force", "break_away": "force"}

    nodes: tuple[Point, ...]
    break_away: float


@dataclass(frozen=True)
class DwellTime(Law):
    """f_s(t_s) = f_k + Δ∞ (1 − exp(−γ t_s^m)) at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    kinetic : kinetic force f_k ≥ 0.
    limit : growth of static friction after an infinite rest, Δ∞ ≥ 0.
    rate : γ > 0, in 1/time^m.
    exponent : m > 0; 0.36 to 0.67 in Kato's measurements.

    Source: Kato, Sato & Matsubayashi, Wear 20 (1972) 315.

    >>> DwellTime(kinetic=0.5, limit=0.5, rate=0.4).break_away_force(float(10**6))
    1.0
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"kinetic": 0.5, "limit": 0.5, "rate": 0.4}
    UNITS: ClassVar[dict[str, str]] = {"kinetic": "force", "limit": "force", "rate": "time^-exponent", "exponent": ""}

    kinetic: float
    limit: float
    rate: float
    exponent: float = 1.0


@dataclass(frozen=True)
class Rational(Law):
    """F = f_s/(1 + δ|w|) in motion, |F| ≤ f_s at rest.

    Parameters
    ----------
    break_away : f_s ≥ 0.
    weakening : δ ≥ 0, in 1/velocity.

    Source: Leine, van Campen, de Kraker & van den Steen, Nonlinear Dynamics 16 (1998) 41.

    >>> Rational(break_away=1.0, weakening=3.0).kinetic_force(1.0)
    0.25
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"break_away": 1.0, "weakening": 3.0}
    UNITS: ClassVar[dict[str, str]] = {"break_away": "force", "weakening": "velocity^-1"}
    SMOOTH: ClassVar[bool] = True

    break_away: float
    weakening: float


@dataclass(frozen=True)
class Cubic(Law):
    """F = μ_s − k₁|w| + k₃|w|³ in motion, |F| ≤ μ_s at rest.

    Parameters
    ----------
    static : μ_s ≥ 0, also the break-away force.
    linear : k₁, 1.5 (μ_s − μ_m)/v_m for a minimum μ_m at the slip speed v_m.
    cubic : k₃, 0.5 (μ_s − μ_m)/v_m³ for the same.

    Source: Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389.

    >>> round(Cubic(static=0.4, linear=0.45, cubic=0.6).kinetic_force(0.5), 12)
    0.25
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"static": 0.4, "linear": 0.45, "cubic": 0.6}
    UNITS: ClassVar[dict[str, str]] = {"static": "force", "linear": "force velocity^-1", "cubic": "force velocity^-3"}
    SMOOTH: ClassVar[bool] = True

    static: float
    linear: float
    cubic: float


@dataclass(frozen=True)
class ExponentialStribeck(Law):
    """F = f_k + (f_s − f_k) exp(−(|w|/w_s)ⁿ) + b|w| in motion, |F| ≤ f_s at rest.

    Parameters
    ----------
    break_away : f_s ≥ f_k.
    kinetic : f_k ≥ 0.
    scale : w_s > 0, the slip speed over which friction falls.
    viscous : b.
    exponent : n, 1 (an exponential) or 2 (a Gaussian); other curves have no Taylor series at rest, see :func:`from_function`.

    Source: n = 1: Tustin, J. IEE 94 (1947) 143; n = 2: Armstrong-Hélouvry, Dupont & Canudas de Wit, Automatica 30 (1994)
    1083, after Bo & Pavelescu, Wear 82 (1982) 277.

    >>> round(ExponentialStribeck(1.0, 0.5, scale=0.5).kinetic_force(0.5), 6)
    0.68394
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"break_away": 1.0, "kinetic": 0.5, "scale": 0.1, "viscous": 0.2}
    UNITS: ClassVar[dict[str, str]] = {
        "break_away": "force",
        "kinetic": "force",
        "scale": "velocity",
        "viscous": "force velocity^-1",
        "exponent": "",
    }
    CHOICES: ClassVar[dict[str, tuple[float, ...]]] = {"exponent": (1.0, 2.0)}
    SMOOTH: ClassVar[bool] = True

    break_away: float
    kinetic: float
    scale: float
    viscous: float = 0.0
    exponent: float = 1.0


@dataclass(frozen=True)
class Lorentzian(Law):
    """F = f_k + (f_s − f_k)/(1 + (w/w_s)²) + b|w| in motion, |F| ≤ f_s at rest.

    Parameters
    ----------
    break_away : f_s ≥ f_k.
    kinetic : f_k ≥ 0.
    scale : w_s > 0, the slip speed at which half of the difference is gone.
    viscous : b.

    Source: Hess & Soom, J. Tribology 112 (1990) 147, as Armstrong-Hélouvry, Dupont & Canudas de Wit, Automatica 30 (1994)
    1083, write it.

    >>> Lorentzian(1.0, 0.5, scale=0.1).kinetic_force(0.1)
    0.75
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"break_away": 1.0, "kinetic": 0.5, "scale": 0.1, "viscous": 0.2}
    UNITS: ClassVar[dict[str, str]] = {
        "break_away": "force",
        "kinetic": "force",
        "scale": "velocity",
        "viscous": "force velocity^-1",
    }
    SMOOTH: ClassVar[bool] = True

    break_away: float
    kinetic: float
    scale: float
    viscous: float = 0.0


@dataclass(frozen=True)
class PoppStelter(Law):
    """F = (f_s − f_k)/(1 + λ₁|w|) + f_k + λ₂w² in motion, |F| ≤ f_s at rest.

    Parameters
    ----------
    break_away : f_s ≥ f_k.
    kinetic : f_k ≥ 0, the force the hyperbola falls to.
    weakening : λ₁ ≥ 0, in 1/velocity.
    square : λ₂, in 1/velocity².

    Source: Popp & Stelter, Phil. Trans. R. Soc. A 332 (1990) 89.

    >>> round(PoppStelter(0.4, 0.1, weakening=1.42, square=0.01).kinetic_force(1.0), 6)
    0.233967
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"break_away": 0.4, "kinetic": 0.1, "weakening": 1.42, "square": 0.01}
    UNITS: ClassVar[dict[str, str]] = {
        "break_away": "force",
        "kinetic": "force",
        "weakening": "velocity^-1",
        "square": "force velocity^-2",
    }
    SMOOTH: ClassVar[bool] = True

    break_away: float
    kinetic: float
    weakening: float
    square: float = 0.0


@dataclass(frozen=True)
class LogarithmicDwell(Law):
    """f_s(t_s) = f_k + A ln(1 + t_s/t_c) at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    kinetic : kinetic force f_k ≥ 0.
    growth : A ≥ 0, what an e-fold of rest adds to static friction; 0.01 to 0.02 of the normal force per decade for rock.
    onset : t_c > 0, the rest after which the logarithm sets in; about 1 s for rock.

    Source: Dieterich, J. Geophysical Research 77 (1972) 3690.

    >>> round(LogarithmicDwell(kinetic=0.5, growth=0.1, onset=1.0).break_away_force(1.718281828459045), 12)
    0.6
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"kinetic": 0.5, "growth": 0.1, "onset": 0.5}
    UNITS: ClassVar[dict[str, str]] = {"kinetic": "force", "growth": "force", "onset": "time"}

    kinetic: float
    growth: float
    onset: float


@dataclass(frozen=True)
class ForceRate(Law):
    """f_s(t_s, δ) = f_k + Δ∞ (1 − exp(−γ t_s^m)) / (1 + (δ/δ₀)^q) at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    kinetic : kinetic force f_k ≥ 0.
    limit : Δ∞ ≥ 0, growth of static friction after an infinite rest at a vanishing force rate.
    rate : γ > 0, in 1/time^m.
    force_rate_scale : δ₀ > 0, the force rate that halves the growth, in force/time.
    exponent : m > 0.
    force_rate_exponent : q > 0.

    Source: that static friction falls with the rate of loading was found by Johannes, Green & Brockley, Wear 24 (1973) 381;
    the form of the fall is our own, with δ₀ → ∞ it is :class:`DwellTime`.

    >>> law = ForceRate(kinetic=0.5, limit=0.5, rate=0.4, force_rate_scale=0.3)
    >>> law.break_away_force(float(10**6), [0.0, 0.3])
    array([1.  , 0.75])
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"kinetic": 0.5, "limit": 0.5, "rate": 0.4, "force_rate_scale": 0.3}
    UNITS: ClassVar[dict[str, str]] = {
        "kinetic": "force", "limit": "force", "rate": "time^-exponent", "force_rate_scale": "force time^-1",
        "exponent": "", "force_rate_exponent": "",
    }  # fmt: skip

    kinetic: float
    limit: float
    rate: float
    force_rate_scale: float
    exponent: float = 1.0
    force_rate_exponent: float = 1.0


@dataclass(frozen=True)
class Tabulated(Law):
    """F(|w|) and f_s(t_s) as they were measured: linear between nodes, constant beyond the last.

    Parameters
    ----------
    kinetic : kinetic force ≥ 0, a number or nodes (slip speed, force), the first at slip speed 0.
    break_away : break-away force, a number or nodes (stick time, force), the first at stick time 0; at least the kinetic
        force at slip speed 0, and never falling, as friction that ages does not.

    >>> law = Tabulated(kinetic=[(0, 0.8), (0.2, 0.6)], break_away=[(0, 0.8), (1, 0.9), (10, 1.0)])
    >>> law.kinetic_force([0.1, 5.0]), law.break_away_force([0.5, 1e9])
    (array([0.7, 0.6]), array([0.85, 1.  ]))
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {
        "kinetic": [(0, 0.9), (0.1, 0.7), (0.3, 0.6), (0.6, 0.65)],
        "break_away": [(0, 0.9), (0.5, 1.0), (2, 1.1), (6, 1.15)],
    }
    UNITS: ClassVar[dict[str, str]] = {"kinetic": "velocity, force", "break_away": "time, force"}

    kinetic: float | tuple[Point, ...]
    break_away: float | tuple[Point, ...]


@dataclass(frozen=True)
class TwoBranch(Law):
    """F = f₊(|w|) while |w| rises, f₋(|w|) while it falls, each with the sign of w; |F| ≤ f_s at rest.

    Parameters
    ----------
    rising : f₊, a number or nodes (slip speed, force), the first at slip speed 0; constant beyond the last.
    falling : f₋, likewise.
    break_away : f_s, at least both branches at slip speed 0.

    The branches need not meet. Where f₋ < f₊ neither is consistent with a balance of forces between them: there ẇ = 0 and
    friction is the reaction that keeps it so (an event of the kind ``hold``, ended by a ``reversal``). Where f₋ > f₊ both
    are consistent in between; the motion stays on its branch until ẇ vanishes there, then ẇ jumps.

    Source: Hunt, Torbe & Spencer, Wear 8 (1965) 455; Powell & Wiercigroch (1992).

    Limits: |w| alone decides, so nothing is remembered of how far the last turn was. :func:`force_along` keeps the branch
    where the measured w stays constant.

    >>> law = TwoBranch(rising=1.0, falling=[(0, 0.8), (0.5, 1.0)], break_away=1.1)
    >>> force_along(law, range(4), [0.0, 0.25, 0.5, 0.25], [True, False, False, False])
    array([1.1, 1. , 1. , 0.9])
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {
        "rising": [(0, 1), (0.6, 0.7)],
        "falling": [(0, 0.6), (0.6, 0.7)],
        "break_away": 1.0,
    }
    UNITS: ClassVar[dict[str, str]] = {"rising": "velocity, force", "falling": "velocity, force", "break_away": "force"}

    rising: float | tuple[Point, ...]
    falling: float | tuple[Point, ...]
    break_away: float
