"""Checks of the frames on their way: scenes that are displaced, channels clipped below white."""

import numpy as np

from chartless.errors import UnfitFramesError
from chartless.frames.frame import Frame
from chartless.frames.same_scene import Glimpse, compare_scenes, glimpse
from chartless.merge._tables import Tables
from chartless.types import Levels

_MOST_AT_WHITE = 0.01  # share of the longest exposure at its highest level that looks like white
_DISPLACED = 0.5  # pixels: still frames are measured at 0.3 at most


class Scenes:
    """Compares each frame with the next longer exposure."""

    def __init__(self) -> None:
        self._before: tuple[str, Glimpse] | None = None
        self.remarks: tuple[str, ...] = ()
        """Where frames are displaced."""

    def see(self, frame: Frame) -> None:
        """Take the next frame, from the shortest exposure to the longest."""
        seen = glimpse(frame.levels[..., frame.levels.shape[2] // 2], frame.white)
        if self._before is not None:
            path, before = self._before
            match = compare_scenes(before, seen)
            if not match.one_scene:
                msg = (
                    f"{path} and {frame.path} do not show the same scene: give exposures of one "
                    "scene"
                )
                raise UnfitFramesError(msg)
            if match.displacement > _DISPLACED:
                text = (
                    f"{frame.path} is displaced by {match.displacement:.1f} pixels against {path}: "
                    "edges are doubled; use a tripod, or align the frames first"
                )
                self.remarks = (*self.remarks, text)
        self._before = str(frame.path), seen


class Whites:
    """Finds channels that seem to saturate below white."""

    def __init__(self) -> None:
        self._highest = np.zeros(0, dtype=np.int64)
        self._longest = (np.zeros(0, dtype=np.int64), np.zeros(0))

    def see(self, levels: Levels) -> None:
        """Take the next frame, from the shortest exposure to the longest."""
        highest = levels.max(axis=(0, 1)).astype(np.int64)
        self._highest = np.maximum(self._highest, highest) if self._highest.size else highest
        self._longest = highest, np.mean(levels == highest, axis=(0, 1))

    def remarks(self, tables: Tables, names: tuple[str, ...]) -> tuple[str, ...]:
        longest, shares = self._longest
        alike = np.asarray(self._highest == longest)
        found = zip(names, longest, shares, alike, tables.whites, strict=True)
        return tuple(
            f"channel {name}: no level is above {level}, where {100 * share:.1f} % of the longest "
            f"exposure lie: if that is this camera's white, merge with `white={level}`"
            for name, level, share, same, white in found
            if same and level < white and share > _MOST_AT_WHITE
        )
