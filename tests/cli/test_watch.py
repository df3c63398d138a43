"""``chartless watch``: videos of cameras that run, move and change, with and without a terminal."""

import hashlib
import inspect
import json
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator, Sequence
from fcntl import ioctl
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyte
import pytest
from videos import grey_planes, write_video

from chartless import AffineNoise, load, named_curve, rmse
from chartless.cli._drawing import drawn_curves
from chartless.cli.watch import watch
from chartless.curves import SampledCurve
from chartless.frames.frame import TimedFrame
from chartless.images import read_video
from chartless.live import LEAST, WINDOW
from chartless.result.response import Response, Status
from chartless.result.verdict import WORST_BAND
from chartless.simulate import simulate_frames

Pixels = npt.NDArray[Any]
Chartless = Callable[..., Any]
Refusal = Callable[..., str]
Shoot = Any  # conftest.Shoot
Record = Callable[..., Path]
CURVE, NOISE = named_curve("srgb"), AffineNoise.of_sensor(1_500, 5)


@pytest.fixture
def record(tmp_path: Path, shoot: Shoot) -> Record:
    """Record scenes, a frame of each, as a video of limited range without loss."""
    scene = shoot.scene()[..., 0]

    def record_as(
        shown: Callable[[Pixels, int], Pixels] = lambda scene, _: scene,
        *,
        n_frames: int = 30,
        name: str = "clip.mkv",
        **how: Any,
    ) -> Path:
        rng = np.random.default_rng(4)

        def planes() -> Iterator[tuple[Pixels, ...]]:
            for number in range(n_frames):
                light = shown(scene, number)
                (levels,) = simulate_frames(light, CURVE, NOISE, n_frames=1, bit_depth=16, seed=rng)
                yield grey_planes(np.rint(16 + 219 * (levels / 65535)).astype(np.uint8))

        return write_video(tmp_path / name, planes(), **{"colour_range": 1} | how)

    return record_as


def dim(scene: Pixels, _: int) -> Pixels:
    """Shows too little of the range for a curve that is good enough."""
    return 0.45 * scene


# The result


@pytest.mark.slow
def test_watching_stops_when_the_curve_is_good_enough(
    record: Record, chartless: Chartless, tmp_path: Path
) -> None:
    clip, camera = record(), tmp_path / "camera.json"

    done = chartless("watch", clip, "-o", camera)

    assert done.status == 0, done.err
    assert f"good enough after {LEAST + 1} frames" in done.err
    assert f"calibration of {LEAST + 1} frames written to {camera}" in done.out
    calibration = load(camera)
    response = calibration.channel("Y")
    assert rmse(response.curve, CURVE) < 0.02
    assert (response.method, response.n_levels) == ("nlf", 220)
    assert calibration.provenance["inputs"] == [
        {
            "file": str(clip),
            "sha256": hashlib.sha256(clip.read_bytes()).hexdigest(),
            "frames": [1, LEAST + 1],
            "used": LEAST + 1,
        }
    ]


def test_it_stops_at_what_a_verdict_does_not_distrust() -> None:
    known = inspect.signature(watch).parameters

    assert (known["until"].default, known["window"].default) == (WORST_BAND, WINDOW)


@pytest.mark.slow
def test_what_is_not_good_enough_is_saved_with_another_status(
    record: Record, chartless: Chartless, tmp_path: Path
) -> None:
    done = chartless("watch", record(dim, n_frames=15), "-o", tmp_path / "camera.json")

    assert done.status == 3, done.err
    assert "the video ended: not good enough yet: the error is above ± 0.045" in done.err
    assert "15 frames, 14 pairs used\n" in done.err
    assert load(tmp_path / "camera.json").channel("Y").n_pairs == 14 * 192 * 256


@pytest.mark.slow
def test_a_narrower_band_may_be_wanted_and_none_may(record: Record, chartless: Chartless) -> None:
    clip = record(n_frames=15)

    assert chartless("watch", clip, "--until", 0.044).status == 0
    assert chartless("watch", clip, "--until", 0.03).status == 3
    never = chartless("watch", record(name="all.mkv"), "--until", 0, "--json")
    assert never.status == 3
    assert never.json["provenance"]["inputs"][0]["frames"] == [1, 30]


@pytest.mark.slow
def test_one_video_gives_one_result(record: Record, chartless: Chartless) -> None:
    clip = record(dim, n_frames=25)

    first, second = (chartless("watch", clip, "--json").json for _ in range(2))

    for each in (first, second):
        del each["provenance"]["created"]
    assert first == second


@pytest.mark.slow
def test_json_is_the_calibration(record: Record, chartless: Chartless, tmp_path: Path) -> None:
    camera = tmp_path / "camera.json"

    done = chartless("watch", record(), "--json", "-o", camera)

    assert done.json == json.loads(camera.read_text(encoding="utf-8"))


@pytest.mark.slow
def test_a_window_forgets(record: Record, chartless: Chartless) -> None:
    done = chartless("watch", record(), "--window", 10, "--until", 0, "--json")

    assert done.json["provenance"]["inputs"][0]["used"] <= 11
    assert done.json["provenance"]["settings"]["window"] == 10


@pytest.mark.slow
def test_colours_are_watched_on_request(record: Record, chartless: Chartless) -> None:
    done = chartless("watch", record(), "--channels", "rgb", "--json")

    assert [each["name"] for each in done.json["channels"]] == ["R", "G", "B"]


@pytest.mark.slow
def test_a_report_is_written(record: Record, chartless: Chartless, tmp_path: Path) -> None:
    report = tmp_path / "camera.html"

    done = chartless("watch", record(), "--report", report)

    assert done.out.endswith(f"\nreport written to {report}\n")
    assert "11 pictures" in report.read_text(encoding="utf-8")


@pytest.mark.slow
def test_what_moves_is_left_out(record: Record, chartless: Chartless) -> None:
    def carried(scene: Pixels, number: int) -> Pixels:
        return np.roll(scene, 4 * min(number, 5), axis=1)

    done = chartless("watch", record(carried))

    assert done.status == 0, done.err
    assert "left out: something moved 5×" in done.err
    assert f"good enough after {5 + LEAST + 1} frames" in done.err


@pytest.mark.slow
def test_compressed_video_is_never_good_enough(record: Record, chartless: Chartless) -> None:
    clip = record(name="clip.mp4", codec="libx264", options={"crf": "20"})

    done = chartless("watch", clip, "--until", 1)

    assert done.status == 3
    assert "do not trust: A curve and its noise do not explain the pictures: " in done.out


@pytest.mark.slow
def test_off_a_terminal_a_line_says_how_it_goes(
    record: Record, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chartless.cli.watch._REPRINTED", 0.0)

    done = chartless("watch", record())

    lines = re.findall(r"note: \d+ s: (.*)", done.err)
    assert len(lines) == LEAST + 1
    assert lines[0].endswith("(there is only one): put the camera on a tripod in front of a still "
                             "scene in steady light")  # fmt: skip
    assert lines[-1].startswith("11 frames, 10 pairs used; ")
    assert "The curve is known to ± 0.0" in lines[-1]


# Interruption


@pytest.fixture
def interrupted(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Ctrl-C after so many frames."""

    def interrupt_after(n_frames: int) -> None:
        def read_some(path: Path, *, colour: bool) -> Iterator[TimedFrame]:
            for number, timed in enumerate(read_video(path, colour=colour)):
                if number == n_frames:
                    raise KeyboardInterrupt
                yield timed

        monkeypatch.setattr("chartless.images.read_video", read_some)

    return interrupt_after


def test_ctrl_c_saves_what_there_is(
    record: Record, chartless: Chartless, tmp_path: Path, interrupted: Callable[[int], None]
) -> None:
    clip, camera = record(), tmp_path / "camera.json"
    interrupted(6)

    done = chartless("watch", clip, "-o", camera)

    assert done.status == 3, done.err
    assert "stopped by Ctrl-C: not good enough yet" in done.err
    assert f"calibration of 6 frames written to {camera}" in done.out
    assert load(camera).channel("Y").n_pairs == 5 * 192 * 256


@pytest.mark.parametrize(
    ("n_frames", "says"), [(0, "there are no frames yet"), (1, "no two frames are still")]
)
def test_ctrl_c_before_there_is_anything_saves_nothing(
    n_frames: int,
    says: str,
    record: Record,
    refusal: Refusal,
    interrupted: Callable[[int], None],
) -> None:
    clip = record(n_frames=3)
    camera = clip.with_name("camera.json")
    interrupted(n_frames)

    assert says in refusal("watch", clip, "-o", camera)
    assert not camera.exists()


# Refusals


@pytest.mark.parametrize(
    ("device", "says"),
    [
        ("/dev/video99", "/dev/video99: gives no pictures (No such file or directory): check"),
        ("none.mkv", "none.mkv: does not exist"),
        ("a.png", "a.png is neither a video nor a camera such as /dev/video0: name one"),
    ],
)
def test_what_is_no_camera_is_refused(device: str, says: str, refusal: Refusal) -> None:
    assert says in refusal("watch", device)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["-o", "clip.mkv"], "clip.mkv is the video and would be overwritten"),
        (["-o", "missing/a.json"], "does not exist: create it first"),
        (["--report", "a.pdf"], "a report is a page: name it .html"),
        (["-o", "a.html", "--report", "a.html"], "cannot be both calibration and report"),
        (["--window", "9"], "--window"),
        (["--until", "-1"], "--until"),
        (["--channels", "hsv"], "channels must be one of auto, rgb, luma, not 'hsv'"),
    ],
)
def test_bad_options_are_refused_before_anything_is_written(
    options: list[str],
    says: str,
    record: Record,
    refusal: Refusal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clip = record(n_frames=3)
    content = clip.read_bytes()
    monkeypatch.chdir(clip.parent)

    assert says in refusal("watch", clip.name, *options)

    assert [each.name for each in clip.parent.iterdir()] == [clip.name]
    assert clip.read_bytes() == content


# On a terminal


class Terminal:
    """Runs the program in a terminal of 80 × 24 characters, and looks at it."""

    def __init__(self, *arguments: object, **environment: str) -> None:
        self.screen = pyte.Screen(80, 24)
        self._stream = pyte.ByteStream(self.screen)
        self.seen: list[str] = []
        """What stood on the screen after each thing that was written."""
        self._end, theirs = pty.openpty()
        ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        unset = {"NO_COLOR", "COLUMNS", "LINES", "FORCE_COLOR"}
        kept = {name: value for name, value in os.environ.items() if name not in unset}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "chartless", *map(str, arguments)],
            stdin=theirs,
            stdout=subprocess.PIPE,
            stderr=theirs,
            text=True,
            env=kept | {"TERM": "xterm-256color"} | environment,
            start_new_session=True,
            # Background jobs of a shell ignore Ctrl-C, and so would what they start.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509
        )
        os.close(theirs)

    def follow(self, on_screen: Callable[[str], None] = lambda _: None) -> tuple[int, str]:
        """Look until the program ends; its status and standard output."""
        while True:
            try:
                told = os.read(self._end, 1 << 16)
            except OSError:  # Linux says so at the end
                told = b""
            if not told:
                break
            self._stream.feed(told)
            self.seen.append("\n".join(line.rstrip() for line in self.screen.display))
            on_screen(self.seen[-1])
        out, _ = self.process.communicate(timeout=60)
        os.close(self._end)
        return self.process.returncode, out


BRAILLE = re.compile("[\u2801-\u28ff]")


@pytest.mark.slow
def test_a_terminal_shows_curve_table_and_verdict(record: Record) -> None:
    def carried(scene: Pixels, number: int) -> Pixels:
        return np.roll(0.7 * scene, 4 * min(number, 3), axis=1)

    terminal = Terminal("watch", record(carried, n_frames=150), "--until", "0.03")
    status, out = terminal.follow()

    assert status == 3
    (*_, last) = (each for each in terminal.seen if "Stops at ± 0.03, or at Ctrl-C." in each)
    lines = last.splitlines()
    assert lines[0].startswith("chartless watch ")
    assert lines[1].startswith("1 │")
    assert len(BRAILLE.findall(last)) > 50
    assert any(line.startswith("0 └───") for line in lines)
    assert re.search(r"Y +\d+ to \d+ +± 0\.0\d\d", last)
    assert "left out: something moved 3×" in " ".join(last.split())
    assert "usable with care: The curve is known to" in last
    # The curve stays on the screen, and the result goes to standard output.
    assert BRAILLE.search(terminal.seen[-1])
    assert out.startswith("channel ")


@pytest.mark.slow
def test_a_terminal_without_colours_or_unicode_is_enough(record: Record) -> None:
    terminal = Terminal("watch", record(dim, n_frames=100), NO_COLOR="1", PYTHONIOENCODING="ascii")
    terminal.follow()

    (*_, last) = (each for each in terminal.seen if "Ctrl-C." in each)
    assert last.count("*") > 50
    assert "0 +-----" in last
    assert not BRAILLE.search(last)


@pytest.mark.slow
def test_ctrl_c_on_a_terminal_saves_and_leaves_it_in_order(record: Record, tmp_path: Path) -> None:
    camera = tmp_path / "camera.json"
    terminal = Terminal("watch", record(dim, n_frames=1500), "-o", camera)

    def stop(screen: str) -> None:
        if "Ctrl-C." in screen and "levels seen" in screen and not stopped:
            terminal.process.send_signal(signal.SIGINT)
            stopped.append(time.monotonic())

    stopped: list[float] = []
    status, out = terminal.follow(stop)

    assert stopped
    assert status == 3
    # How many frames came before, and so why it is not enough, is a matter of speed.
    assert "stopped by Ctrl-C: not good enough" in " ".join(terminal.seen[-1].split())
    assert f"written to {camera}" in out
    (source,) = load(camera).provenance["inputs"]
    assert 2 <= source["frames"][1] < 1500
    assert not terminal.screen.cursor.hidden


# The drawing


def drawn(channels: Sequence[Response], **how: Any) -> list[str]:
    return drawn_curves(channels, 44, 12, **how).plain.splitlines()


def camera(curve: Any, std: float | None = None, name: str = "Y") -> Response:
    return Response(
        name=name,
        curve=curve,
        noise=None,
        n_levels=256,
        observed_levels=(0, 255),
        n_pairs=1,
        method="nlf",
        status=Status.CONVERGED,
        inverse_lut_std=None if std is None else np.full(256, std),
    )


LINE = SampledCurve((0.0, 1.0), (0.0, 1.0))


def test_a_drawing_has_its_size_and_a_line_is_a_diagonal() -> None:
    lines = drawn([camera(LINE)], ascii_only=True)

    assert len(lines) == 12
    assert {len(line) for line in lines[:11]} == {43}
    for row, line in enumerate(lines[:10]):
        assert [place for place, mark in enumerate(line[3:]) if mark == "*"] == list(
            range(36 - 4 * row, 40 - 4 * row)
        )


def test_dots_of_braille_are_where_the_curve_is() -> None:
    """A step from black to white in the middle: black, a vertical line, white."""
    step = SampledCurve((0.0, 0.5, 0.5 + 1e-9, 1.0), (0.0, 0.0, 1.0, 1.0))

    lines = [line[3:] for line in drawn([camera(step)])[:10]]

    assert set(lines[0][21:]) == {"⠉"}
    assert set(lines[9][:19]) == {"⣀"}
    assert all(BRAILLE.search(line[19:21]) for line in lines)
    assert not BRAILLE.search("".join(line[:19] + line[21:] for line in lines[1:9]))


def test_a_band_is_as_wide_as_it_is() -> None:
    lines = drawn([camera(LINE, 0.1)], ascii_only=True)

    assert lines[5][3:].count(":") == pytest.approx(2 * 0.1 * 40, abs=2)
    assert drawn([camera(LINE)]) != drawn([camera(LINE, 0.1)])


def test_colours_mark_channels_where_they_are_alone() -> None:
    channels = [camera(named_curve("gamma:0.4"), name="R"), camera(LINE, name="B")]

    text = drawn_curves(channels, 44, 12)

    styles = {str(span.style) for span in text.spans}
    assert {"red", "blue"} <= styles
    assert "green" not in styles


def test_without_channels_the_axes_are_drawn() -> None:
    assert not BRAILLE.search("".join(drawn([])))
