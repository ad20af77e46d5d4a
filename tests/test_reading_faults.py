"""What an instrument out of order reads is named, and what one in order reads is not."""

import numpy as np
import pytest

from stickslip.measurement import measure

T = np.arange(4000) / 200
SPEED = 0.5 * np.cos(2 * np.pi * 0.5 * T)
X = np.cumsum(SPEED) / 200
TORQUE = 12 * np.tanh(SPEED / 0.05) + 8 * SPEED + 0.6 * np.random.default_rng(3).standard_normal(T.size)


def said(torque: np.ndarray, **column: object) -> list[str]:
    columns = {"time": "t", "displacement": {"column": "x", "unit": "rad"}}
    rig = {"instrument": "direct_force", "columns": columns | {"force": {"column": "torque", "unit": "N m", **column}}}
    return [note for note in measure({"t": T, "x": X, "torque": torque}, rig).attrs["notes"] if "column '" in note]


def changed(first: int, last: int, value: float, step: int = 1) -> np.ndarray:
    torque = TORQUE.copy()
    torque[first:last:step] = value
    return torque


@pytest.mark.parametrize(
    ("torque", "words"),
    [
        (
            np.minimum(TORQUE, 14.0),
            f"column 'torque': {np.count_nonzero(TORQUE >= 14)} readings (33 %) equal the largest value, 14: saturated?",
        ),
        (changed(1000, 2500, TORQUE[1000]), "1500 equal readings in a row (5 to 12.495 s): frozen?"),
        (
            changed(0, 4000, -999, 70),
            "58 readings are exactly -999, far outside all others: a code for missing values?",
        ),
    ],
)
def test_a_fault_is_named_with_its_numbers(torque: np.ndarray, words: str) -> None:
    (note,) = said(torque)
    assert words in note


def test_an_instrument_in_order_is_not_named() -> None:
    coarse = np.round(TORQUE / 3) * 3
    at_rest = np.where((T > 5) & (T < 15), 0.02 * TORQUE[0], TORQUE)
    impulse = changed(70, 71, -999)
    for torque in (TORQUE, np.round(TORQUE, 1), coarse, np.where((T > 5) & (T < 15), 0.0, TORQUE), impulse):
        assert said(torque) == []
    assert said(np.round(at_rest + 0.01 * np.random.default_rng(4).standard_normal(T.size), 2)) == []
    assert said(changed(0, 4000, -999, 70), valid=[-50, 50]) == []  # as the message advises


def test_saturated_readings_are_not_fitted() -> None:
    """Friction 3 + 2 exp(-w/0.01) N, cut at 4.2: with the flats the force at 5 mm/s was 4.2 and not 4.21, and at rest 4.2."""
    w = 0.05 * np.sin(2 * np.pi * 0.5 * T)
    random = np.random.default_rng(5)
    friction = np.sign(w) * (3 + 2 * np.exp(-np.abs(w) / 0.01)) + 0.05 * random.standard_normal(T.size)
    force = np.clip(friction, -4.2, 4.2)
    record = {"t": T, "v": w + 1e-5 * random.standard_normal(T.size), "F": force}
    rig = {
        "instrument": "direct_force",
        "columns": {"time": "t", "velocity": "v", "force": {"column": "F", "unit": "N"}},
    }
    found = measure(record, rig)
    flat = np.abs(force) == 4.2
    said = f"{flat.sum()} samples ({100 * flat.mean():.2g} %) at the end of the range of the force were left out"
    assert any(said in note for note in found.attrs["notes"])
    assert found["time"].size == T.size - flat.sum()
    assert np.abs(found["force"]).max() < 4.2
