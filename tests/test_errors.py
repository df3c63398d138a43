"""What a user reads when a name is unknown."""

import pickle

import pytest

from chartless.errors import ChartlessError, OutputError, UnknownNameError


@pytest.mark.parametrize(
    ("known", "shown"),
    [
        (["gamma"], "gamma"),
        (["a", "b", "c"], "a, b, c"),
        (["eegc0", "eegc1", "eegc2"], "eegc0…2"),
        (["eegc0", "eegc1"], "eegc0, eegc1"),
        (["ggc0", "ggc2"], "ggc0, ggc2"),
        ([f"emor{n}" for n in range(25)], "emor0…24"),
        ([f"emor{n}-monotone" for n in range(25)], "emor0…24-monotone"),
        (["x0", "y", "x1", "z-2", "x2"], "x0…2, y, z-2"),
        (["ameegc0", "ameegc1", "ameegc2", "ameegc2-exact"], "ameegc0…2, ameegc2-exact"),
        (["x1y", "x2y", "x3z", "x4y"], "x1…4y, x3z"),
        (["x1y1", "x2y1", "x3y1", "x1y2"], "x1…3y1, x1y2"),
        (["1", "2", "3"], "1…3"),
        ([], ""),
    ],
)
def test_names_that_differ_by_a_number_alone_are_listed_as_one(
    known: list[str], shown: str
) -> None:
    assert str(UnknownNameError("model", "?!", known)).endswith(f" Available: {shown}.")


def test_a_close_name_is_suggested_even_where_the_list_is_abridged() -> None:
    error = UnknownNameError("model", "EMOR13", [f"emor{n}" for n in range(25)])

    assert str(error) == "unknown model 'EMOR13'. Did you mean 'emor13'? Available: emor0…24."


def test_nothing_is_suggested_where_nothing_is_close() -> None:
    assert str(UnknownNameError("model", "zzz", ["gamma"])) == (
        "unknown model 'zzz'. Available: gamma."
    )


def test_the_error_keeps_every_name_and_survives_pickling() -> None:
    known = tuple(f"eegc{n}" for n in range(11))

    error = pickle.loads(pickle.dumps(UnknownNameError("model", "eeg", known)))

    assert error.args == ("model", "eeg", known)
    assert isinstance(error, ChartlessError)
    assert isinstance(error, LookupError)


def test_the_list_of_models_fits_a_few_lines() -> None:
    from chartless.models import MODELS

    assert len(MODELS) > 100
    with pytest.raises(UnknownNameError) as caught:
        MODELS["?!"]
    assert len(str(caught.value)) < 400


def test_errors_about_files_name_them_first() -> None:
    error = pickle.loads(pickle.dumps(OutputError("a.png", "is a folder")))

    assert str(error) == "a.png: is a folder"
    assert isinstance(error, OSError)
