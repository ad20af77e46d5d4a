"""Displacement, velocity and acceleration from noisy samples; clocks, noise and spectra."""
