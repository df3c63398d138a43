"""Frames of one exposure: the spread of their levels tells the slope of the curve."""
