"""Merging: the sweeps over the frames, and the balance of the channels."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.exposures import require_exposures
from chartless.frames.channels import require_alike
from chartless.frames.frame import Frame
from chartless.merge._checks import Scenes, Whites
from chartless.merge._map import RadianceMap
from chartless.merge._sums import Clipped, Sums, add, finished, mean
from chartless.merge._tables import tables_of
from chartless.result.calibration import Calibration
from chartless.types import Floats, Floats32


def merge_frames(
    frames: Sequence[Frame],
    exposures: Sequence[float] | Floats,
    calibration: Calibration,
    *,
    white: int | None = None,
    bloom_radius: int = 0,
    sweeps: int = 2,
    balanced: bool = True,
    on_frame: Callable[[int, int], None] | None = None,
) -> RadianceMap:
    """Merge exposures of one still scene.

    Memory does not grow with the number of frames: beside one frame there are 16 bytes for each
    sample of a picture.

    Parameters
    ----------
    frames : sequence of Frame
        Two or more of one camera, in any order; an exposure may be repeated. Each is taken once in
        every sweep and forgotten, so the sequence may read files as they are asked for.
    exposures : sequence of float, shape (K,)
        Exposure of each frame, relative to each other: t, or t · ISO/N² where these differ.
    calibration : Calibration
        Calibration of the camera. One of luma serves every channel. Without noise,
        `DEFAULT_NOISE` is taken.
    white : int, optional
        Level from which on a channel is saturated, for cameras whose white lies below the highest
        level. Without, the highest, or where the curve reaches 1.
    bloom_radius : int
        Pixels this close to a saturated one are not used if another exposure serves.
    sweeps : int
        2, or 1, which weighs by the shown levels, takes each frame once and is biased; see the
        package.
    balanced : bool
        Whether a pixel that the camera shows as middle grey is grey (`grey_factors`). Each curve is
        known up to a factor of its own, the irradiance at which its channel saturates.
    on_frame : callable, optional
        Called with the number of frames taken so far and the number in all, over all sweeps.

    Returns
    -------
    RadianceMap

    Raises
    ------
    UnfitFramesError
        If there are fewer than two frames, they differ in more than exposure, or they do not show
        one scene.
    ParameterError
        If a setting is out of range or the calibration has other channels.

    Notes
    -----
    For a channel of a pixel a frame is, from best to worst, one

    1. in which all channels are expected between white and black (see the package);
    2. in which no channel is saturated;
    3. the same within `bloom_radius` of a saturated pixel;
    4. in which another channel is saturated: using it for the others, which need not be, and not
       for this one would mix exposures and colour the highlights wherever exposures are not exact.

    Only frames of the best rank there is are averaged. Where the channel is saturated in all, its
    value is the bound.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from chartless.curves import SrgbCurve
    >>> from chartless.result.response import Response, Status
    >>> curve = SrgbCurve()
    >>> response = Response(
    ...     name="Y", curve=curve, noise=None, n_levels=256, observed_levels=(0, 255), n_pairs=0,
    ...     method="srgb", status=Status.CONVERGED,
    ... )
    >>> camera = Calibration(channels=(response,), bit_depth=8)
    >>> scene = np.array([[[0.02], [0.2], [2.0]]])
    >>> frames = [
    ...     Frame(Path(), np.rint(255 * curve.response(scene * t)).astype(np.uint8))
    ...     for t in (0.25, 1, 4)
    ... ]
    >>> merge_frames(frames, (0.25, 1, 4), camera).values.ravel().round(2)
    array([0.02, 0.2 , 2.01], dtype=float32)
    """
    times = _checked(frames, exposures, sweeps)
    relative = times / times.max()
    order = np.argsort(times, kind="stable")
    first = frames[int(order[0])]
    shape = first.levels.shape
    tables = tables_of(calibration, first, white)
    lit = np.zeros(shape, dtype=bool)
    clipped = Clipped.none(shape, relative[order])
    whites, scenes = Whites(), Scenes()
    earlier: Floats32 | None = None
    for sweep in range(sweeps):
        sums = Sums.zeros(shape)
        for turn, place in enumerate(order):
            frame = frames[int(place)]
            if sweep == 0:
                require_alike(first, frame, one_exposure=False)
                lit |= frame.levels > 0
                whites.see(frame.levels)
                scenes.see(frame)
            add(sums, frame.levels, turn, clipped, tables, bloom_radius, earlier)
            if on_frame is not None:
                on_frame(1 + turn + sweep * order.size, sweeps * order.size)
        if sweep + 1 < sweeps:
            earlier = mean(sums)
    remarks = (*scenes.remarks, *whites.remarks(tables, first.channel_names))
    merged = finished(sums, lit, tables, times, orientation=first.orientation, remarks=remarks)
    if not balanced or len(calibration.channels) == 1:
        return merged
    factors = grey_factors(calibration).astype(np.float32)
    return replace(merged, values=merged.values * factors, std=merged.std * factors)


def grey_factors(calibration: Calibration) -> Floats:
    """Factors on the irradiance of each channel that make middle grey grey, shape (C,).

    The middle channel keeps its own. Debevec & Malik (1997) set their channels likewise.
    """
    middle = np.array([float(each.curve.inverse(0.5)) for each in calibration.channels])
    return np.asarray(middle[middle.size // 2] / middle)


def _checked(frames: Sequence[Frame], exposures: Sequence[float] | Floats, sweeps: int) -> Floats:
    times = np.asarray(exposures, dtype=np.float64)
    if len(frames) < 2:  # noqa: PLR2004 - exposures
        msg = f"{len(frames)} frame is not a bracket: give two or more exposures of one scene"
        raise UnfitFramesError(msg)
    if times.shape != (len(frames),):
        msg = f"{times.size} exposures were given for {len(frames)} frames: give one for each"
    elif sweeps not in (1, 2):
        msg = f"there are one or two sweeps, not {sweeps}"
    else:
        require_exposures(times, [f"exposure {place}" for place in range(1, 1 + times.size)])
        return times
    raise ParameterError(msg)
