"""Laws fitted to whole measured motions: shooting through exact orbits."""
