"""Reading a system file: an oscillator or masses, and how to simulate them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stickslip.files.disk import read_toml
from stickslip.files.schema import check_keys, kind_of
from stickslip.files.units import check_one_kind
from stickslip.laws.law import load_law
from stickslip.model.system import Oscillator, System, system_from_dict
from stickslip.model.system_schema import SIMULATION


def load_system_document(path: str | Path) -> tuple[Oscillator | System, dict[str, Any]]:
    """The system of a system file and its table ``[simulation]`` (t_end, x0, v0, max_events, max_seconds; may be empty)."""
    document = read_toml(path)
    simulation = document.pop("simulation", {})
    where = f"{path}: simulation"
    check_keys(simulation, SIMULATION, (), where)
    check_one_kind({**document, "simulation": simulation}, str(path))
    simulation = {key: kind_of(SIMULATION[key]).read(value, key, where) for key, value in simulation.items()}
    contacts = document.get("contacts")
    for table in [document, *(contacts if isinstance(contacts, list) else [])]:
        if isinstance(table, dict) and isinstance(table.get("law"), str):
            table["law"] = load_law(Path(path).parent / table["law"])
    return system_from_dict(document, str(path)), simulation


def load_system(path: str | Path) -> Oscillator | System:
    """The oscillator or, where the file has ``[[contacts]]``, the system of masses of a system file.

    ``law`` is a table, or the path of a law file relative to the system file.

    Raises
    ------
    InputError
        with the file and the key.
    """
    return load_system_document(path)[0]
