"""From a record and its rig to friction force, slip velocity and the table of break-aways."""

from stickslip.measure.friction import measure
from stickslip.measure.read import Record, read_columns
from stickslip.measure.rig import Rig

__all__ = ["Record", "Rig", "measure", "read_columns"]
