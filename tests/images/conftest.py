from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from handmade import Pixels

Save = Callable[..., Path]

NAMES = {"float16": "half", "float32": "float", "uint32": "uint"}
"""Types whose numpy name OpenImageIO takes for uint8."""


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(2008)


@pytest.fixture
def rgb(rng: np.random.Generator) -> Pixels:
    return rng.integers(0, 256, (20, 30, 3), dtype=np.uint8)


@pytest.fixture
def save(tmp_path: Path) -> Save:
    """Write an array with OpenImageIO, with EXIF and other attributes."""

    def save_as(name: str, pixels: Pixels, **attributes: object) -> Path:
        path = tmp_path / name
        height, width, n_channels = pixels.shape
        kind = NAMES.get(str(pixels.dtype), str(pixels.dtype))
        spec = oiio.ImageSpec(width, height, n_channels, kind)
        spec["Exif:ColorSpace"] = 65535
        for attribute, value in attributes.items():
            spec[attribute.replace("__", ":")] = value
        target = oiio.ImageOutput.create(str(path))
        assert target is not None
        assert target.open(str(path), spec)
        target.write_image(pixels)
        target.close()
        assert not target.geterror()
        return path

    return save_as
