"""Motions of a system: one orbit, or many."""
