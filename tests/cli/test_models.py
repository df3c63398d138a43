"""``chartless models``: the catalogue of families."""

import re
from collections.abc import Callable
from typing import Any

import pytest

from chartless.curves.transfer import TRANSFER_FUNCTIONS
from chartless.formats.named import NAMED
from chartless.models import MODELS, Property

Chartless = Callable[..., Any]
FAMILIES = list(dict.fromkeys(model.family for model in MODELS.values()))


def table_of(out: str) -> tuple[list[str], dict[str, list[str]]]:
    """Names of the columns, and the cells of each family."""
    table, _, _ = out.partition("\n\n")
    header, *lines = table.splitlines()
    columns = re.findall(r"\S+", header)
    begins = [header.index(column) for column in columns]
    ends = [*begins[1:], None]
    cells = {
        line.split()[0]: [line[begin:end].strip() for begin, end in zip(begins, ends, strict=True)]
        for line in lines
    }
    assert len(cells) == len(lines)
    return columns, cells


def orders_in(cell: str) -> set[int]:
    orders: set[int] = set()
    for run in cell.split(", "):
        first, _, last = run.partition("-")
        orders |= set(range(int(first), int(last or first) + 1))
    return orders


def test_every_family_is_listed_once(chartless: Chartless) -> None:
    done = chartless("models")

    assert (done.status, done.err) == (0, "")
    columns, cells = table_of(done.out)
    assert columns == ["family", "orders", *(each.name.lower() for each in Property), "f(I)"]
    assert list(cells) == FAMILIES


@pytest.mark.parametrize("family", FAMILIES)
def test_a_row_says_what_the_models_claim(family: str, chartless: Chartless) -> None:
    _, cells = table_of(chartless("models").out)
    models = [model for model in MODELS.values() if model.family == family]
    _, orders, *properties, formula = cells[family]

    assert orders_in(orders) == {model.order for model in models}
    for each, cell in zip(Property, properties, strict=True):
        having = {model.order for model in models if each in model.properties}
        if cell == "yes":
            assert having == orders_in(orders), each
        elif cell == "-":
            assert having == set(), each
        else:
            assert cell.startswith("order ")
            assert orders_in(cell.removeprefix("order ")) == having, each
    assert formula == models[0].formula


def test_every_property_is_explained(chartless: Chartless) -> None:
    _, legend, _ = chartless("models").out.split("\n\n")

    lines = [line.split(maxsplit=1) for line in legend.splitlines()]
    assert lines == [[each.name.lower(), each.value] for each in Property]


def test_orders_with_gaps_are_listed_apart(chartless: Chartless) -> None:
    _, cells = table_of(chartless("models").out)

    assert cells["ggc"][1] == "0, 2"
    assert cells["ameegc"][1] == "0-2"
    assert cells["gamma"][1] == "0"


def test_the_list_for_machines(chartless: Chartless) -> None:
    done = chartless("models", "--json")

    assert (done.status, done.err) == (0, "")
    assert list(done.json) == ["models", "named"]
    entries = done.json["models"]
    assert [entry["name"] for entry in entries] == list(MODELS)
    for entry in entries:
        model = MODELS[entry["name"]]
        assert entry == {
            "name": model.name,
            "family": model.family,
            "order": model.order,
            "n_parameters": model.n_parameters,
            "formula": model.formula,
            "properties": sorted(each.name.lower() for each in model.properties),
        }


def test_names_of_calibrations_are_listed_with_their_sources(chartless: Chartless) -> None:
    _, _, names = chartless("models").out.split("\n\n")
    header, *lines = names.splitlines()

    assert header.split() == ["name", "calibration"]
    listed = dict(line.split(maxsplit=1) for line in lines)
    assert list(listed) == [*TRANSFER_FUNCTIONS, *NAMED]
    assert listed["srgb"] == "sRGB (IEC 61966-2-1:1999, 5.2)"
    assert {
        each["name"]: each["title"] for each in chartless("models", "--json").json["named"]
    } == (listed)


def test_an_argument_is_refused(chartless: Chartless) -> None:
    done = chartless("models", "gamma")

    assert (done.status, done.out) == (2, "")
    assert "gamma" in done.err
