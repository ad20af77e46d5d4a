"""What a record holds besides the motion: ripple of the drive or the base, drift of the zero."""
