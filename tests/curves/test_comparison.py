"""Which family is recommended, and the criteria it is recommended by."""

import numpy as np
import pytest

from chartless.curves import comparison
from chartless.curves.comparison import (
    HIGHEST_ORDER,
    compare,
    default_models,
    independent_samples,
    is_valid,
    stays_inside,
)
from chartless.curves.fitting import Fit, fit
from chartless.errors import ParameterError, UnknownNameError
from chartless.models import MODELS, Table
from chartless.types import Floats

FEW = ("gamma", "ameegc2-exact", "eegc4", "gumbel3", "poly3", "emor2")
TRUTH = np.array([-0.3, 1.8, -0.1])
Samples = tuple[Floats, Floats]


def power(n_samples: int = 60, exponent: float = 0.45) -> Samples:
    irradiance = np.linspace(0, 1, n_samples)
    return irradiance, irradiance**exponent


def noisy(seed: int = 0, n_samples: int = 200, deviation: float = 0.003) -> Samples:
    """A member of ameegc2-exact with independent errors; black and white are known."""
    irradiance = np.linspace(0, 1, n_samples)
    errors = np.random.default_rng(seed).normal(scale=deviation, size=n_samples)
    brightness = MODELS["ameegc2-exact"].response(irradiance, TRUTH) + errors
    brightness[[0, -1]] = 0, 1
    return irradiance, brightness.clip(0, 1)


def rank_of(name: str, found: comparison.Comparison) -> int:
    """How many families have a clearly lower BIC."""
    bic = {each.model.name: each.bic for each in found.candidates}
    return sum(other < bic[name] - 1e-6 for other in bic.values())


# Recommendations


@pytest.mark.slow
def test_the_family_with_gamma_inside_and_the_fewest_parameters_describes_a_power() -> None:
    names = [name for name in default_models() if name != "table"]

    recommended = compare([power()], models=names).recommended

    assert recommended is not None
    assert recommended.model.n_parameters == 1
    assert recommended.rmse < 1e-9
    assert recommended.valid


@pytest.mark.slow
def test_the_family_that_made_noisy_samples_is_among_the_best() -> None:
    names = [name for name in default_models() if name != "table"]

    found = compare([noisy()], models=names)

    assert rank_of("ameegc2-exact", found) < 5
    assert found.recommended is not None
    assert 2 <= found.recommended.model.n_parameters <= 4
    assert found.recommended.rmse < 0.004


def test_more_curves_ask_for_what_describes_all_of_them() -> None:
    simple, bent = power(200), noisy()

    alone, both = compare([simple], models=FEW), compare([simple, bent], models=FEW)

    assert alone.recommended is not None
    assert alone.recommended.model.name == "gamma"
    assert both.recommended is not None
    assert both.recommended.model.name == "ameegc2-exact"
    assert len(both.n_independent) == 2
    for each in both.candidates:
        assert len(each.fits) == 2
        squares = [one.rmse**2 for one in each.fits]
        assert each.rmse == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-12)


def test_curves_may_have_different_numbers_of_samples() -> None:
    found = compare([noisy(1, 40), noisy(2, 80)], models=FEW)

    assert [one.n_samples for one in found.candidates[0].fits] == [40, 80]


def test_what_is_no_response_is_not_recommended() -> None:
    irradiance, brightness = power()

    found = compare([(irradiance, 0.1 + 0.7 * brightness)], models=["gamma", "ggc2"])

    affine = found.candidates[1]
    assert affine.model.name == "ggc2"
    assert affine.rmse < 1e-6
    assert not affine.valid
    assert found.recommended is found.candidates[0]


def test_nothing_is_recommended_where_nothing_is_valid() -> None:
    irradiance, brightness = power()

    assert compare([(irradiance, 0.8 * brightness)], models=["ggc2", "poly2"]).recommended is None


def test_one_invalid_fit_is_enough() -> None:
    simple, (irradiance, brightness) = power(), power()

    (affine,) = compare([simple, (irradiance, 0.8 * brightness)], models=["ggc2"]).candidates

    assert is_valid(affine.fits[0])
    assert not is_valid(affine.fits[1])
    assert not affine.valid


@pytest.mark.parametrize("n_samples", [12, 25])
def test_a_table_is_tried_but_not_recommended_for_running_through_the_samples(
    n_samples: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MODELS._items, "table", Table(order=40))  # the whole one takes its time
    names = ["gamma", "ameegc1", "ameegc2-exact", "eegc6"]

    found = compare([noisy(0, n_samples)], models=[*names, "table"])

    table = found.candidates[-1]
    assert table.model.name == "table"
    assert table.rmse < min(each.rmse for each in found.candidates[:-1])
    assert (table.aicc, table.bic) == (np.inf, np.inf)
    assert found.recommended is not None
    assert found.recommended.model.name == "ameegc2-exact"
    without = compare([noisy(0, n_samples)], models=names)
    assert found.n_independent == without.n_independent


def test_smooth_differences_count_little() -> None:
    """A dense, smooth curve that no family meets is not evidence for many parameters."""
    irradiance = np.linspace(0, 1, 1000)
    brightness = irradiance**0.5 + 0.02 * np.sin(2 * np.pi * irradiance)

    found = compare([(irradiance, brightness)], models=["gamma", "ameegc2-exact", "emor2"])

    assert found.n_independent[0] < 100


# Which families


def test_every_family_is_tried_and_no_order_above_the_highest() -> None:
    names = default_models()

    assert {MODELS[name].family for name in names} == {each.family for each in MODELS.values()}
    assert all(MODELS[name].order <= HIGHEST_ORDER for name in names if name != "table")
    assert {f"eegc{order}" for order in range(HIGHEST_ORDER + 1)} <= set(names)
    assert names == [name for name in MODELS if name in names]


def test_the_order_of_the_candidates_is_the_one_asked_for() -> None:
    found = compare([power(12)], models=["poly1", "gamma", "eegc0"])

    assert [each.model.name for each in found.candidates] == ["poly1", "gamma", "eegc0"]


def test_without_two_samples_to_spare_a_family_is_left_out() -> None:
    found = compare([power(5), power(30)], models=["eegc1", "eegc2", "eegc3"])

    assert [each.model.name for each in found.candidates] == ["eegc1", "eegc2"]


def test_progress_counts_the_families() -> None:
    calls: list[tuple[int, int]] = []

    compare(
        [power(5)], models=["eegc1", "eegc9", "gamma"], on_model=lambda *call: calls.append(call)
    )

    assert calls == [(1, 2), (2, 2)]


# Criteria


@pytest.mark.parametrize("n_samples", [30, 200])
def test_criteria_are_those_of_the_books(n_samples: int) -> None:
    """Differences of −2 log likelihood + penalty, with the variance at its maximum."""
    irradiance, brightness = noisy(3, n_samples)

    found = compare([(irradiance, brightness)], models=FEW)

    (n,) = found.n_independent
    for each in found.candidates:
        residual = each.model.response(irradiance, each.fits[0].parameters) - brightness
        variance = np.mean(residual**2)
        n_fitted = each.model.n_parameters + 1
        minus_twice = n * np.log(variance)
        aic = minus_twice + 2 * n_fitted
        assert each.aicc == pytest.approx(
            aic + 2 * n_fitted * (n_fitted + 1) / (n - n_fitted - 1), rel=1e-9
        )
        assert each.bic == pytest.approx(minus_twice + n_fitted * np.log(n), rel=1e-9)


def test_criteria_of_many_curves_are_summed() -> None:
    curves = [noisy(4, 100), noisy(5, 150)]
    apart = [compare([curve], models=FEW) for curve in curves]

    found = compare(curves, models=FEW)

    assert found.n_independent == pytest.approx([each.n_independent[0] for each in apart])
    for place, each in enumerate(found.candidates):
        parts = [one.candidates[place] for one in apart]
        assert each.aicc == pytest.approx(sum(part.aicc for part in parts), rel=1e-9)
        assert each.bic == pytest.approx(sum(part.bic for part in parts), rel=1e-9)


@pytest.mark.parametrize(("n_samples", "name"), [(8, "eegc5"), (11, "eegc4"), (14, "eegc6")])
def test_criteria_are_infinite_with_fewer_than_two_samples_to_a_fitted_number(
    n_samples: int, name: str
) -> None:
    """There BIC, meant for many samples, would reward running through them."""
    found = compare([noisy(6, n_samples)], models=["gamma", name])

    simple, complex_ = found.candidates
    assert found.n_independent[0] < 2 * (complex_.model.n_parameters + 1)
    assert np.isfinite([simple.aicc, simple.bic]).all()
    assert (complex_.aicc, complex_.bic) == (np.inf, np.inf)
    assert found.recommended is simple


def test_nothing_is_recommended_where_nothing_can_be_judged() -> None:
    """A difference that changes its sign once says next to nothing; the fit is there."""
    irradiance = np.linspace(0, 1, 1000)
    brightness = 0.9 * irradiance**0.5

    found = compare([(irradiance, brightness)], models=["gamma"])

    (only,) = found.candidates
    assert only.valid
    assert only.bic == np.inf
    assert found.recommended is None


def test_exact_fits_have_finite_criteria() -> None:
    found = compare([power(50, 1.0)], models=["gamma", "conpoly2", "poly0"])

    assert np.isfinite([[each.aicc, each.bic] for each in found.candidates]).all()


# Independent samples


@pytest.mark.parametrize("seed", range(3))
def test_white_noise_is_independent(seed: int) -> None:
    residual = np.random.default_rng(seed).standard_normal(5000)

    assert independent_samples(residual) == pytest.approx(5000, rel=0.08)


@pytest.mark.parametrize("correlation", [0.3, 0.6, 0.9])
def test_a_process_that_remembers_counts_for_less(correlation: float) -> None:
    white = np.random.default_rng(7).standard_normal(50_000)
    residual = np.empty_like(white)
    last = 0.0
    for place, step in enumerate(white):
        residual[place] = last = correlation * last + step

    expected = 50_000 * 2 * np.arccos(correlation) / np.pi  # Rice: how often its sign changes
    assert independent_samples(residual) == pytest.approx(expected, rel=0.03)


def test_dense_sampling_of_a_smooth_difference_does_not_make_it_count_for_more() -> None:
    counts = [independent_samples(np.sin(12 * np.linspace(0.1, 3, n))) for n in (60, 600, 6000)]

    assert counts[0] == counts[1] == counts[2] == 2 * 11 + 1


def test_alternating_differences_count_for_no_more_than_there_are() -> None:
    assert independent_samples(np.tile([1.0, -1.0], 50)) == 100


def test_no_differences_at_all_count_in_full() -> None:
    assert independent_samples(np.zeros(10)) == 10


def test_equal_differences_count_for_next_to_nothing() -> None:
    assert independent_samples(np.ones(1000)) == 1


# Valid responses


@pytest.mark.parametrize(
    ("name", "parameters", "valid"),
    [
        ("gamma", [0.4], True),
        ("ggc2", [0.0, 1.0, 0.5], True),
        ("ggc2", [0.01, 0.99, 0.5], False),
        ("ggc2", [0.0, 0.99, 0.5], False),
        ("ggc2", [0.0, 1.01, 0.5], False),
        ("conpoly0", [1.5], True),
        ("conpoly0", [2.5], False),
        ("conpoly0", [-0.5], False),
        ("ameegc2", [0.0, 3.0, 0.0], False),
    ],
)
def test_valid_responses(name: str, parameters: list[float], valid: bool) -> None:
    model = MODELS[name]
    found = Fit(model, np.array(parameters), 0.0, np.eye(len(parameters)), 9, 1.0, converged=True)

    assert is_valid(found) is valid


def test_curves_that_leave_the_range() -> None:
    assert stays_inside(np.array([0.0, 0.5, 1.0]))
    assert stays_inside(np.array([-1e-10, 1 + 1e-10]))
    assert not stays_inside(np.array([-1e-6, 0.5]))
    assert not stays_inside(np.array([0.5, 1 + 1e-6]))
    assert not stays_inside(np.array([0.5, np.nan]))


# Refusals


@pytest.mark.parametrize("n_samples", [2, 4])
def test_too_few_samples_to_compare(n_samples: int) -> None:
    with pytest.raises(ParameterError, match=f"5 samples or more, not {n_samples}"):
        compare([power(), power(n_samples)])


def test_an_unknown_family_is_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"unknown model 'gama'. Did you mean 'gamma'\?"):
        compare([power()], models=["gamma", "gama"])


def test_bad_samples_are_refused_before_anything_is_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def never(*_: object) -> Fit:
        pytest.fail("fitted")

    monkeypatch.setattr(comparison, "fit", never)
    irradiance, brightness = power()

    with pytest.raises(ParameterError, match="divide by the highest level"):
        compare([power(), (irradiance, 255 * brightness)])


def test_the_fits_are_those_of_fit() -> None:
    irradiance, brightness = noisy(9, 50)

    found = compare([(irradiance, brightness)], models=FEW)

    for each in found.candidates:
        alone = fit(each.model.name, irradiance, brightness)
        assert np.array_equal(each.fits[0].parameters, alone.parameters)
        assert each.rmse == pytest.approx(alone.rmse, rel=1e-12)
