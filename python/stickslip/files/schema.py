"""What a document may hold, said once by the annotations of a dataclass: reading, error sentences and JSON Schema follow.

The schema of each kind of file is made elsewhere: `measurement/rigs/rig_file.py`, `model/system_schema.py`, `laws/law.py`,
`experiment/experiment.py`.
"""

from __future__ import annotations

import inspect
import re
import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self, Union
from weakref import WeakKeyDictionary

import numpy as np

from stickslip.errors import InputError, did_you_mean, number
from stickslip.files.disk import read_toml, toml_table
from stickslip.files.notebook import InNotebook, shortened
from stickslip.files.units import FARTHEST, quantity, si_unit

DIALECT = "https://json-schema.org/draft/2020-12/schema"


@dataclass(frozen=True)
class Limits:
    """What a number must be; stands in an annotation, ``Annotated[float, Limits(above=0)]``.

    Attributes
    ----------
    above : it is larger than this; `least` and `most`: or equal.
    dimensions : it may be a text with a unit of one of these (:data:`stickslip.files.units.UNITS`), and is read in SI.
    extreme : it may be so large or small that its square is no number.
    """

    above: float | None = None
    least: float | None = None
    most: float | None = None
    dimensions: tuple[str, ...] = ()
    extreme: bool = False


@dataclass(frozen=True)
class Says:
    """What a value must be, in words of its own, where those of its annotation do not say enough; and what several are."""

    what: str
    many: str = "values"


def check_keys(table: Mapping[str, Any], known: Iterable[str], required: Iterable[str], where: str) -> None:
    """Refuse a table with unknown or missing keys; `where` names it in the sentence."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where}: expected a table with the keys {', '.join(known)}, got {table!r}")
    known = list(known)
    for key in table:
        if key not in known:
            raise InputError(f"{where}: unknown key {key!r}{did_you_mean(key, known)}; known are {', '.join(known)}")
    for key in required:
        if key not in table:
            raise InputError(f"{where}: {key} is missing; add a line `{key} = ...`")


Positive = Annotated[float, Limits(above=0)]
NotNegative = Annotated[float, Limits(least=0)]
Share = Annotated[float, Limits(above=0, most=1, dimensions=("ratio",))]
Count = Annotated[int, Limits(least=1)]
Point = Annotated[
    tuple[float, float],
    Says("a pair of numbers such as [0.2, 0.6]", "pairs of numbers such as [[0, 1], [0.2, 0.6]]"),
]


@dataclass(frozen=True)
class Document(InNotebook):
    """A frozen dataclass that is also the table of a document; its annotations say what the table may hold.

    For developers: derive from it, annotate the fields with numbers, texts, ``Literal`` words, tuples, other documents and
    the names of this file, and describe them in the docstring. ``Annotated[what, given]`` is `what` to a type checker and
    takes what `given` says: another annotation, or a :class:`Kind` of its own. What values must be together is checked in
    ``__post_init__``, after that of this class, and refused by :meth:`refuse`.

    >>> @dataclass(frozen=True)
    ... class Spring(Document):
    ...     TITLE: ClassVar[str] = "spring"
    ...     stiffness: Annotated[float, Limits(above=0, dimensions=("stiffness",))]
    ...     kind: Literal["coil", "leaf"] = "coil"
    >>> Spring.from_dict({"stiffness": "2 N/mm"})
    Spring(stiffness=2000.0, kind='coil')
    >>> Spring.schema()["properties"]["kind"]
    {'enum': ['coil', 'leaf'], 'default': 'coil'}
    """

    #: What error sentences call it, and what they say where another thing was given for it.
    TITLE: ClassVar[str] = ""
    WHAT: ClassVar[str] = ""
    #: Keys that a table must have although the dataclass has a default for them.
    REQUIRED: ClassVar[tuple[str, ...]] = ()
    #: Numbers whose dimension depends on where the table stands: the document around it says which (`dimensions`).
    BY_CONTEXT: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def dimensions(cls, name: str) -> tuple[tuple[str, ...], ...]:
        """For each number of `name` those of which it may have a unit, where its annotation does not say it."""
        del name
        return ()

    def __post_init__(self) -> None:
        title = self._title()
        for name, kind in kinds(type(self)).items():
            object.__setattr__(self, name, kind.read(getattr(self, name), name, title))

    def __getstate__(self) -> dict[str, Any]:
        """Its fields alone: what the core has read of them does not go with a copy."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @classmethod
    def _title(cls) -> str:
        return cls.TITLE or cls.__name__

    @classmethod
    def _required(cls) -> list[str]:
        free = {item.name for item in _items(cls) if item.default is not MISSING or item.default_factory is not MISSING}
        return [name for name in kinds(cls) if name not in free or name in cls.REQUIRED]

    def refuse(self, why: str) -> typing.NoReturn:
        """Raise the error of a document whose values do not go together."""
        raise InputError(f"{self._title()}: {why}")

    @classmethod
    def from_dict(cls, table: Mapping[str, Any], where: str = "") -> Self:
        """Make it from a table; `where` names that table in error messages."""
        where = where or cls._title()
        if not isinstance(table, Mapping):
            raise InputError(f"{where}: expected a table with the keys of {cls.__name__}, got {table!r}")
        check_keys(table, kinds(cls), cls._required(), where)
        try:
            return cls(**table)
        except InputError as error:
            raise InputError(f"{where}: {str(error).removeprefix(f'{cls._title()}: ')}") from None

    @classmethod
    def from_toml(cls, text: str, where: str = "") -> Self:
        """Make it from the text of a TOML document."""
        where = where or cls._title()
        return cls.from_dict(toml_table(text, where), where)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Make it from a TOML file."""
        return cls.from_dict(read_toml(path, f"{cls._title()} file"), str(path))

    def to_dict(self) -> dict[str, Any]:
        """The table: numbers, texts, lists and tables only; what is None, or empty by default, is left out."""
        values = {item.name: (getattr(self, item.name), item.default) for item in _items(type(self))}
        return {
            name: plain(value)
            for name, (value, default) in values.items()
            if value is not None and not value == default == ()
        }

    def to_toml(self) -> str:
        """The TOML document; floats survive to the bit."""
        import tomli_w

        return tomli_w.dumps(self.to_dict())

    def facts(self) -> dict[str, Any]:
        """What a notebook shows."""
        return {item.name: value for item in _items(type(self)) if (value := getattr(self, item.name)) is not None}

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "__repr__" not in vars(cls):  # a dataclass makes one of its own, which prints every node of a law
            cls.__repr__ = Document._short  # type: ignore[assignment]

    def _short(self) -> str:
        fields = ", ".join(f"{item.name}={shortened(getattr(self, item.name))}" for item in _items(type(self)))
        return f"{type(self).__name__}({fields})"

    def changed(self) -> dict[str, Any]:
        """The table of what differs from the defaults."""
        return {
            item.name: plain(value)
            for item in _items(type(self))
            if (value := getattr(self, item.name)) is not None and value != item.default
        }

    @classmethod
    def schema(cls) -> dict[str, Any]:
        """The JSON Schema of the document, from which editors complete and check it."""
        return complete(cls.described)

    @classmethod
    def described(cls, definitions: dict[str, Any]) -> dict[str, Any]:
        """The JSON Schema of the table, with the words of the docstring; what several places share is in `definitions`."""
        words = docstring_words(cls)
        properties: dict[str, Any] = {}
        for item in _items(cls):
            properties[item.name] = dict(kinds(cls)[item.name].schema(definitions))
            if item.name in words:
                properties[item.name]["description"] = words[item.name]
            if item.default is not MISSING and item.default is not None:
                properties[item.name]["default"] = plain(item.default)
        return {
            "title": cls.__name__,
            "description": (inspect.getdoc(cls) or "").partition("\n\n")[0].replace("\n", " "),
            "type": "object",
            "properties": properties,
            "required": cls._required(),
            "additionalProperties": False,
        }


def plain(value: Any) -> Any:
    """A value of a document as numbers, texts, lists and tables."""
    if isinstance(value, Document):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    return value


def complete(described: Callable[[dict[str, Any]], dict[str, Any]]) -> dict[str, Any]:
    """A whole JSON Schema from what describes one with the help of definitions."""
    definitions: dict[str, Any] = {}
    found = {"$schema": DIALECT} | described(definitions)
    return found | ({"$defs": definitions} if definitions else {})


def docstring_words(cls: type) -> dict[str, str]:
    """What the docstring of a class says of each parameter.

    >>> docstring_words(Limits)["above"]
    'it is larger than this; `least` and `most`: or equal.'
    """
    text = inspect.getdoc(cls) or ""
    found: dict[str, str] = {}
    for section in re.findall(r"(?:Parameters|Attributes)\n-+\n((?:.+\n?)+)", text):
        for names, words in re.findall(r"^(\w[\w, ]*?) : ((?:.+\n?)(?:[ ].+\n?)*)", section, re.MULTILINE):
            for name in names.split(", "):
                found[name] = " ".join(words.split())
    return found


# --- what one value may be ------------------------------------------------------------------------------------------


Convert = Callable[[Any, tuple[str, ...]], Any]
"""What makes another of a number or a document, given the dimensions of which it may have a unit."""


class Kind:
    """What a value may be: `what` in words, whether it has the shape, the value made from it, its JSON Schema."""

    what: str
    #: What several are, as in "a list of numbers".
    many = "values"

    def takes(self, value: Any) -> bool:
        """Whether a value has the shape, so that its contents may be looked at."""
        raise NotImplementedError

    def made(self, value: Any, name: str, where: str) -> Any:
        """The value, of that shape, as the document keeps it."""
        del name, where
        return value

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        """JSON Schema; what several places share goes into `definitions`."""
        raise NotImplementedError

    def measured(self, dimensions: Sequence[tuple[str, ...]]) -> None:
        """Let its numbers be texts with a unit of these dimensions: of a pair each of its own, one number of the last."""

    def converted(self, value: Any, convert: Convert) -> Any:
        """A value that the document keeps, with its numbers and documents converted."""
        del convert
        return value

    def read(self, value: Any, name: str, where: str) -> Any:
        """The value as the document keeps it, or one sentence."""
        if isinstance(value, np.ndarray):
            value = value.tolist()
        if not self.takes(value):
            raise InputError(f"{where}: {name} must be {self.what}, got {value!r}{self.hint(value)}")
        return self.made(value, name, where)

    def hint(self, value: Any) -> str:
        """What may have been meant."""
        del value
        return ""


def _or_text(dimensions: Sequence[str]) -> str:
    return f' or a text such as "1.5 {si_unit(dimensions[0])}"'


class _Number(Kind):
    def __init__(self, limits: Limits = Limits(), *, whole: bool = False) -> None:
        self.limits, self.whole = limits, whole
        noun = "whole number" if whole else "number"
        said: dict[tuple[float | None, float | None], str] = {
            (0, None): f"a positive {noun}",
            (None, 0): f"zero or a positive {noun}",
        }
        ends = [f"above {limits.above:g}"] if limits.above is not None else []
        ends += [f"of at least {limits.least:g}"] if limits.least is not None else []
        ends += [f"of at most {limits.most:g}"] if limits.most is not None else []
        one_sided = said.get((limits.above, limits.least)) if limits.most is None else None
        self.range = self.what = one_sided or " ".join([f"a {noun}", " and ".join(ends)]).strip()
        self.many = f"{noun}s"
        if limits.dimensions:
            self.what += _or_text(limits.dimensions)

    def measured(self, dimensions: Sequence[tuple[str, ...]]) -> None:
        if not self.whole and dimensions[-1]:
            self.limits = replace(self.limits, dimensions=dimensions[-1])
            self.what += _or_text(dimensions[-1])

    def takes(self, value: Any) -> bool:
        if isinstance(value, str):
            return bool(self.limits.dimensions)
        if isinstance(value, bool | np.bool_):
            return False
        return isinstance(value, int | np.integer) if self.whole else hasattr(value, "__float__")

    def made(self, value: Any, name: str, where: str) -> Any:
        if self.whole:
            result: float = int(value)
        elif isinstance(value, str):
            result = quantity(name, value, self.limits.dimensions, where)
        else:
            result = number(name, value, where)
        if not self.limits.extreme and result and not 1 / FARTHEST <= abs(result) <= FARTHEST:
            raise InputError(
                f"{where}: {name} must be 0 or lie between {1 / FARTHEST:g} and {FARTHEST:g} in size, got {value!r}: choose "
                "units in which it is nearer to 1"
            )
        above, least, most = self.limits.above, self.limits.least, self.limits.most
        low = (above is not None and result <= above) or (least is not None and result < least)
        if low or (most is not None and result > most):
            raise InputError(f"{where}: {name} must be {self.range}, got {value!r}")
        return result

    def converted(self, value: Any, convert: Convert) -> Any:
        return convert(value, self.limits.dimensions)

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        del definitions
        found: dict[str, Any] = {"type": "integer" if self.whole else "number"}
        keys = {"exclusiveMinimum": self.limits.above, "minimum": self.limits.least, "maximum": self.limits.most}
        found |= {key: value for key, value in keys.items() if value is not None}
        if not self.limits.dimensions:
            return found
        units = ", ".join(map(si_unit, self.limits.dimensions))
        return {"anyOf": [found, {"type": "string"}], "description": f"in {units}, or a text with another unit"}


class _Plain(Kind):
    """A value of one of Python's types, kept as it is."""

    def __init__(self, type_: Any, what: str, many: str, in_json: str) -> None:
        self.type, self.what, self.many, self.in_json = type_, what, many, in_json

    def takes(self, value: Any) -> bool:
        return isinstance(value, self.type)

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        del definitions
        return {"type": self.in_json}


class _Path(_Plain):
    def made(self, value: Any, name: str, where: str) -> Any:
        del name, where
        return str(value)


FilePath = Annotated[str, _Path(str | Path, "a path", "paths", "string")]


class _Word(Kind):
    def __init__(self, words: Sequence[str | int]) -> None:
        self.words = words
        self.what = f"one of {', '.join(str(word) for word in words if word)}"

    def takes(self, value: Any) -> bool:
        return isinstance(value, str | int | float) and not isinstance(value, bool) and value in self.words

    def hint(self, value: Any) -> str:
        return did_you_mean(str(value), map(str, self.words))

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        del definitions
        return {"enum": list(self.words)}


class _List(Kind):
    """A list of any length, or with one kind a place."""

    def __init__(self, parts: Sequence[Kind], *, fixed: bool) -> None:
        self.parts, self.fixed = list(parts), fixed
        self.what = f"a list of {len(parts)} {parts[0].many}" if fixed else f"a list of {parts[0].many}"

    def measured(self, dimensions: Sequence[tuple[str, ...]]) -> None:
        own = [(one,) for one in dimensions] if self.fixed and len(self.parts) == len(dimensions) else [dimensions]
        for part, its in zip(self.parts, own, strict=True):
            part.measured(its)

    def takes(self, value: Any) -> bool:
        listed = isinstance(value, Sequence) and not isinstance(value, str | bytes)
        return listed and (not self.fixed or len(value) == len(self.parts))

    def made(self, value: Any, name: str, where: str) -> Any:
        return tuple(kind.read(item, f"{name}[{i}]", where) for i, (kind, item) in enumerate(self._pairs(value)))

    def converted(self, value: Any, convert: Convert) -> Any:
        return tuple(kind.converted(item, convert) for kind, item in self._pairs(value))

    def _pairs(self, value: Sequence[Any]) -> Iterable[tuple[Kind, Any]]:
        """What each item may be, and the item."""
        return zip(self.parts if self.fixed else self.parts * len(value), value, strict=True)

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        if not self.fixed:
            return {"type": "array", "items": self.parts[0].schema(definitions)}
        items = [part.schema(definitions) for part in self.parts]
        return {"type": "array", "prefixItems": items, "minItems": len(items), "maxItems": len(items)}


class _Pair(_List):
    """Two numbers, the lower one first."""

    def __init__(self, number: Kind) -> None:
        super().__init__([number, number], fixed=True)
        self.what = "a list of two, [lowest, highest]"

    def made(self, value: Any, name: str, where: str) -> Any:
        low, high = super().made(value, name, where)
        if not low < high:
            raise InputError(f"{where}: {name} must be [lowest, highest], got {value!r}")
        return low, high


class _Table(Kind):
    """Another document, or its table."""

    def __init__(self, cls: type[Document]) -> None:
        self.cls = cls
        self.what, self.many = cls.WHAT or f"a table with the keys of {cls.__name__}", f"tables of {cls.__name__}"
        self.dimensions: tuple[str, ...] = ()

    def measured(self, dimensions: Sequence[tuple[str, ...]]) -> None:
        self.dimensions = dimensions[-1]

    def takes(self, value: Any) -> bool:
        return isinstance(value, self.cls | Mapping)

    def made(self, value: Any, name: str, where: str) -> Any:
        if isinstance(value, self.cls):
            return value
        for key in self.cls.BY_CONTEXT if self.dimensions else ():
            if isinstance(value.get(key), str):
                quantity(key, value[key], self.dimensions, f"{where}: {name}")
        return self.cls.from_dict(value, f"{where}: {name}")

    def converted(self, value: Any, convert: Convert) -> Any:
        return convert(value, self.dimensions)

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        name = self.cls.__name__
        if name not in definitions:
            definitions[name] = {}  # A law within a law asks for the laws again.
            definitions[name] = self.cls.described(definitions)
        return {"$ref": f"#/$defs/{name}"}


class _Either(Kind):
    def __init__(self, kinds: Sequence[Kind]) -> None:
        self.kinds = kinds
        self.what = " or ".join(kind.what for kind in kinds)

    def measured(self, dimensions: Sequence[tuple[str, ...]]) -> None:
        for kind in self.kinds:
            kind.measured(dimensions)

    def takes(self, value: Any) -> bool:
        return any(kind.takes(value) for kind in self.kinds)

    def made(self, value: Any, name: str, where: str) -> Any:
        *some, last = [kind for kind in self.kinds if kind.takes(value)]
        for kind in some:
            try:
                return kind.made(value, name, where)
            except InputError:
                continue
        return last.made(value, name, where)

    def converted(self, value: Any, convert: Convert) -> Any:
        return next(kind for kind in self.kinds if kind.takes(value)).converted(value, convert)

    def hint(self, value: Any) -> str:
        return "".join(kind.hint(value) for kind in self.kinds)

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        return {"anyOf": [kind.schema(definitions) for kind in self.kinds]}


class _Optional(Kind):
    def __init__(self, kind: Kind) -> None:
        self.kind, self.what = kind, kind.what

    def measured(self, dimensions: Sequence[tuple[str, ...]]) -> None:
        self.kind.measured(dimensions)

    def takes(self, value: Any) -> bool:
        return value is None or self.kind.takes(value)

    def made(self, value: Any, name: str, where: str) -> Any:
        return None if value is None else self.kind.made(value, name, where)

    def converted(self, value: Any, convert: Convert) -> Any:
        return None if value is None else self.kind.converted(value, convert)

    def hint(self, value: Any) -> str:
        return self.kind.hint(value)

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        return self.kind.schema(definitions)


def kind_of(hint: Any) -> Kind:
    """What an annotation says a value may be."""
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated:
        return _marked(*parts)
    if origin in (Union, types.UnionType):
        some = [kind_of(part) for part in parts if part is not type(None)]
        kind = some[0] if len(some) == 1 else _Either(some)
        return _Optional(kind) if type(None) in parts else kind
    if origin is Literal:
        return _Word(parts)
    if origin is tuple:
        fixed = parts[-1] is not Ellipsis
        return _List([kind_of(part) for part in parts if part is not Ellipsis], fixed=fixed)
    if (hint if origin is None else origin) is Mapping:
        return _Plain(Mapping, "a table", "values", "object")
    if isinstance(hint, type) and issubclass(hint, Document):
        return _Table(hint)
    if hint is bool:
        return _Plain(bool, "true or false", "values", "boolean")
    return _Plain(str, "a text", "texts", "string") if hint is str else _Number(whole=hint is int)


def _marked(hint: Any, *marks: Any) -> Kind:
    """The kind of an annotation with limits, with words of its own, or with another annotation or kind for documents."""
    for mark in marks:
        if isinstance(mark, Kind):
            return mark
        if not isinstance(mark, Limits | Says):
            hint = mark
    limits = [mark for mark in marks if isinstance(mark, Limits)]
    kind = _Number(limits[0], whole=hint is int) if limits else kind_of(hint)
    for mark in marks:
        if isinstance(mark, Says):
            kind.what, kind.many = mark.what, mark.many
            if isinstance(kind, _Number):
                kind.range = mark.what
    return kind


def any_number(*dimensions: str) -> Any:
    """The annotation of a number, or a text with a unit of one of these dimensions."""
    return Annotated[float, Limits(dimensions=dimensions)]


def positive(*dimensions: str) -> Any:
    """The same of a number above 0."""
    return Annotated[float, Limits(above=0, dimensions=dimensions)]


def pair(*dimensions: str) -> Any:
    """The same of two numbers, the lower one first."""
    return Annotated[Any, _Pair(kind_of(any_number(*dimensions)))]


def _items(cls: type) -> list[Any]:
    """The fields of a document; those that `compare` leaves out are not in it."""
    assert is_dataclass(cls)
    return [item for item in fields(cls) if item.compare]


_KNOWN: WeakKeyDictionary[type, dict[str, Kind]] = WeakKeyDictionary()


def kinds(cls: type) -> dict[str, Kind]:
    """What each field of a document may be, by name."""
    # Annotations can be read only when all of their modules are there, and not for every document anew.
    if cls not in _KNOWN:
        hints = typing.get_type_hints(cls, include_extras=True)
        assert issubclass(cls, Document)
        found = {item.name: kind_of(hints[item.name]) for item in _items(cls)}
        for name, kind in found.items():
            if dimensions := cls.dimensions(name):
                kind.measured(dimensions)
        _KNOWN[cls] = found
    return _KNOWN[cls]
