"""From friction records to a law with its uncertainty, and from the law back to the motion it came from."""

from stickslip.identification.agreement import Agreement, compare_motion
from stickslip.identification.break_away import StaticFriction, fit_static_friction
from stickslip.identification.fit import Identification, identify
from stickslip.identification.synthetic import friction_of_orbit

__all__ = [
    "Agreement",
    "Identification",
    "StaticFriction",
    "compare_motion",
    "fit_static_friction",
    "friction_of_orbit",
    "identify",
]
