"""Reports: one HTML page each."""
