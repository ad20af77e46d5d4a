"""Oscillators, systems, drives and scales as values."""
