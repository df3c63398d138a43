"""How far the families of any order are registered."""

HIGHEST_ORDER = 10
"""Highest order of polynomials; beyond, they follow the noise of any measured curve."""
