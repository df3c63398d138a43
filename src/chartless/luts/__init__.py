"""Response curves in the files of other programs, one file for each format.

A format's file says whether a file is of that format (`recognised`, by content, whatever its
name), reads it into a `chartless.calibration.Calibration` (`read`), and knows no other format.
"""
