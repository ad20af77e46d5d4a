"""From records and their rigs to motion, friction force, slip velocity and the table of break-aways."""

from stickslip.measurement.friction import measure
from stickslip.measurement.instruments import INSTRUMENTS, InstrumentRig
from stickslip.measurement.kinematics import motion
from stickslip.measurement.read import Record, read_columns
from stickslip.measurement.result import facts, notes
from stickslip.measurement.rigs.layout import Layout
from stickslip.measurement.rigs.rig import Rig
from stickslip.measurement.rigs.rig_file import load_rig
from stickslip.measurement.signals.spectra import spectrum, spectrum_over_time
from stickslip.measurement.summary import summary

__all__ = [
    "INSTRUMENTS",
    "InstrumentRig",
    "Layout",
    "Record",
    "Rig",
    "facts",
    "load_rig",
    "measure",
    "motion",
    "notes",
    "read_columns",
    "spectrum",
    "spectrum_over_time",
    "summary",
]
