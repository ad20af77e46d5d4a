"""What becomes of small disturbances of a motion, and of the motion as its system changes.

Derivatives through events, periodic orbits and their multipliers, Lyapunov exponents, critical velocities, branches.
"""
