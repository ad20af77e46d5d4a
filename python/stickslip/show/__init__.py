"""Pictures a person looks at, with matplotlib.

Every function takes ``ax=None``, draws there or into a new figure in our style, returns the axes and never shows or
saves. Axis labels carry units: dimensionless where mass = stiffness = 1, else SI; ``units=`` says otherwise.

>>> import stickslip as ss
>>> ax = ss.show.phase_plane(ss.simulate(ss.paper.oscillator(0.30), t_end=100))
>>> ax.get_xlabel()
'position x (dimensionless)'
>>> import matplotlib.pyplot as plt; plt.close(ax.figure)
"""

from stickslip.show.branches import branches_plot, loci_plot
from stickslip.show.canvas import (
    DIRECTION_COLOURS,
    MODE_COLOURS,
    OKABE_ITO,
    REGIME_COLOURS,
    STYLE,
    new_axes,
    shade_sticks,
    styled,
)
from stickslip.show.diagram import orbit_diagram_plot
from stickslip.show.law import break_away_plot, law_plot
from stickslip.show.maps import basins_plot, regime_map_plot
from stickslip.show.motion import motion_figure, motion_phase, motion_plot, spectra_plot
from stickslip.show.orbits.loop import BRANCH_COLOURS, friction_loop
from stickslip.show.orbits.phase import phase_plane
from stickslip.show.orbits.section import return_map_plot, section_plot
from stickslip.show.orbits.series import time_series
from stickslip.show.record import friction_record
from stickslip.show.stability import lyapunov_plot, manifold_plot, multipliers_plot

__all__ = [
    "BRANCH_COLOURS",
    "DIRECTION_COLOURS",
    "MODE_COLOURS",
    "OKABE_ITO",
    "REGIME_COLOURS",
    "STYLE",
    "basins_plot",
    "branches_plot",
    "break_away_plot",
    "friction_loop",
    "friction_record",
    "law_plot",
    "loci_plot",
    "lyapunov_plot",
    "manifold_plot",
    "motion_figure",
    "motion_phase",
    "motion_plot",
    "multipliers_plot",
    "new_axes",
    "orbit_diagram_plot",
    "phase_plane",
    "regime_map_plot",
    "return_map_plot",
    "section_plot",
    "shade_sticks",
    "spectra_plot",
    "styled",
    "time_series",
]
