"""The same document gives the same orbit to the bit on every machine: no function of the platform is asked for a number."""

import hashlib
import itertools
from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip import _core
from stickslip.laws import Law
from stickslip.laws.state_law import StateLaw

#: The first digits of the SHA-256 of all events of twenty orbits, or of force and state along a motion. They change where
#: the arithmetic of the core does, on purpose, and never from one machine to another.
PINNED = {
    "BogaczRyczek": "335105fa1e72",
    "Dahl": "c7f8522f255d",
    "LuGre": "f0e962d25efa",
    "ElastoPlastic": "b7879866022a",
    "BoucWen": "b8c84e7df90d",
    "RateState": "6f8b245ecbe3",
    "Regularised": "c761482c8e6c",
    "Coulomb": "0f600c78cec8",
    "StaticKinetic": "c2560cada25f",
    "PiecewiseLinear": "16cbeeb5046f",
    "PiecewisePolynomial": "e6a6b5e07310",
    "DwellTime": "30d03325c448",
    "Rational": "4f271a826d3f",
    "Cubic": "bf84388ebeaa",
    "ExponentialStribeck": "be83a41c43ca",
    "Lorentzian": "4cae6571d4cb",
    "PoppStelter": "b9d2306c8aab",
    "LogarithmicDwell": "70cc8d789c74",
    "ForceRate": "589a43237207",
    "Tabulated": "2c740cf9357b",
    "TwoBranch": "3f3bc0d072f3",
    "Asymmetric": "0ff871e017f4",
    "Combined": "048d0bbf9f7c",
    "chain": "658ec3f41d3d",
}


def orbits(law):
    """Twenty oscillators: slow and fast drives, free and forced, with damping and without."""
    forcings = [(), ss.Harmonic(0.3, 0.7)]
    for damping, speed, forcing in itertools.product([0.0, 0.15], [0.05, 0.2, 0.5, 0.9, 1.4], forcings):
        yield ss.simulate(ss.Oscillator(damping, speed, law, forcing=forcing), 100.0, x0=0.3)


def motion_of(law):
    """Force and state of a law with an internal state along a motion that slips, creeps, rests and turns."""
    t = np.arange(400) / 64
    w = (np.abs(np.arange(400) % 64 - 32.0) - 16.0) / 64
    return np.concatenate(law.follow(t, np.where(np.abs(w) < 0.05, 0.0, w)))


def digits(parts):
    """The first digits of a hash over the bytes of arrays."""
    total = hashlib.sha256()
    for part in parts:
        # What is no number has no bits of its own.
        total.update(np.nan_to_num(part, nan=-1.0).astype("<f8").tobytes())
    return total.hexdigest()[:12]


def numbers_of(name):
    law = Law.ALL[name].example()
    if isinstance(law, StateLaw):
        return [motion_of(law)]
    return [orbit.events.drop(columns="kind").to_numpy(float) for orbit in orbits(law)]


@pytest.mark.parametrize("name", Law.ALL)
def test_events_of_every_law_have_the_same_bits_everywhere(name):
    assert digits(numbers_of(name)) == PINNED[name]


def test_events_of_masses_have_the_same_bits_everywhere():
    systems = [ss.chain(3, Law.ALL[name].example(), 0.2) for name in ("StaticKinetic", "BogaczRyczek", "Rational")]
    events = [ss.simulate(system, 30.0).events.drop(columns="kind").to_numpy(float) for system in systems]
    assert digits(events) == PINNED["chain"]


def test_the_library_asks_the_platform_for_no_function():
    # What an ELF, Mach-O or PE file imports stands in it by name.
    names = (
        "sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 expm1 log log2 log10 log1p pow cbrt"
    )
    words = set(Path(_core.__file__).read_bytes().split(b"\0"))
    assert not words & {name.encode() for name in [*names.split(), "hypot", "sincos", "fma"]}
