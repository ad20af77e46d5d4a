"""The default calibration of the paper's oscillator. The numbers of its law are the defaults in `laws/bogacz_ryczek.py`."""

from __future__ import annotations

from stickslip.laws import BogaczRyczek
from stickslip.model.drive import Harmonic
from stickslip.model.system import Oscillator

#: Dimensionless damping d: the paper does not state it; this value puts the end of stick-slip at s ≈ 0.25.
DAMPING = 0.35

#: What the paper reports: stick-slip below the first, stable slip above the second drive velocity.
END_OF_STICK_SLIP, END_OF_OSCILLATION = 0.25, 0.40


def oscillator(drive_velocity: float, forcing: Harmonic | None = None) -> Oscillator:
    """The paper's oscillator ẍ + d ẋ + x = f(w, t_s, δ, sign ẇ) + u₀ cos ηt at one drive velocity, dimensionless.

    Parameters
    ----------
    drive_velocity : s, dimensionless.
    forcing : u₀ cos ηt as ``Harmonic(u0, eta)``, or None.

    Source: Eqs. (6) and (10) of the paper; damping and law are our calibration (``docs/paper-law.md``).

    >>> oscillator(0.3).damping
    0.35
    """
    return Oscillator(damping=DAMPING, drive_velocity=drive_velocity, law=BogaczRyczek(), forcing=forcing)
