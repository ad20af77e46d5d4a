"""Kinetic friction: branches with memory along a motion, and velocity steps."""
