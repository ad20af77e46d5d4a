"""What an orbit diagram is drawn of, apart from the pictures, as the command line names it before it loads them."""

from __future__ import annotations

from typing import Final

QUANTITIES: Final = {
    "x": ("turning_x", "position x at ẋ = 0", "position"),
    "slip_velocity": ("turning_slip_velocity", "slip velocity w at ẇ = 0", "velocity"),
    "section": ("section_x", "position x in the section", "position"),
    "amplitude": ("amplitude", "amplitude of x", "position"),
}
"""By its name: the variable of the diagram, what it is, and its dimension."""
