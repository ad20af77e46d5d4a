"""Friction over slip velocity alone: points, forms of the curve, what a fit leaves, and what is said of it."""
