"""Whether two frames of different exposure show one scene, and how far one is displaced.

What is compared must not depend on exposure or on the camera's curve. A curve that increases
keeps the order of any two levels, so the sign of a step from a pixel to its neighbour is that of
the scene in every exposure, and 0 where it is clipped; no mask and no curve is needed. Steps are
taken of block means at three sizes of picture and softened by the noise, s = d/√(d² + τ²). At a
displacement the agreement of two frames is Σ s t / Σ |s t|: 1 if all steps have the same sign, 0 if
they have nothing to do with each other.

The same scene shows as a peak: at one displacement the agreement stands out from that at all
others by many deviations, also where noise makes it small, and where a third of the scene moved.
Smooth scenes have no peak, but levels of one frame then follow those of the other.
Limits are measured in `docs/design/0010-one-scene.md`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeVar

import numpy as np

from chartless._numeric.ranks import rank_correlation
from chartless.types import Bools, Floats, Floats32, Indices, Levels

REACH = 0.15
"""Displacement that is searched, as a share of the larger side."""
STANDS_OUT = 8.0
"""Deviations by which the peak of one scene exceeds the agreement at other displacements: 4.9 in
99 % of the pairs of different photographs, 5.8 at most of 400, and 7.6 when turns are tried."""
STANDS_OUT_AT_REST = 4.0
"""The same without displacement, which is one chance and not thousands: 2.9 at most."""
_AGREES = 0.45  # agreement of smooth scenes, without displacement
_FOLLOWS = 0.9  # rank correlation of levels, of smooth scenes; 0.88 in different photographs
_LITTLE = 0.04  # mean weight of steps that both frames show, below which nothing can be said
# Nor can it of a frame that varies less than this many deviations of its noise, measured at the
# coarsest size, if that noise is a camera's: a share of white. Random images have 0.07 there.
_FLAT, _FLAT_NOISE = 3.0, 0.02

_PIXELS = 1 << 17  # of the largest of the three pictures
_SIZES = 3
_TOO_SMALL = 8  # pixels of a side of a frame that nothing can be said of
_SMALLEST = 16  # pixels of a side that are not halved any more
_ROWS = 3  # that are read of each block of rows
_SOFT = 4.0  # τ in deviations of the noise
_LEAST_SOFT = 0.05  # levels
_NEAR = 3  # pixels around the peak that are part of it
_BLOCK, _AGREEING = 16, 0.3  # pixels of a block; agreement from which its displacement is used
_MOST_AGREE, _DISAGREEING = 0.7, 0.25  # median of blocks; one that moved
_LEAST_BLOCKS, _TEXTURED = 6, 0.05  # mean weight of steps of a block that is informative
_MOVES = 4  # by which the finest displacement may differ from that of the middle size
_LEAST_TURN = 0.15  # pixels of the middle size by which a turn must move blocks to be believed
_TURNS = (-4.0, -2.0, 2.0, 4.0)  # degrees that are tried where the peak is low or missing
_CLEAR, _TURN_GAINS = 12.0, 1.3  # deviations of a high peak; factor by which a turn must raise it
_RANKED = 20_000  # pixels


Steps = tuple[Floats32, Floats32]
"""Softened steps from each pixel to the next, to the right and down."""


@dataclass(frozen=True, slots=True, eq=False)
class Glimpse:
    """What is kept of a frame in order to compare it: block means at up to three sizes."""

    pictures: tuple[Floats32, ...]
    """Largest first, each half as wide and high as the one before."""
    usable: tuple[Bools, ...]
    """Where the mask covers all that a pixel is the mean of, same shapes."""
    steps: tuple[Steps, ...]
    """One row and one column smaller."""
    factor: int
    """Pixels of the frame along a side of a pixel of the first picture."""
    white: int
    """Level at which the frame is clipped."""

    @property
    def brightness(self) -> float:
        """Mean level where the mask is; 0 if it is nowhere."""
        used = self.pictures[-1][self.usable[-1]]
        return float(used.mean()) if used.size else 0.0

    @property
    def is_flat(self) -> bool:
        """Whether it shows little but the noise of a camera, as a wall does."""
        picture = self.pictures[-1]
        shown = self.usable[-1] & (picture > 0) & (picture < self.white)
        noise = _noise(picture, shown)
        if noise > _FLAT_NOISE * self.white or not shown.any():
            return False
        return float(picture[shown].std()) < _FLAT * noise

    @property
    def radius(self) -> float:
        """Root mean square distance of the frame's pixels from its middle."""
        rows, columns = self.pictures[0].shape
        return float(np.hypot(rows, columns) * self.factor / 12**0.5)


@dataclass(frozen=True, slots=True)
class SceneMatch:
    """What a frame has in common with another."""

    right: float
    """Columns by which what the first shows lies further right in the second; 0 if nothing shows
    it."""
    down: float
    """Rows, likewise."""
    turn: float
    """Degrees by which the second is turned, clockwise as displayed."""
    displacement: float
    """Root mean square over the frame of the displacement, turn included, in pixels."""
    standing_out: float
    """Deviations by which the agreement of the details exceeds that at other displacements."""
    agreement: float
    """Agreement of the details at this displacement, coarse ones, −1 … 1."""
    following: float
    """Rank correlation of the levels at this displacement, −1 … 1."""
    moved: float
    """Share of the blocks with detail that disagree where most agree: something moved."""
    one_scene: bool
    """Whether they show one scene or too little in common to say."""


def glimpse(levels: Levels, white: int, mask: Bools | None = None) -> Glimpse:
    """Reduce one channel of a frame to what is compared.

    Parameters
    ----------
    levels : ndarray of uint8 or uint16, shape (M, N)
    white : int
        Highest level.
    mask : ndarray of bool, shape (M, N), optional
        Only pixels where it is True are compared.
    """
    factor = max(1, int(np.ceil(np.sqrt(levels.size / _PIXELS))))
    pictures = [_means(levels, factor)]
    if mask is None:
        usable = [np.ones(pictures[0].shape, dtype=bool)]
    else:
        usable = [_means(mask.astype(np.uint8), factor) > 1 - 1e-6]
    while len(pictures) < _SIZES and min(pictures[-1].shape) >= 2 * _SMALLEST:
        pictures.append(_means(pictures[-1], 2))
        usable.append(_means(usable[-1].astype(np.uint8), 2) > 1 - 1e-6)
    return _with_steps(pictures, usable, factor, white)


def compare_scenes(first: Glimpse, second: Glimpse) -> SceneMatch:
    """Compare two frames of one size.

    Parameters
    ----------
    first, second : Glimpse
        Frames of any exposures; the result is surest if these are neighbours.
    """
    match = _compared(first, second)
    if match.one_scene and match.standing_out >= _CLEAR:
        return match
    tried = [(turn, _compared(first, _turned(second, -turn))) for turn in _TURNS]
    turn, other = max(tried, key=lambda each: each[1].standing_out)
    if other.standing_out < max(STANDS_OUT, _TURN_GAINS * match.standing_out):
        return match
    found = turn + other.turn
    moved = np.hypot(other.right, other.down), np.radians(found) * first.radius
    return replace(other, turn=found, displacement=float(np.hypot(*moved)))


@dataclass(frozen=True, slots=True)
class SceneChain:
    """Frames of different exposure, each compared with the next brighter one."""

    order: tuple[int, ...]
    """Numbers of the frames from the darkest to the brightest."""
    matches: tuple[SceneMatch, ...]
    """Match of each frame in this order with the next."""
    brightness: tuple[float, ...]
    """Mean level of each frame, as given; pixels near white count too."""
    width: float
    """Larger side of the frames, in pixels."""
    radius: float
    """Radius of the frames, as of a `Glimpse`."""

    def mismatched(self) -> tuple[int, int] | None:
        """Numbers of two frames that show different scenes, the lower first; None if all agree."""
        for pair, match in zip(pairwise(self.order), self.matches, strict=True):
            if not match.one_scene:
                return min(pair), max(pair)
        return None

    def displacement(self, one: int, other: int) -> float:
        """By how much two frames are displaced, turn included: root mean square, in pixels."""
        first, second = sorted((self.order.index(one), self.order.index(other)))
        passed = self.matches[first:second]
        turn = np.radians(sum(match.turn for match in passed))
        right, down = sum(match.right for match in passed), sum(match.down for match in passed)
        return float(np.hypot(np.hypot(right, down), turn * self.radius))


def chained(glimpses: Sequence[Glimpse]) -> SceneChain:
    """Compare each frame with the next brighter one: these have most in common."""
    brightness = tuple(each.brightness for each in glimpses)
    order = sorted(range(len(glimpses)), key=brightness.__getitem__)
    matches = [compare_scenes(glimpses[a], glimpses[b]) for a, b in pairwise(order)]
    first = glimpses[0]
    width = float(max(first.pictures[0].shape) * first.factor)
    return SceneChain(tuple(order), tuple(matches), brightness, width, first.radius)


def _compared(first: Glimpse, second: Glimpse) -> SceneMatch:
    if min(first.pictures[0].shape) < _TOO_SMALL:
        return SceneMatch(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, one_scene=True)
    steps = first.steps, second.steps
    middle = min(1, len(first.pictures) - 1)
    place, standing_out, at_rest = _peak(steps[0][middle], steps[1][middle])
    found = standing_out >= STANDS_OUT and at_rest < standing_out
    scale = 1 << (len(first.pictures) - 1 - middle)
    down, right = place if found else (0, 0)
    coarse = round(down / scale), round(right / scale)
    agreement, weight = _agreement(steps[0][-1], steps[1][-1], *coarse)
    following = _following(first, second, *coarse)
    one_scene = (
        standing_out >= STANDS_OUT
        or at_rest >= STANDS_OUT_AT_REST
        or agreement >= _AGREES
        or following >= _FOLLOWS
        or weight < _LITTLE
        or first.is_flat
        or second.is_flat
    )
    moved = 0.0, 0.0, 0.0, 0.0
    shows = max(standing_out if found else 0.0, at_rest) >= STANDS_OUT_AT_REST
    if shows and weight >= _LITTLE:
        moved = _displacement(first, steps, middle, (down, right))
    return SceneMatch(
        *moved,
        standing_out=max(standing_out, at_rest),
        agreement=agreement,
        following=following,
        moved=_moved(steps[0][-1], steps[1][-1], coarse),
        one_scene=one_scene,
    )


# Pictures


def _means(levels: Levels | Floats32, factor: int) -> Floats32:
    """Means of blocks; not of all rows if they are large."""
    if factor == 1:
        return levels.astype(np.float32)
    rows, columns = (length // factor for length in levels.shape)
    blocks = levels[: rows * factor].reshape(rows, factor, -1)
    if factor > _ROWS:
        chosen = (2 * np.arange(_ROWS) + 1) * factor // (2 * _ROWS)
        blocks = blocks[:, chosen]
    wide = np.float32 if levels.dtype == np.float32 else np.uint32
    sums = blocks.sum(axis=1, dtype=wide)[:, : columns * factor]
    sums = sums.reshape(rows, columns, factor).sum(axis=2)
    return np.asarray(sums / np.float32(blocks.shape[1] * factor), dtype=np.float32)


def _turned(seen: Glimpse, degrees: float) -> Glimpse:
    """Turn a picture about its middle, clockwise as displayed."""
    from scipy.ndimage import affine_transform

    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    matrix = np.array([[cosine, -sine], [sine, cosine]])
    pictures, usable = [], []
    for picture, known in zip(seen.pictures, seen.usable, strict=True):
        centre = (np.array(picture.shape) - 1) / 2
        offset = centre - matrix @ centre
        pictures.append(affine_transform(picture, matrix, offset, order=1, mode="nearest"))
        inside = affine_transform(known.astype(np.float32), matrix, offset, order=1)
        usable.append(inside > 1 - 1e-6)
    return _with_steps(pictures, usable, seen.factor, seen.white)


def _with_steps(pictures: list[Floats32], usable: list[Bools], factor: int, white: int) -> Glimpse:
    steps = [
        _softened(picture, known, white) for picture, known in zip(pictures, usable, strict=True)
    ]
    return Glimpse(tuple(pictures), tuple(usable), tuple(steps), factor, white)


def _softened(picture: Floats32, usable: Bools, white: int) -> Steps:
    shown = usable & (picture > 0) & (picture < white)
    soft = np.float32(max(_SOFT * _noise(picture, shown), _LEAST_SOFT))
    here = picture[:-1, :-1]
    known = usable[:-1, :-1] & usable[:-1, 1:] & usable[1:, :-1]
    right, down = picture[:-1, 1:] - here, picture[1:, :-1] - here
    across = np.asarray(right / np.sqrt(right * right + soft * soft) * known, dtype=np.float32)
    along = np.asarray(down / np.sqrt(down * down + soft * soft) * known, dtype=np.float32)
    return across, along


def _noise(picture: Floats32, shown: Bools) -> float:
    """Deviation of pixels by second differences, of which slopes have none."""
    found = []
    for values, known in ((picture, shown), (picture.T, shown.T)):
        every = max(1, values.shape[0] * values.shape[1] // _RANKED)
        bend = np.abs(2 * values[:, 1:-1] - values[:, :-2] - values[:, 2:])[known[:, 1:-1]]
        if bend.size:
            found.append(float(np.median(bend[::every])))
    # For a Gaussian, the median of |x| is 0.6745 σ; second differences have √6 its deviation.
    return float(np.mean(found)) / (0.6745 * 6**0.5) if found else 0.0


# Displacement


def _peak(first: Steps, second: Steps) -> tuple[tuple[int, int], float, float]:
    """Displacement of best agreement, and how far it and that at rest stand out."""
    from scipy.fft import irfft2, next_fast_len, rfft2

    rows, columns = first[0].shape
    reach = int(np.ceil(REACH * max(rows, columns)))
    far = min(reach, rows // 2), min(reach, columns // 2)
    size = [next_fast_len(n + r, real=True) for n, r in zip((rows, columns), far, strict=True)]
    products = np.zeros((size[0], size[1] // 2 + 1), dtype=np.complex64)
    weights = np.zeros_like(products)
    for one, other in zip(first, second, strict=True):
        products += rfft2(one, size).conj() * rfft2(other, size)
        weights += rfft2(np.abs(one), size).conj() * rfft2(np.abs(other), size)
    # A displacement below 0 is one from the other end.
    near = np.ix_(*(np.arange(-r, r + 1) for r in far))
    weight = np.maximum(irfft2(weights, size)[near], 0)
    agreement = irfft2(products, size)[near] / (weight + 0.05 * weight.max() + 1e-3)
    best = np.unravel_index(int(agreement.argmax()), agreement.shape)
    place = int(best[0]) - far[0], int(best[1]) - far[1]
    return place, _standing_out(agreement, place), _standing_out(agreement, (0, 0))


def _standing_out(agreement: Floats32, place: tuple[int, int]) -> float:
    """Deviations by which a displacement agrees better than those away from it."""
    rows, columns = (length // 2 for length in agreement.shape)
    y, x = np.ogrid[-rows : rows + 1, -columns : columns + 1]
    others = agreement[np.hypot(y - place[0], x - place[1]) > _NEAR]
    if not others.size:
        return 0.0
    middle = float(np.median(others))
    spread = 1.4826 * float(np.median(np.abs(others - middle)))
    here = float(agreement[place[0] + rows, place[1] + columns])
    return (here - middle) / (spread + 1e-4)


_Pixels = TypeVar("_Pixels", Floats32, Bools)


def _beside(first: _Pixels, second: _Pixels, down: int, right: int) -> tuple[_Pixels, _Pixels]:
    """Parts of two pictures that show the same at this displacement."""
    rows, columns = first.shape
    one = first[max(0, -down) : rows - max(0, down), max(0, -right) : columns - max(0, right)]
    other = second[max(0, down) : rows - max(0, -down), max(0, right) : columns - max(0, -right)]
    return one, other


def _products(first: Steps, second: Steps, down: int, right: int) -> tuple[Floats32, Floats32]:
    """Product of steps and its size, at each pixel."""
    parts = [_beside(*pair, down, right) for pair in zip(first, second, strict=True)]
    across, along = (one * other for one, other in parts)
    return across + along, np.abs(across) + np.abs(along)


def _agreement(first: Steps, second: Steps, down: int, right: int) -> tuple[float, float]:
    """Agreement and mean weight."""
    product, weight = _products(first, second, down, right)
    total = float(weight.sum())
    return float(product.sum()) / max(total, 1e-6), total / max(weight.size, 1)


def _following(first: Glimpse, second: Glimpse, down: int, right: int) -> float:
    """Rank correlation of levels at the same place; 1 if a frame is of one level."""
    pictures = _beside(first.pictures[-1], second.pictures[-1], down, right)
    one, other = _beside(first.usable[-1], second.usable[-1], down, right)
    usable = one & other
    sampled = (each[usable][:: max(1, usable.size // _RANKED)] for each in pictures)
    return rank_correlation(*sampled)


def _displacement(
    seen: Glimpse, steps: tuple[tuple[Steps, ...], ...], middle: int, place: tuple[int, int]
) -> tuple[float, float, float, float]:
    """Right, down, turn and root mean square displacement, in pixels and degrees."""
    turn = 0.0
    if middle:
        around = _around(steps[0][middle], steps[1][middle], place, reach=2)
        turn = _turn(around)
        best = around.shifts[int(around.agreement.argmax())]
        place = 2 * (place[0] + int(best[0])), 2 * (place[1] + int(best[1]))
    for _ in range(_MOVES):
        surface = _around(steps[0][0], steps[1][0], place, reach=1).agreement.reshape(3, 3)
        y, x = np.unravel_index(int(surface.argmax()), surface.shape)
        if y == x == 1:
            break
        place = place[0] + int(y) - 1, place[1] + int(x) - 1
    down = seen.factor * (place[0] + _vertex(surface[:, 1]))
    right = seen.factor * (place[1] + _vertex(surface[1]))
    turned = np.radians(turn) * seen.radius
    return right, down, turn, float(np.hypot(np.hypot(right, down), turned))


@dataclass(frozen=True, slots=True, eq=False)
class _Around:
    """How blocks agree at displacements around one."""

    shifts: Indices
    """Rows and columns by which each differs from it, shape (S, 2)."""
    products: Floats
    """Sums over blocks, shape (S, B)."""
    weights: Floats
    """Same shape."""
    centres: Floats
    """Rows and columns of the blocks from the middle of the picture, shape (B, 2)."""

    @property
    def agreement(self) -> Floats:
        """Agreement of all blocks together, shape (S,)."""
        return np.asarray(self.products.sum(axis=1) / np.maximum(self.weights.sum(axis=1), 1e-6))


def _around(first: Steps, second: Steps, place: tuple[int, int], *, reach: int) -> _Around:
    shape = first[0].shape
    # Rows and columns of the first frame that the second shows at all these displacements.
    begin = [max(0, reach - at) for at in place]
    count = [
        max(min(n, n - at - reach) - start, 0)
        for n, at, start in zip(shape, place, begin, strict=True)
    ]
    size = [min(_BLOCK, max(n, 1)) for n in count]
    number = [n // b for n, b in zip(count, size, strict=True)]
    span = range(-reach, reach + 1)
    shifts = np.array([(y, x) for y in span for x in span])
    sums = []
    for y, x in shifts:
        product, weight = _products(first, second, place[0] + int(y), place[1] + int(x))
        skip = [
            start - max(0, -(at + int(s)))
            for start, at, s in zip(begin, place, (y, x), strict=True)
        ]
        kept = tuple(
            slice(start, start + n * b) for start, n, b in zip(skip, number, size, strict=True)
        )
        blocks = [
            each[kept].reshape(number[0], size[0], number[1], size[1]).sum(axis=(1, 3)).ravel()
            for each in (product, weight)
        ]
        sums.append(blocks)
    products, weights = np.array(sums, dtype=np.float64).swapaxes(0, 1)
    down, right = (
        start + (np.arange(n) + 0.5) * b - length / 2
        for start, n, b, length in zip(begin, number, size, shape, strict=True)
    )
    centres = np.stack(np.meshgrid(down, right, indexing="ij"), axis=-1).reshape(-1, 2)
    return _Around(shifts, products, weights, centres)


def _moved(first: Steps, second: Steps, place: tuple[int, int]) -> float:
    """Share of textured blocks that disagree, if most agree: if not, noise makes them."""
    around = _around(first, second, place, reach=1)
    textured = around.weights.mean(axis=0) >= _TEXTURED * _BLOCK**2
    if np.count_nonzero(textured) < _LEAST_BLOCKS:
        return 0.0
    agreement = (around.products / np.maximum(around.weights, 1e-6)).max(axis=0)[textured]
    if np.median(agreement) < _MOST_AGREE:
        return 0.0
    return float((agreement < _DISAGREEING).mean())


def _turn(around: _Around) -> float:
    """Degrees by which blocks turn about the middle; 0 if that is within chance."""
    width = round(len(around.shifts) ** 0.5)
    agreement = around.products / np.maximum(around.weights, 1e-6)
    textured = around.weights.mean(axis=0) >= _TEXTURED * _BLOCK**2
    used = textured & (agreement.max(axis=0) >= _AGREEING)
    if np.count_nonzero(used) < _LEAST_BLOCKS:
        return 0.0
    moved = []
    for surface in agreement.T[used].reshape(-1, width, width):
        y, x = np.unravel_index(int(surface.argmax()), surface.shape)
        inner = 0 < y < width - 1, 0 < x < width - 1
        moved.append(
            (
                y + (_vertex(surface[y - 1 : y + 2, x]) if inner[0] else 0.0),
                x + (_vertex(surface[y, x - 1 : x + 2]) if inner[1] else 0.0),
            )
        )
    shift, centres = np.array(moved), around.centres[used]
    own = np.ones(len(shift), dtype=bool)
    for _ in range(3):  # blocks that moved by themselves are left out
        away = centres - centres[own].mean(axis=0)
        gone = shift - shift[own].mean(axis=0)
        spread = float((away[own] ** 2).sum())
        turn = float((gone[own, 0] * away[own, 1] - gone[own, 1] * away[own, 0]).sum()) / spread
        rest = np.hypot(gone[:, 0] - turn * away[:, 1], gone[:, 1] + turn * away[:, 0])
        own = rest <= 3 * np.median(rest) + 1e-3
    chance = float(np.sqrt((rest[own] ** 2).mean() / spread))
    moves = abs(turn) * float(np.sqrt((around.centres**2).sum(axis=1).mean()))
    return float(np.degrees(turn)) if abs(turn) > 4 * chance and moves > _LEAST_TURN else 0.0


def _vertex(values: Floats) -> float:
    """Where two lines of opposite slope through three values meet, from the middle one.

    The agreement of steps has a sharp peak: parabolas put it at half its distance.
    """
    left, top, right = (float(value) for value in values)
    fall = top - min(left, right)
    return float(np.clip((right - left) / (2 * fall), -0.5, 0.5)) if fall > 0 else 0.0
