"""Instruments beside the spring: one file each, one registry.

A new instrument is a function from samples in SI to a friction tree, its channels and constants, and a line here.
"""

from __future__ import annotations

from stickslip.measurement.instruments.cylinder import CYLINDER
from stickslip.measurement.instruments.direct_force.direct_force import DIRECT_FORCE
from stickslip.measurement.instruments.event_list import EVENT_LIST
from stickslip.measurement.instruments.force_log import FORCE_LOG
from stickslip.measurement.instruments.free_decay import FREE_DECAY
from stickslip.measurement.instruments.instrument import Channel, Constant, Instrument, InstrumentRig, Samples
from stickslip.measurement.instruments.motor_current import MOTOR_CURRENT
from stickslip.measurement.instruments.torque_observer import TORQUE_OBSERVER
from stickslip.measurement.instruments.velocity_steps import VELOCITY_STEPS

INSTRUMENTS = {
    instrument.name: instrument
    for instrument in (
        CYLINDER,
        DIRECT_FORCE,
        EVENT_LIST,
        FORCE_LOG,
        FREE_DECAY,
        MOTOR_CURRENT,
        TORQUE_OBSERVER,
        VELOCITY_STEPS,
    )
}

__all__ = ["INSTRUMENTS", "Channel", "Constant", "Instrument", "InstrumentRig", "Samples"]
