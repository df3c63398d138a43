"""The live view: frames that the browser takes from its camera, and the curve that they give."""

import secrets
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from chartless.errors import ImageError, UnfitFramesError, with_options
from chartless.frames.frame import Frame
from chartless.live import LiveEvidence, lacking, live_calibration
from chartless.report import card
from chartless.result.calibration import Calibration
from chartless.types import JsonObject, Levels

MOST_BYTES = 36_000_000
"""Bytes of a frame: 9 megapixels, more than 3840 × 2160, in red, green, blue and nothing."""
_INTERVAL = 1.0  # seconds between two drawings of the curve, each a tenth of a second
_BLACK, _WHITE = 16, 235  # of luma in limited range (ITU-R BT.601)
_NAME = Path("camera")  # in messages and in the calibration


class Shape(NamedTuple):
    """What a browser says of the bytes of a frame."""

    width: int
    height: int
    kind: str
    """luma: one byte for each pixel; rgba: four."""
    is_full: bool
    """Whether luma is 0 at black and 255 at white."""

    @property
    def n_bytes(self) -> int:
        """Length that the frame must have."""
        return self.width * self.height * (1 if self.kind == "luma" else 4)


def frame_of(content: bytes, shape: Shape) -> Frame:
    """Frame from the bytes that a browser sent.

    Raises
    ------
    ImageError
        If they are not as many as the shape asks for.
    """
    if shape.kind not in {"luma", "rgba"} or min(shape[:2]) < 1 or len(content) != shape.n_bytes:
        msg = "sent a frame whose size differs from that stated: load the page again"
        raise ImageError(str(_NAME), msg)
    samples = np.frombuffer(content, np.uint8).reshape(shape.height, shape.width, -1)
    if shape.kind == "rgba":
        what = "R′G′B′ as the browser shows them, converted from what the camera sent"
        return Frame(_NAME, np.ascontiguousarray(samples[..., :3]), remarks=(what,))
    if shape.is_full:
        return Frame(_NAME, samples, remarks=("Y′ as the camera sent it; black 0, white 255",))
    levels: Levels = np.clip(samples, _BLACK, _WHITE) - np.uint8(_BLACK)
    what = f"Y′ as the camera sent it; black {_BLACK}, white {_WHITE}"
    return Frame(_NAME, levels, remarks=(what,), white=_WHITE - _BLACK)


class LiveView:
    """Evidence of one browser's camera, and the latest curve; for one thread at a time."""

    def __init__(self) -> None:
        self.id = secrets.token_hex(8)
        self._evidence = LiveEvidence()
        self._drawn = 0.0

    def add(self, content: bytes, shape: Shape, until: float) -> JsonObject:
        """Count a frame; what the page shows, with the curve if it was drawn anew.

        Raises
        ------
        ImageError
            As `frame_of` does.
        UnfitFramesError
            If the frame is of another kind than those before.
        """
        self._evidence.add(frame_of(content, shape))
        answer: JsonObject = {"counts": self._evidence.account}
        now = time.monotonic()
        if now - self._drawn < _INTERVAL:
            return answer
        try:
            calibration = self.calibration()
        except UnfitFramesError as error:
            return {**answer, "curve": "", "note": with_options(str(error)), "is_enough": False}
        lack = lacking(self._evidence, calibration, until)
        answer |= {
            "curve": card(calibration.channels),
            "note": f"{lack[0].upper()}{lack[1:]}." if lack else "Good enough.",
            "is_enough": not lack,
        }
        self._drawn = time.monotonic()
        return answer

    def calibration(self) -> Calibration:
        """Calibrate from what there is now; raises as `live_calibration` does."""
        return live_calibration(self._evidence)
