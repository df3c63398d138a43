"""Flags of a result: doubts about a calibration, with advice in words.

A result that deserves less trust is flagged, not refused. Calibration files hold the
codes; people are shown the `advice`.
"""

from enum import Enum
from typing import Self


class Advice(Enum):
    """A code for files and a sentence for people."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.code}>"

    @property
    def code(self) -> str:
        """Name in calibration files."""
        return str(self.value[0])

    @property
    def advice(self) -> str:
        """Meaning and remedy, in one sentence."""
        return str(self.value[1])

    @classmethod
    def from_code(cls, code: str) -> Self:
        """Member with this name; raises ValueError for an unknown name."""
        for member in cls:
            if member.code == code:
                return member
        msg = f"the {cls.__name__.lower()} {code!r} is unknown to this version of chartless"
        raise ValueError(msg)


class Flag(Advice):
    """A doubt about a result, with its remedy."""

    NO_EVIDENCE = (
        "no-evidence",
        (
            "the pictures do not constrain the curve, which is that of a typical digital camera: "
            "give two or more exposures of one scene, or the raw file of the picture as `raw`"
        ),
    )
    NOISE_DISCOUNTED = (
        "noise-discounted",
        (
            "the noise of these frames is not that of a sensor alone, so it counts little, and the "
            "curve is close to that of a typical camera: give lossless frames without noise "
            "reduction, an exposure bracket, or raw files as `raw`"
        ),
    )
    LEVELS_UNSEEN = (
        "levels-unseen",
        (
            "only part of the brightness range was observed, and outside it the curve is "
            "extrapolated: include dark and bright parts in the scene"
        ),
    )
    DARK_LEVELS_UNSEEN = (
        "dark-levels-unseen",
        (
            "the scene has no dark parts, so the noise at black and the curve there are "
            "guesses: take two frames with the lens covered and give them as `dark`"
        ),
    )
    CLIPPED = (
        "clipped",
        "many pixels are fully black or white and carry no information: change the exposure",
    )
    MOTION = (
        "motion",
        "the frames seem displaced relative to each other: use a tripod and a self-timer",
    )
    BRIGHTNESS_DRIFT = (
        "brightness-drift",
        (
            "the light or the exposure changed between frames; a few per cent are corrected for: "
            "fix the exposure by hand, avoid flickering lamps"
        ),
    )
    STRUCTURED_DIFFERENCE = (
        "structured-difference",
        "the difference of the frames has large patches: something moved, or the light changed",
    )
    CORRELATED_NOISE = (
        "correlated-noise",
        (
            "the noise of neighbouring pixels is correlated, a sign of denoising, sharpening or "
            "strong compression: switch these off or use a higher quality"
        ),
    )
    COMPRESSED = (
        "compressed",
        (
            "lossy compression, of these files or before, changes the noise that the curve is "
            "estimated from: give lossless files or an exposure bracket"
        ),
    )
    CORRELATED_CHANNELS = (
        "correlated-channels",
        (
            "the noise of the channels is correlated, a sign of demosaicing, denoising or "
            "compression: switch these off or use a higher quality"
        ),
    )
    MOVERS = (
        "movers",
        (
            "some pixels changed far more than noise explains and were excluded: keep everything "
            "in the scene still"
        ),
    )
    EMPTY_LEVELS = (
        "empty-levels",
        (
            "some levels are never used: the picture was stretched or has fewer bits than its "
            "file: give frames as the camera writes them"
        ),
    )
    EXPONENT_UNKNOWN = (
        "exponent-unknown",
        (
            "exposures of unknown ratio determine the curve f only up to a power f^γ; γ was set by "
            "the prior over typical cameras: give `times`, or repeat one of the exposures"
        ),
    )
    EXPOSURES_OFF = (
        "exposures-off",
        (
            "the exposures differ from those in the files or `times`: the shutter, the light or "
            "the camera's own gain changed; the curve follows the pictures"
        ),
    )
    SCATTER = (
        "scatter",
        (
            "levels of one exposure do not follow from those of another: something moved, or the "
            "camera treats each picture differently: fix focus, white balance and picture style"
        ),
    )
    UNEVEN_TONES = (
        "uneven-tones",
        (
            "equal light has different levels, a sign of tone mapping that depends on "
            "the surroundings: switch off HDR, shadow lifting and other automatic enhancement"
        ),
    )
    LITTLE_OVERLAP = (
        "little-overlap",
        (
            "neighbouring exposures share few levels that are neither black nor white: take them "
            "closer together"
        ),
    )
    LOW_NOISE = (
        "low-noise",
        "the noise hardly exceeds the rounding of the levels: raise the ISO",
    )
    NOISE_AT_BOUND = (
        "noise-at-bound",
        (
            "the frames do not determine how the noise divides into slope and floor: do not "
            "trust U or V alone, and trust the curve less than usual"
        ),
    )
    MISFIT = (
        "misfit",
        (
            "the model explains the level pairs poorly: the camera may process its pictures in "
            "ways a response curve and sensor noise do not describe"
        ),
    )
    DISAGREEMENT = (
        "disagreement",
        (
            "kinds of evidence show different curves, so one of them is wrong: check `times`, keep "
            "the scene still, or choose one kind with `evidence`"
        ),
    )
    NOT_MONOTONE = (
        "not-monotone",
        (
            "the curve decreases somewhere, which no camera does: choose a family that cannot, "
            "such as ameegc2-exact"
        ),
    )
    FEW_PIXELS = (
        "few-pixels",
        "there are few pixels for so many levels: give more or larger frames, or fewer `n_levels`",
    )
    SEARCH_UNFINISHED = (
        "search-unfinished",
        (
            "the search was still improving when it stopped: trust the curve less; the "
            "methods ism-… accept more `rounds`"
        ),
    )
