"""What the page knows of every law: names, symbols, ranges and words of its numbers, read from where they are documented."""

from __future__ import annotations

import inspect
import json
import re
from dataclasses import fields
from typing import Any

from stickslip.files.schema import Document, docstring_words
from stickslip.laws import Law
from stickslip.laws.state_law import StateLaw
from stickslip.laws.static_friction import StaticFriction
from stickslip.model.system import Oscillator

#: A symbol at the start of a description, or before a relation or a comma: f_s, Δ∞, σ₀, γ, z∞.
_SYMBOL = re.compile(r"(?<![\w/])((?:[A-Zα-ωΑ-Ω]|[a-zμ])(?:_[A-Za-z0-9]{1,2}|[₀-₉]|∞)?)(?=\s*(?:[><≥≤,.;=:(]|$))")
_UNDER = str.maketrans("0123456789sk", "₀₁₂₃₄₅₆₇₈₉ₛₖ")
#: The paper says of all three that they are angles in degrees.
_ANGLES = {"phi": "angle of A’s lines", "psi": "angle of C’s lines", "eta": "angle of D’s lines"}
_GREEK = {"phi": "φ", "psi": "ψ", "eta": "η", "alpha": "α", "beta": "β", "gamma": "γ"}


def _parameters(cls: type) -> dict[str, str]:
    """The words of a docstring, name by name."""
    words = docstring_words(cls)
    # A law may refer to another one of its family for words.
    other = next((found[1] for said in words.values() if (found := re.match(r"as for :class:`(\w+)`", said))), None)
    return (
        {**words, **{name: said for name, said in _parameters(Law.ALL[other]).items() if name in words}}
        if other
        else words
    )


def _symbol(name: str, words: str, position: int) -> str:
    """The symbol of the parameter at `position` among those that share these words; its own name where there is none."""
    if len(name) == 1:
        return name
    if name in _GREEK:
        return _GREEK[name]
    found = _SYMBOL.findall(words)
    symbol = found[position] if position < len(found) else name.replace("_", " ")
    return re.sub(r"_([0-9sk])$", lambda match: match[1].translate(_UNDER), symbol)


def _spoken(words: str) -> str:
    """Words as they are read to someone: no marks of source text, and nothing of what Python calls None."""
    return re.sub(r"[,;] None\b[^.;]*|:\w+:(?=`)", "", words).replace("`", "")


def _range(value: object, unit: str) -> tuple[float, float]:
    """From where to where a slider goes."""
    if unit == "angle":
        return -89.0, 89.5
    size = abs(value) if isinstance(value, int | float) and value else 1.0
    low = 0.0 if isinstance(value, int | float) and value >= 0 else -3 * size
    return low, float(f"{3 * size:.6g}")


def _numbers(table: Law | StaticFriction, document: dict[str, Any], path: str = "") -> list[dict[str, Any]]:
    """Every parameter of a law or of a table within it."""
    words = {name: _spoken(said) for name, said in _parameters(type(table)).items()}
    shared: dict[str, int] = {}
    numbers: list[dict[str, Any]] = []
    for item in fields(table):
        value = getattr(table, item.name)
        said = words.get(item.name, item.name.replace("_", " "))
        position = shared.get(said, 0)
        shared[said] = position + 1
        if isinstance(value, Law | StaticFriction):
            numbers += _numbers(value, document[item.name], f"{path}{item.name}.")
            continue
        parameter = type(table).PARAMETERS[item.name]
        dimension = parameter.dimension
        if value is None and parameter.numbers:  # it is left out: the range is that of the first number of its kind
            like = (name for name in document if name in type(table).PARAMETERS and document[name] is not None)
            value = next((document[name] for name in like if type(table).PARAMETERS[name].dimension == dimension), None)
        low, high = _range(value, dimension)
        number = {
            "path": path + item.name,
            "symbol": _symbol(item.name, said, position),
            "name": _ANGLES.get(item.name, said.rstrip(".") if item.name in _GREEK else item.name.replace("_", " ")),
            "words": said.rstrip("."),
            "unit": dimension,
            "low": low,
            "high": high,
        }
        choices = parameter.choices
        options = (
            {"choices": list(choices)} if choices else {"options": list(parameter.words)} if parameter.words else {}
        )
        numbers.append(number | options)
    return numbers


def full(law: Law) -> dict[str, Any]:
    """The document of a law with every parameter in it; a pencil at infinity, or what else is None, as null."""
    document = {item.name: getattr(law, item.name) for item in fields(law)}
    inner = {name: full(value) if isinstance(value, Law) else value for name, value in document.items()}
    return {"type": type(law).__name__, **_plain(inner)}


def whole(table: Document) -> dict[str, Any]:
    """A document with every number in it, those that have their usual value too."""
    return _plain({item.name: getattr(table, item.name) for item in fields(table)})


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    plain: dict[str, Any] = json.loads(json.dumps(values, default=whole))
    return plain


def laws() -> dict[str, Any]:
    """Each law of the package: its sentence, its numbers, an example, and whether it has an internal state."""
    catalogue = {}
    for name, cls in Law.ALL.items():
        example = cls.example()
        document = full(example)
        catalogue[name] = {
            "sentence": (inspect.getdoc(cls) or "").partition("\n")[0],
            "numbers": _numbers(example, document),
            "example": document,
            "state": issubclass(cls, StateLaw),
        }
    return catalogue


def oscillator() -> list[dict[str, Any]]:
    """The numbers of the oscillator itself."""
    words = _parameters(Oscillator)
    highs = {"drive_velocity": 0.6, "damping": 1.0, "stiffness": 3.0, "mass": 3.0}
    return [
        {
            "path": name,
            "symbol": {"drive_velocity": "s", "damping": "D", "stiffness": "k", "mass": "m"}[name],
            "name": "drive velocity" if name == "drive_velocity" else name,
            "words": _spoken(words[name]).rstrip("."),
            "unit": "",
            "low": 0.05 if name in ("stiffness", "mass") else 0.0,
            "high": high,
        }
        for name, high in highs.items()
    ]
