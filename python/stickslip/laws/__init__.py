"""Friction laws: immutable data, checked and evaluated by the core.

Every law answers two questions: what force adhesion can bear (:meth:`Law.break_away_force`) and what force slip produces
(:meth:`Law.kinetic_force`, :func:`force_along`). Friction on the mass has the sign of the slip velocity w.
"""

from __future__ import annotations

from stickslip.laws.asymmetric import Asymmetric as Asymmetric
from stickslip.laws.bands import friction_table as friction_table
from stickslip.laws.bogacz_ryczek import BogaczRyczek as BogaczRyczek
from stickslip.laws.bouc_wen import BoucWen as BoucWen
from stickslip.laws.code import law_code as law_code
from stickslip.laws.combined import Combined as Combined
from stickslip.laws.coulomb import Coulomb as Coulomb
from stickslip.laws.cubic import Cubic as Cubic
from stickslip.laws.dahl import Dahl as Dahl
from stickslip.laws.dwell_time import DwellTime as DwellTime
from stickslip.laws.elasto_plastic import ElastoPlastic as ElastoPlastic
from stickslip.laws.exponential_stribeck import ExponentialStribeck as ExponentialStribeck
from stickslip.laws.force_rate import ForceRate as ForceRate
from stickslip.laws.law import Law as Law
from stickslip.laws.law import force_along as force_along
from stickslip.laws.law import load_covariance as load_covariance
from stickslip.laws.law import load_law as load_law
from stickslip.laws.logarithmic_dwell import LogarithmicDwell as LogarithmicDwell
from stickslip.laws.lorentzian import Lorentzian as Lorentzian
from stickslip.laws.lu_gre import LuGre as LuGre
from stickslip.laws.piecewise_linear import PiecewiseLinear as PiecewiseLinear
from stickslip.laws.piecewise_polynomial import PiecewisePolynomial as PiecewisePolynomial
from stickslip.laws.popp_stelter import PoppStelter as PoppStelter
from stickslip.laws.rate_state import RateState as RateState
from stickslip.laws.rational import Rational as Rational
from stickslip.laws.regularised import Regularised as Regularised
from stickslip.laws.smooth_function import smooth_from_function as smooth_from_function
from stickslip.laws.static_friction import StaticFriction as StaticFriction
from stickslip.laws.static_kinetic import StaticKinetic as StaticKinetic
from stickslip.laws.tabulated import Tabulated as Tabulated
from stickslip.laws.tabulation import from_function as from_function
from stickslip.laws.two_branch import TwoBranch as TwoBranch
