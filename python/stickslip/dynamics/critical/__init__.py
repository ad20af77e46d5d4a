"""Drive velocities at which the kind of motion changes."""
