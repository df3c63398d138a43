"""Evidence of many files: the same to the last bit however it is split."""

import logging
import tracemalloc
import weakref
from itertools import pairwise
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from hypothesis import given
from hypothesis import strategies as st
from slow_cases import slow_but

from chartless.errors import ImageError, ParameterError, UnfitFramesError
from chartless.evidence.noise import accumulate
from chartless.evidence.noise.accumulate import noise_evidence_of_files
from chartless.evidence.noise.gather import NoiseEvidence, joined, noise_evidence
from chartless.frames.frame import Frame
from chartless.images import read_frame

SHAPE = (40, 50, 3)


def levels_of(seed: int, shape: tuple[int, int, int] = SHAPE) -> Any:
    """A ramp with noise."""
    rng = np.random.default_rng(seed)
    ramp = np.linspace(10, 240, shape[0] * shape[1]).reshape(*shape[:2], 1)
    return np.rint(ramp + rng.normal(0, 3, shape)).astype(np.uint8)


def write(path: Path, levels: Any) -> Path:
    rows, columns, channels = levels.shape
    target = oiio.ImageOutput.create(str(path))
    target.open(str(path), oiio.ImageSpec(columns, rows, channels, "uint8"))
    target.write_image(np.ascontiguousarray(levels))
    target.close()
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("frames")
    return [write(folder / f"{n:02d}.png", levels_of(n)) for n in range(38)]


def assert_equal(one: NoiseEvidence, other: NoiseEvidence) -> None:
    assert list(one.tables) == list(other.tables)
    for name, table in one.tables.items():
        assert table.counts.dtype == other.tables[name].counts.dtype
        assert np.array_equal(table.counts, other.tables[name].counts)
    assert one.checks == other.checks
    assert one.bit_depth == other.bit_depth
    for source, its in zip(one.sources, other.sources, strict=True):
        assert (source.sha256, source.remarks) == (its.sha256, its.remarks)


def serial(files: list[Path], **settings: Any) -> NoiseEvidence:
    return noise_evidence(map(read_frame, files), **settings)


@pytest.mark.slow
@pytest.mark.parametrize("n_frames", slow_but([2, 3, 4, 17, 18, 33, 34, 38], 2, 3, 4, 17, 18))
def test_runs_add_up_to_the_whole(n_frames: int, files: list[Path]) -> None:
    assert_equal(noise_evidence_of_files(files[:n_frames]), serial(files[:n_frames]))


@pytest.mark.slow
@pytest.mark.parametrize("n_frames", slow_but([2, 3, 38], 3))
@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"channels": "luma", "n_levels": 64},
        {"mask": np.random.default_rng(3).uniform(size=SHAPE[:2]) < 0.3},
    ],
)
def test_processes_count_the_same(
    n_frames: int, settings: dict[str, Any], files: list[Path]
) -> None:
    some = files[:n_frames]

    assert_equal(noise_evidence_of_files(some, jobs=2, **settings), serial(some, **settings))


@pytest.mark.slow
def test_a_cluster_counts_the_same(files: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import LocalCluster

    monkeypatch.setattr(accumulate, "_MOST_PAIRS", 5)
    mask = np.random.default_rng(3).uniform(size=SHAPE[:2]) < 0.3
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
    ) as cluster:
        together = noise_evidence_of_files(files, mask=mask, scheduler=cluster.scheduler_address)

    assert_equal(together, serial(files, mask=mask))


@pytest.mark.slow
def test_workers_in_another_folder_find_the_files(
    files: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    noise_evidence_of_files(files[:3], jobs=2)  # starts processes that stay
    monkeypatch.chdir(files[0].parent)

    names = [path.name for path in files[:5]]
    found = noise_evidence_of_files(names, jobs=2)

    assert_equal(found, serial(files[:5]))
    assert [str(source.path) for source in found.sources] == names


@given(n_frames=st.integers(0, 200), jobs=st.integers(1, 40))
def test_each_pair_is_in_one_run(n_frames: int, jobs: int) -> None:
    files = [Path(f"{n}") for n in range(n_frames)]

    runs = accumulate._runs(files, jobs)

    assert [pair for run in runs for pair in pairwise(run)] == list(pairwise(files))
    assert max(map(len, runs)) <= accumulate._MOST_PAIRS + 1
    if n_frames > 1:
        assert min(map(len, runs)) >= 2
        assert len(runs) >= min(jobs, 2, n_frames - 1)
    else:
        assert runs == [files]


@pytest.mark.slow
@given(data=st.data(), n_runs=st.integers(1, 20))
def test_the_order_of_arrival_does_not_matter(data: st.DataObject, n_runs: int) -> None:
    frames = [Frame(Path(f"{n}.png"), levels_of(n, (4, 5, 1))) for n in range(n_runs + 1)]
    runs = [noise_evidence(pair) for pair in pairwise(frames)]
    order = data.draw(st.permutations(range(n_runs)))

    together = accumulate._joined_by_tree(((n, runs[n]) for n in order), n_runs)

    assert_equal(together, noise_evidence(frames))


def test_joining_two_runs() -> None:
    frames = [Frame(Path(f"{n}.png"), levels_of(n)) for n in range(5)]

    both = joined(noise_evidence(frames[:3]), noise_evidence(frames[2:]))

    assert_equal(both, noise_evidence(frames))
    assert both.n_frames == 5


def test_progress_counts_runs(files: list[Path]) -> None:
    calls: list[tuple[int, int]] = []

    noise_evidence_of_files(files, on_chunk=lambda *call: calls.append(call))

    assert calls == [(0, 3), (1, 3), (2, 3), (3, 3)]


# Memory


@pytest.mark.slow
def test_never_more_than_two_frames_are_held(monkeypatch: pytest.MonkeyPatch) -> None:
    alive: list[weakref.ref[Any]] = []
    most = 0

    def read(path: Path, **_: bool) -> Frame:
        nonlocal most
        levels = levels_of(int(path.stem))
        alive.append(weakref.ref(levels))
        most = max(most, sum(reference() is not None for reference in alive))
        return Frame(path, levels)

    monkeypatch.setattr(accumulate, "read_frame", read)

    noise_evidence_of_files([f"{n}.png" for n in range(100)])

    assert len(alive) == 100 + 6  # seven runs
    assert most == 2


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    shape = (300, 400, 3)
    pictures = [levels_of(n, shape) for n in (1, 2)]

    def read(path: Path, **_: bool) -> Frame:
        return Frame(path, pictures[int(path.stem) % 2].copy())

    def peak(n_frames: int) -> int:
        tracemalloc.start()
        try:
            noise_evidence_of_files([f"{n}.png" for n in range(n_frames)])
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    monkeypatch.setattr(accumulate, "read_frame", read)
    peak(3)  # imports

    tables = 3 * 256 * 256 * 8  # bytes of one run; log₂ of the number of runs wait
    assert peak(129) < peak(17) + 4 * tables


# Refusals


def test_no_more_processes_are_started_than_there_are_runs(
    files: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []

    class Pool(joblib.Parallel):
        def __init__(self, n_jobs: int, **settings: Any) -> None:
            asked.append(n_jobs)
            super().__init__(n_jobs=1, **settings)

    monkeypatch.setattr(joblib, "Parallel", Pool)

    noise_evidence_of_files(files[:4], jobs=100_000)

    assert asked == [3]


@pytest.mark.parametrize("jobs", slow_but([1, 2], 1))
def test_an_unreadable_frame_is_named(jobs: int, files: list[Path], tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.png"
    damaged.write_bytes(files[0].read_bytes()[:200])

    with pytest.raises(ImageError, match=r"damaged\.png: "):
        noise_evidence_of_files([*files[:20], damaged, *files[20:]], jobs=jobs)
    with pytest.raises(ImageError, match=r"missing\.png: "):
        noise_evidence_of_files([*files[:20], tmp_path / "missing.png"], jobs=jobs)


@pytest.mark.slow
@pytest.mark.parametrize("place", [0, 1, 15, 16, 17, 19, 33])
@pytest.mark.parametrize("jobs", slow_but([1, 2], 1))
def test_a_frame_of_another_size_is_named(
    jobs: int, place: int, files: list[Path], tmp_path: Path
) -> None:
    other = write(tmp_path / "other.png", levels_of(1, (50, 40, 3)))

    with pytest.raises(UnfitFramesError, match=r"differ in size: .*other\.png has"):
        noise_evidence_of_files([*files[:place], other, *files[place:33]], jobs=jobs)


def test_fewer_than_two_files(files: list[Path]) -> None:
    with pytest.raises(UnfitFramesError, match=r"two or more frames .* none was given"):
        noise_evidence_of_files([])
    with pytest.raises(UnfitFramesError, match=r"two or more frames .* only .*00\.png was given"):
        noise_evidence_of_files(files[:1])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"channels": "RGB"}, "channels must be one of auto, rgb, luma, not 'RGB'"),
        ({"n_levels": 15}, "levels must lie between 16 and 256 for 8-bit frames, not 15"),
        ({"mask": np.ones((50, 40), bool)}, "the mask is 40 × 50, the frames are 50 × 40"),
        ({"jobs": 0}, "jobs must be 1 or more, not 0"),
    ],
)
def test_settings_without_meaning(
    settings: dict[str, Any], message: str, files: list[Path]
) -> None:
    with pytest.raises(ParameterError, match=message):
        noise_evidence_of_files(files, **settings)
