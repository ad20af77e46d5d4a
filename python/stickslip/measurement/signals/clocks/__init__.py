"""The clocks of two channels: their offset, and the lag of a force over speed or at slips."""
