"""What kinds of evidence say of themselves, in values that explain themselves."""

import pytest

from chartless.errors import ParameterError
from chartless.result.account import (
    Account,
    Column,
    Fact,
    Fit,
    Table,
    UnknownRecord,
    Value,
    require_form,
    written,
)

FORMS = ["", "file", ".0f", ".2f", ".4g", ".1%"]


@pytest.fixture
def account() -> Account:
    return Account(
        kind="wedge",
        facts=(Fact("patches", "Patches of the wedge", (1.0, 2.0), ".1f"),),
        fits=(Fit("gap", "Gap between patches", 0.125, ".1%"),),
        record=UnknownRecord({"patches": [1, 2]}),
    )


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [
        (None, ".2f", ""),
        (None, "file", ""),
        (0.126, ".2f", "0.13"),
        (0.126, "", "0.126"),
        (0.126, ".1%", "12.6%"),
        (10230.4, ".4g", "10230"),
        (0.00001234, ".2g", "1.2e-05"),
        (1234567.0, ".0f", "1234567"),
        ("peaked", "", "peaked"),
        ("peaked", ".2f", "peaked"),
        ("folder/a.png", "file", "a.png"),
        ("folder/a.png", "", "folder/a.png"),
        ((), ".1f", ""),
        ((1.0,), ".1f", "1.0"),
        ((1.0, 4.0, 10230.0), ".4g", "1 4 10230"),
        ((4.0, 1.0, 16.0, 2.0), ".4g", "1 to 16"),
        ((1.0, 1.0, 1.0001, 1.0), ".1f", "1.0"),
    ],
)
def test_values_are_written_as_people_read_them(value: Value | None, form: str, text: str) -> None:
    assert written(value, form) == text


@pytest.mark.parametrize("form", FORMS)
def test_a_form_is_one(form: str) -> None:
    assert require_form(form) == form


@pytest.mark.parametrize(
    "form", ["2f", ".f", ".10f", ".2e", ".%", "x", ">9.2f", ".2f ", "\n", "files", ","]
)
def test_other_forms_are_refused(form: str) -> None:
    with pytest.raises(ParameterError, match="form must be such as"):
        require_form(form)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("value", [0.0, -1e-300, 1e300, 3.0, "text", (), (1.0, 1e9), None])
def test_every_value_can_be_written_in_every_form(value: Value | None, form: str) -> None:
    assert isinstance(written(value, form), str)


def test_a_value_is_found_by_its_name(account: Account) -> None:
    assert account["patches"] == (1.0, 2.0)
    assert account["gap"] == 0.125
    assert "gap" in account
    assert "scatter" not in account
    assert account.values == {"patches": (1.0, 2.0), "gap": 0.125}


def test_a_value_that_is_not_there_is_named_with_those_that_are(account: Account) -> None:
    with pytest.raises(LookupError, match="no 'scatter' of wedge; known: patches, gap"):
        account["scatter"]
    with pytest.raises(LookupError, match="known: nothing"):
        Account(kind="wedge")["scatter"]


def test_facts_and_fits_have_a_text(account: Account) -> None:
    (fact,), (fit,) = account.facts, account.fits

    assert fact.text == "1.0 2.0"
    assert fit.text == "gap 12.5%"
    assert fit._replace(code="black-gap").text == "black gap 12.5%"


def test_a_record_that_is_not_known_belongs_to_its_levels(account: Account) -> None:
    other = account.at_levels(1024)

    assert other.record is None
    assert (other.kind, other.facts, other.fits) == (account.kind, account.facts, account.fits)
    assert Account(kind="wedge").at_levels(1024).record is None


def test_columns_that_hold_nothing_are_not_shown() -> None:
    columns = (Column("file", "File", "file"), Column("found", "Found"), Column("r", "R", ".1f"))
    table = Table("t", "A table", columns, (("x/a.png", None, 1.0), ("x/b.png", None, None)))

    assert table.shown == ((columns[0], ["a.png", "b.png"]), (columns[2], ["1.0", ""]))
