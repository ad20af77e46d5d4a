"""The paper's figures, drawn from our model.

``FIGURES`` maps the numbers of the paper's figures to what draws them and to the sentences that go with them. The paper's own
figures are not available to us: what it says of them is its caption and its words. Where a curve of the paper is lost, the
picture shows our calibration; where the paper shows a measurement, a synthetic record of our model stands in for it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from stickslip.paper.figures.law import (
    climbs,
    fall_after_break_away,
    static_friction,
    steep_climbs,
    stick_slip_geometry,
)
from stickslip.paper.figures.measured import measured_displacement, measured_friction
from stickslip.paper.figures.motion import (
    drive_velocity_diagram,
    forced_motions,
    friction_over_drive_velocity,
    general_shape,
    limit_cycles,
    overview,
    phase_portraits,
    regimes,
    translation_of_d,
)
from stickslip.paper.figures.trade_offs import trade_offs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "FIGURES",
    "climbs",
    "drive_velocity_diagram",
    "fall_after_break_away",
    "forced_motions",
    "friction_over_drive_velocity",
    "general_shape",
    "limit_cycles",
    "measured_displacement",
    "measured_friction",
    "overview",
    "phase_portraits",
    "regimes",
    "static_friction",
    "steep_climbs",
    "stick_slip_geometry",
    "trade_offs",
    "translation_of_d",
]


class Figure(NamedTuple):
    """A figure of the paper: what draws ours, what the paper says of its own, what to see in ours."""

    draw: Callable[[], Axes | list[Axes]]
    paper: str
    see: str


#: The paper's figures by number; Fig. 1 is a sketch of the oscillator.
FIGURES: dict[str, Figure] = {
    "fig-02-static-friction": Figure(
        static_friction,
        "Static friction over stick time and force rate, measured; the surface is lost.",
        "Our calibration, not the paper's curve. Left: the growth with rest, smaller the faster the force grows. Right: what "
        "is there without rest falls from the end of stick-slip to the end of the oscillation, where it meets the line l.",
    ),
    "fig-03-displacement": Figure(
        measured_displacement,
        "Displacement over time at given drive velocities, measured.",
        "Synthetic records of our model with noise, as there are none of the paper's: saw teeth in stick-slip, rounded "
        "ones without sticks, a damped approach in stable slip.",
    ),
    "fig-04-measured-friction": Figure(
        measured_friction,
        "Friction over slip velocity at several drive velocities, with its piecewise-linear approximation, measured.",
        "Friction found from synthetic records (points) and the least-squares lines through them: higher while "
        "the slip velocity grows (full line) than while it falls (broken), as the paper reports.",
    ),
    "fig-05-friction-over-drive-velocity": Figure(
        friction_over_drive_velocity,
        "The approximated loops over each other: with s friction falls and the slip velocities at ẇ = 0 rise.",
        "Highest and lowest friction fall as s grows, as stated; the smaller turning slip velocity rises, the larger one "
        "soon falls.",
    ),
    "fig-06-general-shape": Figure(
        general_shape,
        "General shape of the law; a broken line where it belongs to almost-harmonic vibration.",
        "One law in three motions: with a stick at w = 0 (full lines), a loop that never reaches it (broken), one point. "
        "Where ẇ = 0 the slip velocity has the paper's name: w_k with sticks, w_h1 and w_h3 without.",
    ),
    "fig-07-stick-slip-geometry": Figure(
        stick_slip_geometry,
        "Geometrical parameters in stick-slip.",
        "From break-away down to a corner on l, up the common line, back through B. The inset has the fall α over β = 0.01.",
    ),
    "fig-08-climbs": Figure(
        climbs,
        "Geometrical parameters in almost-harmonic vibration: a) in successive periods, b) after different break-aways.",
        "After each turn of ẇ the climb aims at D, whose lines are drawn on (dotted) where they are climbed along.",
    ),
    "fig-09-steep-climbs": Figure(
        steep_climbs,
        "Geometrical parameters of stable slip, with D at infinity.",
        "The climb aims at D at s = 0.36; once it would be steeper than η = 89° it has that angle, at 0.38 and 0.39. At 0.45 "
        "the loop is one point.",
    ),
    "fig-10-translation-of-d": Figure(
        translation_of_d,
        "Impact of the translation of D on the trajectory.",
        "A nearer D makes the climb less wide and the limit cycle larger.",
    ),
    "fig-11-fall-after-break-away": Figure(
        fall_after_break_away,
        "α over static friction; the curve is lost.",
        "Our calibration, not the paper's curve: nothing falls up to the static friction without rest at s = 0.25, and "
        "beyond it more than rest has added.",
    ),
    "fig-12-phase-portraits": Figure(
        phase_portraits,
        "Phase portraits from simulation for various drive velocities.",
        "From rest: stick-slip, from s = 0.25 on almost-harmonic vibration after a first stick, above 0.40 stable slip. At "
        "0.25, just above the end of stick-slip, several sticks come before the last one.",
    ),
    "fig-13-forced-motions": Figure(
        forced_motions,
        "Forced motions: two-periodic and non-periodic, at s = 0.30 and at s = 0.40.",
        "Above the trajectories with a point per forcing period, below the position of those points one after the other: "
        "two rows are a two-periodic motion, no rows a non-periodic one. The paper does not state its u₀; ours is another "
        "in each column.",
    ),
    "fig-14-regimes": Figure(
        regimes,
        "The motions that follow each other as the drive gets faster.",
        "Turning points of the steady motion from rest; the paper's thresholds 0.25 and 0.40 are dashed.",
    ),
}
