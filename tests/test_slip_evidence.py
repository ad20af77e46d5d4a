"""The evidence of a slip, against dense least squares with splines of SciPy."""

import math

import numpy as np
import pytest
from scipy.interpolate import BSpline

from stickslip.measurement.signals.piecewise_fit import OscillatorConstants
from stickslip.measurement.signals.slip_evidence import SlipModel

TIME = np.arange(0.0, 4.0, 0.05)
NOISE = 0.003 * np.random.default_rng(1).standard_normal(TIME.size)
MODEL = SlipModel(
    TIME,
    0.4 * (1 - np.cos(1.6 * TIME)) + NOISE,
    0.5 + TIME % 1,
    OscillatorConstants(0.9, 0.1, 1.2, 0.3),
    0.003,
    0.3,
    4.0,
)


def by_squares(model, start, end, origin, joined, soft):
    """Square, linear and constant part of the evidence, from the orthogonal complement of the splines that are free."""
    o, count = model.oscillator, max(math.ceil((end - start) / model.knots), 2)
    h = (end - start) / count
    knots = np.concatenate([[start] * 5, np.linspace(start, end, count + 1), [end] * 5])
    spline = BSpline(knots, np.eye(count + 5), 5)
    inside = slice(*np.searchsorted(model.time, [start, end]))
    root = np.sqrt(model.weight[inside])[:, None] / model.noise
    seen = root * np.column_stack([spline(model.time[inside]), model.path[inside] - origin])
    points, shares = np.polynomial.legendre.leggauss(5)
    since = (h * (np.arange(count)[:, None] + 0.5 + 0.5 * points)).ravel()
    weights = np.tile(0.5 * h * shares, count) / (model.step * (2 * np.pi * model.cutoff) ** 6 * model.noise**2)
    rate = np.sqrt(o.stiffness / o.mass)
    if soft:
        weights *= 1 + (rate * since) ** -2
    first, second, third = (spline.derivative(order)(start + since) for order in (1, 2, 3))
    falls = model.slope * np.exp(-model.decay * since) if joined == "start" else np.zeros_like(since)
    change = o.stiffness / o.mass * first + (o.damping + falls)[:, None] / o.mass * second + third
    target = np.full(since.size, o.stiffness * o.drive_velocity / o.mass)
    walk = np.sqrt(weights)[:, None] * np.column_stack([change, target])
    tied, size = (3 if soft else 2), count + 5
    ends = {"start": range(tied), "end": range(size - tied, size)}.get(joined, range(0))
    free = [column for column in range(size) if column not in ends]
    at = end if joined == "end" else start
    states = [spline(at, nu=order) * unit / o.drive_velocity for order, unit in enumerate((rate, 1, 1 / rate))]
    held = np.array(states if joined == "nowhere" else [] if soft else states[2:]).reshape(-1, size)[:, free]
    rows = np.concatenate([seen, walk])
    base, triangle = np.linalg.qr(rows[:, free])
    level, right = (side - base @ (base.T @ side) for side in (rows[:, ends].sum(axis=1), rows[:, -1]))
    scale = np.sum(held**2) / np.sum(walk[:, free] ** 2) if len(held) else 1.0
    prior = np.linalg.qr(np.concatenate([walk[:, free], held / np.sqrt(scale)]), mode="r")
    logs = [2 * np.log(np.abs(np.diag(one))).sum() for one in (triangle, prior)]
    constant = right @ right + logs[0] - logs[1] - len(held) * np.log(scale)
    return (1.0, 0.0, constant) if joined == "nowhere" else (level @ level, level @ right, constant)


@pytest.mark.parametrize("end", [0.9, 1.7, 3.6])
@pytest.mark.parametrize(
    ("joined", "soft", "slope"),
    [("start", False, 0.0), ("start", False, -0.6), ("start", True, 0.0), ("end", False, 0.0), ("nowhere", False, 0.0)],
)
def test_it_is_that_of_dense_least_squares(joined, soft, slope, end):
    model = SlipModel(**{**vars(MODEL), "slope": slope, "decay": 2.0})
    found = model.slip(0.31, end, 0.1, joined, soft)
    expected = by_squares(model, 0.31, end, 0.1, joined, soft)
    np.testing.assert_allclose((found.square, found.linear, found.constant), expected, rtol=1e-7, atol=1e-4)


def test_a_slip_without_a_sample_has_the_evidence_of_none():
    found = MODEL.slip(1.01, 1.04, 0.1, "end")
    assert found.square == pytest.approx(0.0, abs=1e-6)
