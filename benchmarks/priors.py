"""Priors without the camera under test, for the other benchmarks."""

import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from chartless.curves.populations import Population, population_basis
from chartless.curves.prior import CurvePrior, digital_basis
from chartless.evidence.origins import weights_of
from chartless.frames.frame import Origin
from chartless.types import Floats

sys.path.append(str(Path(__file__).parents[1] / "scripts"))
from fit_digital import of_brackets, of_others


@cache
def digital_cameras(data: Path) -> Mapping[str, Floats]:
    """Log slopes of the cameras of which the prior of digital cameras is made."""
    return {**of_brackets(data), **of_others(data)}


def digital_prior(data: Path, *left_out: str) -> CurvePrior:
    """Prior of digital cameras but some."""
    cameras = digital_cameras(data)
    kept = [rows for name, rows in cameras.items() if name not in left_out]
    return digital_basis(kept, population_basis(Population.DORF)).prior()


def mixture(
    origin: Origin = Origin.UNKNOWN,
    *,
    digital: CurvePrior | None = None,
    dorf: CurvePrior | None = None,
) -> CurvePrior:
    """Mixture for files of this origin, some of its parts replaced."""
    given = {Population.DIGITAL: digital, Population.DORF: dorf}
    replaced = {population: prior for population, prior in given.items() if prior is not None}
    return weights_of([origin]).prior(replaced=replaced)
