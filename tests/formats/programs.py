"""Programs that read our files, and what they make of a ramp of 256 levels."""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt
import PyOpenColorIO as Ocio
import pytest

Floats32 = npt.NDArray[np.float32]

RAMP = np.repeat(np.arange(256, dtype=np.float32)[:, np.newaxis] / np.float32(255), 3, axis=1)
"""Brightness of R, G and B, shape (256, 3)."""
LEVELS = np.repeat(np.arange(256, dtype=np.uint8)[np.newaxis, :, np.newaxis], 3, axis=2)
"""The same as a picture of one row."""


def program(name: str, package: str) -> str:
    """Path of a program of Debian; the test is skipped without, and fails in CI."""
    require(package, name)
    return str(shutil.which(name))


def require(package: str, *programs: str) -> None:
    """Skip where a program is missing; on CI, where all of them belong, fail."""
    missing = [each for each in programs if shutil.which(each) is None]
    if not missing:
        return
    why = f"no {', '.join(missing)} here: apt-get install {package}"
    if os.environ.get("CI") == "true":
        pytest.fail(why)
    pytest.skip(why)


def ocio_processor(path: Path, *, inverse: bool = False) -> Ocio.Processor:
    direction = Ocio.TRANSFORM_DIR_INVERSE if inverse else Ocio.TRANSFORM_DIR_FORWARD
    Ocio.ClearAllCaches()  # a file of the same name may have changed
    transform = Ocio.FileTransform(str(path), interpolation=Ocio.INTERP_LINEAR, direction=direction)
    return Ocio.Config.CreateRaw().getProcessor(transform)


def linearised_by_ocio(path: Path) -> Floats32:
    """What OpenColorIO makes of `RAMP`, shape (256, 3)."""
    pixels = RAMP.copy()
    ocio_processor(path).getDefaultCPUProcessor().applyRGB(pixels)
    return pixels


def linearised_by_ffmpeg(path: Path) -> Floats32:
    """What FFmpeg makes of `RAMP`, shape (256, 3)."""
    form = ["-f", "rawvideo", "-pix_fmt", "gbrpf32le"]
    ffmpeg = program("ffmpeg", "ffmpeg")
    ending = [f"lut1d=file={path.name}:interp=linear", *form, "-"]
    done = subprocess.run(
        [ffmpeg, "-v", "error", *form, "-s", "256x1", "-i", "-", "-vf", *ending],
        input=np.ascontiguousarray(RAMP[:, [1, 2, 0]].T).tobytes(),
        capture_output=True,
        check=True,
        cwd=path.parent,
    )
    return np.frombuffer(done.stdout, "<f4").reshape(3, 256).T[:, [2, 0, 1]]
