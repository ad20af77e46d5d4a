"""Gauges beside the spring: one file each, one registry.

A new gauge is a function from samples in SI to a friction tree, the names of its channels and constants, and a line here.
"""

from __future__ import annotations

from stickslip.measurement.gauges.cylinder import CYLINDER
from stickslip.measurement.gauges.direct_force import DIRECT_FORCE
from stickslip.measurement.gauges.event_list import EVENT_LIST
from stickslip.measurement.gauges.force_log import FORCE_LOG
from stickslip.measurement.gauges.free_decay import FREE_DECAY
from stickslip.measurement.gauges.gauge import Bench, Channel, Constant, Gauge, Samples
from stickslip.measurement.gauges.motor_current import MOTOR_CURRENT
from stickslip.measurement.gauges.torque_observer import TORQUE_OBSERVER
from stickslip.measurement.gauges.velocity_steps import VELOCITY_STEPS

GAUGES = {
    gauge.name: gauge
    for gauge in (
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

__all__ = ["GAUGES", "Bench", "Channel", "Constant", "Gauge", "Samples"]
