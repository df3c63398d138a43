"""A camera that stores each shot twice: as DNG what its sensor saw, as JPEG what it made of it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import tifffile
from PIL import Image
from scipy.ndimage import gaussian_filter, uniform_filter

from chartless.curves import AbstractCurve, named_curve
from chartless.frames.frame import Frame, RawPicture
from chartless.images import through_jpeg

Pixels = npt.NDArray[Any]

BAYER = ((0, 1), (1, 2))
XTRANS = (
    (1, 1, 0, 1, 1, 2),
    (1, 1, 2, 1, 1, 0),
    (2, 0, 1, 0, 2, 1),
    (1, 1, 2, 1, 1, 0),
    (1, 1, 0, 1, 1, 2),
    (0, 2, 1, 2, 0, 1),
)
_COLOUR_FILTERS, _LINEAR_RAW = 32803, 34892


def write_dng(
    path: Path,
    mosaic: Pixels,
    *,
    pattern: Sequence[Sequence[int]] | None = BAYER,
    black: int | Sequence[int] = 256,
    white: int = 4095,
    neutral: Sequence[float] = (0.5, 1.0, 0.625),
    orientation: int = 1,
    tags: Sequence[tuple[Any, ...]] = (),
) -> Path:
    """Store levels of the sites of a sensor; without a pattern, of a grey one."""

    def fractions(values: Sequence[float]) -> list[int]:
        return [number for value in values for number in (round(1000 * value), 1000)]

    own: list[tuple[Any, ...]] = [
        (50706, "B", 4, bytes([1, 4, 0, 0]), True),  # version
        (50707, "B", 4, bytes([1, 1, 0, 0]), True),
        (50708, "s", 0, "simulated", True),
        (50714, "H", np.size(black), black, True),
        (50717, "H", 1, white, True),
        (50721, "2i", 9, fractions(np.eye(3).ravel()), True),  # colour matrix
        (50728, "2I", 3, fractions(neutral), True),
        (50778, "H", 1, 21, True),
        (274, "H", 1, orientation, True),
    ]
    if pattern is not None:
        sites = bytes(np.ravel(pattern).tolist())
        own.append((33421, "H", 2, (len(pattern), len(pattern[0])), True))
        own.append((33422, "B", len(sites), sites, True))
    tifffile.imwrite(path, mosaic, photometric="minisblack", extratags=[*own, *tags], metadata=None)
    with tifffile.TiffFile(path, mode="r+") as file:
        kind = _LINEAR_RAW if pattern is None else _COLOUR_FILTERS
        file.pages[0].tags[262].overwrite(kind)  # type: ignore[union-attr]
    return path


def patches(height: int = 384, width: int = 512, seed: int = 0, greys: float = 0.6) -> Pixels:
    """Light of plain surfaces of many colours, shaded softly, 0 … 1, shape (height, width, 3)."""
    rng = np.random.default_rng(seed)
    rows, columns = -(-height // 32), -(-width // 32)
    lightness = rng.permutation(np.linspace(0.002, 1, rows * columns)) ** 2
    colours = lightness[:, np.newaxis] * rng.uniform(0.5, 1.0, (rows * columns, 3))
    grey = rng.uniform(size=rows * columns) < greys
    colours[grey] = lightness[grey, np.newaxis]
    scene = colours.reshape(rows, columns, 3).repeat(32, axis=0).repeat(32, axis=1)
    shade = gaussian_filter(rng.standard_normal((height, width)), 40, mode="wrap")
    return scene[:height, :width] * np.exp(0.1 * shade / shade.std())[..., np.newaxis]


@dataclass(frozen=True)
class Camera:
    """What it does to light, in the order in which it is done."""

    curve: AbstractCurve = field(default_factory=lambda: named_curve("srgb"))
    matrix: Pixels = field(
        default_factory=lambda: np.array([[1.6, -0.5, -0.1], [-0.2, 1.5, -0.3], [0, -0.4, 1.4]])
    )
    balance: tuple[float, float, float] = (2.0, 1.0, 1.6)
    falloff: float = 0.2
    gain: float = 1.2
    sharpening: float = 0.3
    noise: tuple[float, float] = (1e-4, 1e-7)
    black: int = 256
    white: int = 4095
    pattern: tuple[tuple[int, ...], ...] = BAYER

    def shoot(
        self, scene: Pixels, *, exposure: float = 1.0, seed: int = 0
    ) -> tuple[Pixels, Pixels]:
        """Levels of the sites, shape (M, N), and of the finished picture, shape (M, N, 3)."""
        rng = np.random.default_rng(seed)
        height, width = scene.shape[:2]
        down, right = (np.linspace(-1, 1, size) for size in (height, width))
        square = (down[:, np.newaxis] * height) ** 2 + (right * width) ** 2
        falloff = np.exp(-self.falloff * square / (height**2 + width**2))[..., np.newaxis]
        seen = exposure * falloff * (scene @ np.linalg.inv(self.matrix).T).clip(0) / self.balance
        seen = seen + rng.standard_normal(seen.shape) * np.sqrt(
            self.noise[0] * seen + self.noise[1]
        )
        span = self.white - self.black
        levels = np.rint(self.black + span * seen).clip(0, self.white)
        repeats = -(-height // len(self.pattern)), -(-width // len(self.pattern[0]))
        colour = np.tile(self.pattern, repeats)[:height, :width]
        mosaic = np.take_along_axis(levels, colour[..., np.newaxis], axis=2)[..., 0]
        light = (levels - self.black) / span * self.balance / falloff
        shown = self.curve.response((self.gain * light @ self.matrix.T).clip(0, 1))
        shown = shown + self.sharpening * (shown - uniform_filter(shown, (5, 5, 0)))
        finished = np.rint(255 * shown.clip(0, 1)).astype(np.uint8)
        return mosaic.astype(np.uint16), finished

    def store(
        self, folder: Path, name: str, scene: Pixels, *, quality: int = 92, **how: Any
    ) -> tuple[Path, Path]:
        """Files of one shot: JPEG, with its chroma halved, and DNG."""
        mosaic, finished = self.shoot(scene, **how)
        picture, original = folder / f"{name}.JPG", folder / f"{name}.dng"
        Image.fromarray(finished).save(picture, "JPEG", quality=quality, subsampling=2)
        neutral = tuple(1 / factor for factor in self.balance)
        write_dng(
            original,
            mosaic,
            pattern=self.pattern,
            black=self.black,
            white=self.white,
            neutral=neutral,
        )
        return picture, original

    def pair(self, scene: Pixels, *, quality: int = 90, **how: Any) -> tuple[RawPicture, Frame]:
        """A shot in memory, its picture compressed channel by channel."""
        mosaic, finished = self.shoot(scene, **how)
        light = (mosaic.astype(np.float64) - self.black) / (self.white - self.black)
        green = (light[::2, 1::2] + light[1::2, ::2]) / 2
        cells = np.stack([light[::2, ::2], green, light[1::2, 1::2]], axis=-1)
        raw = RawPicture(
            path=Path("a.dng"),
            light=cells.astype(np.float32),
            saturated=np.asarray(np.any(cells > 0.95, axis=-1)),
            cell=(2, 2),
            white_balance=np.array(self.balance),
            error=1e-4,
        )
        planes = [through_jpeg(np.ascontiguousarray(finished[..., c]), quality) for c in range(3)]
        return raw, Frame(Path("a.jpg"), np.stack(planes, axis=-1))
