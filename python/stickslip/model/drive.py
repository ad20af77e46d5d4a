"""What drives and presses: a velocity that is constant or varies, harmonic force, a normal force that varies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from stickslip.errors import InputError
from stickslip.files.schema import Document, Limits, Point
from stickslip.files.units import TEXTS


def several(document: Document, name: str) -> None:
    """Make a tuple of what stands alone under a name of a document."""
    value = getattr(document, name)
    object.__setattr__(document, name, value if isinstance(value, tuple) else (value,))


@dataclass(frozen=True)
class Harmonic(Document):
    """A harmonic force, amplitude · cos(frequency · t + phase); at the frequency 0 it is constant.

    Parameters
    ----------
    amplitude : in the unit of what it is part of: a force (dimensionless: the paper's u₀), in a :class:`Drive` a velocity.
    frequency : angular frequency Ω ≥ 0 in 1/time (the paper's η); 0 is a constant force, such as weight on an incline.
    phase : in rad.

    Source: Eq. (10) of the paper, phase 0.

    >>> Harmonic(0.1, 1.25)
    Harmonic(amplitude=0.1, frequency=1.25, phase=0.0)
    >>> Harmonic.constant(9.81)
    Harmonic(amplitude=9.81, frequency=0.0, phase=0.0)
    """

    BY_CONTEXT: ClassVar[tuple[str, ...]] = ("amplitude",)

    amplitude: Annotated[float, Limits(dimensions=(*TEXTS["force"], *TEXTS["velocity"], "ratio"))]
    frequency: Annotated[float, Limits(dimensions=TEXTS["time^-1"])]
    phase: Annotated[float, Limits(dimensions=("angle",))] = 0.0

    @classmethod
    def constant(cls, force: float) -> Self:
        """A force that does not vary."""
        return cls(force, 0.0)


#: Several, or one.
Harmonics = Annotated[tuple[Harmonic, ...], Harmonic | tuple[Harmonic, ...]]


@dataclass(frozen=True)
class Drive(Document):
    """A drive velocity that varies: s(t) = velocity + Σ A cos(Ω t + φ) + table(t).

    Parameters
    ----------
    velocity : the constant part s₁.
    harmonics : :class:`Harmonic` or several, whose amplitudes are velocities.
    nodes : pairs (t, s) of a table, linear between them and constant beyond; t increasing.

    The paper's Eq. (8), S = S₁ + Ω U₀ cos Ω τ, is ``Drive(S1, Harmonic(Omega * U0, Omega))``, or :meth:`shaken`. It is the
    motion of an oscillator with a constant drive and a harmonic force: with y = x − U₀ sin Ω t the slip velocity is
    S₁ − ẏ and m ÿ + D ẏ + k y = F − U₀ [(k − m Ω²) sin Ω t + D Ω cos Ω t], a force of the amplitude
    U₀ √((k − m Ω²)² + (D Ω)²). The force of Eqs. (9) and (10), k U₀ cos Ω τ, is its limit for slow shaking, but for a quarter
    of a period; for Eq. (10) as printed use `forcing=Harmonic(u0, eta)`.

    >>> Drive.ramp(0.0, 0.5, duration=10.0)
    Drive(velocity=0.0, harmonics=(), nodes=((0.0, 0.0), (10.0, 0.5)))
    """

    velocity: Annotated[float, Limits(dimensions=TEXTS["velocity"])] = 0.0
    harmonics: Harmonics = ()
    nodes: tuple[Point, ...] = ()

    @classmethod
    def dimensions(cls, name: str) -> tuple[tuple[str, ...], ...]:
        """Those of a node, time and velocity, and of a harmonic."""
        return {"nodes": (TEXTS["time"], TEXTS["velocity"]), "harmonics": (TEXTS["velocity"],)}.get(name, ())

    def __post_init__(self) -> None:
        super().__post_init__()
        several(self, "harmonics")

    @classmethod
    def shaken(cls, velocity: float, displacement: float, frequency: float) -> Self:
        """The paper's Eq. (8): S₁ + Ω U₀ cos Ω τ for `velocity` S₁, `displacement` U₀ and `frequency` Ω."""
        return cls(velocity, (Harmonic(frequency * displacement, frequency),))

    @classmethod
    def ramp(cls, start: float, end: float, duration: float) -> Self:
        """From one velocity to another at a constant rate, from t = 0 on."""
        return cls(nodes=((0.0, start), (duration, end)))

    @classmethod
    def table(cls, t: ArrayLike, velocity: ArrayLike) -> Self:
        """Linear between given times."""
        times, values = np.asarray(t, float), np.asarray(velocity, float)
        if times.ndim != 1 or times.shape != values.shape:
            raise InputError(f"Drive: t and velocity must have one length, got {times.shape} and {values.shape}")
        return cls(nodes=tuple(zip(times.tolist(), values.tolist(), strict=True)))

    @property
    def fastest(self) -> float:
        """A bound of |s|."""
        waves = sum(abs(wave.amplitude) for wave in self.harmonics)
        return abs(self.velocity) + waves + max((abs(node[1]) for node in self.nodes), default=0.0)

    def at(self, t: ArrayLike) -> Any:
        """The drive velocity at times.

        >>> float(Drive.shaken(0.3, 0.1, 2.0).at(0.0))
        0.5
        """
        times = np.asarray(t, float)
        s = np.full(times.shape, self.velocity)
        for harmonic in self.harmonics:
            s = s + harmonic.amplitude * np.cos(harmonic.frequency * times + harmonic.phase)
        if self.nodes:
            nodes = np.asarray(self.nodes)
            s = s + np.interp(times, nodes[:, 0], nodes[:, 1])
        return s


@dataclass(frozen=True)
class NormalForce(Document):
    """A normal force that varies, over that of the law: n = constant + Σ A cos(Ω t + φ) + position · x + velocity · ẋ ≥ 0.

    Friction at rest and in motion is n times that of the law: |F| ≤ n f_s, F = n f(w). Where the sum is negative n is 0: the
    bodies part (event ``"parting"``) without friction until they meet again (event ``"meeting"``). With a law per unit of
    normal force, a coefficient of friction, n is the normal force itself.

    Parameters
    ----------
    constant : n₀, a pure number; 1 by default.
    harmonics : :class:`Harmonic` or several, whose amplitudes are pure numbers.
    position : ∂n/∂x in 1/length, x of the mass; for a contact of two masses x of the mass less that of the other.
    velocity : ∂n/∂ẋ in 1/velocity, likewise.

    Limits: laws that follow the force rate or the sign of the slip acceleration, and contacts that close a loop, are refused:
    what they do under a varying normal force is not known.

    Source: for n(x) B. F. Feeny and F. C. Moon, J. Sound Vib. 170 (1994) 303.

    >>> float(NormalForce(position=1.5).at(0.0, x=-0.2)), float(NormalForce(position=1.5).at(0.0, x=-1.0))
    (0.7, 0.0)
    """

    constant: float = 1.0
    harmonics: Harmonics = ()
    position: Annotated[float, Limits(dimensions=TEXTS["length^-1"])] = 0.0
    velocity: Annotated[float, Limits(dimensions=TEXTS["velocity^-1"])] = 0.0

    @classmethod
    def dimensions(cls, name: str) -> tuple[tuple[str, ...], ...]:
        """That of a harmonic: none."""
        return (("ratio",),) if name == "harmonics" else ()

    def __post_init__(self) -> None:
        super().__post_init__()
        several(self, "harmonics")

    def at(self, t: ArrayLike, x: ArrayLike = 0.0, v: ArrayLike = 0.0) -> Any:
        """n at times, positions and velocities."""
        n = self.constant + self.position * np.asarray(x, float) + self.velocity * np.asarray(v, float)
        for harmonic in self.harmonics:
            n = n + harmonic.amplitude * np.cos(harmonic.frequency * np.asarray(t, float) + harmonic.phase)
        return np.maximum(n, 0.0)
