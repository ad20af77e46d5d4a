"""From pixels to lengths: calibration, rulers, and checks of the scale."""
