"""Friction laws with an internal state: smooth everywhere, stiff, without adhesion proper.

Such a law says what force slip at velocity w and state z produces and how fast z changes, :meth:`StateLaw.rates`. The core
has these right-hand sides; the motion is integrated by :func:`stickslip.integrate`, which :func:`stickslip.simulate` calls.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.documents import did_you_mean
from stickslip.errors import InputError
from stickslip.law import Law


class StateLaw(Law, family=True):
    """What the laws with an internal state have in common."""

    #: No closed form: the motion is integrated.
    SMOOTH: ClassVar[bool] = True

    @cached_property
    def _read(self) -> _core.StateLaw:
        return _core.StateLaw(self.to_json())

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_read"}

    @property
    def has_state(self) -> bool:
        """Whether there is a state at all; a :class:`Regularised` law has none."""
        return self._read.has_state

    def rates(self, w: ArrayLike, state: ArrayLike = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The friction force and the rate of the state.

        Parameters
        ----------
        w : slip velocity, any shape.
        state : z, same shape or a number.

        Returns
        -------
        force, rate : F(w, z) with the sign it has on the mass, and dz/dt, of that shape.

        >>> force, rate = LuGre(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3).rates(0.0, 1e-5)
        >>> float(force), float(rate)
        (1.0, 0.0)
        """
        slip, z = np.broadcast_arrays(np.asarray(w, float), np.asarray(state, float))
        force, rate = self._read.rates(np.ascontiguousarray(slip.ravel()), np.ascontiguousarray(z.ravel()))
        return force.reshape(slip.shape), rate.reshape(slip.shape)

    def steady_state(self, w: ArrayLike) -> Any:
        """The state of steady slip at velocity w; for w = 0 that of a contact that was never loaded."""
        slip = np.asarray(w, float)
        state = self._read.steady(np.ascontiguousarray(slip.ravel())).reshape(slip.shape)
        return state if slip.ndim else float(state)

    def state_scale(self, speed: float) -> float:
        """The size of the state in slip at that speed, by which an integrator measures its errors."""
        return abs(self.steady_state(speed)) or 1.0

    def kinetic_force(self, w: ArrayLike) -> Any:
        """Friction in steady slip at velocity w, with the sign of w.

        >>> Dahl(stiffness=2.0, kinetic=0.5).kinetic_force([-0.1, 0.2])
        array([-0.5,  0.5])
        """
        slip = np.asarray(w, float)
        force, _ = self.rates(slip, self.steady_state(slip))
        return force if slip.ndim else float(force)

    def break_away_force(self, stick_time: ArrayLike = 0.0, force_rate: ArrayLike = 0.0) -> Any:
        """Refused: adhesion is a state here, and how much it bears depends on how it is loaded."""
        del stick_time, force_rate
        raise InputError(
            f"{type(self).__name__}: has no break-away force, as adhesion is a state of the law; "
            "simulate, or follow a motion with force_along"
        )

    def follow(self, t: ArrayLike, w: ArrayLike, state: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Force and state along a prescribed motion.

        Parameters
        ----------
        t, w : time (not falling) and slip velocity, shape (n,); w is linear between samples.
        state : z at the first sample.

        Returns
        -------
        force, state : shape (n,).

        Between samples the state is advanced at the mean slip velocity, exactly for :class:`Dahl`, :class:`LuGre` and
        :class:`RateState`; the error of that is of second order in the change of w between samples, and none where w is
        constant. A jump of w is two samples at one time.

        >>> force, _ = Dahl(stiffness=2.0, kinetic=1.0).follow([0, 1], [0.25, 0.25])
        >>> bool(abs(force[1] - (1 - np.exp(-0.5))) < 1e-15)
        True
        """
        times, slip = np.ascontiguousarray(t, float), np.ascontiguousarray(w, float)
        for name, values in (("t", times), ("w", slip)):
            if not np.isfinite(values).all():
                raise InputError(f"follow: {name} must be finite, got {values[~np.isfinite(values)][0]}")
        if (np.diff(times) < 0).any():
            raise InputError("follow: t must not fall; sort the samples by time")
        try:
            return self._read.follow(times, slip, float(state))
        except ValueError as error:
            raise InputError(f"follow: {error}") from None

    def _along(
        self, t: NDArray[np.float64], w: NDArray[np.float64], stuck: NDArray[np.bool_], rate: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        del rate
        return self.follow(t, np.where(stuck, 0.0, w))[0]


def _one_of(law: Law, name: str, known: tuple[str, ...]) -> None:
    value = getattr(law, name)
    if value not in known:
        hint = did_you_mean(str(value), known)
        raise InputError(f"{type(law).__name__}: {name} must be one of {', '.join(known)}, got {value!r}{hint}")


@dataclass(frozen=True)
class Dahl(StateLaw):
    """dF/dx = σ |1 − (F/f_k) sgn w|^i sgn(1 − (F/f_k) sgn w): friction that yields like a strained solid.

    Parameters
    ----------
    stiffness : σ > 0, at F = 0.
    kinetic : f_k > 0, friction of steady slip.
    exponent : i > 0: 1 as a rule, below for brittle, above for ductile contacts.

    The state is F. Rate-independent: time does not matter, only the path.

    Limits: no static friction above kinetic, hence no stick-slip; no drift only for i < 1.

    Source: Dahl, Aerospace Corporation TOR-158(3107-18) (1968).

    >>> Dahl(stiffness=2.0, kinetic=1.0).rates(1.0, 0.5)
    (array(0.5), array(1.))
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"stiffness": 4.0, "kinetic": 1.0}
    UNITS: ClassVar[dict[str, str]] = {"stiffness": "stiffness", "kinetic": "force", "exponent": ""}

    stiffness: float
    kinetic: float
    exponent: float = 1.0


@dataclass(frozen=True)
class Bristles(StateLaw, family=True):
    """The parameters of laws whose contacts are bristles; :class:`LuGre` says what they are."""

    EXAMPLE: ClassVar[dict[str, Any]] = {
        "stiffness": 100.0, "damping": 2.0, "viscous": 0.1, "kinetic": 1.0, "break_away": 1.5, "scale": 0.1,
    }  # fmt: skip
    UNITS: ClassVar[dict[str, str]] = {
        "stiffness": "stiffness", "damping": "damping", "viscous": "damping", "kinetic": "force", "break_away": "force",
        "scale": "velocity", "exponent": "",
    }  # fmt: skip

    stiffness: float
    damping: float
    viscous: float
    kinetic: float
    break_away: float
    scale: float
    exponent: float = 2.0


@dataclass(frozen=True)
class LuGre(Bristles):
    """ż = w − σ₀ |w| z/g(w), F = σ₀ z + σ₁ ż + σ₂ w, g(w) = f_k + (f_s − f_k) exp(−|w/w_s|^n).

    Parameters
    ----------
    stiffness, damping : σ₀ > 0 and σ₁ ≥ 0 of the bristles.
    viscous : σ₂ ≥ 0.
    kinetic, break_away : f_k, f_s > 0, friction of fast and of vanishing steady slip.
    scale : w_s > 0.
    exponent : n > 0, 2 as a rule.

    The state z is the mean deflection of the bristles. For σ₀ → ∞ it is static and kinetic friction with Stribeck's curve.

    Limits: a stuck contact drifts under loads that oscillate below break-away (:class:`ElastoPlastic` does not); with a
    constant σ₁ the model feeds energy at high slip velocities (Barabanov & Ortega, IEEE TAC 45 (2000) 675).

    Source: Canudas de Wit, Olsson, Åström & Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419.

    >>> law = LuGre(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3)
    >>> round(law.kinetic_force(1e-9), 6), round(law.kinetic_force(0.1), 6)
    (1.5, 1.04)
    """


@dataclass(frozen=True)
class ElastoPlastic(Bristles):
    """ż = w (1 − α z/z∞), F = σ₀ z + σ₁ ż + σ₂ w: LuGre's bristles, purely elastic below a force.

    Parameters
    ----------
    stiffness, damping, viscous, kinetic, break_away, scale, exponent : as for :class:`LuGre`; z∞ = g(w) sgn w/σ₀.
    elastic : by name, the force σ₀ z_e up to which the contact is purely elastic, 0 ≤ elastic < min(f_k, f_s).

    α = 0 where |z| ≤ z_e or z and w differ in sign, 1 where |z| ≥ |z∞|, half a sine wave between.

    Source: Dupont, Hayward, Armstrong & Altpeter, IEEE Trans. Automatic Control 47 (2002) 787.

    >>> law = ElastoPlastic(1e5, 316.0, 0.4, kinetic=1.0, break_away=1.5, scale=1e-3, elastic=0.9)
    >>> law.rates(1e-4, 0.5e-5)[1]
    array(0.0001)
    """

    EXAMPLE: ClassVar[dict[str, Any]] = Bristles.EXAMPLE | {"elastic": 0.8}
    UNITS: ClassVar[dict[str, str]] = Bristles.UNITS | {"elastic": "force"}

    elastic: float = field(kw_only=True)


@dataclass(frozen=True)
class BoucWen(StateLaw):
    """ż = A w − β |w| |z|^(n−1) z − γ w |z|^n, F = k z.

    Parameters
    ----------
    stiffness : k > 0.
    beta, gamma : β > 0 in 1/length^n, −β < γ ≤ β.
    exponent : n ≥ 1.
    amplitude : A > 0, 1 as a rule.

    Steady slip has F = k (A/(β + γ))^(1/n). Rate-independent. With n = 1, γ = 0 and β = k/f_k it is :class:`Dahl`.

    Limits: a loop that does not close under small cycles drifts (Thyagarajan & Iwan 1990).

    Source: Bouc (1967) for n = 1; Wen, J. Engineering Mechanics Division ASCE 102 (1976) 249.

    >>> BoucWen(stiffness=2.0, beta=3.0, gamma=1.0, exponent=2).kinetic_force(0.1)
    1.0
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {"stiffness": 4.0, "beta": 8.0, "gamma": 4.0, "exponent": 2.0}
    UNITS: ClassVar[dict[str, str]] = {
        "stiffness": "stiffness",
        "beta": "length^-exponent",
        "gamma": "length^-exponent",
        "exponent": "",
        "amplitude": "",
    }

    stiffness: float
    beta: float
    gamma: float
    exponent: float = 1.0
    amplitude: float = 1.0


@dataclass(frozen=True)
class RateState(StateLaw):
    """F = N a asinh((w/2V₀) exp((μ₀ + b ψ)/a)), ψ = ln(V₀ θ/L): friction of rock.

    Parameters
    ----------
    normal_force : N > 0.
    a, b : direct and evolution effect, a > 0; steady slip weakens with velocity where b > a.
    length : L > 0 (D_c), the slip over which the state evolves.
    reference_velocity : V₀ > 0.
    reference_friction : μ₀ > 0, of steady slip at V₀.
    law : ``"aging"``: θ̇ = 1 − |w| θ/L; ``"slip"``: θ̇ = −(|w| θ/L) ln(|w| θ/L).

    The state is ψ, 0 in steady slip at V₀. For |w| ≫ V₀ exp(−μ₀/a), F = N (μ₀ + a ln(|w|/V₀) + b ψ) sgn w; the inverse
    hyperbolic sine carries that through w = 0.

    Source: Dieterich, J. Geophysical Research 84 (1979) 2161; Ruina, ibid. 88 (1983) 10359; Rice, Lapusta & Ranjith,
    J. Mechanics and Physics of Solids 49 (2001) 1865.

    Limits: steady slip on a spring k is unstable for k < N (b − a)/L (1 + m V₀²/(N a L)).

    >>> law = RateState(normal_force=1e7, a=0.01, b=0.015, length=1e-5, reference_velocity=1e-6)
    >>> round(law.kinetic_force(1e-6) / 1e7, 12)
    0.6
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {
        "normal_force": 1.0, "a": 0.01, "b": 0.015, "length": 1.0, "reference_velocity": 1.0,
    }  # fmt: skip
    UNITS: ClassVar[dict[str, str]] = {
        "normal_force": "force", "a": "", "b": "", "length": "length", "reference_velocity": "velocity",
        "reference_friction": "", "law": "",
    }  # fmt: skip

    normal_force: float
    a: float
    b: float
    length: float
    reference_velocity: float
    reference_friction: float = 0.6
    law: str = "aging"

    def state_scale(self, speed: float) -> float:
        """1, as the state is a logarithm."""
        del speed
        return 1.0

    def __post_init__(self) -> None:
        _one_of(self, "law", ("aging", "slip"))
        super().__post_init__()


@dataclass(frozen=True)
class Regularised(StateLaw):
    """F = s(w/width) f(|w|): a memoryless law with a smooth sign, to compare with codes that smooth it.

    Parameters
    ----------
    law : any law without memory, of which the kinetic force f is used; its break-away force is lost.
    width : slip velocity over which the sign changes, > 0.
    shape : ``"arctan"``: s(y) = (2/π) arctan y; ``"tanh"``: s(y) = tanh y.

    Limits: it creeps where the law would stick, and the period of its stick-slip is wrong: for ``Rational(1, 3)`` on a drive
    of velocity 0.2 by 6 % at width 1e-3 and by 0.1 % at 1e-6. It is no substitute for the law itself.

    >>> from stickslip.laws import Coulomb
    >>> Regularised(Coulomb(0.5), width=1e-3).kinetic_force(1e-3)
    0.25
    """

    EXAMPLE: ClassVar[dict[str, Any]] = {
        "law": {"type": "Rational", "break_away": 1.0, "weakening": 3.0},
        "width": 0.05,
    }
    UNITS: ClassVar[dict[str, str]] = {"law": "law", "width": "velocity", "shape": ""}

    law: Law
    width: float
    shape: str = "arctan"

    def __post_init__(self) -> None:
        if isinstance(self.law, Mapping):
            object.__setattr__(self, "law", Law.from_dict(self.law, "Regularised: law"))
        if not isinstance(self.law, Law) or isinstance(self.law, StateLaw):
            raise InputError(
                f"Regularised: law must be a memoryless friction law such as stickslip.laws.Coulomb, got {self.law!r}"
            )
        _one_of(self, "shape", ("arctan", "tanh"))
        super().__post_init__()
