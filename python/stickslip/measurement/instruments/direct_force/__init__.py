"""Friction from a force that is measured in its line: clocks, motion, lags, sticks, and friction over speed."""
