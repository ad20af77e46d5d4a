"""Steady slip, its stability, and the Hopf points where that changes."""
