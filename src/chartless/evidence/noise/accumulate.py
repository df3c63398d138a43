"""Evidence from thousands of frames, by several processes or a Dask cluster.

Files are split into runs that overlap by one frame, so that each pair of consecutive
frames is counted exactly once; runs are counted independently and added up in a tree.
Counts are integers: the sum is the same to the last bit whatever the order of the runs.
"""

import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from chartless._numeric.parallel import run_all
from chartless.evidence.noise.gather import NoiseEvidence, joined, noise_evidence
from chartless.images import read_frame
from chartless.types import Bools

_MOST_PAIRS = 16  # in a run: its first frame is read twice, so 6 % more reading

OnChunk = Callable[[int, int], None]
"""Function called with the number of runs counted and the total number."""


def noise_evidence_of_files(
    paths: Sequence[str | os.PathLike[str]],
    *,
    channels: str = "auto",
    n_levels: int = 256,
    mask: Bools | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    on_chunk: OnChunk | None = None,
) -> NoiseEvidence:
    """Count the level pairs of consecutive frames, as `noise_evidence` does.

    Errors name files absolutely, as workers see them. Each worker holds two frames at a time,
    this process the tables of a few runs.

    Parameters
    ----------
    paths : sequence of path-like
        Files of two or more frames in the order in which they were taken.
    channels : str
        "auto" (those of the frames), "rgb" or "luma".
    n_levels : int
        Levels are reduced to this many.
    mask : ndarray of bool, shape (M, N), optional
        Only pixels where it is True are used.
    jobs : int
        Number of processes; the result does not depend on it.
    scheduler : str, optional
        Address of a Dask scheduler to run on instead, such as ``tcp://host:8786``. Its workers
        must see the files under the same absolute names.
    on_chunk : OnChunk, optional

    Returns
    -------
    NoiseEvidence

    Raises
    ------
    ImageError
        If a file cannot be read.
    UnfitFramesError, ParameterError
        As `noise_evidence` does; of several unfit frames, one is named. Also
        ParameterError if the scheduler does not answer or Dask is not installed.
    WorkerError
        If a worker process was killed; on Dask, if one run killed several workers.
    """
    files = [Path(path).absolute() for path in paths]  # workers may be in another folder
    packed = None if mask is None else _PackedMask.of(mask)
    tasks = {
        str(place): partial(_evidence_of, run, channels, n_levels, packed)
        for place, run in enumerate(_runs(files, jobs))
    }
    if on_chunk is not None:
        on_chunk(0, len(tasks))

    def arrivals() -> Iterable[tuple[int, NoiseEvidence]]:
        for done, (name, evidence) in enumerate(counted, start=1):
            if on_chunk is not None:
                on_chunk(done, len(tasks))
            yield int(name), evidence

    with closing(run_all(tasks, jobs=jobs, scheduler=scheduler)) as counted:
        evidence = _joined_by_tree(arrivals(), len(tasks))
    sources = (
        replace(source, path=Path(path))  # as it was given
        for source, path in zip(evidence.sources, paths, strict=True)
    )
    return replace(evidence, sources=tuple(sources))


@dataclass(frozen=True, slots=True, eq=False)
class _PackedMask:
    """A mask with one bit for each pixel, as it is sent with every run."""

    bits: npt.NDArray[np.uint8]
    shape: tuple[int, ...]

    @classmethod
    def of(cls, mask: Bools) -> "_PackedMask":
        return cls(np.packbits(mask), mask.shape)

    @property
    def mask(self) -> Bools:
        size = int(np.prod(self.shape))
        return np.unpackbits(self.bits, count=size).astype(bool).reshape(self.shape)


def _runs(files: list[Path], jobs: int) -> list[list[Path]]:
    """Split files evenly into runs that overlap by one; few files make one run."""
    n_pairs = max(len(files) - 1, 0)
    size = min(_MOST_PAIRS, -(-n_pairs // max(jobs, 1))) or 1
    n_runs = max(-(-n_pairs // size), 1)
    ends = [n_pairs * place // n_runs for place in range(n_runs + 1)]
    return [files[first : last + 1] for first, last in pairwise(ends)]


def _evidence_of(
    files: list[Path], channels: str, n_levels: int, packed: _PackedMask | None
) -> NoiseEvidence:
    mask = None if packed is None else packed.mask
    frames = (read_frame(file, raw=True) for file in files)
    return noise_evidence(frames, channels=channels, n_levels=n_levels, mask=mask)


def _joined_by_tree(arrivals: Iterable[tuple[int, NoiseEvidence]], n_runs: int) -> NoiseEvidence:
    """Join adjacent runs in a binary tree, as soon as both are available.

    If runs arrive roughly in order, about log₂ of their number wait at a time.
    """
    waiting: dict[tuple[int, int], NoiseEvidence] = {}  # by nodes in level, place
    for leaf, counted in arrivals:
        place, size, evidence = leaf, n_runs, counted
        while size > 1:
            sibling = place ^ 1
            if sibling < size:
                other = waiting.pop((size, sibling), None)
                if other is None:
                    break
                first = sibling < place
                evidence = joined(other, evidence) if first else joined(evidence, other)
            place, size = place // 2, (size + 1) // 2
        waiting[size, place] = evidence
    return waiting[1, 0]
