"""A pendulum that swings out: friction from the energy that each cycle costs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.integrate import cumulative_trapezoid

from stickslip.errors import InputError
from stickslip.files.arrays import Array
from stickslip.files.schema import positive
from stickslip.measurement.instruments.instrument import Constant, Instrument, InstrumentRig, Samples, only
from stickslip.measurement.result import event_table, friction_tree
from stickslip.measurement.signals.smooth import Smooth, jerk_spline

MODELS = {
    "Coulomb + viscous": (0, 1),
    "Coulomb + quadratic drag": (0, 2),
    "Coulomb + viscous + quadratic drag": (0, 1, 2),
}
"""What dissipates, as powers of the speed."""
NAMES = ("force", "viscous", "quadratic")
"""What the coefficient of each power is called among the facts."""


def _measure(records: list[Samples], rig: InstrumentRig) -> xr.DataTree:
    """Coulomb torque and what grows with speed, from the energy m g l (1 - cos A) of successive turning points A.

    The energy of a full cycle over its path is tau_c + c <|v|> + q <v^2>, means over the path. Which of the terms with
    speed is at work a decay hardly tells, so three models are fitted: the value is that of the one that fits best with
    no negative coefficient, and the error covers the Coulomb torques of all of them.

    A mean of w^2 is more than the square of the mean of w. So that the rows of the table `steady` lie on the curve of torque
    over speed, what the drag of that model has of it is taken off the mean torque of each cycle.
    """
    record = only(records, "free_decay")
    restoring = rig.maybe("restoring_torque")
    if restoring is None:
        mass, length = rig.maybe("mass"), rig.maybe("length")
        if mass is None or length is None:
            raise InputError(
                "rig: a free_decay instrument needs restoring_torque (m g l), or mass and length; add them"
            )
        restoring = mass * length * rig.number("gravity")
    notes = list(record.notes)
    time = record.time
    smooth = jerk_spline(time, record["angle"])
    at, swing = _turning_points(time, smooth)
    if len(swing) < 6:
        raise InputError(f"{record.source}: {len(swing)} turning points are too few for a decay, at least 6 are needed")
    rest = float(np.median((swing[:-2] + 2 * swing[1:-1] + swing[2:]) / 4))
    swing = swing - rest
    kept = _decaying(np.abs(swing), rig.number("least_amplitude"))
    at, swing = at[kept], swing[kept]
    if len(swing) and np.abs(swing).max() > np.pi:
        raise InputError(
            f"{record.source}: swings of {np.abs(swing).max():.3g} rad are larger than half a turn, over which a pendulum "
            'goes round; is the angle in degrees? Give its unit in the rig, as angle = { column = ..., unit = "deg" }'
        )
    if len(swing) < 6:
        raise InputError(
            f"{record.source}: {len(swing)} swings are larger than least_amplitude = {rig.number('least_amplitude'):g} "
            "rad; at least 6 are needed"
        )
    notes.append(f"the angle of rest is {rest:.4g} rad by the turning points; it was subtracted")
    paths = np.stack([_per_cycle(time, np.abs(smooth.v) ** (power + 1), at) for power in range(3)])
    energy = restoring * (1 - np.cos(swing))
    torque = (energy[:-2] - energy[2:]) / paths[0]
    speed = paths[1:] / paths[0]
    fits = {name: _fit(torque, speed, powers) for name, powers in MODELS.items()}
    sound = {name: fit for name, fit in fits.items() if min(fit[0]) >= 0} or fits
    best = min(sound, key=lambda name: sound[name][2] / (len(torque) - len(sound[name][0])) ** 0.5)
    values, errors, rms = fits[best]
    coulomb = values[0]
    spread = max(abs(fit[0][0] - coulomb) for fit in fits.values())
    coulomb_error = float(np.hypot(errors[0], spread))
    others = "; ".join(f"{name}: {fit[0][0]:.2e} N m (rms {fit[2]:.1e})" for name, fit in fits.items())
    notes.append(f"Coulomb torque by model: {others}; {best} is used and the error covers them all")
    powers = MODELS[best]
    drag, drag_error = (column[powers.index(2)] if 2 in powers else 0.0 for column in (values, errors))
    curved = speed[1] - speed[0] ** 2
    amplitude = np.abs(swing[:-2])
    loss = amplitude - np.abs(swing[2:])
    tends, tends_error = 4 * coulomb / restoring, 4 * coulomb_error / restoring
    notes.append(
        f"amplitude {amplitude[0]:.3g} -> {abs(swing[-1]):.3g} rad; loss per cycle {loss[0]:.3g} rad at first, "
        f"{np.median(loss[-6:]):.3g} at last: it tends to {tends:.2g} +- {tends_error:.1g} rad per cycle, "
        + ("not to zero" if tends > 2 * tends_error else "which is not told from zero")
    )
    cycles = xr.Dataset(
        {
            "t": ("cycle", at[:-2], {"units": "s"}),
            "amplitude": ("cycle", amplitude, {"units": "rad"}),
            "loss": ("cycle", loss, {"units": "rad"}),
            "loss_error": ("cycle", np.full(len(loss), float(np.std(np.diff(loss, 2))) / 6**0.5), {"units": "rad"}),
        }
    )
    steady = xr.Dataset(
        {
            "slip_velocity": ("row", speed[0], {"units": "rad/s"}),
            "force": ("row", torque - drag * curved, {"units": "N m"}),
            "force_error": ("row", np.hypot(rms, drag_error * curved), {"units": "N m"}),
        }
    )
    return friction_tree(
        series={},
        tables={"break_away": event_table([], "N m"), "steady": steady, "cycle": cycles},
        source=record.source,
        rig=rig.toml,
        notes=notes,
        facts={
            "force": coulomb,
            "force_error": coulomb_error,
            "model": best,
            **{NAMES[power]: value for power, value in zip(powers, values, strict=True) if power},
            "least_torque": float(np.min(torque)),
            "greatest_torque": float(np.max(torque)),
            "restoring_torque": restoring,
            "rest": rest,
            "cycles": float(len(torque)) / 2,
            "period": float(2 * np.median(np.diff(at))),
            "cutoff": smooth.cutoff,
        },
    )


def _turning_points(time: Array, smooth: Smooth) -> tuple[Array, Array]:
    """Times and angles where the speed changes its sign."""
    v = smooth.v
    i = np.flatnonzero(v[:-1] * v[1:] < 0)
    share = v[i] / (v[i] - v[i + 1])
    step = time[i + 1] - time[i]
    return time[i] + share * step, smooth.x[i] + 0.5 * v[i] * share * step


def _decaying(amplitude: Array, least: float) -> slice:
    """From the largest swing to the last before one is too small: neither the hand at the start nor the rest."""
    first = int(np.argmax(amplitude))
    small = np.flatnonzero(amplitude[first:] < least)
    return slice(first, first + int(small[0]) if len(small) else len(amplitude))


def _per_cycle(time: Array, values: Array, at: Array) -> Array:
    """Integrals over each full cycle, that begins at every turning point but the last two."""
    marks = np.interp(at, time, cumulative_trapezoid(values, time, initial=0))
    return np.asarray(marks[2:] - marks[:-2])


def _fit(torque: Array, speed: Array, powers: tuple[int, ...]) -> tuple[list[float], list[float], float]:
    """Coefficients, standard errors and rms of torque = sum over powers of c_p <v^p>."""
    columns = np.stack([np.ones(len(torque)) if p == 0 else speed[p - 1] for p in powers], axis=1)
    values = np.linalg.lstsq(columns, torque, rcond=None)[0]
    residuals = torque - columns @ values
    rms = float(np.sqrt(np.mean(residuals**2)))
    # cycles overlap by half, so only every other one is independent
    free = max(len(torque) // 2 - len(powers), 1)
    covariance = np.linalg.inv(columns.T @ columns) * float(residuals @ residuals) / free
    return [float(v) for v in values], [float(e) for e in np.sqrt(np.diag(covariance))], rms


FREE_DECAY = Instrument(
    name="free_decay",
    channels={"angle": ("angle",)},
    optional={},
    constants={
        "restoring_torque": Constant(positive("torque")),
        "mass": Constant(positive("mass")),
        "length": Constant(positive("length")),
        "gravity": Constant(positive("acceleration"), 9.81),
        "least_amplitude": Constant(positive("angle"), 0.06),
    },
    measure=_measure,
)
