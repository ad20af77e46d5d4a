"""The JSON Schema of system files, and what their table ``[simulation]`` may hold."""

from __future__ import annotations

from typing import Annotated, Any

from stickslip.files.schema import Count, Limits, complete, kind_of
from stickslip.files.units import TEXTS
from stickslip.model.system import Oscillator, System, Velocity

Time = Annotated[float, Limits(above=0, dimensions=TEXTS["time"])]

#: Of a system of masses a start is one number a mass.
SIMULATION = {
    "t_end": Time,
    "x0": Annotated[float, Limits(dimensions=TEXTS["length"])] | tuple[float, ...],
    "v0": Velocity | tuple[float, ...],
    "max_events": Count,
    "max_seconds": Time,
}
"""What the table ``[simulation]`` of a system file may hold."""


def system_schema() -> dict[str, Any]:
    """The JSON Schema of a system file: an oscillator, or masses where it has contacts."""

    def described(definitions: dict[str, Any]) -> dict[str, Any]:
        table = {
            "type": "object",
            "properties": {key: kind_of(hint).schema(definitions) for key, hint in SIMULATION.items()},
            "additionalProperties": False,
        }
        systems = [cls.described(definitions) for cls in (Oscillator, System)]
        for system in systems:
            system["properties"]["simulation"] = table
        # A law may stand in a file of its own.
        definitions["Law"] = {"anyOf": [definitions["Law"], {"type": "string"}]}
        return {"title": "System", "anyOf": systems}

    return complete(described)
