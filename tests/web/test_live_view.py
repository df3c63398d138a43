"""Frames that a browser takes from its camera."""

import contextlib
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import numpy as np
import pytest
from web_client import Client

from chartless import AffineNoise, named_curve, simulate_frames
from chartless.errors import ImageError
from chartless.web._live import Shape, frame_of

SHAPE = "width=320&height=240&kind=luma&full=1"


def luma(n_frames: int) -> list[bytes]:
    scene = np.random.default_rng(3).uniform(size=(240, 320))
    noise = AffineNoise.of_sensor(1_500, 5)
    frames = simulate_frames(scene, named_curve("srgb"), noise, n_frames=n_frames, seed=1)
    return [levels.tobytes() for levels in frames]


def begun(client: Client) -> str:
    """Address of a new live view."""
    answer = client.ask("POST", "/api/live")
    assert answer.status == 201
    return f"/api/live/{answer.json['id']}"


def test_frames_in_curve_out(client: Client) -> None:
    view = begun(client)
    answers = [
        client.ask("POST", f"{view}/frames?{SHAPE}&until=0.1", content).json for content in luma(14)
    ]
    saved = client.ask("POST", f"{view}/save").json["id"]

    assert "no two frames are still" in answers[0]["note"]
    assert not answers[0]["is_enough"]
    drawn = [each for each in answers if each.get("curve")]
    assert "<svg" in drawn[0]["curve"]
    assert answers[-1]["counts"].startswith("14 frames, 13 pairs used")
    camera = client.finished(saved)
    assert camera["state"] == "done"
    kept = client.ask("GET", f"/api/cameras/{saved}/camera.json").json
    (channel,) = kept["channels"]
    truth = named_curve("srgb").inverse(np.linspace(0, 1, 256))
    assert np.sqrt(np.mean((channel["inverse_lut"] - truth) ** 2)) < 0.03
    assert kept["method"] == "nlf"
    assert any("14 frames, 13 pairs used" in text for text in kept["provenance"]["remarks"])


def test_a_new_start_forgets(client: Client) -> None:
    frames = luma(3)
    for _ in range(2):
        view = begun(client)
        answers = [
            client.ask("POST", f"{view}/frames?{SHAPE}&until=0", each).json for each in frames
        ]
        assert answers[-1]["counts"].startswith("3 frames, 2 pairs used")


def test_before_the_camera_was_started(client: Client) -> None:
    view = "/api/live/1"
    assert client.ask("POST", f"{view}/frames?{SHAPE}&until=0", luma(2)[0]).status == 404
    assert client.ask("POST", f"{view}/save").status == 404
    assert "there are no frames yet" in client.ask("POST", f"{begun(client)}/save").error


def test_two_pages_of_one_browser_do_not_mix_their_frames(client: Client) -> None:
    frames = luma(3)
    first, second = begun(client), begun(client)
    for each in frames:
        assert client.ask("POST", f"{first}/frames?{SHAPE}&until=0", each).status == 404
    answers = [client.ask("POST", f"{second}/frames?{SHAPE}&until=0", each) for each in frames]

    assert answers[-1].json["counts"].startswith("3 frames, 2 pairs used")


def test_frames_at_once_are_read_one_after_the_other(client: Client) -> None:
    """A page sends the next when the last was counted; who sends more holds no more memory."""
    view, (one, other) = begun(client), luma(2)
    path = f"{view}/frames?{SHAPE}&until=0"
    with ThreadPoolExecutor(20) as threads:
        answers = list(threads.map(lambda each: client.ask("POST", path, each), 10 * [one, other]))

    assert {each.status for each in answers} == {200}
    numbers = [int(each.json["counts"].split()[0]) for each in answers]
    assert sorted(numbers) == list(range(1, 21))


@pytest.mark.slow
def test_frames_that_never_end_are_not_all_held(client: Client) -> None:
    """However often the camera is started anew: the second waits in the browser."""
    size = 30_000_000
    shape = f"width={size}&height=1&kind=luma&full=1&until=0"
    with ExitStack() as open_ones:
        for is_read in (True, False):
            line = f"POST {begun(client)}/frames?{shape}"
            connection = open_ones.enter_context(client.begun(line, size, b""))
            connection.settimeout(1)
            with contextlib.nullcontext() if is_read else pytest.raises(TimeoutError):
                connection.sendall(bytes(size - 1))


@pytest.mark.parametrize(
    ("query", "content", "status"),
    [
        ("", b"", 400),
        ("width=a&height=1&kind=luma&full=1&until=0", b"1", 400),
        ("width=-1&height=-1&kind=luma&full=1&until=0", b"1", 413),
        ("width=60000&height=60000&kind=luma&full=1&until=0", b"1", 413),
        ("width=2&height=2&kind=luma&full=1&until=0", b"1", 422),
        ("width=2&height=2&kind=luma&full=1&until=0", b"12345", 413),
        ("width=2&height=2&kind=nv12&full=1&until=0", b"1234", 422),
        (f"{SHAPE}&until=0", b"1", 422),
    ],
)
def test_frames_that_are_not_what_they_say(
    client: Client, query: str, content: bytes, status: int
) -> None:
    answer = client.ask("POST", f"{begun(client)}/frames?{query}", content)

    assert answer.status == status
    assert answer.error


def test_a_camera_that_changes_its_size(client: Client) -> None:
    view = begun(client)
    client.ask("POST", f"{view}/frames?{SHAPE}&until=0", luma(2)[0])
    answer = client.ask("POST", f"{view}/frames?width=2&height=2&kind=luma&full=1&until=0", b"1234")

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
    with pytest.raises(ImageError, match="size differs"):
        frame_of(bytes(7), Shape(2, 1, "rgba", is_full=True))
