"""Numbers of a system document by their path, such as ``law.break_away`` or ``forcing.amplitude``, and grids over them.

Of a system of masses ``drive_velocity`` is that of all its contacts on a drive, where it is the same.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip.errors import InputError, did_you_mean, numbers, whole_number
from stickslip.model.system import Oscillator, System, paths_of, system_from_dict, usual_name

#: Names of a start: position and velocity, for a system of masses with the number of the mass, ``x0.1``.
STARTS = ("x0", "v0")


def document_of(system: Oscillator | System) -> dict[str, Any]:
    """The document of a system as the core reads it, where forcing is a list.

    >>> from stickslip import paper
    >>> document_of(paper.oscillator(0.3))["drive_velocity"]
    0.3
    """
    document: dict[str, Any] = json.loads(system.to_json())
    return document


def is_dimensionless(system: Oscillator | System, over: Iterable[str] = ()) -> bool:
    """Whether mass and stiffness, or each of several masses, are 1, and stay so over the parameters that are varied.

    >>> from stickslip import paper
    >>> is_dimensionless(paper.oscillator(0.3)), is_dimensionless(paper.oscillator(0.3), ["mass"])
    (True, False)
    """
    if not {"mass", "stiffness"}.isdisjoint(path.split(".")[0] for path in over):
        return False
    if isinstance(system, Oscillator):
        return system.mass == system.stiffness == 1
    return all(row[i] == 1 for i, row in enumerate(system.mass))


def path_in(name: str, document: Mapping[str, Any], where: str, *, starts: bool = True) -> str:
    """The dotted path of the number `name` in a document; starts, where they may be named, stay as they are.

    >>> from stickslip import Harmonic, paper
    >>> path_in("forcing.amplitude", document_of(paper.oscillator(0.3, Harmonic(0.1, 1.2))), "example")
    'forcing.0.amplitude'
    """
    if not isinstance(name, str):
        raise InputError(f"{where}: a parameter is named by a word such as 'drive_velocity', got {name!r}")
    if starts and name.split(".")[0] in STARTS:
        return name
    name = usual_name(name)
    driven = _driven(document)
    if name == "drive_velocity" and driven is not None:
        speeds = [document["contacts"][i]["drive_velocity"] for i in driven]
        if not speeds or any(speed != speeds[0] for speed in speeds):
            raise InputError(
                f"{where}: 'drive_velocity' of a system of masses is that of all its contacts on a drive, and here they "
                "have not the same; name one of them, such as 'contacts.0.drive_velocity'"
            )
    node: Any = document
    for key in paths_of(name, driven)[0].split("."):
        try:
            node = node[int(key)] if isinstance(node, list) else node[key]
        except (KeyError, IndexError, ValueError, TypeError):
            known = [*node] if isinstance(node, Mapping) else []
            hint = did_you_mean(key, known)
            listed = f"; known here are {', '.join(known)}" if known else ""
            raise InputError(f"{where}: the system has no number {name!r}{hint}{listed}") from None
    if isinstance(node, bool) or not isinstance(node, int | float):
        inner = ""
        if isinstance(node, list | Mapping) and node:
            keys = list(node) if isinstance(node, Mapping) else [str(i) for i in range(len(node))]
            inner = f"; it holds {', '.join(f'{name}.{key}' for key in keys[:4])}{', …' if len(keys) > 4 else ''}"
        raise InputError(f"{where}: {name!r} is not a number of the system, so it cannot be varied{inner}")
    return name


def varied(document: Mapping[str, Any], paths: Sequence[str], values: Sequence[float]) -> tuple[Any, dict[str, Any]]:
    """The system with `values` at `paths`, and the start among them as arguments of :func:`stickslip.simulate`.

    >>> from stickslip import paper
    >>> varied(document_of(paper.oscillator(0.3)), ["damping", "x0"], [0.1, 2.0])[1]
    {'x0': 2.0}
    """
    copy = json.loads(json.dumps(document))
    starts: dict[str, Any] = {}
    masses = len(copy["mass"]) if isinstance(copy["mass"], list) else None
    for path, value in zip(paths, values, strict=True):
        *parents, last = path.split(".")
        if path.split(".")[0] in STARTS:
            if masses is None or not parents:
                starts[path] = value
            else:
                starts.setdefault(parents[0], [0.0] * masses)[int(last)] = value
            continue
        for one in paths_of(path, _driven(copy)):
            *parents, last = one.split(".")
            node = copy
            for key in parents:
                node = node[int(key)] if isinstance(node, list) else node[key]
            node[int(last) if isinstance(node, list) else last] = value
    return system_from_dict(copy), starts


def _driven(document: Mapping[str, Any]) -> list[int] | None:
    """Of the document of masses the contacts on a drive; None for an oscillator."""
    contacts = document.get("contacts")
    return None if contacts is None else [i for i, item in enumerate(contacts) if item.get("other") is None]


def contact_of(system: Oscillator | System, contact: int, where: str) -> int:
    """The contact that is looked at, if the system has it.

    >>> from stickslip import paper
    >>> contact_of(paper.oscillator(0.3), 0, "example")
    0
    """
    return whole_number("contact", contact, where, 0, len(system.contacts) - 1)


def initial_state(
    system: Oscillator | System, x0: ArrayLike | None, v0: ArrayLike | None, where: str
) -> tuple[list[float] | None, list[float] | None]:
    """Positions and velocities of the masses at the start as the core reads them; None where they are not given.

    >>> from stickslip import paper
    >>> initial_state(paper.oscillator(0.3), 0.5, None, "example")
    ([0.5], None)
    """
    x, v = (
        None if value is None else numbers(name, value, system.masses, where, "mass")
        for name, value in zip(STARTS, (x0, v0), strict=True)
    )
    return x, v


def axis_of(name: str, values: ArrayLike, where: str) -> NDArray[np.float64]:
    """The values of an axis: finite numbers, at least one.

    >>> axis_of("damping", 0.1, "example")
    array([0.1])
    """
    try:
        axis = np.atleast_1d(np.asarray(values, float))
    except (TypeError, ValueError):
        raise InputError(f"{where}: the values of {name} must be numbers, got {values!r}") from None
    if axis.ndim != 1 or not axis.size:
        raise InputError(f"{where}: {name} must be a list of one number or more, got shape {axis.shape}")
    if not np.isfinite(axis).all():
        index = int(np.argmin(np.isfinite(axis)))
        raise InputError(f"{where}: {name} must be finite numbers, got {axis[index]} at place {index}")
    return axis


def grid(name: str, values: ArrayLike, where: str) -> NDArray[np.float64]:
    """The values of an axis, in increasing order.

    >>> grid("damping", [0.1, 0.2], "example")
    array([0.1, 0.2])
    """
    axis = axis_of(name, values, where)
    if (np.diff(axis) <= 0).any():
        raise InputError(f"{where}: the values of {name} must be a list of finite numbers in increasing order")
    return axis
