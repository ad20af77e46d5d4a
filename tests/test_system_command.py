"""A system file goes through the command."""

from __future__ import annotations

from pathlib import Path

import stickslip as ss
from stickslip.cli.main import main


def test_chain_from_its_file(tmp_path: Path) -> None:
    system = ss.chain(3, ss.laws.StaticKinetic(1.0, 0.6), 0.2)
    path = tmp_path / "chain.toml"
    path.write_text(system.to_toml() + "\n[simulation]\nt_end = 30.0\n")
    assert main(["simulate", str(path), "-o", str(tmp_path / "orbit.nc")]) == 0
    assert ss.load(tmp_path / "orbit.nc").system == system
