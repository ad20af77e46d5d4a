import math

import numpy as np
import pytest

import stickslip as ss


@pytest.mark.parametrize("error", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize(
    "f",
    [
        lambda w: 0.5 + 0.5 * np.exp(-w / 0.1),
        lambda w: 1 / (1 + 3 * w),
        lambda w: np.sqrt(w) + 0.1,
        lambda w: 0.4 - 0.5 * w + 0.2 * w**3,
        lambda w: np.abs(w - 0.3) + 0.2,
        lambda w: np.full_like(w, 0.7),
        lambda w: 0.5 + 0.3 * np.exp(-(((w - 0.61) / 0.003) ** 2)),
        lambda w: 0.5 + 0.3 * np.exp(-(((w - 0.5123) / 1e-4) ** 2)),
        lambda w: 0.5 + 0.5 * np.exp(-w / 1e-3),
        lambda w: 1 + 0.2 * np.sin(40 * w) * np.exp(-w),
    ],
)
def test_function_is_met_within_the_stated_error(f, error):
    law = ss.laws.from_function(f, 1.0, break_away=2.0, error=error)
    w = np.linspace(0, 1, 100_001)
    assert np.abs(law.kinetic_force(w[1:]) - f(w[1:])).max() <= error
    # A chord can do no better than √(8 error/|f″|) a piece; the greedy choice comes near it.
    bend = np.sqrt(np.abs(np.gradient(np.gradient(f(w), w), w))[2:-2]).mean()
    assert len(law.nodes) <= 2 + 1.6 * bend / np.sqrt(8 * error) + 40


@pytest.mark.parametrize("waves", [256, 1024, 4096])
def test_no_wave_hides_between_the_samples(waves):
    def f(w):
        return 1 + 0.1 * np.sin(np.pi * waves * w) ** 2

    law = ss.laws.from_function(f, 1.0, error=0.02)
    w = np.linspace(0, 1, 200_001)
    assert np.abs(law.kinetic_force(w[1:]) - f(w[1:])).max() <= 0.02


def test_nodes_are_few_where_the_function_is_linear():
    assert len(ss.laws.from_function(lambda w: 1.0 - 0.3 * w, 2.0).nodes) == 2
    assert len(ss.laws.from_function(lambda w: abs(w - 0.5) + 0.1, 2.0, error=1e-3).nodes) <= 4


def test_function_of_one_number_and_table_are_taken_too():
    def scalar(w: float) -> float:
        return 1.0 if w < 0 else 1.0 / (1.0 + w)

    law = ss.laws.from_function(scalar, 1.0)
    assert law.kinetic_force(0.5) == pytest.approx(2 / 3, abs=1e-4)
    assert law.break_away == 1.0
    w = np.linspace(0, 1, 1001)
    table = np.column_stack([w, 1 / (1 + w)])
    thin = ss.laws.from_function(table, error=1e-3)
    assert len(thin.nodes) < 15
    assert np.abs(thin.kinetic_force(w[1:]) - table[1:, 1]).max() <= 1e-3 * (1 + 1e-12)
    short = ss.laws.from_function(table, w_max=0.55, error=1e-3)
    assert short.nodes[-1] == pytest.approx((0.55, 1 / 1.55), abs=1e-6)


def test_s5_from_a_function():
    # S5 of the validation cases (Leine et al. 1998) with its smooth law in pieces: the error falls with the stated one.
    errors = []
    for error in (1e-4, 1e-6):
        law = ss.laws.from_function(lambda w: 1 / (1 + 3 * w), w_max=1.2, error=error)
        orbit = ss.simulate(ss.Oscillator(damping=0.0, drive_velocity=0.2, law=law), 60)
        release = orbit.events.query("kind == 'release'")["t"]
        errors.append(abs(release.diff().iloc[-1] - 12.00103129483058))
    assert errors[0] < 1e-3
    assert errors[1] < 1e-5


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ss.laws.from_function(lambda w: np.where(w > 0.5, 1.0, 2.0), 1), "out of reach near w = 0.5, where f jumps"),
        (lambda: ss.laws.from_function(lambda w: w * np.nan, 1), r"f must be finite on \[0, w_max\], got nan at w = 0"),
        (lambda: ss.laws.from_function(lambda w: 1 / w if w else np.inf, 1), "got inf at w = 0"),
        (lambda: ss.laws.from_function(lambda w: np.sqrt(0.5 - w), 1), "got nan at w = 0.5"),
        (lambda: ss.laws.from_function(lambda w: math.exp(-1 / w), 1), "got the error: float division by zero at w = 0"),
        (lambda: ss.laws.from_function(lambda w: {}[w], 1), "got the error: .* at w = 0"),
        (lambda: ss.laws.from_function(lambda w: 1 + 1j * w, 1), "got the error: complex numbers"),
        (lambda: ss.laws.from_function(3, 1), "f must be a function of the slip speed, or a table .*, got int"),
        (lambda: ss.laws.from_function("law", 1), "f must be a function of the slip speed, or a table .*, got str"),
        (lambda: ss.laws.from_function(lambda w, v: w + v, 1), "f must give a number for a number, got the error"),
        (lambda: ss.laws.from_function(lambda w: f"{w}a", 1), "f must give a number for a number, got the error"),
        (lambda: ss.laws.from_function(lambda w: w), "w_max is missing"),
        (lambda: ss.laws.from_function(lambda w: w, -1), "w_max must be greater than 0, got -1"),
        (lambda: ss.laws.from_function(lambda w: w, 1, error=0), "error must be greater than 0, got 0"),
        (lambda: ss.laws.from_function(np.cos, 1, error=1e-15), "an error of 1e-15 is out of reach|needs .* nodes"),
        (lambda: ss.laws.from_function([(0, 1), (1, np.nan)]), r"table must be finite, got \[1.0, nan\] in row 1"),
        (lambda: ss.laws.from_function([(1, 1), (0, 1)]), "must start at 0 and increase"),
        (lambda: ss.laws.from_function([(0, 1), (1, 1)], 2), r"w_max must lie in \(0, 1\], the end of the table, got 2"),
        (lambda: ss.laws.from_function(np.cos, 1, break_away=0.5), "at least the kinetic force"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_one_sentence(refused, make, sentence):
    refused(sentence, make)
