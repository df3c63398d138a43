"""The experiments of the paper, one file each, and what they share.

An experiment is a set of independent cases. Each finished case is recorded at once, so an
interrupted run goes on where it stopped.
"""

from chartless.experiments._cases import OnCase, fingerprint_of, run_cases

__all__ = ["OnCase", "fingerprint_of", "run_cases"]
