"""Settings of a method from the texts of ``--set NAME=VALUE``."""

from collections.abc import Callable, Iterable
from typing import Any

from chartless.cli._options import parse_numbers
from chartless.errors import ParameterError


def parse_settings(texts: Iterable[str], method: str) -> dict[str, Any]:
    """Values by name, each of the type that the method has for it.

    Raises
    ------
    ParameterError
        If a text is not ``NAME=VALUE``, or a value is of another type.
    UnknownNameError
        If there is no such method; settings that it does not have are refused where it is made.
    """
    from chartless.curves.populations import PopulationWeights
    from chartless.methods import CALIBRATORS

    usual = CALIBRATORS[method]()
    found = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            msg = f"--set takes NAME=VALUE, such as weight=0.5, not {text!r}"
            raise ParameterError(msg)
        name = name.strip().replace("-", "_")
        reads_weights = name == "populations" and hasattr(usual, name)
        found[name] = (
            PopulationWeights.parsed(value)
            if reads_weights
            else _parsed(name, value, getattr(usual, name, ""))
        )
    return found


def _parsed(name: str, text: str, usual: object) -> Any:  # noqa: ANN401 - of the setting's type
    parse, what = _reader_of(usual)
    try:
        return parse(text)
    except ValueError:
        msg = f"--set {name} takes {what}, not {text!r}"
        raise ParameterError(msg) from None


def _yes_or_no(text: str) -> bool:
    answers = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
    if text.lower() not in answers:
        raise ValueError
    return answers[text.lower()]


def _reader_of(usual: object) -> tuple[Callable[[str], Any], str]:
    """What makes a value like a usual one out of a text, and how to write it."""
    from chartless.noise import NoisePrior

    if isinstance(usual, NoisePrior):
        what = "electrons at white and of read noise, as data sheets give them, such as 10000,13"
        return (lambda text: NoisePrior.of_sensor(*parse_numbers(text, 2))), what
    if isinstance(usual, tuple):
        what = f"{len(usual)} numbers, such as {','.join(f'{each:g}' for each in usual)}"
        return (lambda text: parse_numbers(text, len(usual))), what
    if isinstance(usual, bool):
        return _yes_or_no, "yes or no"
    if isinstance(usual, int):
        return int, f"a whole number, such as {usual}"
    if isinstance(usual, float):
        return float, f"a number, such as {usual:g}"
    return str, "a word"
