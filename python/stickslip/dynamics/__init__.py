"""What a motion is and what a family of motions does: sections, return maps, orbit diagrams, regime maps, basins.

>>> import stickslip as ss
>>> ss.orbit_diagram(ss.paper.oscillator(0.3), "drive_velocity", [0.2, 0.45])["regime"].values.tolist()
['stick_slip', 'stable_slip']
"""

from stickslip.dynamics.basins_of_attraction import basins
from stickslip.dynamics.diagrams import orbit_diagram
from stickslip.dynamics.orbit_summary import sign_changes, steady_motion
from stickslip.dynamics.regime_maps import regime_map
from stickslip.dynamics.return_maps import release_map, return_map
from stickslip.dynamics.sections import section
from stickslip.dynamics.surface import Surface

__all__ = [
    "Surface",
    "basins",
    "orbit_diagram",
    "regime_map",
    "release_map",
    "return_map",
    "section",
    "sign_changes",
    "steady_motion",
]
