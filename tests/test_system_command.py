"""A system file goes through the command in a process of its own, where no law has been imported yet."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import stickslip as ss


def test_chain_from_its_file(tmp_path: Path) -> None:
    system = ss.chain(3, ss.laws.StaticKinetic(1.0, 0.6), 0.2)
    path = tmp_path / "chain.toml"
    path.write_text(system.to_toml() + "\n[simulation]\nt_end = 30.0\n")
    command = [sys.executable, "-m", "stickslip", "simulate", str(path), "-o", str(tmp_path / "orbit.nc")]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert ss.load(tmp_path / "orbit.nc").system == system
