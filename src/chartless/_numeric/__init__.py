"""Numerical tools that know nothing of cameras."""
