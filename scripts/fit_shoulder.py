"""Fit how hard the shoulders of digital cameras are: the last term of the prior of curves.

    python scripts/fit_shoulder.py [--data FOLDER]

The prior of log slopes was learned from DoRF, mostly film. Response curves of 26 digital cameras
(folder modern_curves of FOLDER, or of the one that CHARTLESS_DATA names) are steeper next to white
than it expects: what lies above level 254 is 4 % of their light in the median, and 12 % in one of
ten, of DoRF 0.8 %. The term has the form of `chartless.curves.prior`: Matérn 3/2 in ln of the
distance from white, of deviation s and length l. Both are fitted by maximum likelihood of log
slopes above level 160 given those below, without fading, as then nothing is left to other levels:

    deviation 1.01, length 0.74

`chartless.curves.prior` has 0.7 and 0.75, and lets the term fade by e within 32 levels, so that it
does not loosen the curve where frames show it: with 1.0, a noisy test bracket of a linear camera
was off by 0.006. Also printed: how far the light at white is off if the curve is known up to a
level, and how often by more than two of the deviations that the prior gives.
"""

import argparse
import os
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from chartless.curves.populations import measured_prior
from chartless.curves.prior import bin_edges, log_slopes_of_response, shoulder_covariance
from chartless.types import Floats

N_LEVELS, SPLIT = 256, 160
LAST_SEEN = (254, 250, 246)
N_DRAWS = 300
ENDLESS = 1e6  # reach of a term that does not fade


def log_slopes(data: Path) -> Floats:
    """Log slopes of the cameras, shape (B, 256)."""
    with np.load(data / "modern_curves" / "responses_1024.npz") as stored:
        light, curves = stored["E"].astype(float), stored["f"].astype(float)
    return np.array([log_slopes_of_response(light, curve) for curve in curves])


def misfit(unknown: Floats, known: Floats, rows: Floats) -> float:
    """Minus ln of the probability of log slopes above `SPLIT` given those below."""
    deviation, length = np.exp(unknown)
    covariance = known + shoulder_covariance(
        N_LEVELS, deviation=float(deviation), length=float(length), reach=ENDLESS
    )
    low, high = slice(SPLIT), slice(SPLIT, None)
    away = rows - measured_prior(N_LEVELS).mean
    weights = np.linalg.solve(covariance[low, low], covariance[low, high])
    rest = away[:, high] - away[:, low] @ weights
    factor = np.linalg.cholesky(covariance[high, high] - covariance[high, low] @ weights)
    scaled = np.linalg.solve(factor, rest.T)
    return float(0.5 * np.sum(scaled**2) + len(rows) * np.log(np.diag(factor)).sum())


def white_errors(covariance: Floats, rows: Floats, last: int) -> tuple[Floats, Floats]:
    """Ln of the light at white, predicted less true, and its deviation, of each camera."""
    mean, width = measured_prior(N_LEVELS).mean, np.diff(bin_edges(N_LEVELS))
    low, high = slice(last + 1), slice(last + 1, None)
    weights = np.linalg.solve(covariance[low, low], covariance[low, high])
    spread = covariance[high, high] - covariance[high, low] @ weights
    generator = np.random.default_rng(0)
    draws = generator.multivariate_normal(
        np.zeros(len(spread)), (spread + spread.T) / 2, N_DRAWS, check_valid="ignore"
    )
    errors, deviations = [], []
    for row in rows:
        expected = mean[high] + (row - mean)[low] @ weights
        below = float(np.exp(row[low]) @ width[low])
        white = np.log(below + np.exp(expected + draws) @ width[high])
        errors.append(float(white.mean()))
        deviations.append(float(white.std()))
    return np.array(errors), np.array(deviations)


def main() -> None:
    """Fit, and print what the term is worth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("CHARTLESS_DATA", "data")))
    rows = log_slopes(parser.parse_args().data)
    known = measured_prior(N_LEVELS).covariance
    found = minimize(misfit, np.zeros(2), args=(known, rows), method="Nelder-Mead")
    deviation, length = np.exp(found.x)
    print(f"deviation {deviation:.2f}, length {length:.2f}, of {len(rows)} cameras")
    priors = {"without": known, "with": measured_prior(N_LEVELS).with_shoulder().covariance}
    for name, covariance in priors.items():
        for last in LAST_SEEN:
            errors, deviations = white_errors(covariance, rows, last)
            print(
                f"{name:8} seen up to {last}: off by {np.median(np.abs(errors)):.3f}, claimed "
                f"{np.median(deviations):.3f} (medians), "
                f"{np.mean(np.abs(errors) > 2 * deviations):.0%} beyond two deviations"
            )


if __name__ == "__main__":
    main()
