"""Limits on scenes that several kinds of evidence share."""

SUSPICIOUS = 0.05
"""Share of the difference of two frames that is not noise, above which they are flagged."""
LEAST_COVERAGE = 0.25
"""Share of the level range that the scene must cover; below it, most of the curve is
guessed."""
GOOD_COVERAGE = 0.8
"""Share of the range below which the result is flagged."""
MANY_CLIPPED = 0.25
"""Share of black and white pixels above which the result is flagged."""
