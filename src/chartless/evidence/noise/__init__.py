"""Frames of one exposure: the spread of their levels shows the slope of the curve."""
