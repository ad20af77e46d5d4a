"""One file per kind of record file; each turns bytes into a `Table`."""

from stickslip.measurement.formats.table import Table

__all__ = ["Table"]
