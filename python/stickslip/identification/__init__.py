"""From friction records to a law with its uncertainty, and from the law back to the motion it came from."""

from stickslip.identification.break_away import StaticFriction, fit_static_friction
from stickslip.identification.fit import Identification, identify

__all__ = ["Identification", "StaticFriction", "fit_static_friction", "identify"]
