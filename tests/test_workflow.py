"""From frames to a calibration in one call."""

import hashlib
import json
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter
from slow_cases import slow_but
from threadpoolctl import threadpool_info, threadpool_limits

import chartless
from chartless import AffineNoise, calibrate, named_curve, simulate_frames
from chartless.errors import (
    ChartlessError,
    ImageError,
    ParameterError,
    UnfitFramesError,
    UnknownNameError,
)
from chartless.evidence.noise.channel import LevelPairs
from chartless.formats.calibration_file import to_json
from chartless.images import write_image
from chartless.methods import LikelihoodSearch

Levels = npt.NDArray[Any]
ONE_ARRAY = "frames must be a list of files or arrays, not one array of shape"
QUICK: dict[str, Any] = {"method": "ism-bin", "n_levels": 32, "rounds": 1}


@pytest.fixture(scope="module")
def frames() -> list[Levels]:
    white = np.random.default_rng(0).standard_normal((120, 160))
    blobs = gaussian_filter(white, 8, mode="wrap")
    scene = blobs.ravel().argsort().argsort().reshape(blobs.shape) / blobs.size
    noise = AffineNoise.of_sensor(1_500, 5)
    found = list(simulate_frames(scene, named_curve("srgb"), noise, n_frames=3))
    for levels in found:
        levels.setflags(write=False)
    return found


@pytest.fixture
def paths(frames: list[Levels], tmp_path: Path) -> list[Path]:
    written = [tmp_path / f"{number}.png" for number, _ in enumerate(frames)]
    for path, levels in zip(written, frames, strict=True):
        write_image(path, levels[..., np.newaxis] / 255, data_type="uint8", linear=False)
    return written


def test_arrays_and_files_give_the_same(frames: list[Levels], paths: list[Path]) -> None:
    of_arrays = calibrate(frames, **QUICK)
    of_files = calibrate(paths, **QUICK)
    of_strings = calibrate([str(path) for path in paths], **QUICK)

    for other in (of_files, of_strings):
        assert to_json(of_arrays)["channels"] == to_json(other)["channels"]


def test_grey_with_and_without_its_axis(frames: list[Levels]) -> None:
    flat = calibrate(frames, **QUICK)
    deep = calibrate([levels[..., np.newaxis] for levels in frames], **QUICK)

    assert to_json(flat)["channels"] == to_json(deep)["channels"]


def test_where_it_comes_from_is_kept(frames: list[Levels], paths: list[Path]) -> None:
    mask = np.ones(frames[0].shape, bool)

    found = calibrate(paths, mask=mask, **QUICK)

    provenance = json.loads(json.dumps(found.provenance, allow_nan=False))
    assert provenance["chartless"] == chartless.__version__
    assert datetime.fromisoformat(provenance["created"]).tzinfo is not None
    assert provenance["inputs"] == [
        {"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
        for path in paths
    ]
    settings = provenance["settings"]
    assert settings["model"] == "ameegc2-exact"
    assert settings["method"] == "ism-bin"
    assert settings["levels"] == 32
    assert settings["rounds"] == 1
    assert settings["mask"] == "array"
    assert provenance["remarks"] == []


def test_arrays_are_named_by_their_number(frames: list[Levels]) -> None:
    inputs = calibrate(frames, **QUICK).provenance["inputs"]

    assert [each["file"] for each in inputs] == ["frame 1", "frame 2", "frame 3"]
    assert inputs[0]["sha256"] == hashlib.sha256(frames[0].tobytes()).hexdigest()


@pytest.mark.slow
def test_several_processes_find_the_same(paths: list[Path]) -> None:
    told: list[str] = []

    alone, together = (
        to_json(calibrate(paths, jobs=jobs, progress=lambda what, _: told.append(what), **QUICK))
        for jobs in (1, 2)
    )

    for content in (alone, together):
        del content["provenance"]["created"]
    assert together == alone
    assert "reading frames" in told


def test_several_processes_read_no_arrays(frames: list[Levels]) -> None:
    with pytest.raises(ParameterError, match="only files can be read by several processes"):
        calibrate(frames, jobs=2, **QUICK)


def test_progress_runs_to_the_end(frames: list[Levels]) -> None:
    told: list[tuple[str, float]] = []

    calibrate(
        frames, progress=lambda *each: told.append(each), n_levels=32, rounds=3, method="ism-bin"
    )

    assert {stage for stage, _ in told} == {"reading frames", "estimating"}
    shares = [share for stage, share in told if stage == "estimating"]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)
    assert all(0 <= share <= 1 for _, share in told)


@pytest.mark.parametrize("kind", ["array", "numbers", "file"])
def test_a_mask_chooses_pixels(kind: str, frames: list[Levels], tmp_path: Path) -> None:
    chosen = np.zeros(frames[0].shape, bool)
    chosen[10:110, 20:150] = True
    mask: Any = chosen
    if kind == "numbers":
        mask = chosen * 7
    elif kind == "file":
        mask = tmp_path / "mask.png"
        write_image(mask, np.repeat(chosen[..., np.newaxis], 3, axis=2) * [0.0, 0.1, 0.0])

    found = calibrate(frames, mask=mask, **QUICK)

    assert found.channel("Y").n_pairs == 2 * np.count_nonzero(chosen)


def test_a_remark_names_its_file(frames: list[Levels], paths: list[Path]) -> None:
    from PIL import Image

    for path in paths:
        with Image.open(path) as image:
            with_alpha = image.convert("LA")
        with_alpha.save(path)

    remarks = calibrate(paths, **QUICK).provenance["remarks"]

    assert remarks == [f"{path}: dropped the alpha channel" for path in paths]


@pytest.mark.parametrize(
    "bad",
    [
        np.zeros((4, 4)),
        np.zeros((4, 4), np.int64),
        np.zeros((4, 4), bool),
        np.zeros((4, 4), np.int8),
        np.zeros(4, np.uint8),
        np.zeros((4, 4, 2), np.uint8),
        np.zeros((4, 4, 4), np.uint8),
        np.zeros((0, 4), np.uint8),
        np.zeros((1, 4, 4, 3), np.uint8),
    ],
)
def test_arrays_that_are_no_levels(bad: Levels, frames: list[Levels]) -> None:
    with pytest.raises(ParameterError, match=r"^frame 2: "):
        calibrate([frames[0], bad], **QUICK)


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"model": "gama"}, UnknownNameError, "unknown model 'gama'. Did you mean 'gamma'"),
        ({"method": "nlf2"}, UnknownNameError, "unknown method 'nlf2'"),
        ({"channels": "cmyk"}, ParameterError, "channels must be one of"),
        ({"n_levels": 5}, ParameterError, "levels must lie between"),
        ({"rounds": 0}, ParameterError, "rounds"),
        ({"turns": 3}, ChartlessError, "turns"),
        ({"mask": np.ones((2, 2), bool)}, ParameterError, "the mask is 2 × 2"),
        ({"jobs": 0}, ParameterError, "jobs must be a whole number, 1 or above, not 0"),
        ({"jobs": "2"}, ParameterError, "jobs must be a whole number"),
        ({"evidence": None}, ParameterError, "evidence must be auto or some of"),
        ({"evidence": []}, ParameterError, "evidence must be auto or some of"),
        ({"evidence": ["noise", 3]}, ParameterError, "not 3"),
        ({"time_error": "a"}, ParameterError, "time_error must be a number"),
    ],
)
def test_settings_without_meaning(
    settings: dict[str, Any], error: type[Exception], message: str, frames: list[Levels]
) -> None:
    with pytest.raises(error, match=message):
        calibrate(frames, **{**QUICK, **settings})


def test_settings_are_checked_before_frames_are_read(tmp_path: Path) -> None:
    missing = [tmp_path / "a.png", tmp_path / "b.png"]

    with pytest.raises(UnknownNameError):
        calibrate(missing, model="gama")
    with pytest.raises(ParameterError):
        calibrate(missing, method="ism-bin", rounds=0)


def test_no_frames() -> None:
    with pytest.raises(UnfitFramesError, match="none was given"):
        calibrate([])


def test_a_missing_file_is_named(paths: list[Path]) -> None:
    missing = paths[0].with_name("missing.png")

    with pytest.raises(ImageError, match=f"^{missing}: does not exist"):
        calibrate([paths[0], missing], **QUICK)


def test_frames_are_read_one_by_one(paths: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """The first bad pair stops the reading; two frames are decoded ahead."""
    from chartless import images

    read: list[Path] = []
    original = images.read_frame

    def noting(path: Any, **how: Any) -> Any:
        read.append(Path(path))
        return original(path, **how)

    monkeypatch.setattr(images, "read_frame", noting)
    copy = paths[1].with_name("copy.png")
    copy.write_bytes(paths[0].read_bytes())
    later = []
    for number in range(6):
        later.append(paths[1].with_name(f"later{number}.png"))
        later[-1].write_bytes(paths[1].read_bytes())

    with pytest.raises(UnfitFramesError, match="identical"):
        calibrate([paths[0], copy, *later], **QUICK)

    assert {paths[0], copy} <= set(read)
    assert len(read) <= 4


# Exposures


def exposures_of(frames: list[float], seed: int = 0) -> list[Levels]:
    """Soft light over two decades, a frame for each exposure."""
    rng = np.random.default_rng(seed)
    blobs = gaussian_filter(np.random.default_rng(0).standard_normal((120, 160)), 8, mode="wrap")
    rank = blobs.ravel().argsort().argsort().reshape(blobs.shape) / blobs.size
    light = 1.3 * np.exp(5 * (rank - 1))
    noise = AffineNoise.from_8bit(0.03, 4)
    return [
        next(simulate_frames(light * each, named_curve("srgb"), noise, n_frames=1, seed=rng))
        for each in frames
    ]


def test_progress_of_a_bracket_runs_to_the_end() -> None:
    told: list[tuple[str, float]] = []
    frames = exposures_of([0.1, 0.4, 0.4, 1.0])

    calibrate(frames, times=[1, 4, 4, 10], progress=lambda *each: told.append(each), n_levels=64)

    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages == ["reading exposures", "reading frames", "estimating"]
    for stage in stages:
        shares = [share for each, share in told if each == stage]
        assert shares == sorted(shares)
        assert shares[-1] == pytest.approx(1)


@pytest.mark.parametrize("times", [None, [1, 4, 10]])
def test_matrices_are_small_and_multiplied_by_one_thread(times: list[float] | None) -> None:
    n_threads: dict[str, set[int]] = {}

    def progress(stage: str, _: float) -> None:
        blas = [each for each in threadpool_info() if each["user_api"] == "blas"]
        n_threads.setdefault(stage, set()).update(each["num_threads"] for each in blas)

    given = exposures_of([0.4, 0.4] if times is None else [0.1, 0.4, 1.0])
    with threadpool_limits(limits=2, user_api="blas"):
        calibrate(given, times=times, progress=progress, n_levels=64)
        progress("after", 1.0)

    assert n_threads["estimating"] == {1}
    assert n_threads["after"] == {2}


def test_repeats_of_two_exposures_are_added_up(monkeypatch: pytest.MonkeyPatch) -> None:
    frames = exposures_of([0.1, 0.1, 0.1, 0.4, 0.4])
    alone = [
        calibrate(part, method="nlf", n_levels=64).channel("Y").n_pairs
        for part in (frames[:3], frames[3:])
    ]

    told: list[int] = []
    original = LikelihoodSearch.calibrate_channels

    def noting(self: LikelihoodSearch, channels: Any, **more: Any) -> Any:
        told.extend(part.n_frames for part in channels["Y"] if isinstance(part, LevelPairs))
        return original(self, channels, **more)

    monkeypatch.setattr(LikelihoodSearch, "calibrate_channels", noting)
    response = calibrate(frames, times=[1, 1, 1, 4, 4], n_levels=64).channel("Y")

    assert told == [3]  # of the longer run: they do not go on from one another
    table = response.account("noise").record
    assert table.n_pairs <= sum(alone)
    assert table.n_pairs > 0.99 * sum(alone)


def test_a_mask_chooses_pixels_of_exposures_and_of_repeats() -> None:
    frames = exposures_of([0.1, 0.4, 0.4, 1.0])
    mask = np.zeros(frames[0].shape, bool)
    mask[:60] = True
    spoiled = [levels.copy() for levels in frames]
    for levels in spoiled:
        levels[60:] = np.random.default_rng(levels.sum()).integers(0, 256, (60, 160))

    found, same = (
        to_json(calibrate(each, times=[1, 4, 4, 10], mask=mask, n_levels=64))
        for each in (frames, spoiled)
    )

    assert found["channels"] == same["channels"]


@pytest.mark.slow
def test_sixteen_bits_and_more_levels_than_are_compared() -> None:
    light = np.exp(5 * (np.linspace(0, 1, 120 * 160).reshape(120, 160) - 1))
    frames = [
        next(
            simulate_frames(
                light * each,
                named_curve("srgb"),
                AffineNoise.from_8bit(0.03, 4),
                n_frames=1,
                bit_depth=16,
                seed=seed,
            )
        )
        for seed, each in enumerate((0.25, 1.0, 1.0))
    ]

    found = calibrate(frames, times=[1, 4, 4], n_levels=1024)
    with_dark = calibrate(frames, times=[1, 4, 4], n_levels=1024, dark=[frames[0] // 64] * 2)

    for each in (found, with_dark):
        assert each.bit_depth == 16
        assert each.channel("Y").n_levels == 256
        assert chartless.rmse(each.channel("Y").curve, named_curve("srgb")) < 0.05


def test_a_failure_of_the_plan_comes_before_pixels_are_read(
    paths: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    from chartless import images

    def never(path: Any) -> Any:
        pytest.fail(f"{path} was read")

    monkeypatch.setattr(images, "read_frame", never)

    with pytest.raises(ParameterError, match="times were given for 3 frames"):
        calibrate(paths, times=[1, 2])
    with pytest.raises(ParameterError, match="debevec uses bracket only; the files"):
        calibrate(paths, method="debevec")


@pytest.mark.parametrize("n_pixels", slow_but([30, 100, 500], 100))
def test_a_bracket_of_few_pixels_is_right_within_its_band(n_pixels: int) -> None:
    """The end of the curve does not drift with their number, as that of others does."""
    rng = np.random.default_rng(n_pixels)
    scene, noise = np.exp(rng.uniform(-5, 0.3, (40, 50))), AffineNoise.from_8bit(0.03, 4)
    exposures = [0.25, 0.5, 1.0]
    shots = [
        next(iter(simulate_frames(each * scene, named_curve("srgb"), noise, n_frames=1, seed=seed)))
        for seed, each in enumerate(exposures)
    ]
    mask = np.zeros(scene.size, bool)
    mask[rng.choice(mask.size, n_pixels, replace=False)] = True

    found = calibrate(shots, times=exposures, mask=mask.reshape(scene.shape), n_levels=64)

    (response,) = found.channels
    truth = named_curve("srgb").inverse(np.linspace(0, 1, 64))
    assert response.inverse_lut_std is not None
    away = (response.inverse_lut - truth)[1:-1] / response.inverse_lut_std[1:-1]
    assert np.mean(np.abs(away) < 2) > 0.9
    assert np.abs(away[-16:]).max() < 2


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("a.jpg", "frames must be a list of files or arrays, not one string: write ['a.jpg']"),
        (Path("a.jpg"), "frames must be a list of files or arrays, not one path: write ['a.jpg']"),
        (b"a.jpg", "frames must be a list of files or arrays, not one string: write [b'a.jpg']"),
        (
            np.zeros((40, 30), np.uint8),
            f"{ONE_ARRAY} (40, 30): write [first, second]",
        ),
        (
            np.zeros((40, 30, 3), np.uint8),
            f"{ONE_ARRAY} (40, 30, 3): write [first, second]",
        ),
        (None, "frames must be a list of files or arrays, not NoneType"),
        (7, "frames must be a list of files or arrays, not int"),
        (["a.jpg", 7], "frames[1] must be the name of a file or an array of levels, not int"),
    ],
)
def test_one_file_or_picture_is_no_list_of_frames(given: Any, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        calibrate(given)
    assert str(caught.value) == message


@pytest.mark.parametrize("name", ["dark", "raw"])
def test_one_file_is_no_list_of_others(name: str, paths: list[Path]) -> None:
    with pytest.raises(ParameterError, match=rf"^{name} must be a list .* not one string"):
        calibrate(paths, **{name: str(paths[0])})
    with pytest.raises(ParameterError, match=rf"^{name} must be a list .* not one array"):
        calibrate(paths, **{name: np.zeros((40, 30), np.uint8)})


def test_a_stack_of_frames_and_a_generator_are_lists(frames: list[Levels]) -> None:
    listed = to_json(calibrate(frames, **QUICK))["channels"]

    assert to_json(calibrate(np.stack(frames), **QUICK))["channels"] == listed
    assert to_json(calibrate((each for each in frames), **QUICK))["channels"] == listed


def test_what_is_no_mask_or_raw_file_is_named(frames: list[Levels], paths: list[Path]) -> None:
    with pytest.raises(ParameterError, match="mask must be the name of a file or an array"):
        calibrate(frames, mask=[[True]])
    with pytest.raises(ParameterError, match="matched by their names: give files, not arrays"):
        calibrate(paths, raw=frames)


def test_settings_of_a_calibrator_that_change_nothing_are_refused() -> None:
    method = LikelihoodSearch(shared_noise=True)

    with pytest.raises(ParameterError, match="`shared_noise` has no effect on"):
        calibrate(exposures_of([0.1, 0.4]), times=[1, 4], method=method)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1.3, 1.5])
def test_two_jpegs_of_nearly_one_exposure_leave_the_exponent_open(
    tmp_path: Path, ratio: float
) -> None:
    """Lossy exposures stay as given, and what they err by is all of their extent."""
    paths = []
    for place, levels in enumerate(exposures_of([0.5, 0.5 * ratio])):
        paths.append(tmp_path / f"{place}.jpg")
        Image.fromarray(levels).save(paths[-1], quality=95)

    response = calibrate(paths, times=[1, ratio], time_error=0.045).channel("Y")

    assert response.account("bracket")["exponent_error"] > 0.1
    assert chartless.Flag.EXPONENT_UNKNOWN in response.flags
