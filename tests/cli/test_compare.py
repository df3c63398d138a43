"""``chartless compare``: all families fitted to measured curves."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from chartless.curves.comparison import compare
from chartless.models import MODELS

Chartless = Callable[..., Any]
Refusal = Callable[..., str]

FEW = [
    "ameegc0",
    "ameegc1",
    "ameegc2-exact",
    "eegc2",
    "eegc3",
    "eegc4",
    "gamma",
    "gumbel3",
    "poly2",
]
IRRADIANCE = np.linspace(0, 1, 120)
POWER = IRRADIANCE**0.45


@pytest.fixture(autouse=True)
def few(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some of the families, where it does not matter which."""
    if "every_family" not in request.fixturenames:
        monkeypatch.setattr("chartless.curves.comparison.default_models", lambda: FEW)


@pytest.fixture
def every_family(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """All of them at low orders, but for the table, which takes its time."""
    names = [name for name, model in MODELS.items() if model.order <= 2]
    monkeypatch.setattr("chartless.curves.comparison.default_models", lambda: names)
    return names


def noisy(seed: int = 0) -> Any:
    brightness = MODELS["ameegc2-exact"].response(IRRADIANCE, [-0.3, 1.8, -0.1])
    brightness += np.random.default_rng(seed).normal(scale=0.003, size=IRRADIANCE.size)
    brightness[[0, -1]] = 0, 1
    return brightness.clip(0, 1)


def write(path: Path, brightness: Any, irradiance: Any = IRRADIANCE) -> Path:
    rows = zip(map(float, irradiance), map(float, brightness), strict=True)
    path.write_text("\n".join(f"{x!r} {y!r}" for x, y in rows))
    return path


@pytest.fixture
def curve(tmp_path: Path) -> Path:
    return write(tmp_path / "curve.csv", noisy())


def rows_of(out: str) -> dict[str, list[str]]:
    table, _, _ = out.partition("\n\n")
    header, *rows = table.splitlines()
    assert header.split() == [
        "model", "parameters", "RMSE", "ΔAICc", "ΔBIC", "valid", "response",
    ]  # fmt: skip
    assert len({len(line) for line in (header, *rows)}) == 1
    cells = {row.split()[0]: row.split()[1:] for row in rows}
    assert len(cells) == len(rows)
    return cells


# The table


def test_the_best_order_of_each_family_is_shown_best_first(
    curve: Path, chartless: Chartless
) -> None:
    done = chartless("compare", curve)

    assert done.status == 0
    found = compare([(IRRADIANCE, noisy())], models=FEW)
    rows = rows_of(done.out)
    families = [MODELS[name].family for name in rows]
    assert sorted(families) == sorted({MODELS[name].family for name in FEW})
    least = {}
    for each in found.candidates:
        least[each.model.family] = min(each.bic, least.get(each.model.family, np.inf))
    for each in found.candidates:
        shown = each.model.name in rows
        assert shown == (each.bic == least[each.model.family])
        if shown:
            n_parameters, rmse, aicc, bic, valid = rows[each.model.name]
            assert int(n_parameters) == each.model.n_parameters
            assert float(rmse) == pytest.approx(each.rmse, abs=6e-7)
            assert float(bic) == pytest.approx(each.bic - min(least.values()), abs=0.06)
            assert float(aicc) >= 0
            assert valid == ("yes" if each.valid else "no")
    differences = [float(row[3]) for row in rows.values()]
    assert differences == sorted(differences)
    assert differences[0] == 0


def test_the_last_word_is_a_recommendation(curve: Path, chartless: Chartless) -> None:
    done = chartless("compare", curve)

    recommended = compare([(IRRADIANCE, noisy())], models=FEW).recommended
    assert recommended is not None
    assert done.out.endswith(f"\n\nrecommended: {recommended.model.name}\n")
    assert recommended.model.n_parameters == 3


def test_how_many_samples_count_is_remarked(curve: Path, chartless: Chartless) -> None:
    done = chartless("compare", curve)

    (count,) = compare([(IRRADIANCE, noisy())], models=FEW).n_independent
    assert done.err == (
        f"chartless: note: the criteria count {count:.0f} independent samples of 120\n"
    )


def test_all_shows_every_order(curve: Path, chartless: Chartless) -> None:
    rows = rows_of(chartless("compare", curve, "--all").out)

    assert list(rows) == FEW
    assert min(float(row[2]) for row in rows.values()) == 0
    assert min(float(row[3]) for row in rows.values()) == 0


def test_a_power_is_recognised_among_all_families(
    every_family: list[str], tmp_path: Path, chartless: Chartless
) -> None:
    curve = write(tmp_path / "curve.csv", POWER)

    found = chartless("compare", curve, "--json").json

    assert [each["model"] for each in found["models"]] == every_family
    assert found["recommended"] in {"ameegc0", "eegc0", "gamma", "ggc0", "gumbel0", "meegc0"}


def test_several_curves_at_once(curve: Path, tmp_path: Path, chartless: Chartless) -> None:
    power = write(tmp_path / "power.csv", POWER)

    done = chartless("compare", power, curve)

    assert done.out.splitlines()[-1].split()[-1] in {"ameegc2-exact", "eegc2"}
    assert "independent samples of 120, 120\n" in done.err
    assert chartless("compare", power).out.splitlines()[-1].split()[-1] in {"ameegc0", "gamma"}


def test_where_the_samples_are_too_few_to_judge_this_is_said(
    tmp_path: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A difference that changes its sign once: the fits are valid, yet none is preferred."""
    curve = write(tmp_path / "curve.csv", 0.9 * IRRADIANCE**0.5)

    monkeypatch.setattr("chartless.curves.comparison.default_models", lambda: ["gamma", "ameegc0"])

    done = chartless("compare", curve)

    assert done.status == 0
    assert "recommended: " not in done.out
    assert [row[2:] for row in rows_of(done.out).values()] == [["-", "-", "yes"]] * 2
    count, advice = done.err.splitlines()
    assert count.endswith(" independent samples of 120")
    assert advice.startswith("chartless: note: these are too few to recommend a family: ")


def test_criteria_that_do_not_apply_are_dashes(tmp_path: Path, chartless: Chartless) -> None:
    curve = write(tmp_path / "curve.csv", [0, 0.3, 0.6, 0.7, 0.9, 1], np.linspace(0, 1, 6))

    done = chartless("compare", curve, "--all")
    found = chartless("compare", curve, "--json").json

    rows = rows_of(done.out)
    assert rows["eegc2"][2:4] == ["-", "-"]
    assert "eegc4" not in rows
    entry = next(each for each in found["models"] if each["model"] == "eegc2")
    assert entry["aicc"] is None
    assert entry["bic"] is None


def test_where_no_fit_is_valid_this_is_said(
    tmp_path: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chartless.curves.comparison.default_models", lambda: ["poly1", "ggc2"])
    curve = write(tmp_path / "curve.csv", 0.1 + 0.7 * POWER)

    done = chartless("compare", curve)

    assert done.status == 0
    assert "recommended" not in done.out
    assert "chartless: note: no family gives a valid response: check" in done.err
    assert chartless("compare", curve, "--json").json["recommended"] is None


# JSON


def test_json_says_all_there_is(curve: Path, tmp_path: Path, chartless: Chartless) -> None:
    other = write(tmp_path / "other.csv", noisy(1)[::2], IRRADIANCE[::2])

    done = chartless("compare", curve, other, "--json")

    samples = [(IRRADIANCE, noisy()), (IRRADIANCE[::2], noisy(1)[::2])]
    found = compare(samples, models=FEW)
    assert (done.status, done.err) == (0, "")
    assert found.recommended is not None
    assert done.json == {
        "recommended": found.recommended.model.name,
        "independent_samples": list(found.n_independent),
        "models": [
            {
                "model": each.model.name,
                "n_parameters": each.model.n_parameters,
                "rmse": each.rmse,
                "aicc": each.aicc,
                "bic": each.bic,
                "valid_response": each.valid,
                "converged": True,
                "parameters": [one.parameters.tolist() for one in each.fits],
            }
            for each in found.candidates
        ],
    }


# Pictures


def test_a_picture_of_the_first_curve_is_drawn(
    curve: Path, tmp_path: Path, chartless: Chartless
) -> None:
    output = tmp_path / "compare.svg"

    done = chartless("compare", curve, write(tmp_path / "b.csv", POWER), "-o", output)

    assert done.status == 0
    assert done.out.splitlines()[-1] == f"picture written to {output}"
    assert output.read_bytes().startswith(b"<?xml")
    assert output.stat().st_size > 5000


def test_every_family_is_drawn_once(
    curve: Path, tmp_path: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The recommended one first."""
    drawn: list[str] = []

    def note(*arguments: Any, **_: object) -> Figure:
        drawn.extend(fit.model.name for fit in arguments[2])
        return Figure()

    monkeypatch.setattr("chartless.plotting.fits_figure", note)

    done = chartless("compare", curve, "-o", tmp_path / "compare.svg", "--json")

    assert drawn[0] == done.json["recommended"]
    assert len(drawn) == len(set(drawn)) == 4


@pytest.mark.parametrize("output", ["missing/compare.png", "compare.gif", "curve.csv"])
def test_a_picture_that_cannot_be_written_leaves_nothing(
    output: str, curve: Path, tmp_path: Path, refusal: Refusal
) -> None:
    before = curve.read_bytes()

    line = refusal("compare", curve, "-o", tmp_path / output, "--json")

    assert line.startswith(f"{tmp_path / output}: ")
    assert list(tmp_path.iterdir()) == [curve]
    assert curve.read_bytes() == before


def test_a_missing_folder_is_noticed_before_the_work(
    curve: Path, tmp_path: Path, refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        pytest.fail("fitted first")

    monkeypatch.setattr("chartless.curves.comparison.compare", never)

    line = refusal("compare", curve, "-o", tmp_path / "missing" / "compare.png")

    assert "does not exist: create it first" in line


# Curves


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "holds no samples"),
        ("0,0\n0.5,nan\n1,1\n", "sample 2: brightness is not a finite number"),
        ("0,0\n0.5,180\n1,255\n", "divide by the highest level, 255 for 8 bits"),
        ("0,0\n0.5,0.7\n0.4,0.8\n1,1\n", "sort them"),
        ("0,0.5\n0.5,0.5\n1,0.5\n", "brightness is 0.5 everywhere"),
        ("0,0\n0.5,much\n1,1\n", "line 2 is not two numbers"),
    ],
)
def test_of_several_curves_the_bad_one_is_named(
    text: str, why: str, curve: Path, tmp_path: Path, refusal: Refusal
) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text(text)

    line = refusal("compare", curve, bad, "--json")

    assert line.startswith(f"{bad}: ")
    assert why in line


def test_of_several_curves_the_missing_one_is_named(
    curve: Path, tmp_path: Path, refusal: Refusal
) -> None:
    line = refusal("compare", curve, tmp_path / "missing.csv")

    assert line.startswith(f"{tmp_path / 'missing.csv'}: cannot be read as a text file: No such")
    assert refusal("compare", tmp_path, curve).startswith(f"{tmp_path}: ")


def test_fewer_than_five_samples(tmp_path: Path, refusal: Refusal) -> None:
    curve = write(tmp_path / "curve.csv", [0, 0.5, 0.7, 1], [0, 0.3, 0.6, 1])

    line = refusal("compare", curve, "--json")

    assert "families are compared on 5 samples or more, not 4" in line


def test_five_samples_are_enough(tmp_path: Path, chartless: Chartless) -> None:
    curve = write(tmp_path / "curve.csv", [0, 0.5, 0.7, 0.9, 1], [0, 0.25, 0.5, 0.75, 1])

    done = chartless("compare", curve)

    assert done.status == 0
    assert "recommended: " in done.out


def test_without_a_curve(refusal: Refusal) -> None:
    assert "curves" in refusal("compare").lower()
