"""Measured curves in text files."""

import json
from pathlib import Path

import numpy as np
import pytest

from chartless.curves.file import read_curve, read_samples
from chartless.errors import ParameterError

SAMPLES = [(0.0, 0.0), (0.25, 0.5), (0.5, 0.75), (1.0, 1.0)]


@pytest.mark.parametrize("name", ["curve.csv", "curve.txt", "curve.dat"])
@pytest.mark.parametrize(
    "text",
    [
        "0,0\n0.25,0.5\n0.5,0.75\n1,1\n",
        "0 0\n0.25 0.5\n0.5 0.75\n1 1",
        "0\t0\n0.25\t0.5\n0.5\t0.75\n1\t1\n",
        "0;0\n.25; 5e-1\n+0.5 ;0.75\n1.0;1\n",
        "irradiance,brightness\n0,0\n0.25,0.5\n0.5,0.75\n1,1\n",
        "I B\n0 0\n0.25 0.5\n0.5 0.75\n1 1\n",
        "# measured on a Monday\n\n0,0\n0.25,0.5\n# half\n0.5,0.75\n\n1,1\n",
        "# comment\nirradiance;brightness\n0;0\n0.25;0.5\n0.5;0.75\n1;1\n",
        "\ufeffI,B\r\n0,0\r\n0.25,0.5\r\n0.5,0.75\r\n1,1\r\n",
    ],
)
def test_two_columns_of_text(text: str, name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8", newline="")

    curve = read_curve(path)

    assert list(zip(curve.irradiance, curve.brightness, strict=True)) == SAMPLES
    assert curve.response(0.375) == pytest.approx(0.625)
    assert curve.inverse(0.625) == pytest.approx(0.375)


def test_a_truth_of_simulate(tmp_path: Path) -> None:
    path = tmp_path / "truth.json"
    samples = np.linspace(0, 1, 1024) ** 0.5
    path.write_text(json.dumps({"format": "chartless-truth", "response_lut": samples.tolist()}))

    curve = read_curve(path)

    assert np.array_equal(curve.response(np.linspace(0, 1, 1024)), samples)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "two rows or more"),
        ("I,B\n", "two rows or more"),
        ("0,0\n", "two rows or more"),
        ("0,0\n0.5,0.6,0.7\n1,1\n", "line 2 is not two numbers, irradiance and brightness: '0.5,0"),
        ("0,0\n0.5\n1,1\n", "line 2 is not two numbers"),
        ("0,0\n0.5,much\n1,1\n", "line 2 is not two numbers"),
        ("0,0\nI,B\n1,1\n", "line 2 is not two numbers"),
        ("\n# c\n0,0\n0,5;0,6\n1,1\n", "line 4 is not two numbers"),
        ("0,0\n0.5,0.6\n0.5,0.7\n1,1\n", "must increase"),
        ("0,0\n0.5,0.6\n0.7,0.5\n1,1\n", "must increase"),
        ("1,1\n0,0\n", "must increase"),
        ("0,0\n0.5,nan\n1,1\n", "must increase"),
        ("0,0\ninf,0.5\n1,1\n", "must increase"),
        ("0,0\n0.5,0.5\n", r"runs from \(0, 0\) to \(1, 1\), this one from \(0, 0\) to \(0.5, 0.5"),
        ("0,0\n255,255\n", r"to \(255, 255\)"),
        ("0.1,0\n1,1\n", r"from \(0.1, 0\)"),
    ],
)
def test_text_that_is_no_response(text: str, why: str, tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    path.write_text(text)

    with pytest.raises(ParameterError, match=why) as caught:
        read_curve(path)

    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[0, 1]",
        "{}",
        '{"response": [0, 1]}',
        '{"response_lut": null}',
        '{"response_lut": []}',
        '{"response_lut": 5}',
        '{"response_lut": "0 1"}',
        '{"response_lut": [0, null, 1]}',
        '{"response_lut": [0, "x", 1]}',
        '{"response_lut": {"R": [0, 1]}}',
        '{"response_lut": [[0, 1], [0, 1]]}',
        '{"response_lut": [0, 0.7, 0.3, 1]}',
        '{"response_lut": [0, 0.5]}',
    ],
)
def test_json_that_holds_no_response(text: str, tmp_path: Path) -> None:
    path = tmp_path / "truth.json"
    path.write_text(text)

    with pytest.raises(ParameterError) as caught:
        read_curve(path)

    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["curve.csv", "curve.json"])
def test_files_that_cannot_be_read(name: str, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="cannot be read as a text file: No such file"):
        read_curve(tmp_path / name)

    (tmp_path / name).mkdir()
    with pytest.raises(ParameterError, match="cannot be read as a text file: Is a directory"):
        read_curve(tmp_path / name)


def test_a_binary_file(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    path.write_bytes(b"\x89PNG\xff\xff")

    with pytest.raises(ParameterError, match="cannot be read as a text file"):
        read_curve(path)


# Samples


@pytest.mark.parametrize(
    "samples",
    [
        [(0.5, 0.7), (0.25, 0.5), (1.0, 1.0), (0.0, 0.0)],
        [(1.0, 0.0), (400.0, 255.0)],
        [(-0.5, -1.25), (1e300, 5e-324)],
        [(0.5, 0.6), (0.5, 0.6)],
        [(0.0, 0.3)],
    ],
)
def test_samples_keep_their_order_and_range(
    samples: list[tuple[float, float]], tmp_path: Path
) -> None:
    path = tmp_path / "curve.csv"
    path.write_text("irradiance;brightness\n" + "\n".join(f"{x!r};{y!r}" for x, y in samples))

    irradiance, brightness = read_samples(path)

    assert irradiance.dtype == brightness.dtype == np.float64
    assert irradiance.shape == brightness.shape == (len(samples),)
    assert list(zip(irradiance.tolist(), brightness.tolist(), strict=True)) == samples


def test_numbers_that_are_not_finite_are_left_to_the_caller(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    path.write_text("0,nan\ninf,1\n")

    irradiance, brightness = read_samples(path)

    assert np.isnan(brightness[0])
    assert irradiance[1] == np.inf


def test_samples_of_a_truth_lie_on_a_uniform_grid(tmp_path: Path) -> None:
    path = tmp_path / "TRUTH.JSON"
    path.write_text('{"response_lut": [0.1, 0.9, 0.2]}')

    irradiance, brightness = read_samples(path)

    assert irradiance.tolist() == [0, 0.5, 1]
    assert brightness.tolist() == [0.1, 0.9, 0.2]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("curve.csv", ""),
        ("curve.csv", "I,B\n"),
        ("curve.txt", "# nothing\n\n"),
        ("curve.json", '{"response_lut": []}'),
    ],
)
def test_no_samples_at_all_are_refused(name: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(text)

    with pytest.raises(ParameterError, match="holds no samples; give two rows or more") as caught:
        read_samples(path)

    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("text", ["0 0\nnan nan nan\n", "0,0\n1,1\nthe end\n", "1\n2\n"])
def test_what_is_no_number_is_named_by_its_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    path.write_text(text)

    with pytest.raises(ParameterError, match=r"line \d is not two numbers"):
        read_samples(path)
