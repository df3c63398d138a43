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
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the server that tests share."""
    folder = tmp_path_factory.mktemp("server") / "desk"
    folder.mkdir()
    return folder


@pytest.fixture(scope="module")
def nobody(desk: Path) -> Iterator[Client]:
    """A client of which the server knows nothing."""
    with serving(desk, limits=Limits(sessions=1000)) as client:
        yield client


@pytest.fixture
def client(nobody: Client) -> Client:
    """A browser with an empty workspace."""
    return Client(nobody.port).begin()


@pytest.fixture(scope="module")
def strict_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A server that takes three files of 200 kB from a browser, 500 kB in all."""
    limits = Limits(file_bytes=200_000, total_bytes=500_000, files=3, cameras=2)
    with serving(tmp_path_factory.mktemp("strict"), limits=limits) as client:
        yield client


@pytest.fixture
def strict_client(strict_server: Client) -> Iterator[Client]:
    """A browser with an empty workspace there."""
    client = Client(strict_server.port).begin()
    yield client
    for camera in client.state["cameras"]:
        client.ask("DELETE", f"/api/cameras/{camera['id']}")


@pytest.fixture(scope="session")
def frames(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two small shots of one scene."""
    folder = tmp_path_factory.mktemp("frames")
    scene = np.random.default_rng(3).uniform(size=(240, 320))
    noise = AffineNoise.of_sensor(1_500, 5)
    paths = []
    for number, levels in enumerate(simulate_frames(scene, named_curve("srgb"), noise), start=1):
        path = folder / f"shot_{number}.png"
        Image.fromarray(levels).save(path)
        paths.append(path)
    return paths
