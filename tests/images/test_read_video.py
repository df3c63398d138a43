import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from handmade import Pixels
from videos import grey_planes, write_video

from chartless.errors import ImageError
from chartless.frames.frame import Frame
from chartless.images import is_video, read_video

LIMITED, FULL = 1, 2


@pytest.fixture
def noise(rng: np.random.Generator) -> Pixels:
    """Three frames of every level, of odd size."""
    return rng.integers(0, 256, (3, 33, 47), dtype=np.uint8)


def frames(path: Path, **how: Any) -> list[Frame]:
    return [frame for _, frame in read_video(path, **how)]


def refusal(path: Path, **how: Any) -> str:
    with pytest.raises(ImageError) as caught:
        frames(path, **how)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{path}: ")


# Luma


@pytest.mark.parametrize(
    ("tag", "expected", "white"),
    [(LIMITED, lambda y: np.clip(y, 16, 235) - 16, 219), (FULL, lambda y: y, 255)],
    ids=["limited", "full"],
)
def test_luma_is_the_plane(
    tag: int, expected: Any, white: int, noise: Pixels, tmp_path: Path
) -> None:
    path = write_video(tmp_path / "a.mkv", map(grey_planes, noise), colour_range=tag)

    read = frames(path)

    for frame, luma in zip(read, noise, strict=True):
        assert np.array_equal(frame.levels[..., 0], expected(luma))
        assert frame.levels.dtype == np.uint8
        assert (frame.white, frame.channel_names, frame.path) == (white, ("Y",), path)
    low = 16 if tag == LIMITED else 0
    assert read[0].remarks == (
        f"Y′ read as stored, without chroma; 8 bits, black {low}, white {low + white}",
    )


@pytest.mark.parametrize(("bits", "white"), [(10, 876), (12, 3504)])
def test_luma_of_more_bits_is_the_plane(
    bits: int, white: int, tmp_path: Path, rng: np.random.Generator
) -> None:
    luma = rng.integers(0, 2**bits, (2, 32, 48), dtype=np.uint16)
    path = write_video(
        tmp_path / "a.mkv",
        (grey_planes(each, 1 << (bits - 1)) for each in luma),
        pixels=f"yuv420p{bits}le",
        colour_range=LIMITED,
    )

    for frame, each in zip(frames(path), luma, strict=True):
        black = 16 << (bits - 8)
        assert np.array_equal(frame.levels[..., 0], np.clip(each, black, black + white) - black)
        assert (frame.white, frame.bit_depth) == (white, bits)


@pytest.mark.parametrize(("pixels", "place"), [("yuyv422", 0), ("uyvy422", 1)])
def test_luma_of_packed_pixels_is_unpacked(
    pixels: str, place: int, tmp_path: Path, rng: np.random.Generator
) -> None:
    packed = rng.integers(0, 256, (2, 32, 48, 2), dtype=np.uint8)
    path = write_video(
        tmp_path / "a.nut", ((each,) for each in packed), pixels=pixels, codec="rawvideo"
    )

    for frame, each in zip(frames(path), packed, strict=True):
        luma = each[..., place].astype(int)
        assert np.array_equal(frame.levels[..., 0], np.clip(luma, 16, 235) - 16)


def test_grey_is_of_full_range(noise: Pixels, tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mkv", ((each,) for each in noise), pixels="gray")

    for frame, each in zip(frames(path, colour=True), noise, strict=True):
        assert np.array_equal(frame.levels[..., 0], each)


def test_untagged_range_is_assumed_with_a_remark(noise: Pixels, tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mkv", map(grey_planes, noise), colour_range=0)

    (remark,) = frames(path)[0].remarks

    assert remark.endswith("black 16, white 235 (assumed: not recorded in the video)")


# Colours


# R, G, B of the primaries and greys at 8 bits of limited range, by the matrices of BT.601-7
# (2.5.1), BT.709-6 (3.2 … 3.4) and BT.2020-2 (table 4), rounded to samples.
WEIGHTS = {6: (0.299, 0.587, 0.114), 1: (0.2126, 0.7152, 0.0722), 9: (0.2627, 0.6780, 0.0593)}
NAMES = {6: "BT.601", 1: "BT.709", 9: "BT.2020"}


def encoded(rgb: Pixels, weights: tuple[float, ...], bits: int) -> Pixels:
    """Y′, C′B, C′R samples of limited range, shape (…, 3)."""
    luma = rgb @ np.array(weights)
    cb = (rgb[..., 2] - luma) / (2 * (1 - weights[2]))
    cr = (rgb[..., 0] - luma) / (2 * (1 - weights[0]))
    scale = 2 ** (bits - 8)
    samples = np.stack([219 * luma + 16, 224 * cb + 128, 224 * cr + 128], axis=-1) * scale
    return np.rint(samples).astype(np.uint8 if bits == 8 else np.uint16)


@pytest.mark.parametrize("matrix", WEIGHTS)
@pytest.mark.parametrize(("bits", "pixels"), [(8, "yuv444p"), (10, "yuv444p10le")])
def test_colours_follow_the_tagged_matrix(
    matrix: int, bits: int, pixels: str, tmp_path: Path, rng: np.random.Generator
) -> None:
    rgb = rng.uniform(size=(32, 48, 3))
    rgb[:2, :2] = [[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 1]]]
    planes = tuple(np.moveaxis(encoded(rgb, WEIGHTS[matrix], bits), -1, 0))
    path = write_video(
        tmp_path / "a.mkv", [planes], pixels=pixels, colour_range=LIMITED, matrix=matrix
    )

    (frame,) = frames(path, colour=True)

    top = 2**bits - 1
    assert (frame.white, frame.channel_names) == (top, ("R", "G", "B"))
    # Rounding of luma by half a sample, of chroma times up to 2 (1 - 0.0593).
    assert np.abs(frame.levels - rgb * top).max() <= 0.5 + 255 / 219 / 2 + 1.9 * 255 / 224 / 2
    assert abs(float((frame.levels - rgb * top).mean())) < 0.1
    assert frame.remarks[0].startswith(f"R′G′B′ computed from Y′CbCr by {NAMES[matrix]}; {bits} b")


def test_a_chroma_sample_stands_for_the_pixels_that_share_it(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    luma = np.full((32, 48), 120, dtype=np.uint8)
    chroma = rng.integers(90, 160, (2, 16, 24), dtype=np.uint8)
    path = write_video(tmp_path / "a.mkv", [(luma, *chroma)], colour_range=FULL, matrix=1)

    (frame,) = frames(path, colour=True)

    blocks = frame.levels.reshape(16, 2, 24, 2, 3)
    assert np.array_equal(blocks, np.broadcast_to(blocks[:, :1, :, :1], blocks.shape))
    assert len(np.unique(blocks[:, 0, :, 0], axis=0)) > 1


@pytest.mark.parametrize(("lines", "matrix"), [(718, "BT.601"), (720, "BT.709")])
def test_matrix_of_an_untagged_video_is_assumed_by_its_lines(
    lines: int, matrix: str, tmp_path: Path
) -> None:
    path = write_video(tmp_path / "a.mkv", [grey_planes(np.full((lines, 16), 99, np.uint8))])

    (remark,) = frames(path, colour=True)[0].remarks

    assert f"by {matrix} (assumed from its {lines} lines: not recorded in the video)" in remark


def test_a_strange_matrix_is_refused_for_colours_alone(noise: Pixels, tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mkv", map(grey_planes, noise), matrix=8)

    assert refusal(path, colour=True).startswith("stores its colours by the matrix 8 of H.273")
    assert len(frames(path)) == 3


@pytest.mark.parametrize("colour", [True, False])
def test_stored_colours_come_back(colour: bool, tmp_path: Path, rng: np.random.Generator) -> None:
    stored = rng.integers(0, 256, (32, 48, 4), dtype=np.uint8)  # blue, green, red, nothing
    path = write_video(tmp_path / "a.mkv", [(stored,)], pixels="bgr0")

    (frame,) = frames(path, colour=colour)

    assert np.array_equal(frame.levels, stored[..., 2::-1])
    assert frame.white == 255


# What else a video tells


def test_times_are_those_of_the_frames(noise: Pixels, tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mkv", map(grey_planes, noise), times=[0, 40, 250])

    assert [time for time, _ in read_video(path)] == [0.0, 0.04, 0.25]


@pytest.mark.parametrize(
    ("matrix", "orientation"),
    [((0, 1, -1, 0), 6), ((-1, 0, 0, -1), 3), ((0, -1, 1, 0), 8), ((1, 0, 0, 1), 1)],
)
def test_rotation_is_the_orientation(
    matrix: tuple[int, ...], orientation: int, noise: Pixels, tmp_path: Path
) -> None:
    path = write_video(tmp_path / "a.mp4", map(grey_planes, noise), codec="mpeg4")
    a, b, c, d = (each << 16 for each in matrix)
    # ISO/IEC 14496-12, 6.2.2: a b u, c d v, x y w. The header of the track has the last one.
    parts = path.read_bytes().rpartition(display_matrix(1 << 16, 0, 0, 1 << 16))
    path.write_bytes(parts[0] + display_matrix(a, b, c, d) + parts[2])

    assert frames(path)[0].orientation == orientation


def display_matrix(a: int, b: int, c: int, d: int) -> bytes:
    rows = (a, b, 0, c, d, 0, 0, 0, 1 << 30)
    return b"".join(each.to_bytes(4, "big", signed=True) for each in rows)


# Refusals


def test_interlaced_video_is_refused(noise: Pixels, tmp_path: Path) -> None:
    path = write_video(
        tmp_path / "a.mkv",
        (grey_planes(np.tile(each[:32, :32], (2, 2))) for each in noise),
        codec="libx264",
        options={"qp": "0", "x264-params": "tff=1"},
    )

    assert refusal(path).startswith("is interlaced: the lines of a frame are from two moments")


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.mp4", b"", "is empty"),
        ("a.mp4", b"Dear diary, " * 99, "is damaged or no video"),
        ("a.mkv", bytes(999), "is damaged or no video"),
    ],
)
def test_what_is_no_video_is_refused(
    name: str,
    content: bytes,
    reason: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / name
    path.write_bytes(content)

    assert refusal(path).startswith(reason)
    assert capfd.readouterr() == ("", "")


def test_a_missing_video_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "a.mp4") == "does not exist: check the name"


@pytest.mark.skipif(sys.platform != "linux", reason="others have no such names")
def test_a_missing_webcam_is_refused() -> None:
    assert refusal(Path("/dev/video-none")).startswith("gives no pictures (No such file")


def test_a_damaged_video_is_refused(
    tmp_path: Path, rng: np.random.Generator, capfd: pytest.CaptureFixture[str]
) -> None:
    luma = rng.integers(0, 256, (5, 64, 64), dtype=np.uint8)
    path = write_video(
        tmp_path / "a.mp4", map(grey_planes, luma), codec="libx264", options={"qp": "0"}
    )
    data = bytearray(path.read_bytes())
    start = data.index(b"mdat") + 1200
    for place in range(start, start + 15000, 37):
        data[place] ^= 0xFF
    path.write_bytes(data)

    assert "is damaged" in refusal(path)
    assert capfd.readouterr() == ("", "")


def test_a_video_cut_short_is_refused(noise: Pixels, tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mp4", map(grey_planes, noise), codec="mpeg4")
    path.write_bytes(path.read_bytes()[:-500])  # its index stands at the end

    assert refusal(path).startswith("is damaged or no video")


@pytest.mark.slow
def test_without_pyav_one_line_says_what_to_install(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_bytes(b"video")
    program = (
        "import sys; sys.modules['av'] = None\n"
        "from chartless.cli import main\n"
        f"raise SystemExit(main(['calibrate', {str(path)!r}]))"
    )

    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=tmp_path
    )

    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"chartless: error: {path}: is a video, which needs PyAV: "
        "in the folder of chartless, run pip install '.[video]'\n"
    )


def test_reading_pictures_does_not_import_pyav() -> None:
    program = "import sys, chartless.images; raise SystemExit('av' in sys.modules)"

    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


@pytest.mark.parametrize(
    ("name", "expected"),
    [("a.mp4", True), ("A.MOV", True), ("/dev/video0", True), ("a.png", False), ("mp4", False)],
)
def test_videos_are_known_by_their_names(name: str, expected: bool) -> None:
    assert is_video(name) == expected


@pytest.mark.parametrize("name", ["cut.mkv", "cut.avi"])
def test_a_video_that_was_cut_short_is_refused(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    shots = [grey_planes(rng.integers(16, 236, (48, 64), dtype=np.uint8)) for _ in range(75)]
    whole = write_video(tmp_path / name, shots)
    assert len(list(read_video(whole))) == 75

    content = whole.read_bytes()
    whole.write_bytes(content[: len(content) // 3])

    with pytest.raises(ImageError, match=r"ends after frame \d+, before its time|is damaged"):
        list(read_video(whole))
