"""Static friction that grows with the logarithm of stick time."""

from __future__ import annotations

from dataclasses import dataclass

from stickslip.laws.law import Law


@dataclass(frozen=True)
class LogarithmicDwell(Law):
    """f_s(t_s) = f_k + A ln(1 + t_s/t_c) at rest, F = f_k sgn w in motion.

    Parameters
    ----------
    kinetic : kinetic force f_k ≥ 0.
    growth : A ≥ 0, what an e-fold of rest adds to static friction; 0.01 to 0.02 of the normal force per decade for rock.
    onset : t_c > 0, the rest after which the logarithm sets in; about 1 s for rock.

    Source: Dieterich, J. Geophysical Research 77 (1972) 3690.

    >>> round(LogarithmicDwell(kinetic=0.5, growth=0.1, onset=1.0).break_away_force(1.718281828459045), 12)
    0.6
    """

    kinetic: float
    growth: float
    onset: float
