"""Cameras made up come back, within the error bars: the exact likelihood and the noise level."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.stats import beta
from slow_cases import slow_but

from chartless.curves import AbstractCurve, ModelCurve, SampledCurve, named_curve
from chartless.curves.populations import (
    Population,
    PopulationWeights,
    measured_prior,
    population_prior,
)
from chartless.curves.whitening import whitening
from chartless.errors import ParameterError
from chartless.evidence.noise.channel import LevelPairs, independent_share
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.origins import weights_of
from chartless.flags import Flag
from chartless.frames.levels import level_table
from chartless.inference.posterior import at_mode
from chartless.methods import (
    AbstractCalibrator,
    LikelihoodSearch,
    NoiseLevelSearch,
)
from chartless.models import MODELS
from chartless.noise import CAMERAS_OF_2008, AffineNoise, NoisePrior
from chartless.result.response import Response, Status, rmse
from chartless.simulate import simulate_frames
from chartless.types import Counts, Floats

NOISE = AffineNoise.from_8bit(0.03, 16)
LEVELS = np.arange(256) / 255

# The prior that goes with NOISE, so that what is left is what the search does.
likelihood_search = partial(LikelihoodSearch, noise_prior=CAMERAS_OF_2008)
noise_level_search = partial(NoiseLevelSearch, noise_prior=CAMERAS_OF_2008)
METHODS = {"likelihood": likelihood_search, "nlf": noise_level_search}


def s_shaped() -> AbstractCurve:
    """Logistic in the logarithm of exposure, as film is: flat near black and near white."""
    irradiance = np.linspace(0, 1, 2049)
    brightness = 1 / (1 + (0.18 / (irradiance + 1e-3)) ** 1.6)
    brightness = (brightness - brightness[0]) / (brightness[-1] - brightness[0])
    return SampledCurve(tuple(irradiance.tolist()), tuple(brightness.tolist()))


CURVES = {
    "srgb": named_curve("srgb"),
    "linear": named_curve("linear"),
    "gamma": named_curve("gamma:0.45454545454545453"),
    "s-shaped": s_shaped(),
}


@cache
def scene(height: int = 300, width: int = 400) -> Floats:
    """Smooth random light, as much of one irradiance as of another."""
    white = np.random.default_rng(7).standard_normal((height, width))
    smooth = gaussian_filter(white, 8, mode="wrap")
    return np.asarray(smooth.ravel().argsort().argsort().reshape(smooth.shape) / (smooth.size - 1))


@cache
def table_of(
    name: str, n_frames: int = 2, noise: AffineNoise = NOISE, size: int = 1
) -> Cooccurrence:
    light = scene(300 * size, 400 * size)
    frames = simulate_frames(light, CURVES[name], noise, n_frames=n_frames, seed=3)
    table = Cooccurrence.zeros()
    for first, second in pairwise(frames):
        table += Cooccurrence.of_pair(first, second)
    return table


def dark_levels(name: str, n_pixels: int) -> Counts:
    (frame,) = simulate_frames(np.zeros(n_pixels), CURVES[name], NOISE, n_frames=1, seed=9)
    return np.bincount(frame, minlength=256).astype(np.int64)


@dataclass(frozen=True)
class Case:
    """A camera and what was found."""

    truth: AbstractCurve
    table: Cooccurrence
    found: Response

    @property
    def covered(self) -> float:
        """Share of levels whose true irradiance is within two deviations."""
        assert self.found.inverse_lut_std is not None
        error = np.abs(self.found.inverse_lut - self.truth.inverse(LEVELS))
        return float(np.mean(error <= 2 * self.found.inverse_lut_std + 1e-12))


@cache
def case_of(method: str, name: str) -> Case:
    table = table_of(name)
    return Case(CURVES[name], table, METHODS[method]().calibrate(LevelPairs(table)))


@pytest.fixture(params=CURVES)
def likelihood(request: pytest.FixtureRequest) -> Case:
    return case_of("likelihood", request.param)


@pytest.fixture(params=CURVES)
def nlf(request: pytest.FixtureRequest) -> Case:
    return case_of("nlf", request.param)


def deviations(response: Response) -> Floats:
    assert response.inverse_lut_std is not None
    return response.inverse_lut_std


# The exact likelihood


def test_the_curve_is_found_within_its_error_bars(likelihood: Case) -> None:
    assert rmse(likelihood.found.curve, likelihood.truth) < 0.03
    assert likelihood.covered >= 0.85
    # Bars that said nothing would cover as well: the curve is known to 4 % of the range.
    assert deviations(likelihood.found).max() < 0.04


def test_the_noise_is_found_within_its_error_bars(likelihood: Case) -> None:
    error = likelihood.found.noise_error
    assert error is not None

    slope = np.log(likelihood.found.noise.slope / NOISE.slope) / error.log_slope
    floor = np.log(likelihood.found.noise.floor / NOISE.floor) / error.log_floor

    assert abs(slope) < 2.5
    assert abs(floor) < 2.5
    assert error.log_floor < 0.4
    # More of the one explains as much as more of the other.
    assert -1 < error.correlation < -0.5


def test_a_found_curve_increases_from_black_to_white(likelihood: Case) -> None:
    inverse = likelihood.found.inverse_lut

    assert (inverse[0], inverse[-1]) == (0, 1)
    assert np.all(np.diff(inverse) > 0)
    assert np.all(np.diff(likelihood.found.response_lut) > 0)
    bars = deviations(likelihood.found)
    assert bars[0] == bars[-1] == 0
    assert np.all(bars[1:-1] > 0)


def test_a_made_up_camera_is_explained(likelihood: Case) -> None:
    assert likelihood.found.account("noise")["deviance"] == pytest.approx(1, abs=0.1)
    assert likelihood.found.flags == ()
    assert likelihood.found.status is Status.CONVERGED


def test_the_result_tells_where_it_comes_from(likelihood: Case) -> None:
    found = likelihood.found

    assert (found.name, found.method, found.n_levels) == ("Y", "likelihood", 256)
    assert found.n_pairs == 300 * 400
    assert found.observed_levels == likelihood.table.observed_levels
    assert np.array_equal(found.account("noise").record.counts, likelihood.table.counts)
    assert isinstance(found.curve, SampledCurve)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [(0.06, 10), (0.015, 20), (0.03, 60)], ids=str)
def test_noise_that_is_not_typical_is_covered_too(noise: tuple[float, float]) -> None:
    table = table_of("srgb", noise=AffineNoise.from_8bit(*noise))

    case = Case(CURVES["srgb"], table, likelihood_search().calibrate(LevelPairs(table)))

    assert rmse(case.found.curve, case.truth) < 0.04
    assert case.covered >= 0.85


def test_pairs_that_no_camera_makes_are_flagged() -> None:
    """Two levels up or two down, and never the same again: no noise is so."""
    rng = np.random.default_rng(9)
    first = rng.integers(4, 60, 40_000, dtype=np.uint8)
    second = first + rng.choice([-2, 2], first.size)

    found = likelihood_search().calibrate(
        LevelPairs(Cooccurrence.of_pair(first, second.astype(np.uint8), n_levels=64))
    )

    assert Flag.MISFIT in found.flags
    assert found.account("noise")["deviance"] > 1.5


@pytest.mark.slow
def test_two_runs_are_equal_to_the_last_bit() -> None:
    once, again = (likelihood_search().calibrate(LevelPairs(table_of("srgb"))) for _ in range(2))

    assert once.curve == again.curve
    assert once.noise == again.noise
    assert once.noise_error == again.noise_error
    assert once.log_evidence == again.log_evidence
    np.testing.assert_array_equal(deviations(once), deviations(again))


def test_the_prior_may_be_given() -> None:
    found = likelihood_search(prior=weights_of(()).prior(256)).calibrate(
        LevelPairs(table_of("srgb")), channel="G"
    )

    assert found.name == "G"
    assert found.curve == case_of("likelihood", "srgb").found.curve


def test_progress_rises_to_one() -> None:
    shares: list[float] = []

    likelihood_search(model=MODELS["gamma"]).calibrate(
        LevelPairs(table_of("srgb")), progress=shares.append
    )

    assert len(shares) >= 2
    assert all(before < after for before, after in pairwise(shares))
    assert shares[-1] == 1


# Weights


@pytest.mark.parametrize("weight", [0.0, -0.2, 1.0001, np.nan, np.inf])
def test_a_weight_without_a_meaning_is_refused(weight: float) -> None:
    with pytest.raises(ParameterError, match=r"^weight must lie above 0 and not above 1, not "):
        likelihood_search(weight=weight)


@pytest.mark.parametrize("population", Population)
def test_the_full_weight_is_allowed_and_narrows_the_error_bars_of_one_population(
    population: Population,
) -> None:
    """Along the ridge, where the shape of a curve is evidence, more pairs do not count as more."""
    prior = population_prior(population, 256)

    usual, trusting = (
        likelihood_search(weight=weight, prior=prior).ridge(LevelPairs(table_of("srgb")))
        for weight in (0.2, 1.0)
    )

    usual_std, trusting_std = (
        at_mode(max(walked.modes, key=walked.weighted), walked.space).inverse_std[1:-1]
        for walked in (usual, trusting)
    )
    assert trusting_std.mean() < 0.7 * usual_std.mean()


def test_settings_name_what_a_user_may_choose() -> None:
    prior = NoisePrior(AffineNoise(2e-4, 1e-5), (0.5, 1.0), 0.25)
    of_noise = {
        "centre": {"slope": 2e-4, "floor": 1e-5},
        "spread": [0.5, 1.0],
        "correlation": 0.25,
    }
    search = LikelihoodSearch(weight=0.5, model=MODELS["gamma"], noise_prior=prior)
    assert search.settings == {
        "populations": None,
        "weight": 0.5,
        "noise_prior": of_noise,
        "shared_noise": False,
    }
    film = PopulationWeights(dorf=1.0)
    assert LikelihoodSearch(populations=film).settings["populations"] == {
        "digital": 0.0,
        "dorf": 1.0,
        "gamma": 0.0,
        "log": 0.0,
    }
    assert LikelihoodSearch(shared_noise=True).settings["shared_noise"] is True
    assert NoiseLevelSearch(noise_prior=prior).settings == {"noise_prior": of_noise}
    assert likelihood_search().family is None
    assert likelihood_search(model=MODELS["gamma"]).family == "gamma"


@pytest.mark.slow
def test_pairs_of_consecutive_frames_tell_less_each() -> None:
    table, search = table_of("srgb"), likelihood_search(populations=PopulationWeights(dorf=1.0))

    bars = [
        deviations(search.calibrate(LevelPairs(table, n_frames=n)))[1:-1].mean()
        for n in (2, 3, 1000)
    ]

    assert bars[0] < bars[1] < bars[2]


def test_more_frames_tell_more_and_are_explained_as_well() -> None:
    table, film = table_of("srgb", n_frames=8), PopulationWeights(dorf=1.0)
    search = likelihood_search(populations=film)

    found = search.calibrate(LevelPairs(table, n_frames=8))

    case = case_of("likelihood", "srgb")
    of_two = deviations(search.calibrate(LevelPairs(case.table)))
    assert found.account("noise")["deviance"] == pytest.approx(1, abs=0.1)
    assert deviations(found)[1:-1].mean() < of_two[1:-1].mean()
    assert rmse(found.curve, case.truth) < 0.03


@pytest.mark.parametrize("n_frames", [2, 3, 5, 40, 1000])
def test_the_share_of_independent_pairs_is_that_of_quadratic_forms(n_frames: int) -> None:
    """The variance of xᵀMx over standard normal x is 2 tr M²: here of half the squared steps."""
    steps = np.diff(np.eye(n_frames), axis=0)
    form = steps.T @ steps / (2 * (n_frames - 1))
    variance = 2 * np.sum(form * form.T)
    of_independent_pairs = 2 / (n_frames - 1)

    share = independent_share(n_frames)

    assert share == pytest.approx(of_independent_pairs / variance, rel=1e-12)


def test_two_frames_are_one_whole_pair_and_many_two_thirds() -> None:
    assert independent_share(2) == 1
    assert independent_share(10**9) == pytest.approx(2 / 3)


# Families


@cache
def of_family(model: str, name: str = "srgb", size: int = 1) -> Response:
    return likelihood_search(model=MODELS[model]).calibrate(LevelPairs(table_of(name, size=size)))


@pytest.mark.slow
@pytest.mark.parametrize("model", ["ameegc2-exact", "gamma", "eegc2", "emor4"])
def test_a_family_gives_one_of_its_members(model: str) -> None:
    found = of_family(model)

    assert isinstance(found.curve, ModelCurve)
    assert found.curve.model == model
    assert len(found.curve.parameters) == MODELS[model].n_parameters
    assert rmse(found.curve, CURVES["srgb"]) < 0.03
    assert found.log_evidence is not None
    assert np.isfinite(found.log_evidence)
    assert found.noise_error is not None
    assert 0 < found.noise_error.log_floor < found.noise_error.log_slope < 1
    assert np.all(deviations(found)[1:-1] > 0)


def test_a_family_that_holds_the_camera_finds_it() -> None:
    found = of_family("gamma", "gamma")

    assert isinstance(found.curve, ModelCurve)
    assert found.curve.parameters == pytest.approx((1 / 2.2,), abs=0.01)
    assert found.account("noise")["deviance"] == pytest.approx(1, abs=0.1)


@pytest.mark.slow
def test_evidence_prefers_the_family_that_is_nearer_the_camera() -> None:
    """SRGB is no power: with enough pixels three parameters earn their keep."""
    exact, gamma = of_family("ameegc2-exact", size=2), of_family("gamma", size=2)

    assert exact.log_evidence is not None
    assert gamma.log_evidence is not None
    assert exact.log_evidence > gamma.log_evidence + 3


def test_evidence_prefers_one_parameter_where_one_is_enough() -> None:
    exact, gamma = of_family("ameegc2-exact", "gamma"), of_family("gamma", "gamma")

    assert exact.log_evidence is not None
    assert gamma.log_evidence is not None
    assert gamma.log_evidence > exact.log_evidence + 1


@pytest.mark.slow
def test_a_family_too_poor_for_the_camera_explains_it_less() -> None:
    free = case_of("likelihood", "s-shaped").found
    poor = of_family("ameegc1", "s-shaped")

    assert poor.account("noise")["deviance"] > 1.5 > free.account("noise")["deviance"]
    assert Flag.MISFIT in poor.flags


@pytest.mark.parametrize("model", ["ameegc2-exact", "gamma", "eegc2", "emor4"])
def test_errors_of_parameters_make_the_error_bars_of_the_curve(model: str) -> None:
    """By δg = −(∂f/∂p) δp/f′; along the ridge curves are no linear function of parameters."""
    found, family = of_family(model), MODELS[model]
    assert isinstance(found.curve, ModelCurve)
    assert found.parameter_covariance is not None
    seen = slice(15, 250)
    light = found.inverse_lut[seen]
    slope = family.derivative(light, found.curve.parameters)
    change = -family.gradient(light, found.curve.parameters) / slope[:, np.newaxis]

    band = np.sqrt(np.einsum("ip,pq,iq->i", change, found.parameter_covariance, change))

    np.testing.assert_allclose(band, deviations(found)[seen], rtol=0.2)
    assert np.median(band / deviations(found)[seen]) == pytest.approx(1, abs=0.07)


def test_only_families_have_parameters() -> None:
    assert case_of("likelihood", "srgb").found.parameter_covariance is None


@pytest.mark.slow
@pytest.mark.parametrize("model", ["ameegc2-exact", "gamma"])
def test_errors_of_parameters_are_of_the_size_they_are_told_to_be(model: str) -> None:
    """Over members of the family as common as among cameras, and noise as it is taken to be."""
    family, rng = MODELS[model], np.random.default_rng(12)
    pulls = []
    for seed in range(12):
        parameters = whitening(family).colour(0.5 * rng.standard_normal(family.n_parameters))
        truth = ModelCurve(model, tuple(map(float, parameters)))
        slope, floor = np.exp(0.6 * rng.standard_normal(2)) * (0.03, 15)
        frames = simulate_frames(
            scene(150, 200), truth, AffineNoise.from_8bit(slope, floor), seed=seed
        )

        found = likelihood_search(model=family).calibrate(LevelPairs(Cooccurrence.of_pair(*frames)))

        assert isinstance(found.curve, ModelCurve)
        assert found.parameter_covariance is not None
        error = np.array(found.curve.parameters) - parameters
        pulls.append(error / np.sqrt(np.diag(found.parameter_covariance)))
    assert np.all(np.abs(pulls) < 4)
    size = np.sqrt(np.mean(np.square(pulls), axis=0))
    assert np.all((size > 0.3) & (size < 1.7)), size


# Several channels


def together_found(
    tables: Mapping[str, Cooccurrence],
    search: LikelihoodSearch,
    *,
    dark: Mapping[str, Counts] | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Response, ...]:
    """Responses of channels that share the ratio of their noise parameters."""
    evidence = {
        name: [LevelPairs(table, dark=None if dark is None else dark.get(name))]
        for name, table in tables.items()
    }
    return replace(search, shared_noise=True).calibrate_channels(evidence, progress=progress)


def log_ratio_deviation(response: Response) -> float:
    """Deviation of ln u/v."""
    error = response.noise_error
    assert error is not None
    product = 2 * error.correlation * error.log_slope * error.log_floor
    return float(np.sqrt(error.log_slope**2 + error.log_floor**2 - product))


@pytest.mark.slow
def test_channels_of_one_noise_ratio_tell_it_together() -> None:
    tables = {}
    for place, name in enumerate("RGB"):
        light = scene() ** (0.7 + 0.3 * place)
        frames = simulate_frames(light, CURVES["s-shaped"], NOISE, seed=20 + place)
        tables[name] = Cooccurrence.of_pair(*frames)
    shares: list[float] = []

    together = together_found(tables, likelihood_search(), progress=shares.append)

    assert [each.name for each in together] == ["R", "G", "B"]
    assert shares[-1] == 1
    assert all(before < after for before, after in pairwise(shares))
    truth = np.log(NOISE.slope / NOISE.floor)
    ratios = [float(np.log(each.noise.slope / each.noise.floor)) for each in together]
    # What they find of the ratio is one; where each ends its ridge differs a little.
    assert np.ptp(ratios) < 0.1
    for response, ratio in zip(together, ratios, strict=True):
        assert abs(ratio - truth) < 2 * log_ratio_deviation(response)
        assert Case(CURVES["s-shaped"], tables[response.name], response).covered >= 0.85
    alone = likelihood_search().calibrate(LevelPairs(tables["R"]))
    # Pairs of a megapixel tell hardly more of the ratio than those of a channel.
    assert log_ratio_deviation(together[0]) < 1.05 * log_ratio_deviation(alone)
    assert deviations(together[0]).mean() < 1.05 * deviations(alone).mean()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["srgb", "linear"])
def test_channels_of_a_sensor_are_no_surer_together_than_they_may_be(name: str) -> None:
    """Their curves are alike: what the prior says of one must not count three times."""
    noise, tables = AffineNoise.of_sensor(1_000, 6), {}
    for place, channel in enumerate("RGB"):
        light = scene() ** (0.7 + 0.3 * place)
        frames = simulate_frames(light, CURVES[name], noise, seed=30 + place)
        tables[channel] = Cooccurrence.of_pair(*frames)

    for response in together_found(tables, LikelihoodSearch()):
        assert Case(CURVES[name], tables[response.name], response).covered >= 0.85


def test_one_channel_has_nobody_to_tell_it_together_with() -> None:
    table = table_of("srgb")

    (found,) = together_found({"Y": table}, likelihood_search())

    alone = case_of("likelihood", "srgb").found
    assert found.curve == alone.curve
    assert found.noise == alone.noise
    np.testing.assert_array_equal(deviations(found), deviations(alone))


@pytest.mark.slow
def test_channels_that_share_no_noise_are_found_each_by_itself() -> None:
    tables = {name: table_of(name) for name in ("srgb", "linear")}
    evidence = {name: [LevelPairs(table)] for name, table in tables.items()}
    shares: list[float] = []

    apart = likelihood_search().calibrate_channels(evidence, progress=shares.append)

    assert shares[-1] == 1
    assert all(before < after for before, after in pairwise(shares))
    together = together_found(tables, likelihood_search())
    for name, found, other in zip(tables, apart, together, strict=True):
        alone = case_of("likelihood", name).found
        assert (found.name, found.curve, found.noise) == (name, alone.curve, alone.noise)
        np.testing.assert_array_equal(deviations(found), deviations(alone))
        assert other.noise != alone.noise


@pytest.mark.slow
def test_each_channel_has_its_own_dark_frames() -> None:
    tables = {"R": table_of("linear"), "B": table_of("srgb")}
    search = likelihood_search()

    red, blue = together_found(tables, search, dark={"R": dark_levels("linear", 200_000)})
    _, plain_blue = together_found(tables, search)

    assert red.noise_error is not None
    assert red.noise_error.log_floor < 0.22  # without dark frames 0.24
    assert (red.name, blue.name) == ("R", "B")
    # The mode of a channel is its own affair.
    assert blue.log_evidence == plain_blue.log_evidence


# Dark frames


def test_dark_frames_tell_more_about_the_floor() -> None:
    dark = dark_levels("linear", 200_000)

    found = likelihood_search().calibrate(LevelPairs(table_of("linear"), dark=dark))

    without = case_of("likelihood", "linear").found
    assert found.noise_error is not None
    assert without.noise_error is not None
    assert found.noise_error.log_floor < 0.9 * without.noise_error.log_floor
    assert deviations(found).max() < deviations(without).max()
    assert found.noise.floor_8bit == pytest.approx(16, rel=3 * found.noise_error.log_floor)
    assert Case(CURVES["linear"], table_of("linear"), found).covered >= 0.85
    # The deviance judges the pairs, not the dark frames.
    assert found.account("noise")["deviance"] == pytest.approx(1, abs=0.1)


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["srgb", "linear", "s-shaped"])
def test_what_dark_frames_would_do_is_what_they_do(name: str) -> None:
    """A scene with nothing below an irradiance of 0.2, and little near it."""
    light = 0.2 + 0.8 * beta(2.5, 2).ppf(scene())
    table = Cooccurrence.of_pair(*simulate_frames(light, CURVES[name], NOISE, seed=5))

    search = likelihood_search(populations=PopulationWeights(dorf=1.0))
    without = search.calibrate(LevelPairs(table))
    with_dark = search.calibrate(LevelPairs(table, dark=dark_levels(name, 240_000)))

    predicted = without.account("noise")["error_with_dark"]
    assert predicted == pytest.approx(rms(deviations(with_dark)), rel=0.2)
    assert predicted <= rms(deviations(without))
    # The truth gains more than the band: of the dark parts the scene shows nothing.
    truth = CURVES[name].inverse(LEVELS)
    assert rms(with_dark.inverse_lut - truth) < 0.6 * rms(without.inverse_lut - truth)
    worth = predicted < 0.9 * rms(deviations(without))
    assert worth == (name != "linear")  # 10.6 and 28 %, of the linear camera 9.5 %
    assert (Flag.DARK_LEVELS_UNSEEN in without.flags) == worth
    assert "error_with_dark" not in with_dark.account("noise")
    assert Flag.DARK_LEVELS_UNSEEN not in with_dark.flags


def test_where_black_is_seen_dark_frames_would_do_nothing(likelihood: Case) -> None:
    predicted = likelihood.found.account("noise")["error_with_dark"]

    assert 0.97 * rms(deviations(likelihood.found)) < predicted
    assert Flag.DARK_LEVELS_UNSEEN not in likelihood.found.flags


def test_a_family_is_not_told_to_take_dark_frames() -> None:
    """They would draw it to the toe, where it cannot follow, and spoil the rest."""
    assert "error_with_dark" not in of_family("gamma").account("noise")


@pytest.mark.slow
@pytest.mark.xfail(
    strict=True,
    reason="dark pixels count fully, pairs a fifth: two million of them outweigh the scene where "
    "the family cannot follow the camera exactly; RMSE 0.003 becomes 0.051",
)
def test_a_dark_frame_of_two_megapixels_does_no_harm() -> None:
    search = likelihood_search(model=MODELS["ameegc2-exact"])

    found = search.calibrate(LevelPairs(table_of("srgb"), dark=dark_levels("srgb", 2_000_000)))

    truth = CURVES["srgb"]
    assert rmse(found.curve, truth) < 1.5 * rmse(of_family("ameegc2-exact").curve, truth)


# Levels


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n_levels", "bit_depth"),
    [
        (52, 8),  # five levels of the file make one
        pytest.param(
            64,
            8,
            marks=pytest.mark.xfail(
                strict=True,
                reason="levels of the file are whole, so those made of them do not end at "
                "(k − ½)/(L − 1): with a megapixel the difference is taken for a misfit",
            ),
        ),
        (64, 16),
    ],
)
def test_fewer_levels_than_the_file_has_are_no_misfit(n_levels: int, bit_depth: int) -> None:
    reduce = level_table(2**bit_depth - 1, n_levels)
    frames = simulate_frames(scene(900, 1200), CURVES["srgb"], NOISE, bit_depth=bit_depth, seed=1)
    table = Cooccurrence.of_pair(*(reduce[frame] for frame in frames), n_levels=n_levels)

    found = likelihood_search().calibrate(LevelPairs(table))

    assert found.n_levels == n_levels
    assert rmse(found.curve, CURVES["srgb"]) < 0.03
    assert Flag.MISFIT not in found.flags


# Sensors as they are: the default


@pytest.mark.parametrize("name", slow_but(CURVES, "srgb"))
@pytest.mark.parametrize("electrons", slow_but([300, 1_000, 5_000], 1_000))
def test_the_band_holds_whatever_the_sensor(name: str, electrons: int) -> None:
    """Light is off by more than with the right prior, and the band says so."""
    table = table_of(name, noise=AffineNoise.of_sensor(electrons, 5))

    for search in (LikelihoodSearch(), NoiseLevelSearch()):
        case = Case(CURVES[name], table, search.calibrate(LevelPairs(table)))

        assert rmse(case.found.curve, case.truth) < 0.09
        assert case.covered >= 0.85
        assert 0.01 < rms(deviations(case.found)) < 0.06


@pytest.mark.slow
def test_a_smooth_scene_tells_hardly_anything_of_the_ratio() -> None:
    table = table_of("srgb", noise=AffineNoise.of_sensor(1_000, 5))

    found = LikelihoodSearch().ridge(LevelPairs(table))

    told = [found.share * (each.mode.log_evidence - each.known) for each in found.modes]

    assert found.modes[0].ratio < 5
    assert found.modes[-1].ratio > 100
    assert np.ptp(told) < 6  # nats; 16 where scenes were as smooth in light


# Scenes


@pytest.mark.slow
def test_a_scene_of_nine_greys_is_covered() -> None:
    light = 0.05 + 0.9 * np.round(8 * scene()) / 8
    table = Cooccurrence.of_pair(*simulate_frames(light, CURVES["linear"], NOISE, seed=20))

    case = Case(CURVES["linear"], table, likelihood_search().calibrate(LevelPairs(table)))

    assert case.covered >= 0.85 or case.found.flags


# The noise level alone


def test_the_noise_level_alone_finds_the_curve(nlf: Case) -> None:
    assert rmse(nlf.found.curve, nlf.truth) < 0.05
    assert nlf.covered >= 0.85
    assert deviations(nlf.found).max() < 0.06
    assert np.all(np.diff(nlf.found.inverse_lut) > 0)


def test_the_noise_level_alone_finds_the_noise(nlf: Case) -> None:
    assert nlf.found.noise.std(0.5) == pytest.approx(NOISE.std(0.5), rel=0.2)


def test_the_noise_level_alone_tells_no_goodness_of_fit(nlf: Case) -> None:
    found = nlf.found

    assert (found.method, found.status, found.n_pairs) == ("nlf", Status.CONVERGED, 300 * 400)
    assert "deviance" not in found.account("noise")
    assert found.log_evidence is None
    assert np.array_equal(found.account("noise").record.counts, nlf.table.counts)


def test_error_bars_of_the_noise_level_allow_for_the_ratio() -> None:
    """The likelihood, which knows something of the ratio, is surer of it."""
    exact = deviations(case_of("likelihood", "s-shaped").found).mean()

    assert exact < deviations(case_of("nlf", "s-shaped").found).mean()


def test_the_noise_level_makes_no_use_of_dark_frames() -> None:
    with pytest.raises(ParameterError, match=r"^nlf does not use dark frames: .*likelihood$"):
        noise_level_search().calibrate(LevelPairs(table_of("srgb"), dark=dark_levels("srgb", 1000)))


def test_the_noise_level_takes_a_prior_and_tells_when_it_is_done() -> None:
    shares: list[float] = []

    found = noise_level_search(prior=measured_prior(256)).calibrate(
        LevelPairs(table_of("srgb")), channel="B", progress=shares.append
    )

    assert found.name == "B"
    assert shares == [1.0]
    assert found.curve == case_of("nlf", "srgb").found.curve


@pytest.mark.parametrize("calibrator", [LikelihoodSearch, NoiseLevelSearch])
def test_settings_must_be_named(calibrator: type[AbstractCalibrator]) -> None:
    with pytest.raises(TypeError):
        calibrator(measured_prior(16))  # type: ignore[call-arg]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["likelihood", "nlf"])
def test_error_bars_are_as_wide_as_errors_over_many_cameras(method: str) -> None:
    """Curves drawn from the prior, noise as spread as it is taken to be, scenes of all kinds."""
    rng = np.random.default_rng(2008)
    prior = measured_prior(256)
    root = np.linalg.cholesky(prior.covariance)
    covered, pulls = [], []
    for seed in range(40):
        slopes = prior.mean + root @ rng.standard_normal(256)
        widths = np.exp(slopes - slopes.max())
        inverse = np.concatenate([[0], np.cumsum(widths)[:-1] + widths[1:] / 2])
        truth = SampledCurve.from_inverse(np.append(inverse[:-1] / widths.sum(), 1.0))
        slope, floor = np.exp(0.6 * rng.standard_normal(2)) * (0.03, 15)
        light = scene() ** np.exp(0.4 * rng.standard_normal())
        frames = simulate_frames(light, truth, AffineNoise.from_8bit(slope, floor), seed=seed)
        table = Cooccurrence.of_pair(*frames)

        case = Case(truth, table, METHODS[method]().calibrate(LevelPairs(table)))

        covered.append(case.covered)
        error = (case.found.inverse_lut - truth.inverse(LEVELS))[1:-1]
        pulls.append(np.sqrt(np.mean((error / deviations(case.found)[1:-1]) ** 2)))
    # Two deviations hold 95 % if errors are normal and the bars right.
    assert np.mean(covered) > 0.85
    assert 0.3 < np.sqrt(np.mean(np.square(pulls))) < 1.7
