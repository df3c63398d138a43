"""Responses of OpenCV: files that it wrote, and files like them with faults."""

import hashlib
import json
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from chartless.errors import CalibrationFileError
from chartless.flags import Flag
from chartless.formats import OpenCv, import_response, is_calibration
from chartless.formats._base import MOST_BYTES, Source
from chartless.formats.calibration_file import load, save

Floats = npt.NDArray[np.float64]
LEVELS = np.arange(256)
GAMMAS = np.array([2.0, 2.2, 2.4])
"""Of blue, green and red."""
LANGUAGES = ("yml", "xml", "json")


def table(n_channels: int = 3) -> Floats:
    """Irradiance at the levels, 1 at level 128, blue first, shape (256, n)."""
    return ((LEVELS[:, np.newaxis] + 0.5) / 128.5) ** GAMMAS[:n_channels]


def number(value: float) -> str:
    if np.isfinite(value):
        return f"{value:.9g}" if value % 1 else f"{value:.0f}."
    return ".Nan" if np.isnan(value) else ".Inf" if value > 0 else "-.Inf"


def text_of(suffix: str, dt: str = "3f", n_rows: int = 256, **nodes: Floats) -> str:
    """Text as FileStorage writes it."""
    if suffix == "json":
        parts = [
            f'"{name}": {{"type_id": "opencv-matrix", "rows": {n_rows}, "cols": 1, "dt": "{dt}", '
            f'"data": [{", ".join(re.sub("[.]$", ".0", number(v)) for v in values.ravel())}]}}'
            for name, values in nodes.items()
        ]
        return "{\n" + ",\n".join(parts) + "\n}\n"
    if suffix == "xml":
        parts = [
            f'<{name} type_id="opencv-matrix">\n<rows>{n_rows}</rows><cols>1</cols>'
            f'<dt>"{dt}"</dt>\n<data>\n{" ".join(map(number, values.ravel()))}</data></{name}>\n'
            for name, values in nodes.items()
        ]
        return f'<?xml version="1.0"?>\n<opencv_storage>\n{"".join(parts)}</opencv_storage>\n'
    parts = [
        f'{name}: !!opencv-matrix\n   rows: {n_rows}\n   cols: 1\n   dt: "{dt}"\n'
        f"   data: [ {(',' + chr(10) + '       ').join(map(number, values.ravel()))} ]\n"
        for name, values in nodes.items()
    ]
    return "%YAML:1.0\n---\n" + "".join(parts)


def written(folder: Path, text: str, name: str = "crf.yml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(path: Path) -> str:
    with pytest.raises(CalibrationFileError) as caught:
        import_response(path, "opencv")
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert len(message) < len(str(path)) + 200
    return message


# What OpenCV wrote


@pytest.mark.parametrize("name", ["opencv5_response.yml", "opencv5_response.xml"])
def test_a_file_of_opencv(name: str, data_path: Path) -> None:
    path = data_path / "format_samples" / name
    numbers = re.findall(r"\d\.\d+(?:e-?\d+)?", path.read_text().partition("data")[2])
    bgr = np.array(numbers, dtype=float)[-768:].reshape(256, 3)

    camera = import_response(path)

    assert is_calibration(path)
    assert [each.name for each in camera.channels] == ["R", "G", "B"]
    for response, column in zip(camera.channels, bgr.T[::-1], strict=True):
        wanted = np.maximum.accumulate(column)[1:]
        assert response.inverse_lut[0] == 0
        assert response.inverse_lut[1:] == pytest.approx(wanted / wanted[-1], abs=1e-8)
        assert (response.method, response.noise, response.observed_levels) == (
            "opencv", None, (0, 255),
        )  # fmt: skip
        falls = bool(np.any(np.diff(column) < 0))
        assert response.flags == ((Flag.NOT_MONOTONE,) if falls else ())
    assert camera.bit_depth == 8
    assert camera.provenance["inputs"] == [
        {"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    ]


def test_matrices_of_few_rows_are_no_response(data_path: Path) -> None:
    for name in ("opencv413_tiny.yml", "opencv413_nan_grey.yml"):
        path = data_path / "format_samples" / name

        assert is_calibration(path)
        assert "holds no response: give a matrix of 256 × 1" in refused(path)


def test_gaps_as_opencv_writes_them(data_path: Path, tmp_path: Path) -> None:
    """The sample's first numbers, .Nan and .Inf among them, at the head of a full table."""
    sample = (data_path / "format_samples" / "opencv413_nan_grey.yml").read_text()
    first = sample.rpartition("[")[2].partition("]")[0].replace(",", " ").split()
    text = text_of("yml", response=table())
    for old, new in zip(map(number, table().ravel()[:6]), first, strict=True):
        text = text.replace(old, new, 1)

    camera = import_response(written(tmp_path, text))

    assert [each.observed_levels for each in camera.channels] == [(0, 255), (0, 255), (2, 255)]
    assert [each.rpartition("channel ")[2][:12] for each in camera.provenance["remarks"]] == [
        "B: filled 2 ",
        "G: black had",
        "R: black had",
    ]


def test_files_of_other_programs_are_not_recognised(data_path: Path) -> None:
    others = [
        path
        for path in (data_path / "format_samples").iterdir()
        if not path.name.startswith("opencv")
    ]

    assert others
    assert not any(OpenCv().recognises(Source.read(path)) for path in others)


# What is read


@pytest.mark.parametrize("n_channels", [1, 3])
@pytest.mark.parametrize("suffix", LANGUAGES)
def test_each_language_gives_the_same_curve(suffix: str, n_channels: int, tmp_path: Path) -> None:
    dt = "3f" if n_channels == 3 else "f"
    path = written(tmp_path, text_of(suffix, dt, response=table(n_channels)), f"crf.{suffix}")

    camera = import_response(path)

    assert is_calibration(path)
    assert [each.name for each in camera.channels] == (["Y"] if n_channels == 1 else list("RGB"))
    wanted = table(n_channels).T[::-1]
    for response, column in zip(camera.channels, wanted, strict=True):
        assert response.inverse_lut[1:] == pytest.approx(column[1:] / column[-1], abs=1e-8)
    assert camera.provenance["remarks"] == []


@pytest.mark.parametrize("suffix", LANGUAGES)
def test_gaps_are_filled_by_lines_and_remarked_on(suffix: str, tmp_path: Path) -> None:
    values = table()
    values[100:110, 0] = np.nan
    values[250:, 0] = np.nan
    values[:3, 1] = np.inf
    path = written(tmp_path, text_of(suffix, response=values), "crf.txt")

    camera = import_response(path)

    blue, green = camera.channel("B"), camera.channel("G")
    column = np.interp(
        LEVELS, np.flatnonzero(np.isfinite(values[:, 0])), table()[np.isfinite(values[:, 0]), 0]
    )
    assert blue.inverse_lut[1:] == pytest.approx(column[1:] / column[-1], abs=1e-8)
    assert blue.inverse_lut[249:] == pytest.approx(1, abs=1e-8)
    assert blue.observed_levels == (0, 249)
    assert green.inverse_lut[:4] == pytest.approx(green.inverse_lut[3] * np.arange(4) / 3)
    assert green.observed_levels == (3, 255)
    assert camera.provenance["remarks"] == [
        f"{path}: channel B: filled 16 levels without value",
        f"{path}: channel G: filled 3 levels without value",
    ]


def test_a_curve_that_falls_is_held_and_flagged(tmp_path: Path) -> None:
    values = table()
    values[120, 2] = 0.1

    camera = import_response(written(tmp_path, text_of("yml", response=values)))

    red = camera.channel("R")
    assert red.flags == (Flag.NOT_MONOTONE,)
    assert red.inverse_lut[120] == pytest.approx(red.inverse_lut[119], abs=1e-8)
    assert camera.channel("G").flags == ()


def test_of_several_matrices_the_response_is_taken(tmp_path: Path) -> None:
    text = text_of("yml", other=table() ** 2, response=table())

    camera = import_response(written(tmp_path, text))

    assert camera.channel("B").inverse_lut[128] == pytest.approx((128.5 / 255.5) ** 2, abs=1e-6)


@pytest.mark.parametrize("suffix", LANGUAGES)
def test_matrices_of_other_kinds_do_not_disturb(suffix: str, tmp_path: Path) -> None:
    text = text_of(suffix, crf=table())
    other = text_of(suffix, "u", n_rows=2, size=np.array([5.0, 7.0]))
    join = {"yml": ("---\n", "---\n"), "xml": ("<opencv_storage>\n",) * 2, "json": ("{\n",) * 2}
    head, _, body = text.partition(join[suffix][0])
    node = other.partition(join[suffix][1])[2]
    node = {"yml": node, "xml": node.replace("</opencv_storage>\n", ""), "json": node[:-3] + ","}[
        suffix
    ]

    camera = import_response(written(tmp_path, head + join[suffix][0] + node + body))

    assert len(camera.channels) == 3


def test_a_matrix_of_many_dimensions(tmp_path: Path) -> None:
    text = text_of("yml", "f", response=table(1)).replace("opencv-matrix", "opencv-nd-matrix")
    text = text.replace("   rows: 256\n   cols: 1\n", "   sizes: [ 256 ]\n")

    assert import_response(written(tmp_path, text)).channel("Y").inverse_lut[-1] == 1


def test_line_ends_of_windows_and_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "crf.yml"
    text = text_of("yml", response=table())
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())

    assert is_calibration(path)
    assert len(import_response(path).channels) == 3


def test_it_is_kept_as_a_calibration_file(tmp_path: Path) -> None:
    camera = import_response(written(tmp_path, text_of("yml", response=table())))

    save(camera, tmp_path / "camera.json")

    again = load(tmp_path / "camera.json")
    for name in "RGB":
        lut = again.channel(name).inverse_lut
        assert lut == pytest.approx(camera.channel(name).inverse_lut, abs=1e-12)
    assert again.channels[0].method == "opencv"
    assert is_calibration(tmp_path / "camera.json")


# Refusals


@pytest.mark.parametrize("suffix", LANGUAGES)
def test_a_file_cut_short_is_refused(suffix: str, tmp_path: Path) -> None:
    text = text_of(suffix, response=table())

    for share in (0.3, 0.6, 0.9):
        line = refused(written(tmp_path, text[: int(share * len(text))]))
        assert "not a sound OpenCV response file: " in line


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("rows: 256", "rows: 255"), "should have 255 × 3 numbers, not 768"),
        (("rows: 256", "rows: many"), "not a sound OpenCV response file: invalid literal"),
        (("rows: 256\n", ""), "not a sound OpenCV response file: no 'rows'"),
        (('"3f"', '"3i"'), "holds no response: give"),
        (("data: [ ", "data: [ what, "), "not 769"),
        (("!!opencv-matrix", "!!map"), "holds no response: give"),
    ],
)
def test_damaged_yaml_is_refused(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    text = text_of("yml", response=table())
    assert change[0] in text

    assert message in refused(written(tmp_path, text.replace(*change, 1)))


def test_a_document_type_is_refused(tmp_path: Path) -> None:
    bomb = (
        '<?xml version="1.0"?>\n<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]>\n'
        '<opencv_storage><r type_id="opencv-matrix"><data>&b;</data></r></opencv_storage>'
    )

    assert "declares a document type, which OpenCV never writes" in refused(
        written(tmp_path, bomb, "crf.xml")
    )


def node_of(**fields: object) -> str:
    return json.dumps({"r": {"type_id": "opencv-matrix", "dt": "f", **fields}})


@pytest.mark.parametrize(
    "content",
    [
        '{"a": ' * 100_000,
        node_of(rows=256, cols=1),
        node_of(rows=256, cols=1, data=7),
        node_of(rows=1, cols=1, data=[[]]),
        node_of(rows=-1, cols=-1, data=[1]),
        node_of(rows=10**30, cols=10**30, data=[]),
        "%YAML:1.0\n---\nr: !!opencv-matrix\n" + "   data: [ \n" * 200_000,
        "<" * 1000,
        "",
    ],
    ids=[
        "deep", "no data", "number for data", "list for number", "negative", "huge", "many",
        "not XML", "empty",
    ],
)  # fmt: skip
def test_hostile_content_is_refused_in_one_line(content: str, tmp_path: Path) -> None:
    refused(written(tmp_path, content))


def test_a_file_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "crf.yml"
    with path.open("wb") as file:
        file.truncate(MOST_BYTES + 1)

    assert "larger than any response curve" in refused(path)
    assert not is_calibration(path)


def test_a_long_file_is_not_parsed(tmp_path: Path) -> None:
    path = written(
        tmp_path, text_of("xml", response=table()) + 200_000 * "<!-- and so on, and on -->"
    )

    assert "larger than any response of OpenCV" in refused(path)


def test_what_is_no_text_and_what_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "crf.yml").write_bytes(b"\xff\xfe\x00")

    assert "is not text" in refused(tmp_path / "crf.yml")
    assert "cannot be read: No such file" in refused(tmp_path / "none.yml")
    assert "cannot be read: Is a directory" in refused(tmp_path)


def test_a_channel_without_light_is_refused(tmp_path: Path) -> None:
    for nothing in (np.nan, 0.0, -1.0):
        values = table()
        values[:, 1] = nothing

        line = refused(written(tmp_path, text_of("yml", response=values)))

        assert "channel G has no irradiance above 0" in line


def test_two_candidates_of_other_names_are_refused(tmp_path: Path) -> None:
    text = text_of("yml", debevec=table(), robertson=table())

    line = refused(written(tmp_path, text))

    assert "debevec, robertson can each be a response: name the right one 'response'" in line
