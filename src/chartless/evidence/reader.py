"""Reading of frames from files, arrays, videos and raw files."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import count, groupby, islice
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, TypeGuard

import numpy as np

from chartless._numeric.threads import in_order
from chartless.frames.frame import CameraSettings, Frame, FrameSource, RawPicture
from chartless.frames.pictures import array_frame
from chartless.types import Bools, Levels

if TYPE_CHECKING:
    from chartless.frames.frame import TimedFrame

LEVELS = 256
"""Default number of levels to which frames are reduced."""
Item: TypeAlias = str | os.PathLike[str] | Levels
"""A frame as users give it: a file or an array."""
Progress: TypeAlias = Callable[[str, float], None]
"""Function called with the current stage and its finished share, 0 … 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Reader:
    """Reader of frames, with settings common to all kinds of evidence."""

    channels: str = "auto"
    n_levels: int | None = None
    """Number of levels to which frames are reduced; None for 256 or as many as there
    are."""
    mask: Bools | None = None
    jobs: int = 1
    """Number of processes that read files, where a kind can use several."""
    scheduler: str | None = None
    """Address of a Dask scheduler to use instead."""
    progress: Progress | None = None

    @property
    def levels(self) -> int:
        """Number of levels to which frames other than video are reduced."""
        return LEVELS if self.n_levels is None else self.n_levels

    def counting(self, stage: str, n_parts: int) -> Callable[[object], None]:
        """Return a function to call with each finished part of the work."""
        places = count(1)

        def on_part(_: object) -> None:
            self.report(stage, min(next(places), n_parts) / n_parts)

        return on_part

    def report(self, stage: str, share: float) -> None:
        """Report how much of the work is done."""
        if self.progress is not None:
            self.progress(stage, share)

    def frames(
        self, items: Sequence[Item], numbers: Iterable[int] | None = None
    ) -> Iterator[Frame]:
        """Iterate over frames of files and arrays; the next two are decoded meanwhile.

        Arrays are named by number: 1, 2, ... or the `numbers` given.
        """

        def frame(number: int, item: Item) -> Frame:
            if isinstance(item, np.ndarray):
                return array_frame(item, number)
            from chartless.images import read_frame

            return read_frame(item, raw=True)

        numbers = range(1, len(items) + 1) if numbers is None else numbers
        return in_order(
            partial(frame, number, item) for number, item in zip(numbers, items, strict=True)
        )

    def still_frames(self, items: Sequence[Item], most: int) -> Iterator[Frame]:
        """Yield frames of pictures and, of each video, the first `most` frames."""
        for are_videos, alike in groupby(items, is_video):
            if not are_videos:
                yield from self.frames(list(alike))
                continue
            for item in filter(is_video, alike):
                with self.video(Path(item)) as frames:
                    yield from (timed.frame for timed in islice(frames, most))

    @contextmanager
    def video(self, path: Path) -> "Iterator[Iterator[TimedFrame]]":
        """Open a video as an iterator of frames with their times."""
        from chartless.images import read_video

        with closing(read_video(path, colour=self.channels == "rgb")) as frames:
            yield frames

    def picture(self, path: Path) -> Frame:
        """Read a picture as programs display it."""
        from chartless.images import read_frame

        return read_frame(path)

    def raw_picture(self, path: Path) -> RawPicture:
        """Read the light of a raw file."""
        from chartless.images import read_raw

        return read_raw(path)


def settings_of(item: Item) -> CameraSettings:
    """Camera settings recorded in a file."""
    if isinstance(item, np.ndarray) or is_video(item):
        return CameraSettings()
    from chartless.images import read_settings

    return read_settings(item, raw=True)


def unread_source(item: Item, place: int) -> FrameSource:
    """Source of a frame that was given but not used."""
    if isinstance(item, np.ndarray):
        source = array_frame(item, place + 1).source
        return FrameSource(source.path, source.sha256, source.remarks, n_used=0)
    return FrameSource(Path(item), digest_of(Path(item)), (), n_used=0)


def digest_of(path: Path) -> str:
    """SHA-256 of a file; empty for anything else, such as a webcam."""
    from chartless.images import digest

    return digest(path) if path.is_file() else ""


def is_video(item: Item) -> TypeGuard[str | os.PathLike[str]]:
    """Whether an item is the name of a video."""
    if isinstance(item, np.ndarray):
        return False
    from chartless.images import is_video as is_name_of_video

    return is_name_of_video(item)
