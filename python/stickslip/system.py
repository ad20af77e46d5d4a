"""What moves: the oscillator, its forcing, and the document that holds them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from stickslip import _core
from stickslip.documents import check_keys, number, read_toml
from stickslip.errors import InputError
from stickslip.law import Law, Table, load_law


@dataclass(frozen=True)
class Harmonic(Table):
    """A harmonic force, amplitude · cos(frequency · t + phase).

    Parameters
    ----------
    amplitude : in the unit of force (dimensionless: the paper's u₀).
    frequency : angular frequency Ω > 0 in 1/time (the paper's η).
    phase : in rad.

    Source: Eq. (10) of the paper, phase 0.

    >>> Harmonic(0.1, 1.25)
    Harmonic(amplitude=0.1, frequency=1.25, phase=0.0)
    """

    amplitude: float
    frequency: float
    phase: float = 0.0


@dataclass(frozen=True)
class Oscillator:
    """One mass on a spring and a damper that rubs on a drive: m ẍ + D ẋ + k x = F(w, memory) + Σ A cos(Ω t + φ).

    x is measured from the equilibrium of the moving drive, w = s − ẋ is the slip velocity, and friction on the mass has the
    sign of w. All values are dimensionless (mass = stiffness = 1) or all in SI.

    Parameters
    ----------
    damping : D ≥ 0.
    drive_velocity : s, any sign.
    law : friction between mass and drive.
    mass : m > 0.
    stiffness : k > 0.
    forcing : None, one :class:`Harmonic` or up to four.

    Raises
    ------
    InputError
        for a value that makes no sense.

    Source: Eqs. (1), (6) and (10) of the paper.

    >>> from stickslip.laws import StaticKinetic
    >>> oscillator = Oscillator(damping=0.1, drive_velocity=0.2, law=StaticKinetic(1.0, 0.6))
    >>> Oscillator.from_dict(oscillator.to_dict()) == oscillator
    True
    """

    damping: float
    drive_velocity: float
    law: Law
    mass: float = 1.0
    stiffness: float = 1.0
    forcing: Harmonic | tuple[Harmonic, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("damping", "drive_velocity", "mass", "stiffness"):
            object.__setattr__(self, name, number(name, getattr(self, name), "Oscillator"))
        if not isinstance(self.law, Law):
            raise InputError(f"Oscillator: law must be a friction law such as stickslip.laws.Coulomb, got {self.law!r}")
        if isinstance(self.forcing, list | tuple):
            forcing = tuple(self.forcing)
            object.__setattr__(self, "forcing", forcing[0] if len(forcing) == 1 else forcing or None)
        for harmonic in self.harmonics:
            if not isinstance(harmonic, Harmonic):
                raise InputError(f"Oscillator: forcing must be a Harmonic or several, got {harmonic!r}")
        try:
            _core.check_oscillator(self.to_json())
        except ValueError as error:
            raise InputError(f"Oscillator: {error}") from None

    @property
    def harmonics(self) -> tuple[Harmonic, ...]:
        """The forcing as a tuple, empty where there is none."""
        if self.forcing is None:
            return ()
        return self.forcing if isinstance(self.forcing, tuple) else (self.forcing,)

    @property
    def natural_period(self) -> float:
        """2π √(m/k)."""
        return float(2 * 3.141592653589793 * (self.mass / self.stiffness) ** 0.5)

    def to_dict(self) -> dict[str, Any]:
        """The system document."""
        document: dict[str, Any] = {
            "mass": self.mass,
            "stiffness": self.stiffness,
            "damping": self.damping,
            "drive_velocity": self.drive_velocity,
            "law": self.law.to_dict(),
        }
        if isinstance(self.forcing, Harmonic):
            document["forcing"] = self.forcing.to_dict()
        elif self.forcing:
            document["forcing"] = [harmonic.to_dict() for harmonic in self.forcing]
        return document

    @classmethod
    def from_dict(cls, table: Mapping[str, Any], where: str = "system") -> Oscillator:
        """An oscillator from a system document; `where` names it in error messages."""
        required = ("mass", "stiffness", "damping", "drive_velocity", "law")
        check_keys(table, (*required, "forcing"), required, where)
        forcing = table.get("forcing", [])
        harmonics = [
            Harmonic.from_dict(item, f"{where}: forcing")
            for item in (forcing if isinstance(forcing, list | tuple) else [forcing])
        ]
        law = table["law"]
        try:
            return cls(
                damping=table["damping"],
                drive_velocity=table["drive_velocity"],
                law=law if isinstance(law, Law) else Law.from_dict(law, f"{where}: law"),
                mass=table["mass"],
                stiffness=table["stiffness"],
                forcing=tuple(harmonics),
            )
        except InputError as error:
            if str(error).startswith("Oscillator: "):
                raise InputError(f"{where}: {str(error).removeprefix('Oscillator: ')}") from None
            raise

    def to_json(self) -> str:
        """The document for the core; floats survive to the bit."""
        law = json.loads(self.law.to_json())
        forcing = [harmonic.to_dict() for harmonic in self.harmonics]
        return json.dumps(self.to_dict() | {"law": law, "forcing": forcing})

    def to_toml(self) -> str:
        """The system document as TOML; floats survive to the bit."""
        return tomli_w.dumps(self.to_dict())


def load_system_document(path: str | Path) -> tuple[Oscillator, dict[str, Any]]:
    """The oscillator of a system file and its table ``[simulation]`` (t_end, x0, v0, max_events; may be empty)."""
    document = read_toml(path)
    simulation = document.pop("simulation", {})
    check_keys(simulation, ("t_end", "x0", "v0", "max_events"), (), f"{path}: simulation")
    if isinstance(document.get("law"), str):
        document["law"] = load_law(Path(path).parent / document["law"])
    return Oscillator.from_dict(document, str(path)), simulation


def load_system(path: str | Path) -> Oscillator:
    """The oscillator of a system file.

    ``law`` is a table, or the path of a law file relative to the system file.

    Raises
    ------
    InputError
        with the file and the key.
    """
    return load_system_document(path)[0]
