"""Known numbers of forced oscillators."""

from __future__ import annotations

import math
from collections.abc import Callable

from known.case import Results, bisect, case

import stickslip as ss


def forced(frequency: float, friction: float, damping: float = 0.0, t_end: float = 20_000.0) -> ss.Orbit:
    """x″ + d x′ + x = cos Ωt − S sgn x′."""
    return ss.simulate(
        ss.Oscillator(damping, 0.0, ss.laws.Coulomb(friction), forcing=ss.Harmonic(1.0, frequency)), t_end
    )


def amplitude(orbit: ss.Orbit) -> float:
    """The largest |x| where the mass turns or stops, late in the run."""
    late = orbit.events[orbit.events["t"] > 0.95 * orbit.t_end]
    return float(late["x"].abs().max())


def turn_ratio(orbit: ss.Orbit, frequency: float) -> float:
    """The acceleration after a turn over that before it: the determinant of the map of half a period."""
    turn = orbit.events.iloc[-2]
    after = float(orbit.to_xarray([turn["t"]])["a"][0])
    return after / (turn["force"] + math.cos(frequency * turn["t"]) - turn["x"])


@case(
    "S10 cos Ωt against Coulomb friction S, no sticking", "closed form: Den Hartog, Trans. ASME 53 (1931) 107", 14,
    amplitude_at_0p7_S_0p3=1.885699850414254, determinant_at_0p7_S_0p3=0.50980108878881,
    amplitude_at_2_S_0p2=0.3179797338056485, determinant_at_2_S_0p2=0.72824590374638,
    sticking_from_S_at_0p7=0.7220709759221043, sticking_from_S_at_2=0.5962847939999439,
    amplitude_at_0p7_S_0p3_d_0p2=1.63078609579815,
)  # fmt: skip
def den_hartog() -> Results:
    low, high = forced(0.7, 0.3), forced(2.0, 0.2)

    def slips(frequency: float) -> Callable[[float], bool]:
        def without_stick(friction: float) -> bool:
            events = forced(frequency, friction, t_end=4000).events
            return not (events["kind"].iloc[-100:] == "capture").any()

        return without_stick

    return {
        "amplitude_at_0p7_S_0p3": amplitude(low),
        "determinant_at_0p7_S_0p3": turn_ratio(low, 0.7),
        "amplitude_at_2_S_0p2": amplitude(high),
        "determinant_at_2_S_0p2": turn_ratio(high, 2.0),
        "sticking_from_S_at_0p7": bisect(slips(0.7), 0.7, 0.75),
        "sticking_from_S_at_2": bisect(slips(2.0), 0.58, 0.62),
        "amplitude_at_0p7_S_0p3_d_0p2": amplitude(forced(0.7, 0.3, 0.2)),
    }


@case(
    "S11 the same with stops", "Hong & Liu, J. Sound Vib. 229 (2000) 1171; 30 digits", 12,
    amplitude_at_0p5_S_0p8=1.0207851736111622, stick_time_at_0p5_S_0p8=1.8763013669687993,
    outer_stop_at_0p2_S_0p4=0.652046061392, inner_stop_at_0p2_S_0p4=0.528984961496,
)  # fmt: skip
def hong_liu() -> Results:
    two, four = forced(0.5, 0.8, t_end=2000), forced(0.2, 0.4, t_end=3000)
    stops = four.events.query("kind == 'capture'")["x"].abs().iloc[-4:]
    return {
        "amplitude_at_0p5_S_0p8": amplitude(two),
        "stick_time_at_0p5_S_0p8": two.events["stick_time"].dropna().iloc[-1],
        "outer_stop_at_0p2_S_0p4": stops.max(),
        "inner_stop_at_0p2_S_0p4": stops.min(),
    }
