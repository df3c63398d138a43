import numpy as np
import pytest
from slow_cases import slow_but

from chartless.curves import named_curve
from chartless.curves.whitening import _file
from chartless.errors import ParameterError
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.flags import Flag
from chartless.methods import CALIBRATORS, SimilaritySearch
from chartless.methods.ism.objectives import BinnedPairs, half_levels, image_similarity
from chartless.models import MODELS
from chartless.noise import AffineNoise
from chartless.result.response import Response, Status, rmse
from chartless.simulate import simulate_frames

TRUTH, LINEAR = named_curve("ameegc2-exact:-0.8,1.8,-0.11"), named_curve("linear")
NOISE = AffineNoise.from_8bit(0.03, 15)


def simulate(curve=TRUTH, *, smooth: bool = False, n_levels: int = 256) -> Cooccurrence:
    scene = np.random.default_rng(4).uniform(0, 1, (600, 800))
    if smooth:
        scene = np.add.outer(np.linspace(0, 0.3, 600), np.linspace(0, 0.7, 800))
    first, second = simulate_frames(scene, curve, NOISE, seed=4)
    if n_levels < 256:
        shift = 256 // n_levels
        first, second = first // shift, second // shift
    return Cooccurrence.of_pair(first, second, n_levels=n_levels)


@pytest.fixture(scope="module")
def table() -> Cooccurrence:
    return simulate()


@pytest.fixture(scope="module")
def found(table: Cooccurrence) -> Response:
    return SimilaritySearch().calibrate(LevelPairs(table))


def test_the_curve_of_a_simulated_camera_is_found(found: Response):
    assert rmse(found.curve, TRUTH) < 0.05
    assert rmse(found.curve, TRUTH) < rmse(LINEAR, TRUTH) / 5


def test_the_noise_of_a_simulated_camera_is_found_in_the_middle(found: Response):
    middle = 0.5

    assert found.noise.std(middle) == pytest.approx(NOISE.std(middle), rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["bin", "sampled"])
@pytest.mark.parametrize("curve", slow_but(["gamma:0.45", "srgb"], "srgb"))
def test_other_cameras_and_smooth_scenes_are_found(curve: str, objective: str):
    truth = named_curve(curve)

    response = SimilaritySearch(objective=objective).calibrate(
        LevelPairs(simulate(truth, smooth=True))
    )

    assert rmse(response.curve, truth) < 0.05
    assert rmse(response.curve, truth) < rmse(LINEAR, truth) / 4
    assert response.method == f"ism-{objective}"


@pytest.mark.slow
def test_a_linear_camera_stays_nearly_linear():
    response = SimilaritySearch().calibrate(LevelPairs(simulate(LINEAR)))

    assert rmse(response.curve, LINEAR) < 0.05


def test_two_runs_are_equal_to_the_last_bit(table: Cooccurrence):
    once, again = (SimilaritySearch(rounds=3).calibrate(LevelPairs(table)) for _ in range(2))

    assert once.curve == again.curve
    assert once.noise == again.noise
    assert once.history == again.history


def test_the_search_never_gets_worse(found: Response):
    assert 3 <= len(found.history.values) <= 16
    assert np.all(np.diff(found.history.values) >= 0)


def test_the_last_value_is_that_of_the_result(table: Cooccurrence, found: Response):
    pairs = BinnedPairs.from_counts(table.symmetric)
    inverse = found.curve.inverse(half_levels(256))

    value = image_similarity(pairs, inverse, found.noise)

    assert value == pytest.approx(found.history.values[-1], rel=1e-9)


def test_the_result_tells_where_it_comes_from(table: Cooccurrence, found: Response):
    assert found.name == "Y"
    assert found.n_levels == 256
    assert found.n_pairs == 600 * 800
    assert found.observed_levels == table.observed_levels
    assert found.account("noise").record is table
    assert found.status is Status.CONVERGED
    rounds = len(found.history.values) - 1
    assert found.history.evaluations > rounds * 2 * 10


def test_the_channel_is_carried_through(table: Cooccurrence):
    assert SimilaritySearch(rounds=1).calibrate(LevelPairs(table), channel="G").name == "G"


def test_progress_rises_to_one(table: Cooccurrence):
    shares: list[float] = []

    SimilaritySearch(rounds=4, iterations=2).calibrate(LevelPairs(table), progress=shares.append)

    assert len(shares) == 4
    assert np.all(np.diff(shares) > 0)
    assert shares[-1] == 1


@pytest.mark.slow
def test_progress_reaches_one_also_when_the_search_converges_early(table: Cooccurrence):
    shares: list[float] = []

    response = SimilaritySearch(rounds=100).calibrate(LevelPairs(table), progress=shares.append)

    assert response.status is Status.CONVERGED
    assert len(shares) < 100
    assert shares[-1] == 1


def test_a_search_that_was_stopped_early_says_so(table: Cooccurrence):
    response = SimilaritySearch(rounds=1, iterations=3).calibrate(LevelPairs(table))

    assert response.status is Status.LIMIT_REACHED
    assert Flag.SEARCH_UNFINISHED in response.flags


@pytest.mark.slow
def test_pairs_that_no_model_explains_are_flagged():
    frames = np.random.default_rng(9).integers(0, 256, (2, 300, 400), dtype=np.uint8)

    response = SimilaritySearch(rounds=2).calibrate(LevelPairs(Cooccurrence.of_pair(*frames)))

    assert Flag.MISFIT in response.flags


def test_identical_frames_drive_the_noise_to_its_bound():
    frame = np.random.default_rng(9).integers(0, 256, (300, 400), dtype=np.uint8)

    response = SimilaritySearch(objective="sampled").calibrate(
        LevelPairs(Cooccurrence.of_pair(frame, frame))
    )

    assert Flag.NOISE_AT_BOUND in response.flags


def test_an_empty_table_gives_a_result_and_no_error():
    response = SimilaritySearch(rounds=2).calibrate(LevelPairs(Cooccurrence.zeros()))

    assert response.n_pairs == 0
    assert response.observed_levels == (0, -1)
    assert "similarity" not in response.account("noise")


def test_a_true_model_attains_what_random_counts_allow(table: Cooccurrence):
    pairs = BinnedPairs.from_counts(table.symmetric)

    at_truth = image_similarity(pairs, TRUTH.inverse(half_levels(256)), NOISE)

    # measured 0.948: the rows of few pixels near white count for more than they are worth
    assert 0.93 < at_truth / pairs.ceiling < 1


def test_goodness_of_fit_is_near_one_for_a_simulated_camera(found: Response):
    assert 0.93 < found.account("noise")["similarity"] <= 1


def test_a_curve_that_decreases_is_flagged(monkeypatch: pytest.MonkeyPatch):
    # at 1 iteration the search of the paper's order 2 keeps to where it starts
    table = simulate()
    monkeypatch.setattr(type(MODELS["ameegc2"]), "identity", np.array([0.0, 3.0, 0.0]))
    search = SimilaritySearch(
        model=MODELS["ameegc2"], rounds=1, iterations=1, curve_step=1e-3, noise_step=1e-3
    )

    assert Flag.NOT_MONOTONE in search.calibrate(LevelPairs(table)).flags


@pytest.mark.parametrize("name", slow_but(_file()["families"], "ameegc2-exact", "gamma", "gumbel2"))
def test_every_family_with_whitening_numbers_can_be_searched(name: str, table: Cooccurrence):
    response = SimilaritySearch(model=MODELS[name], rounds=3, iterations=6).calibrate(
        LevelPairs(table)
    )

    assert response.curve.model == name
    assert response.history.values[-1] > response.history.values[0]
    assert rmse(response.curve, TRUTH) < rmse(LINEAR, TRUTH)


@pytest.mark.parametrize("n_levels", [64, 128])
def test_fewer_levels_will_do(n_levels: int):
    response = SimilaritySearch(rounds=3).calibrate(LevelPairs(simulate(n_levels=n_levels)))

    assert response.n_levels == n_levels
    assert rmse(response.curve, TRUTH) < rmse(LINEAR, TRUTH) / 2


@pytest.mark.parametrize(
    "settings",
    [
        {"rounds": 0},
        {"rounds": 1.5},
        {"iterations": 0},
        {"curve_step": 0.0},
        {"noise_step": np.nan},
        {"shrink": 1.1},
        {"tolerance": -1e-9},
        {"tolerance": np.nan},
    ],
    ids=str,
)
def test_settings_without_a_meaning_are_refused(settings: dict[str, float]):
    with pytest.raises(ParameterError, match=f"^{next(iter(settings))} must"):
        SimilaritySearch(**settings)


@pytest.mark.parametrize("start", [(-0.1, 1.0), (0.06, 0.0), (np.nan, 1.0)])
def test_a_start_that_is_no_noise_is_refused(start: tuple[float, float]):
    with pytest.raises(ParameterError, match="noise"):
        SimilaritySearch(start=start)


def test_an_unknown_objective_is_named(table: Cooccurrence):
    with pytest.raises(LookupError, match="bins"):
        SimilaritySearch(objective="bins").calibrate(LevelPairs(table))


def test_a_family_without_whitening_numbers_is_searched_in_its_own_parameters(
    table: Cooccurrence,
):
    response = SimilaritySearch(model=MODELS["eegc4"], rounds=2).calibrate(LevelPairs(table))

    assert response.curve.model == "eegc4"
    assert response.history.values[-1] > response.history.values[0]


def test_a_start_without_slope_is_searched_from_the_least_slope(table: Cooccurrence):
    response = SimilaritySearch(start=(0.0, 1.0), rounds=2).calibrate(LevelPairs(table))

    assert response.noise.slope_8bit >= 1e-3


@pytest.mark.parametrize("objective", ["bin", "sampled"])
def test_methods_are_found_by_name(objective: str):
    calibrator = CALIBRATORS[f"ism-{objective}"](rounds=2)

    assert calibrator == SimilaritySearch(objective=objective, rounds=2)


def test_settings_must_be_named():
    with pytest.raises(TypeError):
        SimilaritySearch(MODELS["gamma"])
