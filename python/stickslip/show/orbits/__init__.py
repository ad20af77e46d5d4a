"""Pictures of a motion: over time, in its phase plane, as the loop of friction over slip velocity, in a section."""
