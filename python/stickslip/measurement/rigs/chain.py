"""Masses that pull on each other: the friction on each from the motion of all."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomli_w
import xarray as xr

from stickslip.errors import InputError, number
from stickslip.files.arrays import Array
from stickslip.measurement.rigs.rig import Rig

EACH = ("mass", "drive_velocity", "rest", "noise", "effective_mass")
"""Keys that may be a list, one number a mass."""


@dataclass(frozen=True)
class Chain:
    """The rig of several masses, tied to the ground and to each other.

    Σ_j (k_ij x_j + d_ij x_j') + m_i x_i'' = friction on mass i, the matrices as in :class:`stickslip.System`.

    Parameters
    ----------
    rigs : of each mass as if the others were held where they rest: k_ii, d_ii.
    stiffness, damping : (n, n) symmetric, N/m and N s/m (or dimensionless).

    Examples
    --------
    >>> table = {"instrument": "displacement", "column": "x", "unit": "1", "mass": 1, "drive_velocity": 0.2}
    >>> Chain.from_table(table | {"stiffness": [[2, -1], [-1, 2]]}, "rig").rigs[0].stiffness
    2.0
    """

    rigs: tuple[Rig, ...]
    stiffness: tuple[tuple[float, ...], ...]
    damping: tuple[tuple[float, ...], ...]

    @staticmethod
    def describes(table: Mapping[str, Any]) -> bool:
        """Whether a rig table is that of several masses: its stiffness is a matrix."""
        return isinstance(table.get("stiffness"), list | tuple | np.ndarray)

    @classmethod
    def from_table(cls, table: Mapping[str, Any], source: str) -> Chain:
        """Read the rig of several masses: a spring rig with matrices, and with lists for what differs.

        Raises
        ------
        InputError
            for a matrix that is not square and symmetric or not of the size of the lists, another instrument than
            ``"displacement"``, and what a rig of one mass refuses.
        """
        if table.get("instrument") != "displacement":
            raise InputError(
                f'{source}: a matrix of stiffness needs instrument = "displacement", the place of every mass, got '
                f"{table.get('instrument')!r}"
            )
        stiffness = _matrix("stiffness", table["stiffness"], source)
        n = len(stiffness)
        damping = _matrix("damping", table.get("damping", np.zeros((n, n))), source)
        if len(damping) != n:
            raise InputError(f"{source}: damping must be a {n} x {n} matrix like stiffness, got {len(damping)} rows")
        lists = {key: table[key] for key in EACH if isinstance(table.get(key), list | tuple)}
        for key, values in lists.items():
            if len(values) != n:
                raise InputError(f"{source}: {key} must be one number or {n}, one a mass, got {len(values)}")
        rigs = []
        for i in range(n):
            own = {key: values[i] for key, values in lists.items()}
            own |= {"stiffness": stiffness[i][i], "damping": damping[i][i]}
            rigs.append(Rig.from_dict({**table, **own}, source))
        return cls(tuple(rigs), stiffness, damping)

    def to_toml(self) -> str:
        """The document of all masses; :meth:`from_table` reads it back."""
        tables = [tomllib.loads(rig.to_toml()) for rig in self.rigs]
        lists = {key: [table[key] for table in tables] for key in EACH if key in tables[0]}
        return tomli_w.dumps(tables[0] | lists | {"stiffness": self.stiffness, "damping": self.damping})


def _matrix(key: str, value: object, source: str) -> tuple[tuple[float, ...], ...]:
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(rows, list | tuple) or not all(
        isinstance(row, list | tuple) and len(row) == len(rows) for row in rows
    ):
        raise InputError(
            f"{source}: {key} of several masses must be a square matrix, [[k11, k12], [k21, k22]], got {value!r}"
        )
    matrix = np.array([[number(key, one, source) for one in row] for row in rows])
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0):
        raise InputError(f"{source}: {key} must be symmetric: what pulls one mass pulls the other back")
    return tuple(tuple(row) for row in matrix.tolist())


def pull_together(trees: Mapping[str, xr.DataTree], chain: Chain) -> dict[str, xr.DataTree]:
    """Add to the friction on each mass what the others pull: c_i = Σ_{j≠i} (k_ij x_j + d_ij x_j').

    While mass i is held by friction, its springs carry more by c_i; so c_i belongs to `force`, and to the force, force
    rate and drop of its break-aways.

    Parameters
    ----------
    trees : the friction of each mass with its own k_ii, d_ii and m_i, in the order of the chain.
    chain : the matrices.

    Returns
    -------
    The trees over the time in which all masses were seen.
    """
    parts = list(trees.values())
    times = [tree["time"].to_numpy() for tree in parts]
    start, end = max(float(time[0]) for time in times), min(float(time[-1]) for time in times)
    if not start < end:
        raise InputError("measure: the masses were never seen at the same time, so their pull is not known")
    return {name: _pulled(i, parts, chain, (start, end)) for i, name in enumerate(trees)}


def _pulled(i: int, parts: Sequence[xr.DataTree], chain: Chain, window: tuple[float, float]) -> xr.DataTree:
    root = parts[i].to_dataset()
    data = root.sel(time=slice(*window))
    time = data["time"].to_numpy()
    pull, square = np.zeros(len(time)), np.zeros(len(time))
    for j, other in enumerate(parts):
        k, d = chain.stiffness[i][j], chain.damping[i][j]
        if j == i or (k == 0 and d == 0):
            continue
        seen = other["time"].to_numpy()
        for factor, name in ((k, "displacement"), (d, "velocity")):
            pull += factor * np.interp(time, seen, other[name].to_numpy())
        square += (k * float(other.attrs["noise"])) ** 2
    unit = data["force"].attrs
    data["force"] = ("time", data["force"].to_numpy() + pull, unit)
    data["force_error"] = ("time", np.hypot(data["force_error"].to_numpy(), np.sqrt(square)), unit)
    own = data["displacement"].to_numpy() * chain.stiffness[i][i]
    events = _events(parts[i]["break_away"].to_dataset(), time, data["force"].to_numpy(), pull, own + pull)
    data.attrs = {
        **root.attrs,
        "rig": chain.to_toml(),
        "slips": root.attrs["slips"] if root.attrs["regime"] == "unknown" else int(events.sizes["event"]),
        "notes": [*root.attrs["notes"], "the springs and dampers between the masses pull too: that is in the force"],
    }
    return xr.DataTree.from_dict({"/": data, "/break_away": events})


def _events(table: xr.Dataset, time: Array, force: Array, pull: Array, springs: Array) -> xr.Dataset:
    """The break-aways inside the common time, with the pull of the others."""
    ends = table["t"].to_numpy()
    inside = np.flatnonzero((ends > time[0]) & (ends < time[-1]))
    table = table.isel(event=inside)
    ends, starts = table["t"].to_numpy(), table["t"].to_numpy() - table["stick_time"].to_numpy()
    rates, drops = table["force_rate"].to_numpy().copy(), table["drop"].to_numpy().copy()
    for row, end in enumerate(ends):
        a = int(np.searchsorted(time, starts[row])) if np.isfinite(starts[row]) else 0
        b = int(np.searchsorted(time, end))
        if b - a >= 4:
            rates[row] = float(np.polyfit(time[a:b] - end, force[a:b], 1)[0])
        following = starts[row + 1] if row + 1 < len(ends) else np.nan
        if np.isfinite(following):
            c = int(np.searchsorted(time, following, side="right"))
            drops[row] = float(np.interp(end, time, springs) - springs[b:c].min()) if c > b else np.nan
    held = table["force"].to_numpy() + np.interp(ends, time, pull)
    for name, values in (("force", held), ("force_rate", rates), ("drop", drops)):
        table[name] = ("event", values, table[name].attrs)
    return table
