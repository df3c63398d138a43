"""The posterior of curve and noise, given terms of evidence."""
