"""Make the record that ships with the package: ``python -m stickslip.examples.make``."""

from pathlib import Path

import numpy as np

from stickslip.model.system_file import load_system
from stickslip.simulation.simulate import simulate

SETTLED, DURATION, RATE = 2.0, 4.0, 250.0
"""Start of the record, its length (s) and samples per second."""
NOISE = 2e-5
"""Standard deviation of the white noise of the sensor in m."""


def record(seed: int = 1) -> str:
    """The text of ``block.csv``: time in s, position in mm."""
    orbit = simulate(load_system(Path(__file__).with_name("system.toml")), SETTLED + DURATION)
    time = np.arange(round(DURATION * RATE)) / RATE
    position = orbit.at(SETTLED + time)[0] + NOISE * np.random.default_rng(seed).standard_normal(time.size)
    rows = [f"{t:.3f},{1e3 * x:.3f}" for t, x in zip(time, position, strict=True)]
    return "\n".join(["time,position", *rows, ""])


if __name__ == "__main__":
    Path(__file__).with_name("block.csv").write_text(record(), encoding="utf-8")
