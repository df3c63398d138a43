"""Options of the kinds of evidence as options of a command."""

from collections.abc import Callable
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any

import typer

from chartless.evidence.options import Asked, all_options


def with_kind_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options of all kinds to a command that takes them as further keyword arguments.

    They stand before the parameter `shared_noise` or, without, the last one.
    """
    own = [each for each in signature(command).parameters.values() if each.name != "options"]
    place = next((n for n, each in enumerate(own) if each.name == "shared_noise"), len(own) - 1)
    added = [_parameter(asked) for asked in all_options().values()]
    parameters = [*own[:place], *added, *own[place:]]

    def run(**given: Any) -> int:  # noqa: ANN401 - each of the type of its option
        return command(**given)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__signature__ = signature(command).replace(parameters=parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    return run


def chosen(options: dict[str, Any]) -> dict[str, Any]:
    """Options of kinds as the library takes them; patterns of files become files."""
    from chartless.frames.sequence import expanded

    found = dict(options)
    for name, asked in all_options().items():
        if asked.option.form == "files":
            found[name] = expanded(options[name] or ())
        elif asked.option.form == "flag":
            found[name] = asked.default != options[name]  # the flag stands for the other
    return found


def files_of(options: dict[str, Any]) -> list[Path]:
    """Files among options, as `chosen` returns them."""
    found: list[Path] = []
    for name, asked in all_options().items():
        if asked.option.form == "files":
            found += options[name]
        elif asked.option.form == "file" and options[name] is not None:
            found.append(options[name])
    return found


def _parameter(asked: Asked) -> Parameter:
    types: dict[str, Any] = {
        "file": Path | None,
        "files": list[Path] | None,
        "flag": bool,
        "count": int,
    }
    form, flag = asked.option.form, f"--{asked.flag}"
    text = f"{asked.kind}: {asked.option.help}"
    default, described = asked.default, typer.Option(flag, help=text)
    if form in ("file", "files"):
        default, described = None, typer.Option(flag, help=text, show_default=False)
    elif form == "flag":
        default = False
    elif form == "count":
        described = typer.Option(flag, min=0, help=text)
    annotation = Annotated[types[form], described]  # type: ignore[valid-type]
    return Parameter(
        asked.name, Parameter.POSITIONAL_OR_KEYWORD, default=default, annotation=annotation
    )
