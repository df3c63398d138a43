"""Cases of one test, of which a plain ``pytest`` runs some."""

from collections.abc import Iterable
from typing import Any

import pytest


def slow_but(cases: Iterable[Any], *quick: Any) -> list[Any]:
    """The cases as they are, all of them marked slow but these."""
    cases = list(cases)
    assert set(quick) <= set(cases), f"{set(quick) - set(cases)} are no cases"
    return [each if each in quick else pytest.param(each, marks=pytest.mark.slow) for each in cases]
