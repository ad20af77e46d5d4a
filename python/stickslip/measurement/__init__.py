"""From a record and its rig to friction force, slip velocity and the table of break-aways."""

from stickslip.measurement.friction import measure
from stickslip.measurement.read import Record, read_columns
from stickslip.measurement.rig import Rig

__all__ = ["Record", "Rig", "measure", "read_columns"]
