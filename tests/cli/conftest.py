"""The program run in process, and pictures to run it on."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

from chartless import AffineNoise, Calibration, ModelCurve, Response, named_curve, save
from chartless.cli import main
from chartless.flags import Flag
from chartless.images import write_image
from chartless.models import MODELS
from chartless.result.response import Status
from chartless.simulate import simulate_frames

Pixels = npt.NDArray[Any]


@dataclass(frozen=True)
class Run:
    """What a run of the program left behind."""

    status: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        def no_constant(name: str) -> None:
            pytest.fail(f"{name} is not JSON")

        return json.loads(self.out, parse_constant=no_constant)


Chartless = Callable[..., Run]
Refusal = Callable[..., str]


@pytest.fixture
def chartless(capfd: pytest.CaptureFixture[str]) -> Chartless:
    """Run the program in process; also what C libraries print is caught."""

    def run(*arguments: object) -> Run:
        capfd.readouterr()
        status = main([str(argument) for argument in arguments])
        return Run(status, *capfd.readouterr())

    return run


@pytest.fixture
def refusal(chartless: Chartless) -> Refusal:
    """Run the program on bad input; its line after ``chartless: error:``."""

    def refuse(*arguments: object) -> str:
        done = chartless(*arguments)
        assert done.err.startswith("chartless: error: "), done
        assert done.err.count("\n") == 1, done.err
        assert done.status == 2, done.err
        if "--json" in arguments:
            assert done.json == {"error": done.err.removeprefix("chartless: error: ").rstrip()}
        else:
            assert done.out == ""
        return done.err.removeprefix("chartless: error: ").rstrip()

    return refuse


class Shoot:
    """Takes frames of still scenes into a folder, one file for each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(
        self, scene: Pixels | None = None, *, name: str = "shot", n_channels: int = 1, **how: Any
    ) -> list[Path]:
        scene = self.scene(n_channels=n_channels) if scene is None else scene
        return [
            self.write(f"{name}_{number}.png", levels)
            for number, levels in enumerate(self.frames(scene, **how))
        ]

    @staticmethod
    def scene(height: int = 192, width: int = 256, n_channels: int = 1) -> Pixels:
        """Soft blobs in which every irradiance from 0 to 1 is equally frequent."""
        planes = []
        for channel in range(n_channels):
            white = np.random.default_rng(channel).standard_normal((height, width))
            soft = gaussian_filter(white, 12, mode="wrap")
            planes.append(soft.ravel().argsort().argsort().reshape(height, width) / soft.size)
        return np.stack(planes, axis=-1)

    @staticmethod
    def frames(scene: Pixels, *, response: str = "srgb", **how: Any) -> list[Pixels]:
        """Noisy frames with the noise of a compact camera."""
        noise = AffineNoise.from_8bit(0.03, 16)
        return list(simulate_frames(scene, named_curve(response), noise, **how))

    def write(self, name: str, levels: Pixels) -> Path:
        """Write levels as they are; with Pillow where it can, which shares no code with us."""
        path = self.folder / name
        if levels.dtype == np.uint8:
            Image.fromarray(levels.squeeze(-1) if levels.shape[-1] == 1 else levels).save(path)
        else:
            write_image(path, levels / 65535, linear=False)
        return path


@pytest.fixture
def shoot(tmp_path: Path) -> Shoot:
    return Shoot(tmp_path)


def response_of(name: str, *parameters: float, model: str = "ameegc2-exact") -> Response:
    return Response(
        name=name,
        curve=ModelCurve(model, parameters),
        noise=AffineNoise.from_8bit(0.03, 16),
        n_levels=256,
        observed_levels=(3, 250),
        n_pairs=1000,
        method="ism-bin",
        status=Status.CONVERGED,
    )


@pytest.fixture
def colour_camera(tmp_path: Path) -> Path:
    """A calibration of red, green and blue that no search had to make."""
    channels = (
        response_of("R", -0.8, 1.5, -0.6),
        response_of("G", -0.6, 1.6, -0.5),
        response_of("B", -0.7, 1.4, -0.4).with_flags(Flag.MISFIT),
    )
    path = tmp_path / "colour.json"
    save(Calibration(channels=channels, bit_depth=8), path)
    return path


@pytest.fixture
def grey_camera(tmp_path: Path) -> Path:
    path = tmp_path / "grey.json"
    save(Calibration(channels=(response_of("Y", -0.8, 1.5, -0.6),), bit_depth=8), path)
    return path


@pytest.fixture(scope="session")
def dorf_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of 201 made-up curves."""
    irradiance = np.linspace(0, 1, 1024, dtype=np.float32)
    model, rng = MODELS["gumbel3"], np.random.default_rng(3)
    steps = rng.normal(size=(201, 4)) * [0.4, 0.2, 0.1, 0.1]
    brightness = model.response(irradiance.astype(float), model.identity + steps)
    brightness[:, -1] = 1
    path = tmp_path_factory.mktemp("data") / "dorf_own.npz"
    np.savez(
        path,
        I=irradiance,
        B=np.maximum.accumulate(brightness.astype(np.float32), axis=1),
        name=np.array([f"Film_{n // 3}CD{('Red', 'Green', 'Blue')[n % 3]}" for n in range(201)]),
        scale_class=np.array(["graph-log-log-neg"] * 150 + ["graph-lin-lin"] * 51),
    )
    return path
