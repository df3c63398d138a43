"""Servers of the page, browsers that know them, and frames to give."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from web_client import Client, serving

from chartless import AffineNoise, named_curve, simulate_frames
from chartless.web import Limits


@pytest.fixture(scope="module")
def nobody(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A client of which the server knows nothing."""
    with serving(tmp_path_factory.mktemp("desk")) as client:
        yield client


@pytest.fixture
def client(nobody: Client) -> Client:
    """A browser with an empty workspace."""
    return Client(nobody.port).begin()


@pytest.fixture
def strict_client(tmp_path: Path) -> Iterator[Client]:
    """A browser that may give three files of 200 kB, 500 kB in all."""
    limits = Limits(file_bytes=200_000, total_bytes=500_000, files=3, cameras=2)
    with serving(tmp_path, limits=limits) as client:
        yield client.begin()


@pytest.fixture(scope="session")
def frames(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two small shots of one scene."""
    folder = tmp_path_factory.mktemp("frames")
    scene = np.random.default_rng(3).uniform(size=(240, 320))
    noise = AffineNoise.from_8bit(0.03, 16)
    paths = []
    for number, levels in enumerate(simulate_frames(scene, named_curve("srgb"), noise), start=1):
        path = folder / f"shot_{number}.png"
        Image.fromarray(levels).save(path)
        paths.append(path)
    return paths
