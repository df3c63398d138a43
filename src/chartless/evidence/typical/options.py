"""Options for pictures without evidence: none."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Options:
    """No options."""
