"""A rig file of any instrument."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

from stickslip.errors import InputError, did_you_mean
from stickslip.files.disk import read_toml
from stickslip.files.schema import complete
from stickslip.measurement.instruments import INSTRUMENTS as OTHERS
from stickslip.measurement.instruments import InstrumentRig
from stickslip.measurement.rigs.chain import EACH, Chain
from stickslip.measurement.rigs.rig import INSTRUMENTS, Rig


def load_rig(rig: Rig | Chain | InstrumentRig | str | Path | dict[str, Any]) -> Rig | Chain | InstrumentRig:
    """The rig of a TOML file or of its table: a `Rig` for the spring instruments, an `InstrumentRig` for all others.

    Where the stiffness is a matrix, masses pull on each other, and the rig is a `Chain`.

    Raises
    ------
    InputError
        naming the key that is missing, unknown or wrong.

    Examples
    --------
    >>> load_rig({"instrument": "force_log", "least_drop": 0.3, "sampling_rate": 4, "columns": {"force": 1}}).instrument
    'force_log'
    """
    if isinstance(rig, Rig | Chain | InstrumentRig):
        return rig
    where = "rig" if isinstance(rig, dict) else str(rig)
    table = rig if isinstance(rig, dict) else read_toml(rig, "rig file")
    known = [*INSTRUMENTS, *OTHERS]
    instrument = table.get("instrument")
    if instrument is None:
        raise InputError(
            f'{where}: instrument is missing; add a line `instrument = "..."` with one of {", ".join(known)}'
        )
    if isinstance(instrument, str) and instrument in OTHERS:
        return OTHERS[instrument].rig_of(table, where)
    if instrument not in INSTRUMENTS:
        raise InputError(
            f"{where}: instrument must be one of {', '.join(known)}, got {instrument!r}{did_you_mean(str(instrument), known)}"
        )
    return Chain.from_table(table, where) if Chain.describes(table) else Rig.from_dict(table, where)


def rig_schema() -> dict[str, Any]:
    """The JSON Schema of a rig file of any instrument; where masses pull on each other, numbers may be lists or matrices."""

    def described(definitions: dict[str, Any]) -> dict[str, Any]:
        one = Rig.described(definitions)
        several = copy.deepcopy(one) | {"title": "Chain"}
        row = {"type": "array", "items": {"type": "number"}}
        for key in EACH:
            several["properties"][key] = {"anyOf": [one["properties"][key], row]}
        for key in ("stiffness", "damping"):
            several["properties"][key] = {"type": "array", "items": row}
        return {"title": "Rig", "anyOf": [one, several, *(item.described(definitions) for item in OTHERS.values())]}

    return complete(described)
