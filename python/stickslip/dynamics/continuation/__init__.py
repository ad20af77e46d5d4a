"""Branches of equilibria and periodic orbits, and the special points on them."""
