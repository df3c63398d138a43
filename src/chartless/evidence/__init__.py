"""What frames show of a camera, by kind; a folder here for each.

A new kind is a folder with the modules ``kind`` and ``options``, and its name in `FOLDERS`.
"""

FOLDERS = ("raw", "bracket", "points", "noise")
"""Kinds of evidence, in the order in which they are asked."""
