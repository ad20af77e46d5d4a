"""What a friction law is in Python: immutable data, a document, and the questions that the core answers.

Law files are read and written here too (`load_law`, `save_law`).
"""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip import _core
from stickslip.errors import InputError, did_you_mean, numbers, whole_number
from stickslip.files.disk import read_toml, write_text
from stickslip.files.schema import Document, check_keys, complete, kind_of
from stickslip.files.schema import Point as Point
from stickslip.laws.declarations import FACTS, Parameter

if TYPE_CHECKING:
    import pandas as pd

    from stickslip.laws.numbers import Spread


MotionColumns = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.float64]]
"""Time, slip velocity, whether the mass sticks, and force rate of a measured motion, one array each."""
TRIES = 1000
"""Draws for each law that is asked for, at the most."""


@dataclass(frozen=True)
class Law(Document):
    """What all friction laws have in common.

    For developers: CONTRIBUTING.md walks through a new law.
    """

    WHAT: ClassVar[str] = "a friction law such as stickslip.laws.Coulomb"
    ALL: ClassVar[dict[str, type[Law]]] = {}
    #: What the core declares of each parameter.
    PARAMETERS: ClassVar[Mapping[str, Parameter]] = {}
    #: Whether kinetic friction is one smooth curve instead of linear pieces (a Taylor series instead of a closed form).
    SMOOTH: ClassVar[bool] = False

    def __init_subclass__(cls, family: bool = False) -> None:
        super().__init_subclass__()
        if not family:
            Law.ALL[cls.__name__] = cls
            facts = FACTS[cls.__name__]
            cls.PARAMETERS, cls.SMOOTH = facts.parameters, facts.smooth

    @classmethod
    def dimensions(cls, name: str) -> tuple[tuple[str, ...], ...]:
        """Those that the core declares of the numbers."""
        return cls.PARAMETERS[name].texts if name in cls.PARAMETERS else ()

    @cached_property
    def core(self) -> Any:
        """What the core has read."""
        return _core.Law(self.to_json())

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, parameter in self.PARAMETERS.items():
            if parameter.words and (chosen := getattr(self, name)) not in parameter.words:
                self.refuse(
                    f"{name} must be one of {', '.join(parameter.words)}, got {chosen!r}"
                    f"{did_you_mean(chosen, parameter.words)}"
                )
        try:
            self.core  # noqa: B018 - what it reads, it checks
        except ValueError as error:
            raise InputError(f"{type(self).__name__}: {error}") from None

    @classmethod
    def example(cls) -> Self:
        """A law of this kind in plain dimensionless numbers, where there is one the set of its source.

        The pictures of ``docs/laws.md`` show it, and what is asked of every law is tested on it.

        >>> from stickslip.laws import StaticKinetic
        >>> StaticKinetic.example()
        StaticKinetic(break_away=1.0, kinetic=0.6)
        """
        return cls(**FACTS[cls.__name__].example)

    def to_dict(self) -> dict[str, Any]:
        """The document, with the law's name under ``type``."""
        return {"type": type(self).__name__, **super().to_dict()}

    @classmethod
    def from_dict(cls, table: Mapping[str, Any], where: str = "law") -> Self:
        """Any law from its document."""
        # The laws register themselves when they are defined; a file may name one before anything has asked for it.
        importlib.import_module("stickslip.laws")
        if not isinstance(table, Mapping) or "type" not in table:
            raise InputError(f'{where}: type is missing; add `type = "..."` with one of {", ".join(Law.ALL)}')
        name = table["type"]
        if not isinstance(name, str) or name not in Law.ALL:
            hint = did_you_mean(str(name), Law.ALL)
            raise InputError(f"{where}: unknown law {name!r}{hint}; known are {', '.join(Law.ALL)}")
        # The sentence names the law, as a system may have several.
        fields = {key: table[key] for key in table if key != "type"}
        law = super(Law, Law.ALL[name]).from_dict(fields, f"{where}: {name}")
        if not isinstance(law, cls):
            raise InputError(f"{where}: expected the law {cls.__name__}, got {name}")
        return law

    @classmethod
    def described(cls, definitions: dict[str, Any]) -> dict[str, Any]:
        """The JSON Schema of the law's table; of this class that of any law."""
        importlib.import_module("stickslip.laws")
        if cls is Law:
            return {"title": "Law", "anyOf": [law.described(definitions) for law in Law.ALL.values()]}
        found = super().described(definitions)
        found["properties"] = {"type": {"const": cls.__name__}} | found["properties"]
        for name, parameter in cls.PARAMETERS.items():
            if choices := parameter.words or parameter.choices:
                found["properties"][name]["enum"] = list(choices)
        return found | {"required": ["type", *found["required"]]}

    def to_json(self) -> str:
        """The document as JSON; floats survive to the bit."""
        return json.dumps(self.to_dict())

    def break_away_force(self, stick_time: ArrayLike = 0.0, force_rate: ArrayLike = 0.0) -> Any:
        """The largest force that adhesion can carry, f_s(t_s, δ).

        Parameters
        ----------
        stick_time : time of adhesion t_s, any shape.
        force_rate : dF/dt while stuck, of the size δ, same shape or a number; where friction differs between the directions,
            its sign is that of the friction force.

        Returns
        -------
        float or array of that shape.

        >>> from stickslip.laws import DwellTime
        >>> round(DwellTime(kinetic=0.5, limit=0.5, rate=0.4).break_away_force(1.0), 4)
        0.6648
        """
        time, rate = np.broadcast_arrays(np.asarray(stick_time, float), np.asarray(force_rate, float))
        flat = self.core.break_away(np.ascontiguousarray(time.ravel()), np.ascontiguousarray(rate.ravel()))
        return flat.reshape(time.shape) if time.ndim else float(flat[0])

    def kinetic_force(self, w: ArrayLike) -> Any:
        """Friction at slip velocity w for a slip that speeds up steadily from rest, with the sign of w.

        For laws with branches this is the upper one, after a break-away at stick time zero. At w = 0, where a stick bears
        any force up to the break-away force, it is the limit from above, f(0+); that from below is at a tiny w < 0.

        >>> from stickslip.laws import StaticKinetic
        >>> StaticKinetic(break_away=1.0, kinetic=0.6).kinetic_force([-0.1, 0.2])
        array([-0.6,  0.6])
        """
        w = np.asarray(w, float)
        force = np.empty_like(w)
        for direction, part in ((1.0, ~(w < 0)), (-1.0, w < 0)):
            if not part.any():
                continue
            speed, back = np.unique(np.abs(w[part]), return_inverse=True)
            path = direction * np.concatenate([[0.0], speed])
            stuck = np.arange(path.size) == 0
            force[part] = force_along(self, np.zeros_like(path), path, stuck, np.zeros_like(path))[1:][back]
        return force if w.ndim else float(force)

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of the fitted numbers, of a law from a law file or a fit; empty for any other law.

        It belongs to this law alone: one that is made from it with other numbers has none.
        """
        import pandas as pd

        given = self._uncertainty
        return pd.DataFrame() if given is None else given[0]

    def with_covariance(
        self,
        covariance: pd.DataFrame,
        ties: Mapping[str, str] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
    ) -> Self:
        """The same law with the covariance of its fitted numbers, from which :meth:`sample` draws.

        Parameters
        ----------
        covariance : DataFrame over the names of numbers in both directions.
        ties : numbers that take the value of a fitted one, by name.
        bounds : lowest and highest value of fitted numbers, where they are narrower than those of the law.
        """
        twin = copy(self)
        vars(twin)["_uncertainty"] = covariance, dict(ties or {}), dict(bounds or {})
        return twin

    def save(self, path: str | Path, units: Mapping[str, str] | None = None) -> Path:
        """Write the law file, with the covariance of the numbers where the law has one; :func:`load_law` reads it back.

        Parameters
        ----------
        path : ends in ``.toml``.
        units : unit of each number by name, as :func:`stickslip.laws.numbers.units_of` gives it; default: not said.

        >>> from tempfile import TemporaryDirectory
        >>> from stickslip.laws import StaticKinetic
        >>> law = StaticKinetic(break_away=1.0, kinetic=0.6)
        >>> with TemporaryDirectory() as folder:
        ...     print(law.save(f"{folder}/law.toml").read_text())
        [law]
        type = "StaticKinetic"
        break_away = 1.0
        kinetic = 0.6
        ...
        """
        return save_law(path, self, self.covariance, {}, units or {})

    _uncertainty: ClassVar[tuple[Any, ...] | None] = None

    def sample(self, n: int, seed: int | None = None) -> list[Self]:
        """Laws that may as well be: drawn from the covariance of the fitted numbers.

        The fitted numbers are drawn from a normal distribution, those known by their ratio
        (:mod:`stickslip.laws.declarations`), by their logarithm. A draw beyond the limits of a number, or that makes no law,
        is drawn again; ties are kept.

        Parameters
        ----------
        n : how many laws, at least 1.
        seed : of the random numbers, which must be given; the same seed gives the same laws.

        Raises
        ------
        InputError
            where no covariance came with the law, it is not finite, or nearly no draw makes a law.

        >>> import pandas as pd
        >>> from stickslip.laws import StaticKinetic
        >>> covariance = pd.DataFrame([[0.01]], index=["kinetic"], columns=["kinetic"])
        >>> law = StaticKinetic(1.0, 0.6).with_covariance(covariance)
        >>> [round(one.kinetic, 3) for one in law.sample(3, seed=0)]
        [0.613, 0.587, 0.664]
        """
        whole_number("n", n, "sample")
        if seed is None:
            raise InputError("sample: a seed is missing, the same seed gives the same laws; write seed=0, say")
        whole_number("seed", seed, "sample", least=0)
        spread, normal = self._spread(), np.random.default_rng(seed)
        found: list[Self] = []
        for tried in range(1, TRIES * n + 1):
            law = spread.at(normal.standard_normal(len(spread.names)))
            if law is not None:
                found.append(cast(Self, law))
            if len(found) == n:
                return found
            if tried == TRIES and not found:
                break
        raise InputError(
            f"sample: of {tried} draws {len(found)} lie within the limits of {type(self).__name__}: its numbers are known "
            "too poorly to be drawn; hold some of them when it is fitted (fixed)"
        )

    def _spread(self) -> Spread:
        """The laws that may as well be; an InputError where no covariance came with the law, or it is not finite."""
        from stickslip.laws.numbers import Spread

        if self.covariance.empty:
            raise InputError(
                f"sample: this {type(self).__name__} has no covariance; take the law of an identification, or load a law "
                "file that one has saved"
            )
        return Spread(self, *(self._uncertainty or ()))

    def _along(
        self, t: NDArray[np.float64], w: NDArray[np.float64], stuck: NDArray[np.bool_], rate: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        found: NDArray[np.float64] = self.core.force_along(t, w, stuck, rate)
        return found


def force_along(
    law: Law, t: ArrayLike, w: ArrayLike, stuck: ArrayLike | None = None, force_rate: ArrayLike | None = None
) -> NDArray[np.float64]:
    """The friction force a law predicts along a measured motion, its memory included.

    Parameters
    ----------
    law : any law.
    t, w : time and slip velocity, shape (n,).
    stuck : whether the mass sticks, shape (n,); default where w is 0.
    force_rate : dF/dt while stuck and, for a law whose static friction without rest depends on it, what it would be if the
        mass stuck (k V on a spring); shape (n,), default 0.

    Returns
    -------
    Shape (n,): the kinetic force with the sign of w while slipping. While stuck friction is a reaction, which no law knows:
    there it is the break-away force of that moment, with the sign of `force_rate`. A law with an internal state starts
    unloaded (:meth:`~stickslip.laws.state_law.StateLaw.follow` starts anywhere) and knows the reaction too.

    >>> from stickslip.laws import StaticKinetic
    >>> law = StaticKinetic(break_away=1.0, kinetic=0.6)
    >>> force_along(law, [0, 1, 2], [0, 0.1, -0.1], [True, False, False])
    array([ 1. ,  0.6, -0.6])
    """
    return law._along(*motion_columns(t, w, stuck, force_rate))


def motion_columns(
    t: ArrayLike, w: ArrayLike, stuck: ArrayLike | None = None, force_rate: ArrayLike | None = None
) -> MotionColumns:
    """The columns of a measured motion as the core reads them, for many laws along one motion.

    Raises
    ------
    InputError
        where a number is not finite.
    """
    t, w = np.ascontiguousarray(t, float), np.ascontiguousarray(w, float)
    rate = np.zeros_like(t) if force_rate is None else np.ascontiguousarray(force_rate, float)
    for name, values in (("t", t), ("w", w), ("force_rate", rate)):
        if not np.isfinite(values).all():
            raise InputError(f"force_along: {name} must be finite, got {values[~np.isfinite(values)][0]}")
    return t, w, np.ascontiguousarray(w == 0 if stuck is None else stuck, bool), rate


def load_law(path: str | Path) -> Law:
    """The law of a law file: its table ``[law]``, with the covariance of its numbers where the file holds one."""
    return law_of(law_document(path), path)


def law_of(document: Mapping[str, Any], path: str | Path) -> Law:
    """The same of a document that :func:`law_document` has read from this file."""
    law = Law.from_dict(document["law"], f"{path}: law")
    covariance, ties, bounds = _read_covariance(document, path)
    return law if covariance.empty else law.with_covariance(covariance, ties, bounds)


def load_covariance(path: str | Path) -> pd.DataFrame:
    """The covariance of the numbers of a law file, by their names in both directions; empty where it has none.

    The standard errors are the roots of its diagonal. Numbers that were not fitted are not in it.
    """
    return _read_covariance(law_document(path), path)[0]


def _read_covariance(
    document: Mapping[str, Any], path: str | Path
) -> tuple[pd.DataFrame, dict[str, str], dict[str, tuple[float, float]]]:
    """The covariance of a law file, the numbers that follow another, and the limits of the fitted ones."""
    import pandas as pd

    table = document.get("covariance", {"names": [], "matrix": []})
    check_keys(table, ("names", "matrix", "ties", "bounds"), ("names", "matrix"), f"{path}: covariance")
    names = table["names"]
    rows = [numbers("covariance", row, len(names), str(path), "name", finite=False) for row in table["matrix"]]
    if len(rows) != len(names):
        raise InputError(
            f"{path}: covariance: expected {len(names)} rows, one a name, got {len(rows)}; write the law again"
        )
    bounds: dict[str, tuple[float, float]] = {}
    for name, ends in table.get("bounds", {}).items():
        low, high = numbers("bounds", ends, 2, f"{path}: covariance", "end", finite=False)
        bounds[name] = low, high
    frame = pd.DataFrame(np.reshape(rows, (len(names), len(names))), index=names, columns=names)
    return frame, dict(table.get("ties", {})), bounds


TABLES = ("law", "units", "uncertainty", "covariance", "source")
"""The tables of a law file."""


def law_schema() -> dict[str, Any]:
    """The JSON Schema of a law file."""

    def described(definitions: dict[str, Any]) -> dict[str, Any]:
        tables: dict[str, Any] = {name: {"type": "object"} for name in TABLES}
        tables["law"] = kind_of(Law).schema(definitions)
        return {"title": "Law", "type": "object", "properties": tables, "required": ["law"]}

    return complete(described)


def law_document(path: str | Path) -> dict[str, Any]:
    """The tables of a law file."""
    document = read_toml(path)
    check_keys(document, TABLES, ("law",), str(path))
    return document


def law_file(law: Law, covariance: pd.DataFrame, source: Mapping[str, Any], units: Mapping[str, str]) -> str:
    """The text of a law file: [law], [units] of its numbers, [uncertainty] and [covariance] of fitted ones, and [source]."""
    import tomli_w

    names = [str(name) for name in covariance.index]
    matrix = covariance.to_numpy(float)
    _, ties, bounds = law._uncertainty or (None, {}, {})
    document = {"law": law.to_dict(), "units": dict(units)} if units else {"law": law.to_dict()}
    if names:
        document |= {
            "uncertainty": dict(zip(names, np.sqrt(np.diag(matrix)).tolist(), strict=True)),
            "covariance": {"names": names, "matrix": matrix.tolist()}
            | ({"ties": ties} if ties else {})
            | ({"bounds": {name: list(ends) for name, ends in bounds.items()}} if bounds else {}),
        }
    document["source"] = {"version": _core.__version__, **source}
    # a row of numbers a line, not a number
    return re.sub(
        r"\[\n\s*([-+.\de,\s]+?),\n\s*\]", lambda row: f"[{' '.join(row[1].split())}]", tomli_w.dumps(_finite(document))
    )


def save_law(
    path: str | Path, law: Law, covariance: pd.DataFrame, source: Mapping[str, Any], units: Mapping[str, str]
) -> Path:
    """Write a law file that :func:`load_law` and :func:`load_covariance` read back."""
    text = law_file(law, covariance, source, units)
    return write_text(path, text, ".toml")


def _finite(document: Any) -> Any:
    """TOML has inf and nan, but other readers choke on them: as text."""
    if isinstance(document, dict):
        return {key: _finite(item) for key, item in document.items()}
    if isinstance(document, list):
        return [_finite(item) for item in document]
    if isinstance(document, float) and not np.isfinite(document):
        return str(document)
    return document
