"""Known numbers from files and results of others."""

from __future__ import annotations

import math

import numpy as np
from known.case import Results, case

import stickslip as ss


@case(
    "B1 a rotor at 3 that a pulsed brake stops, x″ = −0.6 (1 + 0.5 cos 2t)", "closed form", 14,
    stop_time=5.209615162895713, distance=7.370946284427328,
)  # fmt: skip
def pulsed_brake() -> Results:
    pulsed = ss.NormalForce(harmonics=ss.Harmonic(0.5, 2.0))
    rotor = ss.System(1.0, 0.0, 0.0, ss.Contact(0, ss.laws.Coulomb(0.6), normal_force=pulsed))
    orbit = ss.simulate(rotor, 10.0, 0.0, 3.0)
    return {"stop_time": orbit.events["t"].iloc[0], "distance": orbit.at(10.0)[0].item()}


@case(
    "B2 belt, v = 0.2, friction (1, 0.6) under N = 1 + 0.5 sin 1.3t", "closed form", 13,
    first_release=3.0869191113757912, first_capture=5.998846288446435, x_there=0.4356293884630826,
)  # fmt: skip
def brake_on_a_belt() -> Results:
    pressed = ss.NormalForce(harmonics=ss.Harmonic(0.5, 1.3, -math.pi / 2))
    events = ss.simulate(ss.Oscillator(0.0, 0.2, ss.laws.StaticKinetic(1.0, 0.6), normal_force=pressed), 7.0).events
    (release, capture), x = events["t"].iloc[:2], events["x"].iloc[1]
    return {"first_release": release, "first_capture": capture, "x_there": x}


def feeny_moon(x: float, periods: int, phase: float = 5 * math.pi / 8) -> ss.Orbit:
    """x″ + x = −(1 + 1.5 x) sgn x′ + 1.9 cos(1.25 t + phase), the normal force never below 0."""
    pressed = ss.NormalForce(position=1.5)
    system = ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(1.0), forcing=ss.Harmonic(1.9, 1.25, phase), normal_force=pressed)
    return ss.simulate(system, 2 * math.pi / 1.25 * periods, x, 0.0)


@case(
    "F1 1.9 cos 1.25t against friction 1 + 1.5 x ≥ 0: where a mass stuck at 5/16 of a period sticks a period later",
    "the oscillator of Feeny & Moon, J. Sound Vib. 170 (1994) 303, as we know it from others; another integrator", 10,
    from_0p4=1.1637290460412, from_0p6=0.6497595903184, from_0p8=0.3321630223808, from_1=0.7077803756014,
    from_1p2=1.0439067686478,
)  # fmt: skip
def feeny_moon_map() -> Results:
    images = {x: feeny_moon(x, 1).at(2 * math.pi / 1.25)[0] for x in (0.4, 0.6, 0.8, 1.0, 1.2)}
    return {f"from_{x:g}".replace(".", "p"): image for x, image in images.items()}


def bowed_string(at: int, force: float, masses: int = 39, periods: int = 30) -> tuple[float, float]:
    """Releases in a period of the string, and the share of a period for which the bow holds, in its last ten periods.

    A string of equal masses under unit tension, bowed at speed 1 on the mass number `at`, from the motion of an ideal string.
    """
    ends = np.diff(np.eye(masses + 2), axis=0)[:, 1:-1]
    tension = ends.T @ ends
    law = ss.laws.ExponentialStribeck(0.8 * force, 0.3 * force, 0.5)
    bowed = ss.System(np.ones(masses), tension, 0.005 * np.eye(masses) + 0.05 * tension, ss.Contact(at - 1, law, 1.0))
    # The corner has just left the bow for the far end: two straight lines, and the velocities of both.
    length, place = masses + 1, np.arange(1, masses + 1)
    near = place <= at
    x = np.where(near, place * (length - at), at * (length - place)) / at
    v = np.where(near, place, place - length) / at
    period = 2 * length
    events = ss.simulate(bowed, periods * period, x, v).events
    late = events[(events["t"] > (periods - 10) * period) & (events["kind"] == "release")]
    return len(late) / 10, late["stick_time"].sum() / 10 / period


@case(
    "W1 a string of 39 masses, bowed at β of its length: the motion of Helmholtz",
    "ideal string: one slip a period, the bow holds for 1 − β of it (Schelleng, J. Acoust. Soc. Am. 53 (1973) 26)", 2,
    slips_a_period_at_0p1=1.0, share_of_holding_at_0p1=0.9, slips_a_period_at_0p2=1.0, share_of_holding_at_0p2=0.8,
)  # fmt: skip
def helmholtz() -> Results:
    (slips, share), (more, less) = bowed_string(4, 24.0), bowed_string(8, 12.0)
    return {
        "slips_a_period_at_0p1": slips, "share_of_holding_at_0p1": share,
        "slips_a_period_at_0p2": more, "share_of_holding_at_0p2": less,
    }  # fmt: skip


@case(
    "P1 x″ + x = −sgn x′ from (12, 6)",
    "Siconos, examples/mechanics/FrictionOscillator/FrictionOscillator.ref: steps of 0.01 of a scheme with θ = 1/2", 4,
    missed={"v_at_0p7": "the turn at 0.4324 falls within a step of the file, which loses 0.003 of the velocity there"},
    largest_x=13.31777943672665, x_at_0p4=13.31030142940808, v_at_0p4=0.4639752142966954, x_at_0p7=12.88073364825603,
    v_at_0p7=-3.252237726902930,
)  # fmt: skip
def siconos() -> Results:
    orbit = ss.simulate(ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(1.0)), 1.0, 12.0, 6.0)
    (x, v), (later, slower) = orbit.at(0.4), orbit.at(0.7)
    return {"largest_x": orbit.events["x"].iloc[0], "x_at_0p4": x, "v_at_0p4": v, "x_at_0p7": later, "v_at_0p7": slower}


@case("P2 the same to its end", "Siconos, as P1: its steps have lost a digit by then", 3, rests_at=0.6820441351954105)
def siconos_rest() -> Results:
    return {"rests_at": ss.simulate(ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(1.0)), 100.0, 12.0, 6.0).at(100.0)[0]}


@case(
    "P3 f = 0.5 + 0.5 exp(−2w), d = 0.1, starts in [−2, 2] × [0, 2]",
    "bSTAB, case_friction: Stender & Hoffmann, Nonlinear Dyn. 107 (2022) 1451; of 5000 random starts, ± 0.007", 2,
    share_of_stick_slip_at_v_1p4=0.787, share_of_stick_slip_at_v_1p55=0.6456, share_of_stick_slip_at_v_1p7=0.5078,
)  # fmt: skip
def basin_shares() -> Results:
    law, starts = ss.laws.ExponentialStribeck(1.0, 0.5, 0.5), (np.arange(16) + 0.5) / 16

    def share(velocity: float) -> float:
        system = ss.Oscillator(0.1, velocity, law)
        found = ss.basins(system, x=4 * starts - 2, v=2 * starts, transient=30, window=4)
        return float(found["fraction"][found["attractor_regime"] == "stick_slip"].sum())

    return {f"share_of_stick_slip_at_v_1p{tail}": share(float(f"1.{tail}")) for tail in ("4", "55", "7")}


@case(
    "P4 1.5 cos ωt against Coulomb friction 1, d = 0.1, ω falling from 0.9",
    "PWS-DDE-CONT, dry friction oscillator demo: the end of its branch of orbits without sticks", 3,
    period_at_which_sticks_begin=8.7036,
)  # fmt: skip
def end_of_crossings() -> Results:
    swing = ss.Oscillator(0.1, 0.0, ss.laws.Coulomb(1.0), forcing=ss.Harmonic(1.5, 0.9))
    points = ss.continuation(swing, "forcing.frequency", (0.71, 0.91), guess=(0.0, 5.0), seeds=0).special_points
    (frequency,) = (point.parameter for point in points if point.kind == "crossing_sliding")
    return {"period_at_which_sticks_begin": 2 * math.pi / frequency}


@case(
    "P5 cos t/2 against Coulomb friction 0.2, no damping",
    "a continuum of marginal orbits: Csernák, Stépán & Shaw, Nonlinear Dyn. 50 (2007) 93", 10,
    multiplier_from_1p3=1.0, multiplier_from_1p35=1.0, periods_of_the_forcing=1.0,
)  # fmt: skip
def continuum() -> Results:
    swing = ss.Oscillator(0.0, 0.0, ss.laws.Coulomb(0.2), forcing=ss.Harmonic(1.0, 0.5))
    first, second = (ss.periodic_orbit(swing, (x, 0.0)) for x in (1.3, 1.35))
    assert abs(first.state[1]) != abs(second.state[1])
    return {
        "multiplier_from_1p3": first.largest,
        "multiplier_from_1p35": second.largest,
        "periods_of_the_forcing": float(first.forcing_periods),
    }


MODELICA = "Modelica Association, MAP-LIB_ReferenceResults (Dymola 2020x, tolerance 1e-6)"


@case(
    "P9 x″ + x′ = 25 sin(π t/2) − (5 + 10 exp(−2 abs x′)) sgn x′ from rest",
    f"{MODELICA}: Mechanics.Translational.Examples.Friction, stop1", 5,
    x_at_5=1.76846282132044, v_at_5=6.86485858981257,
)  # fmt: skip
def modelica_friction() -> Results:
    contact = ss.Contact(mass=0, law=ss.laws.ExponentialStribeck(15.0, 5.0, 0.5))
    force = ss.Force(25.0, 0.5 * math.pi, phase=-0.5 * math.pi)
    orbit = ss.simulate(ss.System([1.0], [0.0], contacts=[contact], damping=[1.0], forcing=[force]), 5.0)
    x, v = orbit.at(5.0)
    return {"x_at_5": x[0], "v_at_5": v[0]}


@case(
    "P10 x″ + x′ + 500 (x + 0.25) = −(3 + 5 exp(−2 abs x′)) sgn x′ from (0, −5), caught by a stop at −0.4",
    f"{MODELICA}: Mechanics.Translational.Examples.Friction, stop2", 6,
    v_before_the_stop=-6.10568215752555, rests_at=-0.247515847991475,
)  # fmt: skip
def modelica_stop() -> Results:
    block = ss.Oscillator(1.0, 0.0, ss.laws.ExponentialStribeck(8.0, 3.0, 0.5), stiffness=500.0)
    arrives = 0.0605969540580153
    # The stop itself is no part of the system: what follows it starts from it, at rest.
    return {
        "v_before_the_stop": ss.simulate(block, arrives, x0=0.25, v0=-5.0).at(arrives)[1],
        "rests_at": ss.simulate(block, 5.0 - arrives, x0=-0.15, v0=0.0).at(5.0 - arrives)[0] - 0.25,
    }


@case(
    "P11 drive train of three inertias with a clutch of 80 N m and, from 0.5 s on, a brake of 800 N m",
    f"{MODELICA}: Mechanics.Rotational.Examples.Friction", 5,
    clutch_locks_at=0.0067797089998355, clutch_opens_at=0.0593397659130555, speed_there=96.6432003611788,
    angle_at_3=101.564999390897, speed_at_3=2.28989099827674, twist_at_3=0.195985155867467,
)  # fmt: skip
def modelica_drive_train() -> Results:
    train = {
        "mass": [1.0, 0.05, 1.0],
        "stiffness": [[0, 0, 0], [0, 160, -160], [0, -160, 160]],
        "damping": [[0, 0, 0], [0, 1, -1], [0, -1, 1]],
    }
    clutch = ss.Contact(mass=0, other=1, law=ss.laws.Coulomb(80.0))
    brake = ss.Contact(mass=2, law=ss.laws.Coulomb(800.0))
    motor = ss.Force(200.0, 100.0, phase=-0.5 * math.pi, mass=0)
    driven = ss.simulate(ss.System(**train, contacts=[clutch], forcing=[motor]), 0.5, v0=[100, 90, 90])
    locks, opens = driven.events["t"].iloc[:2]
    braked = ss.simulate(ss.System(**train, contacts=[clutch, brake]), 2.5, *driven.at(0.5))
    x, v = braked.at(2.5)
    return {
        "clutch_locks_at": locks, "clutch_opens_at": opens, "speed_there": driven.at(opens)[1][0],
        "angle_at_3": x[0], "speed_at_3": v[0], "twist_at_3": x[2] - x[1],
    }  # fmt: skip
