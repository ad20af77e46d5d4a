"""What an orbit costs, law by law: events a period and evaluations of the flow an event are pinned, time is not."""

import pytest

import stickslip as ss
from stickslip.laws import Law
from stickslip.laws.state_law import StateLaw

# Events a natural period and evaluations an event without forcing; evaluations an event with it. Measured over 1000 time
# units with damping 0.05 and a drive velocity of 0.15; a search that gets better may lower them. Break-away of the laws with
# dwell is evaluated once more at the root it reports: what is left there is the proof that it is one.
WORK = {
    "Coulomb": (ss.laws.Coulomb(0.5), 0.01, 1, 3),
    "StaticKinetic": (ss.laws.StaticKinetic(1.0, 0.6), 1.41, 1, 3),
    "PiecewiseLinear": (ss.laws.PiecewiseLinear([(0, 1), (0.2, 0.6), (0.3, 0.61)], 1.0), 2.61, 1, 2),
    "DwellTime": (ss.laws.DwellTime(0.5, 0.5, 0.4), 1.33, 4.1, 6),
    "ForceRate": (ss.laws.ForceRate(0.5, 0.5, 0.4, force_rate_scale=0.3), 1.78, 4.1, 24),
    "Tabulated": (ss.laws.Tabulated([(0, 0.8), (0.2, 0.6), (0.5, 0.65)], [(0, 0.9), (2, 1.0), (6, 1.1)]), 3.92, 2, 3),
    "TwoBranch": (ss.laws.TwoBranch([(0, 1), (0.6, 0.7)], [(0, 0.6), (0.6, 0.7)], 1.0), 2.58, 1, 2),
    "BogaczRyczek": (ss.paper.calibration.CALIBRATIONS["one f_s(0)"].law, 3.88, 2, 10),
    "Rational": (ss.laws.Rational(1.0, 3.0), 0.94, 9, 11),
    "Cubic": (ss.laws.Cubic(0.4, 0.45, 0.6), 1.74, 5, 6),
    "ExponentialStribeck": (ss.laws.ExponentialStribeck(1.0, 0.5, 0.1, 0.2), 1.31, 10, 10),
    "PoppStelter": (ss.laws.PoppStelter(0.4, 0.1, 1.42, 0.01), 1.84, 5, 6),
}


@pytest.mark.parametrize("name", WORK)
def test_work_of_every_law(name):
    law, events, alone, forced = WORK[name]
    orbit = ss.simulate(ss.Oscillator(0.05, 0.15, law), 1000)
    assert orbit.work.events / (1000 / orbit.system.natural_period) == pytest.approx(events, abs=0.01)
    assert orbit.work.evaluations <= alone * max(1, orbit.work.events)
    orbit = ss.simulate(ss.Oscillator(0.05, 0.15, law, forcing=ss.Harmonic(0.3, 0.7)), 1000)
    assert orbit.work.evaluations <= forced * orbit.work.events


@pytest.mark.parametrize("name", [name for name, kind in Law.ALL.items() if not issubclass(kind, StateLaw)])
def test_no_law_of_true_adhesion_costs_more_than_the_dearest(name):
    orbit = ss.simulate(ss.Oscillator(0.05, 0.15, Law.ALL[name].example(), forcing=ss.Harmonic(0.3, 0.7)), 1000)
    assert orbit.work.evaluations <= max(forced for *_, forced in WORK.values()) * orbit.work.events
