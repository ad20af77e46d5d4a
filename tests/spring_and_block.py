"""Records of a block on a moving belt from a simulator of the tests' own, which shares no line with the package."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr


def motion(kinetic, limit, drive, *, damping=0.1, step=0.05, samples=3000, inner=10, skip=500):
    """Position, velocity, friction, stuck and releases (time, stick time, limit) of a block of mass 1 on a spring of 1.

    `kinetic` is f(w) for w > 0, `limit` the break-away force over the stick time.
    """
    x, v, rest, stuck, h = 0.0, drive, 0.0, True, step / inner
    rows, releases = [], []

    def rate(x, v):
        return kinetic(abs(drive - v)) - damping * v - x

    for i in range(-skip, samples):
        rows.append((x, v, x + damping * drive if stuck else kinetic(drive - v), stuck))
        for j in range(inner):
            if stuck:
                x, rest = x + drive * h, rest + h
                if x + damping * drive > limit(rest):
                    stuck, v = False, drive - 1e-12
                    releases.append((i * step + j * h, rest, limit(rest)))
                continue
            a1, v1 = rate(x, v), v
            a2, v2 = rate(x + h / 2 * v1, v + h / 2 * a1), v + h / 2 * a1
            a3, v3 = rate(x + h / 2 * v2, v + h / 2 * a2), v + h / 2 * a2
            a4, v4 = rate(x + h * v3, v + h * a3), v + h * a3
            x, v = x + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            if v >= drive:
                stuck, v, rest = True, drive, 0.0
    x, v, force, stuck = np.array(rows[skip:]).T
    return x, v, force, stuck.astype(bool), np.array([row for row in releases if row[0] > row[1]]).reshape(-1, 3)


def coloured(count, together, random):
    """Normal noise of standard deviation 1 that goes together over so many samples."""
    white = random.standard_normal(count)
    keep = math.exp(-2 / together) if together > 1 else 0.0
    for i in range(1, count):
        white[i] = keep * white[i - 1] + math.sqrt(1 - keep**2) * white[i]
    return white


def record(kinetic, limit, drive, *, noise=0.01, together=1.0, recorded=0.0, seed=0, damping=0.1, step=0.05, **more):
    """The friction file of such a motion, with noise of the force and, with `recorded`, of the displacement too."""
    x, v, force, stuck, releases = motion(kinetic, limit, drive, damping=damping, step=step, **more)
    random = np.random.default_rng(seed)
    data = {
        "slip_velocity": np.where(stuck, 0.0, drive - v),
        "force": force + noise * coloured(x.size, together, random),
        "force_error": np.full(x.size, noise),
        "stuck": stuck,
        "displacement": x,
    }
    if recorded:
        data["recorded"] = x + recorded * coloured(x.size, together, random)
    root = xr.Dataset({name: ("time", values) for name, values in data.items()}, {"time": step * np.arange(x.size)})
    root.attrs = {"mass": 1.0, "damping": damping, "stiffness": 1.0, "drive_velocity": drive, "notes": []}
    t, rest, level = releases.T
    falls = [x[(root.time.values >= a) & (root.time.values <= b)] for a, b in zip(t, [*t[1:], np.inf], strict=True)]
    table = {
        "t": t,
        "stick_time": rest,
        "force_rate": np.full(t.size, drive),
        "force": level + noise * random.standard_normal(t.size),
        "drop": np.array([np.ptp(fall) if fall.size else np.nan for fall in falls]),
    }
    rows = {name: ("event", values) for name, values in table.items()}
    rows |= {f"{name}_error": ("event", np.full(t.size, noise * (name in ("force", "drop")))) for name in table}
    return xr.DataTree.from_dict({"/": root, "/break_away": xr.Dataset(rows)})
