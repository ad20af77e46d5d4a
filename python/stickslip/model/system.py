"""What moves: the oscillator, systems of masses, and the document that holds them."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from stickslip import _core
from stickslip.errors import InputError, whole_number
from stickslip.files.schema import Convert, Document, Kind, Limits, Point, Says
from stickslip.files.units import TEXTS, quantity
from stickslip.laws.law import Law
from stickslip.laws.numbers import replaced
from stickslip.laws.state_law import StateLaw
from stickslip.model.drive import Drive, Harmonic, NormalForce, several

Velocity = Annotated[float, Limits(dimensions=TEXTS["velocity"], extreme=True)]


class Described(Document):
    """What the core knows by a document, which it reads and checks once."""

    @classmethod
    def dimensions(cls, name: str) -> tuple[tuple[str, ...], ...]:
        """That of a harmonic of the forcing."""
        return (TEXTS["force"],) if name == "forcing" else ()

    def to_json(self) -> str:
        """The document for the core; floats survive to the bit."""
        raise NotImplementedError

    @cached_property
    def core(self) -> _core.System:
        """What the core has read."""
        return _core.System(self.to_json())

    def with_number(self, name: str, value: float) -> Self:
        """The same with another number, such as ``drive_velocity`` or ``law.kinetic``: no document is made for it.

        >>> from dataclasses import replace
        >>> from stickslip import paper
        >>> paper.oscillator(0.3).with_number("damping", 0.1) == replace(paper.oscillator(0.3), damping=0.1)
        True
        """
        name = usual_name(name)
        try:
            core = self.core.with_number("/" + name.replace(".", "/"), value)
        except ValueError as error:
            raise InputError(f"{type(self).__name__}: {error}") from None
        twin = self
        for path in paths_of(name, self.driven):
            twin = replaced(twin, [int(key) if key.isdigit() else key for key in path.split(".")], float(value))
        vars(twin)["core"] = core
        return twin

    @property
    def driven(self) -> list[int] | None:
        """Of a system of masses the contacts on a drive, by their numbers."""
        return None


def usual_name(name: str) -> str:
    """The name of a number with the place of the force, where it names none: the first."""
    first, _, rest = name.partition(".")
    return f"forcing.0.{rest}" if first == "forcing" and rest and not rest.split(".")[0].isdigit() else name


def paths_of(name: str, driven: Sequence[int] | None) -> list[str]:
    """Where the number of a name stands in a document: ``drive_velocity`` of masses at every contact on a drive.

    >>> paths_of("drive_velocity", [0, 2]), paths_of("damping", None)
    (['contacts.0.drive_velocity', 'contacts.2.drive_velocity'], ['damping'])
    """
    if driven is None or name != "drive_velocity":
        return [name]
    return [f"contacts.{i}.drive_velocity" for i in driven]


@dataclass(frozen=True)
class Oscillator(Described):
    """One mass on a spring and a damper that slides on a drive: m ẍ + D ẋ + k x = F(w, memory) + Σ A cos(Ω t + φ).

    x is measured from the equilibrium of the moving drive, w = s − ẋ is the slip velocity, and friction on the mass has the
    sign of w. All values are dimensionless (mass = stiffness = 1) or all in SI.

    Parameters
    ----------
    damping : D ≥ 0.
    drive_velocity : s, any sign, or a :class:`Drive`.
    law : friction between mass and drive.
    mass : m > 0; 0 under a :class:`~stickslip.laws.RateState`, whose friction then balances the load at every time.
    stiffness : k > 0.
    forcing : None, one :class:`Harmonic` or up to four, and constant ones.
    normal_force : a :class:`NormalForce` that varies; None: always that of the law.
    springs : :class:`Spring` or several, beside the linear one.

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

    # A document says its numbers: in SI a mass of 1 would be a guess.
    REQUIRED: ClassVar[tuple[str, ...]] = ("mass", "stiffness")

    damping: Annotated[float, Limits(dimensions=TEXTS["damping"], extreme=True)]
    # A number in nearly all uses, so that nobody has to ask which it is; a Drive goes to the general engine.
    drive_velocity: Annotated[Any, Velocity | Drive]
    law: Law
    mass: Annotated[float, Limits(dimensions=TEXTS["mass"], extreme=True)] = 1.0
    stiffness: Annotated[float, Limits(dimensions=TEXTS["stiffness"], extreme=True)] = 1.0
    forcing: Harmonic | tuple[Harmonic, ...] | None = None
    normal_force: NormalForce | None = None
    springs: Annotated[Any, Spring | tuple[Spring, ...]] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        several(self, "springs")
        if isinstance(self.forcing, tuple):
            object.__setattr__(self, "forcing", self.forcing[0] if len(self.forcing) == 1 else self.forcing or None)
        try:
            self.core  # noqa: B018 - what it reads, it checks
        except InputError as error:
            raise InputError(f"Oscillator: {str(error).removeprefix('System: ')}") from None
        except ValueError as error:
            raise InputError(f"Oscillator: {error}") from None

    @property
    def masses(self) -> int:
        """One."""
        return 1

    @cached_property
    def contacts(self) -> tuple[Contact, ...]:
        """The one contact, as that of a system."""
        return (Contact(0, self.law, self.drive_velocity, normal_force=self.normal_force),)

    @property
    def harmonics(self) -> tuple[Harmonic, ...]:
        """The forcing as a tuple, empty where there is none."""
        if self.forcing is None:
            return ()
        return self.forcing if isinstance(self.forcing, tuple) else (self.forcing,)

    @property
    def swings(self) -> list[Harmonic | Force]:
        """What varies with time at a frequency: forces, then the drive, then the normal force."""
        return _swings(self.harmonics, self.contacts)

    @property
    def integrated(self) -> bool:
        """Whether the law has an internal state or a smooth sign, so that nothing sticks and the motion is integrated."""
        return isinstance(self.law, StateLaw)

    @property
    def closed_form(self) -> bool:
        """Whether the motion between events is closed: a constant drive, a law of linear pieces, no undamped resonance."""
        varies = isinstance(self.drive_velocity, Drive) or self.normal_force is not None
        if varies or self.springs or self.law.SMOOTH:
            return False
        return self.forcing is None or not self.core.resonates()

    def to_system(self) -> System:
        """The same as a system of one mass."""
        forcing = tuple(Force(item.amplitude, item.frequency, item.phase) for item in self.harmonics)
        return System(
            mass=[[self.mass]],
            stiffness=[[self.stiffness]],
            damping=[[self.damping]],
            contacts=self.contacts,
            forcing=forcing,
            springs=self.springs,
        )

    @property
    def natural_period(self) -> float:
        """2π √(m/k); without mass 2π over the rate at which the law's state comes to that of steady slip."""
        if not self.mass:
            return self.to_system().natural_period
        return float(2 * 3.141592653589793 * (self.mass / self.stiffness) ** 0.5)

    def to_json(self) -> str:
        """The document for the core; floats survive to the bit."""
        law = json.loads(self.law.to_json())
        forcing = [harmonic.to_dict() for harmonic in self.harmonics]
        return json.dumps(self.to_dict() | {"law": law, "forcing": forcing})


def _swings(forces: Sequence[Harmonic | Force], contacts: Sequence[Contact]) -> list[Harmonic | Force]:
    drives = (contact.drive_velocity.harmonics for contact in contacts if isinstance(contact.drive_velocity, Drive))
    normals = (contact.normal_force.harmonics for contact in contacts if contact.normal_force is not None)
    return [item for item in itertools.chain(forces, *drives, *normals) if item.frequency]


#: A mass by its number.
Index = Annotated[int, Limits(least=0, most=2**31 - 1), Says("the number of a mass, counted from 0")]


@dataclass(frozen=True)
class Force(Document):
    """A harmonic force on one mass of a system, amplitude · cos(frequency · t + phase); at the frequency 0 it is constant.

    Parameters
    ----------
    amplitude, frequency, phase : as of :class:`Harmonic`.
    mass : the mass it acts on, counted from 0.

    >>> Force(0.1, 1.25, mass=1)
    Force(amplitude=0.1, frequency=1.25, phase=0.0, mass=1)
    """

    amplitude: Annotated[float, Limits(dimensions=TEXTS["force"])]
    frequency: Annotated[float, Limits(dimensions=TEXTS["time^-1"])]
    phase: Annotated[float, Limits(dimensions=("angle",))] = 0.0
    mass: Index = 0


@dataclass(frozen=True)
class Contact(Document):
    """Friction between a mass and a drive, or between two masses.

    The slip velocity is w = s(t) − ẋ_mass for a drive and w = s(t) + ẋ_other − ẋ_mass for two masses (where s is 0 unless
    something moves between them); friction on `mass` has the sign of w, the other mass feels the opposite.

    Parameters
    ----------
    mass : the mass, counted from 0.
    law : its friction law; every contact has its own memory.
    drive_velocity : s, a number or a :class:`Drive`.
    other : the other mass; None: the drive itself.
    normal_force : a :class:`NormalForce` that varies; None: always that of the law.
    """

    mass: Index
    law: Law
    drive_velocity: Annotated[Any, Velocity | Drive] = 0.0
    other: Index | None = None
    normal_force: NormalForce | None = None


@dataclass(frozen=True)
class Spring(Document):
    """A spring that is not linear: r(ξ) = the line through `nodes` + cubic · ξ³ pulls a mass back.

    ξ is the position of the mass, for a spring between two masses less that of the other, which feels the opposite. Beyond
    the nodes the first and the last piece go on. A node that is passed is an event, ``"spring"``, whose contact is the
    number of the spring.

    Parameters
    ----------
    nodes : pairs (ξ, r), ξ increasing; at least two, or none.
    cubic : the factor of ξ³, of either sign.
    mass : the mass, counted from 0.
    other : the other mass; None: the ground.

    Limits: motions and all that is read off them (sections, sweeps, maps, basins); multipliers and branches are refused.

    >>> Spring.stop(0.5, stiffness=40.0)
    Spring(nodes=((0.0, 0.0), (0.5, 0.0), (1.5, 40.0)), cubic=0.0, mass=0, other=None)
    """

    nodes: tuple[Point, ...] = ()
    cubic: Annotated[float, Limits(dimensions=TEXTS["force length^-3"])] = 0.0
    mass: Index = 0
    other: Index | None = None

    @classmethod
    def dimensions(cls, name: str) -> tuple[Any, ...]:
        """Those of a node: length and force."""
        return (TEXTS["length"], TEXTS["force"]) if name == "nodes" else ()

    @classmethod
    def stop(cls, gap: float, stiffness: float, mass: int = 0) -> Self:
        """An elastic stop beyond a gap ≥ 0, or below one < 0 (-0.0 too)."""
        side = math.copysign(1.0, gap)
        ends = [(gap + side, side * stiffness), (gap, 0.0), (0.0 if gap else -side, 0.0)]
        return cls(tuple(sorted(ends)), mass=mass)

    @classmethod
    def backlash(cls, gap: float, stiffness: float, mass: int = 0, other: int | None = None) -> Self:
        """A spring with play: no force for |ξ| ≤ gap.

        Raises
        ------
        InputError
            for a gap < 0.
        """
        if gap < 0:
            raise InputError(f"Spring.backlash: expected a gap of at least 0, got {gap:g}")
        if gap == 0:
            return cls(((-1.0, -stiffness), (1.0, stiffness)), mass=mass, other=other)
        return cls(((-gap - 1, -stiffness), (-gap, 0.0), (gap, 0.0), (gap + 1, stiffness)), mass=mass, other=other)


Rows = tuple[tuple[float, ...], ...]


class _Matrix(Kind):
    """Rows of a matrix; a number or a list of numbers is its diagonal."""

    what = "a matrix or the list of its diagonal"

    def __init__(self, *dimensions: str) -> None:
        self.dimensions = dimensions

    def takes(self, value: Any) -> bool:
        return isinstance(value, Sequence) or hasattr(value, "__float__")

    def made(self, value: Any, name: str, where: str) -> Any:
        def in_si(item: Any) -> Any:
            if isinstance(item, list | tuple):
                return [in_si(one) for one in item]
            return quantity(name, item, self.dimensions, where) if isinstance(item, str) else item

        value = in_si(value)
        try:
            array = np.asarray(value, float)
        except (TypeError, ValueError, OverflowError):
            array = np.empty((0, 0, 0))
        if array.ndim > 2:
            raise InputError(f"{where}: {name} must be {self.what}, got {value!r}")
        if not np.isfinite(array).all():
            raise InputError(f"{where}: {name} must be finite numbers throughout, got {value!r}")
        return tuple(tuple(row) for row in array.tolist()) if array.ndim == 2 else array.tolist()

    def converted(self, value: Any, convert: Convert) -> Any:
        return tuple(tuple(convert(item, self.dimensions) for item in row) for row in value)

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        del definitions
        one = {"type": ["number", "string"]}
        row = {"type": "array", "items": one}
        return {"anyOf": [one, row, {"type": "array", "items": row}]}


@dataclass(frozen=True)
class System(Described):
    """Masses that slide on drives and on each other: M ẍ + D ẋ + K x = Σ b_c F_c + forcing, b_c = e_mass − e_other.

    Parameters
    ----------
    mass : M, symmetric positive definite, shape (n, n); a list of n numbers is its diagonal. Zero where each mass rubs once,
        on a drive, under a :class:`~stickslip.laws.RateState`: friction then balances the load at every time.
    stiffness, damping : K and D, shape (n, n), any; a list is the diagonal, a number the same for all masses.
    contacts : :class:`Contact` or several.
    forcing : :class:`Force` or several; a :class:`Harmonic` acts on mass 0.
    springs : :class:`Spring` or several, beside the linear ones.

    Stuck contacts are constraints. Where they close a loop (two contacts between the same bodies) the share of each is not
    determined by rigid bodies: the forces with the least sum of squares are taken.

    Raises
    ------
    InputError
        for a value that makes no sense.

    >>> from stickslip.laws import Coulomb
    >>> system = System([1, 1], [[2, -1], [-1, 2]], 0.1, [Contact(0, Coulomb(0.5), 0.3), Contact(1, Coulomb(0.2), other=0)])
    >>> System.from_dict(system.to_dict()) == system
    True
    """

    mass: Annotated[Any, _Matrix(*TEXTS["mass"])]
    stiffness: Annotated[Any, _Matrix(*TEXTS["stiffness"])]
    damping: Annotated[Any, _Matrix(*TEXTS["damping"])]
    contacts: Annotated[Any, Contact | tuple[Contact, ...]]
    forcing: Annotated[Any, Force | Harmonic | tuple[Force | Harmonic, ...] | None] = ()
    springs: Annotated[Any, Spring | tuple[Spring, ...]] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("mass", "stiffness", "damping"):
            value = getattr(self, name)
            if isinstance(value, float):
                value = [value] * (1 if name == "mass" else len(self.mass))
            if isinstance(value, list):
                object.__setattr__(self, name, tuple(tuple(row) for row in np.diag(value).tolist()))
        several(self, "contacts")
        several(self, "springs")
        contacts = self.contacts
        sticking = [contact.law for contact in contacts if not isinstance(contact.law, StateLaw)]
        if 0 < len(sticking) < len(contacts):
            name = type(sticking[0]).__name__
            raise InputError(
                "System: contacts that stick truly and contacts under laws with an internal state cannot be run together, "
                f"got {name} beside {next(type(c.law).__name__ for c in contacts if c.law not in sticking)}: give every "
                f"contact a law of one kind, such as Regularised({name}(...), width)"
            )
        forcing = self.forcing if isinstance(self.forcing, tuple) else (self.forcing,) if self.forcing else ()
        forces = [
            Force(item.amplitude, item.frequency, item.phase) if isinstance(item, Harmonic) else item
            for item in forcing
        ]
        object.__setattr__(self, "forcing", tuple(forces))
        try:
            self.core  # noqa: B018 - what it reads, it checks
        except ValueError as error:
            raise InputError(f"System: {error}") from None

    def to_system(self) -> System:
        """Itself."""
        return self

    @property
    def swings(self) -> list[Harmonic | Force]:
        """What varies with time at a frequency: forces, then drives, then normal forces."""
        return _swings(self.forcing, self.contacts)

    @property
    def integrated(self) -> bool:
        """Whether the laws have an internal state or a smooth sign, so that nothing sticks and the motion is integrated."""
        return any(isinstance(contact.law, StateLaw) for contact in self.contacts)

    @property
    def driven(self) -> list[int]:
        """The contacts on a drive, by their numbers."""
        return [i for i, contact in enumerate(self.contacts) if contact.other is None]

    @property
    def drive_velocity(self) -> float | None:
        """That of all contacts on a drive; None where they have not the same number, or there is none."""
        speeds = [self.contacts[i].drive_velocity for i in self.driven]
        return speeds[0] if speeds and isinstance(speeds[0], float) and speeds.count(speeds[0]) == len(speeds) else None

    @property
    def masses(self) -> int:
        """How many masses there are."""
        return len(self.mass)

    @property
    def natural_period(self) -> float:
        """2π over the highest natural frequency of the undamped masses; over 1 where nothing is sprung.

        Without mass 2π over the rate at which the fastest of the states comes to that of steady slip.
        """
        if not np.any(self.mass):
            return _core.StateSystem(self.to_json()).natural_period
        squares = np.linalg.eigvals(np.linalg.solve(np.array(self.mass), np.array(self.stiffness)))
        fastest = float(np.sqrt(np.abs(squares).max()))
        return 2 * np.pi / (fastest or 1.0)

    def to_json(self) -> str:
        """The document for the core; floats survive to the bit."""
        document = self.to_dict()
        for table, contact in zip(document["contacts"], self.contacts, strict=True):
            table["law"] = json.loads(contact.law.to_json())
        return json.dumps(document)


def chain(
    n: int,
    law: Law | Sequence[Law],
    drive_velocity: float | Drive,
    *,
    mass: float = 1.0,
    stiffness: float = 1.0,
    coupling: float = 1.0,
    damping: float = 0.0,
    coupling_damping: float = 0.0,
) -> System:
    """A row of n equal masses on one drive, each tied to the ground and to its neighbours (Burridge & Knopoff 1967).

    Parameters
    ----------
    n : number of masses.
    law : friction of every mass with the drive, or n laws.
    drive_velocity : s, a number or a :class:`Drive`.
    mass : of each.
    stiffness, damping : of the spring and the damper between each mass and the ground.
    coupling, coupling_damping : of those between neighbours.

    >>> from stickslip.laws import StaticKinetic
    >>> chain(3, StaticKinetic(1.0, 0.6), 0.2).stiffness
    ((2.0, -1.0, 0.0), (-1.0, 3.0, -1.0), (0.0, -1.0, 2.0))
    """
    whole_number("n", n, "chain")
    laws = [law] * n if isinstance(law, Law) else list(law)
    if len(laws) != n:
        raise InputError(f"chain: law must be one law or {n} of them, got {len(laws)}")
    links = np.diff(np.eye(n), axis=0)
    laplacian = links.T @ links + 0.0  # no negative zeros in documents
    return System(
        mass=[mass] * n,
        stiffness=stiffness * np.eye(n) + coupling * laplacian + 0.0,
        damping=damping * np.eye(n) + coupling_damping * laplacian + 0.0,
        contacts=[Contact(i, laws[i], drive_velocity) for i in range(n)],
    )


def system_from_dict(table: Mapping[str, Any], where: str = "system") -> Oscillator | System:
    """A system of masses if the document has contacts, else an oscillator."""
    return System.from_dict(table, where) if "contacts" in table else Oscillator.from_dict(table, where)
