"""The word of a smooth Hopf point against plain runs beside steady slip, by an integrator and equations of their own."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.dynamics.equilibria.criticality import criticality
from stickslip.dynamics.equilibria.hopf_points import hopf_points
from stickslip.dynamics.equilibria.steady_slip import SteadySlip, steady_slip
from stickslip.dynamics.periodic.event_sequence import with_number

SPEED = "/drive_velocity"


def grows(mass, damping, stiffness, friction, state, amplitude):
    """Whether a swing beside steady slip, where small ones neither grow nor decay, grows."""
    n = len(mass)
    inverse = np.linalg.inv(mass)

    def rates(_, y):
        return np.concatenate([y[n:], inverse @ (friction(y[:n], y[n:]) - damping @ y[n:] - stiffness @ y[:n])])

    def leaves(_, y):
        return 4 * amplitude - np.abs(y[n:]).max()

    leaves.terminal = True
    start = np.concatenate([state.x + amplitude * state.displacement, amplitude * state.mode], axis=None)
    end = 120 * 2 * math.pi / state.frequency
    times = np.linspace(0, end, 6000)
    run = solve_ivp(rates, (0, end), start, rtol=1e-9, atol=1e-12, t_eval=times, events=leaves)
    sizes = np.linalg.norm(run.y[n:], axis=0)
    return run.status == 1 or sizes[-2000:].max() > sizes[2000:4000].max()


def cubic(law, w):
    return law.static - law.linear * w + law.cubic * w**3


@pytest.mark.long
@pytest.mark.parametrize(
    ("damping", "stiffness", "law", "position", "velocity", "word"),
    [
        pytest.param(0.1, 1.0, (1.0, 1.5, 0.3), 0.0, 0.0, "supercritical", marks=pytest.mark.slow),
        pytest.param(0.1, 1.0, (1.0, 1.5, 0.3), 0.7, 0.0, "supercritical", marks=pytest.mark.slow),
        # By F‴ > 0 alone these are supercritical too.
        pytest.param(0.1, 1.0, (1.0, 1.5, 0.3), 0.0, 0.4, "subcritical", marks=pytest.mark.slow),
        pytest.param(0.77, 0.8, (2.0, 1.2, 0.07), 0.9, 0.0, "subcritical", marks=pytest.mark.slow),
        pytest.param(0.57, 0.5, (2.0, 1.3, 0.11), 0.9, 0.0, "subcritical", marks=pytest.mark.slow),
        (0.5, 0.5, (2.0, 1.3, 0.11), 0.9, 0.1, "subcritical"),
    ],
)
def test_a_normal_force_that_varies_counts(damping, stiffness, law, position, velocity, word):
    law = ss.laws.Cubic(*law)
    pressed = ss.NormalForce(position=position, velocity=velocity)
    system = ss.Oscillator(damping, 1.0, law, stiffness=stiffness, normal_force=pressed)
    (kind, hopf), *_ = hopf_points(system, SPEED, (0.8, 2.2))
    assert (kind, criticality(system, SPEED, hopf)) == ("hopf", word)
    held = stiffness - position * cubic(law, hopf)
    at = np.array([cubic(law, hopf) / held])
    state = SteadySlip(at, 0.0, 0.0, True, frequency=math.sqrt(held))

    def friction(x, v):
        return (1 + position * x + velocity * v) * cubic(law, hopf - v)

    one = np.eye(1)
    assert grows(one, damping * one, stiffness * one, friction, state, 0.08) == (word == "subcritical")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("laws", "which", "word"),
    [
        ([(1.0, 1.5, 0.3), (1.0, 0.4, 0.5)], 0, "supercritical"),
        ([(1.0, 0.5, 0.3), (1.0, -0.1, -0.05)], 1, "subcritical"),
    ],
)
def test_two_masses(laws, which, word):
    laws = [ss.laws.Cubic(*law) for law in laws]
    mass, damping, stiffness = np.diag([1.0, 1.4]), np.diag([0.1, 0.15]), np.array([[1.8, -0.7], [-0.7, 1.2]])
    contacts = [ss.Contact(i, law, 1.0) for i, law in enumerate(laws)]
    system = ss.System(mass=mass.tolist(), stiffness=stiffness.tolist(), damping=damping.tolist(), contacts=contacts)
    kind, hopf = hopf_points(system, SPEED, (0.3, 1.8))[which]
    assert (kind, criticality(system, SPEED, hopf)) == ("hopf", word)

    def friction(_, v):
        return np.array([cubic(law, hopf - one) for law, one in zip(laws, v, strict=True)])

    state = steady_slip(with_number(system, SPEED, hopf))
    assert grows(mass, damping, stiffness, friction, state, 0.06) == (word == "subcritical")


def test_what_is_not_known_is_not_named():
    # F = 0.6 − 0.1 (w − 1) + a (w − 1)²/2 with a = 0.5 below 1 and 1 above: the damping of 0.1 is taken where F″ jumps.
    nodes = ((0.0, 0.95), (0.5, 0.7125), (1.0, 0.6), (1.5, 0.675), (2.0, 1.0))
    law = ss.laws.PiecewisePolynomial(nodes, break_away=1.0, degree=2)
    system = ss.Oscillator(0.1, 1.0, law)
    assert criticality(system, SPEED, 1.0) == "undetermined"
    assert criticality(ss.Oscillator(0.2, 1.0, law), SPEED, 0.8) == "degenerate"
