"""From friction records to a law with its uncertainty, and from the law back to the motion it came from."""

from stickslip.identification.kinetic.single_velocity_step import VelocityStepFit, fit_velocity_step
from stickslip.identification.kinetic.velocity_step_fits import VelocityStepsFit, fit_velocity_steps
from stickslip.identification.prediction.agreement import Agreement, compare_motion
from stickslip.identification.prediction.prediction import Prediction, predict_motion
from stickslip.identification.result import Identification
from stickslip.identification.selection.comparison import Comparison, compare_laws
from stickslip.identification.selection.identify import identify
from stickslip.identification.static.static_fit import StaticFrictionFit, fit_static_friction
from stickslip.identification.steady.form_choice import fit_steady
from stickslip.identification.steady.steady_result import SteadyFriction
from stickslip.identification.synthetic import friction_of_orbit, friction_of_sticks
from stickslip.identification.trajectory.sensitivity import Sensitivity, sensitivity
from stickslip.identification.trajectory.shooting import fit_trajectories

__all__ = [
    "Agreement",
    "Comparison",
    "Identification",
    "Prediction",
    "Sensitivity",
    "StaticFrictionFit",
    "SteadyFriction",
    "VelocityStepFit",
    "VelocityStepsFit",
    "compare_laws",
    "compare_motion",
    "fit_static_friction",
    "fit_steady",
    "fit_trajectories",
    "fit_velocity_step",
    "fit_velocity_steps",
    "friction_of_orbit",
    "friction_of_sticks",
    "identify",
    "predict_motion",
    "sensitivity",
]
