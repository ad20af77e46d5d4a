"""A rig file of any gauge."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stickslip.errors import InputError
from stickslip.files.documents import did_you_mean, read_toml
from stickslip.measurement.chain import Chain
from stickslip.measurement.gauges import GAUGES as OTHERS
from stickslip.measurement.gauges import Bench
from stickslip.measurement.rig import GAUGES, Rig


def load_rig(rig: Rig | Chain | Bench | str | Path | dict[str, Any]) -> Rig | Chain | Bench:
    """The rig of a TOML file or of its table: a `Rig` for the spring gauges, a `Bench` for all others.

    Where the stiffness is a matrix, masses pull on each other, and the rig is a `Chain`.

    Raises
    ------
    InputError
        naming the key that is missing, unknown or wrong.

    Examples
    --------
    >>> load_rig({"gauge": "force_log", "least_drop": 0.3, "sampling_rate": 4, "columns": {"force": 1}}).gauge
    'force_log'
    """
    if isinstance(rig, Rig | Chain | Bench):
        return rig
    where = "rig" if isinstance(rig, dict) else str(rig)
    table = rig if isinstance(rig, dict) else read_toml(rig, "rig file")
    known = [*GAUGES, *OTHERS]
    gauge = table.get("gauge")
    if gauge is None:
        raise InputError(f'{where}: gauge is missing; add a line `gauge = "..."` with one of {", ".join(known)}')
    if isinstance(gauge, str) and gauge in OTHERS:
        return OTHERS[gauge].bench(table, where)
    if gauge not in GAUGES:
        raise InputError(
            f"{where}: gauge must be one of {', '.join(known)}, got {gauge!r}{did_you_mean(str(gauge), known)}"
        )
    return Chain.from_table(table, where) if Chain.describes(table) else Rig.from_table(table, where)
