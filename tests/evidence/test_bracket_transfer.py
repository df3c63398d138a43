"""Transfer functions and the curves that follow from them, against known curves."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chartless.curves import named_curve
from chartless.curves.populations import measured_prior
from chartless.curves.prior import bin_edges
from chartless.evidence.bracket.likelihood import Comparagram, ExposureCounts
from chartless.evidence.bracket.transfer import brightness_transfer, transfer_curve
from chartless.types import Floats

LIGHT = np.linspace(0, 1, 400_001)


def levels(response: str, exposure: float, n_levels: int = 256) -> Floats:
    """Of ever more light, by a camera without noise."""
    brightness = named_curve(response).response((LIGHT * exposure).clip(0, 1))
    return np.asarray(np.rint((n_levels - 1) * brightness).astype(np.intp))


def exact(response: str, exposures: list[float], n_levels: int = 256) -> ExposureCounts:
    """Counts of every pair of neighbouring exposures; the last holds all light."""
    relative = [each / exposures[-1] for each in exposures]
    shown = [levels(response, each, n_levels) for each in relative]
    tables = []
    for shorter in range(len(exposures) - 1):
        index = shown[shorter + 1] * n_levels + shown[shorter]
        counts = np.bincount(index, minlength=n_levels**2).reshape(n_levels, n_levels)
        ones = np.ones(n_levels)
        tables.append(Comparagram(shorter, shorter + 1, counts * 1.0, ones, ones))
    return ExposureCounts(tuple(tables), np.log(exposures))


def error(edges: Floats, response: str) -> float:
    """Root mean square of f against the truth."""
    irradiance = np.linspace(0, 1, 1024)
    known = np.concatenate([[0.0], edges, [1.0]])
    found = np.interp(irradiance, known, bin_edges(edges.size + 1))
    return float(np.sqrt(np.mean((found - named_curve(response).response(irradiance)) ** 2)))


def test_the_transfer_is_the_median_of_each_row() -> None:
    counts = np.zeros((6, 6))
    counts[0, 3] = counts[5, 3] = 9  # black and white say nothing
    counts[1, [0, 1]] = 3, 1  # black in the shorter exposure
    counts[2, [1, 2]] = 2, 2
    counts[3, [1, 2, 3]] = 1, 2, 1
    counts[4, [4, 5]] = 1, 3  # white

    level, lower = brightness_transfer(counts)

    assert level.tolist() == [2, 3]
    assert lower.tolist() == [1.5, 2.0]


def test_rows_without_pixels_have_no_transfer() -> None:
    level, lower = brightness_transfer(np.zeros((8, 8)))

    assert level.size == lower.size == 0


@pytest.mark.parametrize("response", ["srgb", "gamma:0.45", "linear"])
@pytest.mark.parametrize("ratio", [2.0, 3.7])
def test_an_exact_transfer_is_read_to_half_a_level(response: str, ratio: float) -> None:
    (table,) = exact(response, [1.0, ratio]).tables

    level, lower = brightness_transfer(table.counts)

    curve = named_curve(response)
    expected = 255 * curve.response(curve.inverse(level / 255) / ratio)
    assert level.size > 150
    assert np.abs(lower - expected).max() < 0.5


@pytest.mark.parametrize("response", ["srgb", "gamma:0.45", "gamma:0.6"])
@pytest.mark.parametrize("n_levels", [64, 256])
def test_exact_transfers_at_known_ratios_give_the_curve(response: str, n_levels: int) -> None:
    counts = exact(response, [1.0, 2.0, 4.0, 8.0], n_levels)

    found = transfer_curve(counts, measured_prior(n_levels))

    assert np.all(np.diff(found.edges) > 0)
    assert error(found.edges, response) < 0.005
    assert_allclose(found.log_exposure_changes, 0, atol=1e-9)


def test_a_factor_on_all_exposures_changes_nothing() -> None:
    counts = exact("srgb", [1.0, 2.0, 4.0])
    shifted = ExposureCounts(counts.tables, counts.log_exposures + 5)
    prior = measured_prior(256)

    assert_allclose(
        transfer_curve(shifted, prior).edges, transfer_curve(counts, prior).edges, atol=1e-12
    )


def test_exposures_a_little_wrong_are_made_right() -> None:
    counts = exact("srgb", [1.0, 2.0, 4.0, 8.0])
    wrong = np.array([0.0, 0.05, -0.05, 0.0])
    said = ExposureCounts(counts.tables, counts.log_exposures + wrong, exposure_error=0.05)

    found = transfer_curve(said, measured_prior(256))

    # Up to a power of the curve: what is linear in the steps is not told.
    steps = np.arange(4) - 1.5
    left = wrong + found.log_exposure_changes
    left = left - left.mean() - steps * (steps @ left) / (steps @ steps)
    assert np.abs(left).max() < 0.01
    assert found.log_exposure_changes.sum() == pytest.approx(0, abs=1e-9)
    assert error(found.edges, "srgb") < 0.01


def test_exposures_of_which_nothing_is_known_are_held_at_first() -> None:
    counts = exact("srgb", [1.0, 2.0, 4.0])
    unknown = ExposureCounts(counts.tables, counts.log_exposures, 1.5)

    found = transfer_curve(unknown, measured_prior(256))

    assert_allclose(found.log_exposure_changes, 0, atol=1e-9)
