"""Frames that a browser takes from its camera."""

import numpy as np
import pytest
from web_client import Client

from chartless import AffineNoise, named_curve, simulate_frames
from chartless.errors import ImageError
from chartless.web._live import Shape, frame_of

SHAPE = "width=320&height=240&kind=luma&full=1"


def luma(n_frames: int) -> list[bytes]:
    scene = np.random.default_rng(3).uniform(size=(240, 320))
    noise = AffineNoise.from_8bit(0.03, 16)
    frames = simulate_frames(scene, named_curve("srgb"), noise, n_frames=n_frames, seed=1)
    return [levels.tobytes() for levels in frames]


def test_frames_in_curve_out(client: Client) -> None:
    assert client.ask("POST", "/api/live").status == 204
    answers = [
        client.ask("POST", f"/api/live/frames?{SHAPE}&until=0.1", content).json
        for content in luma(14)
    ]
    saved = client.ask("POST", "/api/live/save").json["id"]

    assert "no two frames are still" in answers[0]["note"]
    assert not answers[0]["is_enough"]
    drawn = [each for each in answers if each.get("curve")]
    assert "<svg" in drawn[0]["curve"]
    assert answers[-1]["counts"].startswith("14 frames, 13 used")
    camera = client.finished(saved)
    assert camera["state"] == "done"
    kept = client.ask("GET", f"/api/cameras/{saved}/camera.json").json
    (channel,) = kept["channels"]
    truth = named_curve("srgb").inverse(np.linspace(0, 1, 256))
    assert np.sqrt(np.mean((channel["inverse_lut"] - truth) ** 2)) < 0.03
    assert kept["method"] == "nlf"
    assert any("14 frames, 13 used" in text for text in kept["provenance"]["remarks"])


def test_a_new_start_forgets(client: Client) -> None:
    frames = luma(3)
    for _ in range(2):
        client.ask("POST", "/api/live")
        answers = [
            client.ask("POST", f"/api/live/frames?{SHAPE}&until=0", each).json for each in frames
        ]
        assert answers[-1]["counts"].startswith("3 frames, 2 used")


def test_before_the_camera_was_started(client: Client) -> None:
    assert client.ask("POST", f"/api/live/frames?{SHAPE}&until=0", luma(2)[0]).status == 404
    assert client.ask("POST", "/api/live/save").status == 404
    client.ask("POST", "/api/live")
    assert "there are no frames yet" in client.ask("POST", "/api/live/save").error


@pytest.mark.parametrize(
    ("query", "content", "status"),
    [
        ("", b"", 400),
        ("width=a&height=1&kind=luma&full=1&until=0", b"1", 400),
        ("width=-1&height=-1&kind=luma&full=1&until=0", b"1", 413),
        ("width=60000&height=60000&kind=luma&full=1&until=0", b"1", 413),
        ("width=2&height=2&kind=luma&full=1&until=0", b"1", 422),
        ("width=2&height=2&kind=luma&full=1&until=0", b"12345", 413),
        ("width=2&height=2&kind=nv12&full=1&until=0", b"1234", 413),
        (f"{SHAPE}&until=0", b"1", 422),
    ],
)
def test_frames_that_are_not_what_they_say(
    client: Client, query: str, content: bytes, status: int
) -> None:
    client.ask("POST", "/api/live")

    answer = client.ask("POST", f"/api/live/frames?{query}", content)

    assert answer.status == status or (status == 413 and answer.status == 422)
    assert answer.error


def test_a_camera_that_changes_its_size(client: Client) -> None:
    client.ask("POST", "/api/live")
    client.ask("POST", f"/api/live/frames?{SHAPE}&until=0", luma(2)[0])
    answer = client.ask(
        "POST", "/api/live/frames?width=2&height=2&kind=luma&full=1&until=0", b"1234"
    )

    assert answer.status == 422
    assert "320" in answer.error


def test_limited_range_is_spread_from_black_to_white() -> None:
    content = bytes([0, 16, 17, 234, 235, 255])

    frame = frame_of(content, Shape(3, 2, "luma", is_full=False))

    assert frame.levels.ravel().tolist() == [0, 0, 1, 218, 219, 219]
    assert frame.white == 219


def test_colours_without_what_shines_through() -> None:
    frame = frame_of(bytes(range(8)), Shape(2, 1, "rgba", is_full=True))

    assert frame.levels.tolist() == [[[0, 1, 2], [4, 5, 6]]]
    assert frame.white == 255
    with pytest.raises(ImageError, match="another size"):
        frame_of(bytes(7), Shape(2, 1, "rgba", is_full=True))
