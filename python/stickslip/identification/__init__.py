"""From friction records to a law with its uncertainty, and from the law back to the motion it came from."""

from stickslip.identification.agreement import Agreement, compare_motion
from stickslip.identification.break_away import StaticFriction, fit_static_friction
from stickslip.identification.fit import Identification, identify
from stickslip.identification.steady import SteadyFriction, fit_steady
from stickslip.identification.synthetic import friction_of_orbit

__all__ = [
    "Agreement",
    "Identification",
    "StaticFriction",
    "SteadyFriction",
    "compare_motion",
    "fit_static_friction",
    "fit_steady",
    "friction_of_orbit",
    "identify",
]
