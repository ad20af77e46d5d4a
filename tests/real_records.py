"""Real records and the rigs that come with the package."""

from __future__ import annotations

from pathlib import Path

import pytest
import xarray as xr

import stickslip as ss

RIGS = Path(__file__).parents[1] / "python" / "stickslip" / "examples" / "rigs"


def measured(shared_data: Path, rig: str, *patterns: str) -> xr.DataTree:
    """Friction of the records with these names, by this rig; without them the test is skipped."""
    files = [path for pattern in patterns for path in sorted(shared_data.glob(pattern))]
    if not files:
        pytest.skip(f"no records {patterns} in {shared_data}")
    return ss.measure(files, RIGS / f"{rig}.toml")
