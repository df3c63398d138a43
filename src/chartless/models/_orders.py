"""How far the families of any order are registered."""

HIGHEST_ORDER = 10
"""Of families of polynomials; beyond, a polynomial follows the noise of any measured curve."""
