"""Intervals from few slips: their scatter is known as well as an ordinary standard deviation, not as the median's."""

import numpy as np
from scipy import stats

from stickslip.identification.estimator.residual_statistics import clipped_scale


def test_students_interval_of_few_residuals_holds_the_truth():
    rng = np.random.default_rng(0)
    for count in (5, 8):
        samples = rng.standard_normal((2000, count))
        means = samples.mean(axis=1)
        scale = np.array([clipped_scale(row - mean) for row, mean in zip(samples, means, strict=True)])
        error = scale * np.sqrt(count / (count - 1) / count)
        held = np.mean(np.abs(means) < stats.t.ppf(0.975, count - 1) * error)
        assert 0.94 < held < 0.97  # the median gives 0.935 and 0.943; the binomial error is 0.005


def test_an_outlier_counts_as_two_at_most():
    rng = np.random.default_rng(1)
    rows = rng.standard_normal(40)
    rows[3] = 1e6
    assert clipped_scale(rows) < 1.3
