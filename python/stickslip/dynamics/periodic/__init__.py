"""Equilibria and periodic orbits, their multipliers, and Lyapunov exponents."""
