"""What a calibration found, how far to trust it, where it is from, and its file."""
