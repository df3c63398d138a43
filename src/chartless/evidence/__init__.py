"""Evidence about a camera in its frames, one folder for each kind.

To add a kind, add a folder with the modules ``kind`` and ``options``, and its name to
`FOLDERS`.
"""

FOLDERS = ("raw", "bracket", "points", "typical", "noise")
"""Kinds of evidence, in the order in which they are considered."""
