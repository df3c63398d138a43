"""``chartless fit``: a family fitted to a measured curve."""

from collections.abc import Callable
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slow_cases import slow_but

from chartless.curves.fitting import fit
from chartless.models import MODELS, Table

Chartless = Callable[..., Any]
Refusal = Callable[..., str]

IRRADIANCE = np.linspace(0, 1, 40)
BENT = IRRADIANCE**0.45 + 0.01 * np.sin(2 * np.pi * IRRADIANCE)
BENT[-1] = 1
FAMILIES = {
    family: [model.name for model in models]
    for family, models in groupby(MODELS.values(), lambda each: each.family)
}


@pytest.fixture
def curve(tmp_path: Path) -> Path:
    """A measured curve that no family meets exactly."""
    return write(tmp_path / "curve.csv", IRRADIANCE, BENT)


def write(path: Path, irradiance: Any, brightness: Any) -> Path:
    rows = [
        f"{x!r},{y!r}" for x, y in zip(map(float, irradiance), map(float, brightness), strict=True)
    ]
    path.write_text("\n".join(["irradiance,brightness", *rows]))
    return path


# The table


def test_the_table_shows_what_was_fitted(curve: Path, chartless: Chartless) -> None:
    done = chartless("fit", curve)

    expected = fit("ameegc2-exact", IRRADIANCE, BENT)
    title, header, *rows, last = done.out.splitlines()
    assert (done.status, done.err) == (0, "")
    assert title == f"ameegc2-exact: f(I) = {expected.model.formula}"
    assert header.split() == ["parameter", "value", "std", "error"]
    names, values, errors = zip(*(row.split() for row in rows), strict=True)
    assert names == expected.model.parameter_names
    assert [float(value) for value in values] == pytest.approx(expected.parameters, rel=1e-5)
    assert [float(error) for error in errors] == pytest.approx(expected.standard_errors, rel=0.06)
    assert last == f"RMSE {expected.rmse:.6f} over 40 samples"


def test_the_table_is_aligned(curve: Path, chartless: Chartless) -> None:
    _, *lines, _ = chartless("fit", curve, "--model", "eegc6").out.splitlines()

    assert len(lines) == 8
    assert len({len(line) for line in lines}) == 1


def test_parameters_that_the_samples_do_not_determine_have_no_error(
    tmp_path: Path, chartless: Chartless
) -> None:
    """As many samples as parameters: an interpolation, without room for an error."""
    curve = write(tmp_path / "curve.csv", [0.2, 0.5, 0.8], [0.4, 0.7, 0.9])

    done = chartless("fit", curve, "--model", "poly2")
    rows = done.out.splitlines()[2:5]
    as_json = chartless("fit", curve, "--model", "poly2", "--json").json

    assert done.status == 0
    assert [row.split()[0] for row in rows] == ["c1", "c2", "c3"]
    assert [row.split()[-1] for row in rows] == ["-"] * 3
    assert as_json["standard_errors"] == {"c1": None, "c2": None, "c3": None}
    assert as_json["covariance"] is None


def test_many_parameters_are_cut_short(curve: Path, chartless: Chartless) -> None:
    done = chartless("fit", curve, "--model", "emor24")
    found = chartless("fit", curve, "--model", "emor24", "--json").json

    assert done.out.splitlines()[-2] == "… and 1 more (see --json)"
    assert len(done.out.splitlines()) == 2 + 24 + 2
    assert len(found["parameters"]) == 25


def test_a_table_is_fitted_to_few_samples(
    tmp_path: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MODELS._items, "table", Table(order=40))  # the whole one takes its time
    curve = write(tmp_path / "curve.csv", IRRADIANCE[::4], IRRADIANCE[::4] ** 0.5)

    found = chartless("fit", curve, "--model", "table", "--json").json

    assert len(found["parameters"]) == 41
    assert found["rmse"] < 1e-3


@pytest.mark.parametrize(
    ("model", "brightness"),
    [
        ("poly0", IRRADIANCE**0.45),
        ("ggc2", 0.1 + 0.8 * IRRADIANCE**0.5),
        ("ggc2", 0.9 * IRRADIANCE**0.5),
        ("conpoly1", (1 - np.cos(3 * np.pi * IRRADIANCE)) / 2),
    ],
)
def test_a_curve_that_is_no_response_is_remarked_on(
    model: str, brightness: Any, tmp_path: Path, chartless: Chartless
) -> None:
    curve = write(tmp_path / "curve.csv", IRRADIANCE, brightness)

    done = chartless("fit", curve, "--model", model)

    assert done.status == 0
    assert done.err.startswith("chartless: note: the fitted curve is not a valid response: ")
    assert done.err.count("\n") == 1
    assert chartless("fit", curve, "--model", model, "--json").json["valid_response"] is False


# JSON


def test_json_says_all_there_is(curve: Path, chartless: Chartless) -> None:
    done = chartless("fit", curve, "--model", "gumbel2", "--json")

    expected = fit("gumbel2", IRRADIANCE, BENT)
    names = expected.model.parameter_names
    assert (done.status, done.err) == (0, "")
    assert done.out.count("\n") == 1
    assert done.json == {
        "model": "gumbel2",
        "formula": expected.model.formula,
        "parameters": dict(zip(names, expected.parameters.tolist(), strict=True)),
        "standard_errors": dict(zip(names, expected.standard_errors.tolist(), strict=True)),
        "covariance": expected.covariance.tolist(),
        "rmse": expected.rmse,
        "samples": 40,
        "converged": True,
        "valid_response": True,
    }


def test_the_rmse_is_that_of_the_parameters_printed(curve: Path, chartless: Chartless) -> None:
    found = chartless("fit", curve, "--model", "eegc3", "--json").json

    exponent = np.exp(np.polynomial.Polynomial(list(found["parameters"].values()))(IRRADIANCE))
    residual = IRRADIANCE**exponent - BENT
    assert found["rmse"] == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)


# Models


@pytest.mark.parametrize(
    "family", slow_but(sorted(set(FAMILIES) - {"table"}), "ameegc", "emor", "gamma", "poly")
)
def test_every_name_of_a_model_is_accepted(family: str, curve: Path, chartless: Chartless) -> None:
    for name in FAMILIES[family][:7]:
        done = chartless("fit", curve, "--model", name, "--json")
        assert done.status == 0, done.err
        assert done.json["model"] == name
        assert done.json["rmse"] < 0.5
    highest = FAMILIES[family][-1]
    assert chartless("fit", curve, "--model", highest).out.startswith(f"{highest}: f(I) = ")


@pytest.mark.parametrize(
    ("name", "suggestion"),
    [("gama", "gamma"), ("Gumbel4", "gumbel4"), ("eegc99", "eegc9"), ("emor2-monoton", "emor2-m")],
)
def test_an_unknown_model_is_refused_with_a_suggestion(
    name: str, suggestion: str, curve: Path, refusal: Refusal
) -> None:
    line = refusal("fit", curve, "--model", name, "--json")

    assert line.startswith(f"unknown model {name!r}. Did you mean '{suggestion}")


def test_the_list_of_models_is_short_enough_to_read(curve: Path, refusal: Refusal) -> None:
    line = refusal("fit", curve, "--model", "nothing like it")

    assert "Did you mean" not in line
    assert len(line) < 400
    for shown in ("eegc0…10", "emor0…24, ", "emor0…24-monotone", "gamma", "ameegc2-exact"):
        assert shown in line


# Pictures


@pytest.mark.slow
@pytest.mark.parametrize(
    ("extension", "magic"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_a_picture_is_drawn(
    extension: str, magic: bytes, curve: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / f"fit.{extension}"

    done = chartless("fit", curve, "-o", output)

    assert (done.status, done.err) == (0, "")
    assert done.out.splitlines()[-1] == f"picture written to {output}"
    assert output.read_bytes().startswith(magic)
    assert output.stat().st_size > 5000
    assert sorted(tmp_path.iterdir()) == sorted([curve, output])


def test_a_picture_beside_json(curve: Path, chartless: Chartless, tmp_path: Path) -> None:
    output = tmp_path / "fit.png"

    done = chartless("fit", curve, "-o", output, "--json")

    assert done.json["model"] == "ameegc2-exact"
    assert output.is_file()


@pytest.mark.parametrize(
    ("output", "why"),
    [
        ("fit.gif", "figures are written as .png, .svg, .pdf, not as '.gif'"),
        ("missing/fit.png", "does not exist: create it first"),
        ("curve.csv", "figures are written as"),
    ],
)
def test_a_picture_that_cannot_be_written_leaves_nothing(
    output: str, why: str, curve: Path, refusal: Refusal, tmp_path: Path
) -> None:
    before = curve.read_bytes()

    line = refusal("fit", curve, "-o", tmp_path / output, "--json")

    assert line.startswith(f"{tmp_path / output}: ")
    assert why in line
    assert list(tmp_path.iterdir()) == [curve]
    assert curve.read_bytes() == before


# Curves


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("0,0\n0.5,0.7\n", "ameegc2-exact needs 3 samples or more, not 2"),
        ("", "holds no samples; give two rows or more"),
        ("I,B\n", "holds no samples; give two rows or more"),
        ("0,0\n0.5,nan\n1,1\n", "sample 2: brightness is not a finite number"),
        ("0,0\nnan,0.7\n1,1\n", "sample 2: irradiance is not a finite number"),
        ("0,0\n0.5,0.7\ninf,1\n", "sample 3: irradiance is not a finite number"),
        ("0,0\n0.5,0.7\n0.4,0.8\n1,1\n", "sample 3 is 0.4 after 0.5; sort them"),
        ("0,0\n0.5,0.7\n0.5,0.8\n1,1\n", "sample 3 is 0.5 after 0.5; sort them, and join"),
        (
            "0,0\n0.5,180\n1,255\n",
            (
                "brightness runs from 0 to 255 instead of within 0 … 1; subtract its value at "
                "black and divide by the highest level, 255 for 8 bits"
            ),
        ),
        (
            "1,0\n20,0.5\n400,1\n",
            (
                "irradiance runs from 1 to 400 instead of within 0 … 1; subtract its value at "
                "black and divide by its value at saturation"
            ),
        ),
        ("0,-0.01\n0.5,0.7\n1,1\n", "brightness runs from -0.01 to 1"),
        ("0,0.5\n0.5,0.5\n1,0.5\n", "brightness is 0.5 everywhere: not a response curve"),
        ("0,0\n0.5,0.7,0.8\n1,1\n", "line 2 is not two numbers, irradiance and brightness"),
    ],
)
@pytest.mark.parametrize("option", [(), ("--json",)])
def test_a_curve_that_cannot_be_fitted_is_named(
    text: str, why: str, option: tuple[str, ...], tmp_path: Path, refusal: Refusal
) -> None:
    curve = tmp_path / "curve.csv"
    curve.write_text(text)

    line = refusal("fit", curve, *option)

    assert line.startswith(f"{curve}: ")
    assert why in line


def test_a_file_that_is_missing(tmp_path: Path, refusal: Refusal) -> None:
    curve = tmp_path / "curve.csv"

    line = refusal("fit", curve, "--json")

    assert (
        line == f"{curve}: cannot be read as a text file: No such file or directory: check the name"
    )


def test_a_folder(tmp_path: Path, refusal: Refusal) -> None:
    line = refusal("fit", tmp_path)

    assert line == f"{tmp_path}: cannot be read as a text file: Is a directory: name a file in it"


@pytest.mark.parametrize("content", [b"\x89PNG\r\n\x1a\n\xff\xfe", bytes(range(128)) * 4])
def test_a_binary_file(content: bytes, tmp_path: Path, refusal: Refusal) -> None:
    curve = tmp_path / "picture.png"
    curve.write_bytes(content)

    assert refusal("fit", curve).startswith(f"{curve}: ")


def test_a_truth_of_simulate_is_a_curve(tmp_path: Path, chartless: Chartless) -> None:
    truth = tmp_path / "truth.json"
    truth.write_text('{"response_lut": [0, 0.5, 0.7071067811865476, 0.8660254037844386, 1]}')

    found = chartless("fit", truth, "--model", "gamma", "--json").json

    assert found["parameters"]["gamma"] == pytest.approx(0.5, rel=1e-9)


def test_an_unsuitable_model_is_refused_before_a_picture(tmp_path: Path, refusal: Refusal) -> None:
    curve = write(tmp_path / "curve.csv", [0, 0.5, 1], [0, 0.7, 1])

    line = refusal("fit", curve, "--model", "eegc4", "-o", tmp_path / "fit.png")

    assert line == f"{curve}: eegc4 needs 5 samples or more, not 3"
    assert list(tmp_path.iterdir()) == [curve]
