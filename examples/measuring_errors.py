"""The table of docs/evidence/measuring.md: how good friction from a film is, over frame rate and noise.

Run it with ``python examples/measuring_errors.py`` (a few minutes); it prints the table.
"""

import math

import numpy as np

import stickslip as ss
from stickslip.measurement import Rig, measure

PERIOD = 2 * math.pi
SPAN = 320.0  # px over which the mass moves
OSCILLATORS = {
    "soft": [ss.paper.oscillator(s) for s in (0.15, 0.2, 0.25)],
    "jump": [
        ss.Oscillator(damping=0.1, drive_velocity=s, law=ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6))
        for s in (0.1, 0.2, 0.3)
    ],
}


def errors(
    oscillator: ss.Oscillator, rate: int, noise: float, seed: int
) -> tuple[float, list[float], list[float], int]:
    """Force error over f_s, errors of releases and captures in pictures, and sticks missed or invented."""
    start, duration, step = 60.0 + 0.37 * seed, 8 * PERIOD, PERIOD / rate
    orbit = ss.simulate(oscillator, start + duration + 1)
    time = np.arange(start, start + duration, step)
    x = orbit.at(time)[0]
    x = x + noise / SPAN * np.ptp(x) * np.random.default_rng(seed).standard_normal(len(x))
    rig = Rig(
        instrument="displacement", column="x", unit="1", stiffness=1, mass=1, damping=oscillator.damping,
        drive_velocity=float(oscillator.drive_velocity),
    )  # fmt: skip
    friction = measure({"t": time, "x": x}, rig)
    force = orbit.to_xarray(time)["force"].to_numpy()
    scatter = float(np.sqrt(np.mean((friction["force"].to_numpy() - force)[:-3] ** 2)) / np.abs(force).max())
    table = friction["break_away"].to_dataset()
    ends = table["t"].to_numpy()
    starts = ends - table["stick_time"].to_numpy()
    last = orbit.events.query("kind == 'release' and t < @time[-1] - 1")["t"].max()
    apart, wrong = [], 0
    for kind, seen in (("release", ends), ("capture", starts[np.isfinite(starts)])):
        at = orbit.events.query("kind == @kind and t > @time[0]")["t"].to_numpy()
        seen = seen[seen < last + 0.5]
        at = at[at < last + 0.5 * (kind == "release")]
        near = [seen[np.abs(seen - t) < 0.5] for t in at]
        apart.append([float((found[0] - t) / step) for found, t in zip(near, at, strict=True) if len(found)])
        wrong += sum(len(found) == 0 for found in near) + abs(len(seen) - sum(len(found) > 0 for found in near))
    return scatter, apart[0], apart[1], wrong


def main() -> None:
    print(
        "| break-away | pictures a period | scatter, px | force, % of f_s | release, pictures | capture, pictures | wrong |"
    )
    print("|---|---|---|---|---|---|---|")
    for name, oscillators in OSCILLATORS.items():
        for rate in (30, 60, 120, 200):
            for noise in (0.02, 0.1):
                rows = [errors(one, rate, noise, seed) for one in oscillators for seed in (0, 1)]
                force = 100 * max(row[0] for row in rows)
                worst = [max((abs(t) for row in rows for t in row[i]), default=math.nan) for i in (1, 2)]
                wrong = sum(row[3] for row in rows)
                print(
                    f"| {name} | {rate} | {noise} | {force:.1f} | {worst[0]:.1f} | {worst[1]:.1f} | {wrong} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
