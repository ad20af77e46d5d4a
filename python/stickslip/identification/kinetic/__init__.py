"""Kinetic friction: branches with memory, steady levels over slip velocity, velocity steps."""
