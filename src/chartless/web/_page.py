"""The page itself, put together from its parts."""

from importlib.resources import files

from chartless.report import environment, stylesheet


def part(name: str) -> str:
    """Text of a file beside this one."""
    return files("chartless.web").joinpath(name).read_text(encoding="utf-8")


def style() -> str:
    """Style of the reports, and what the page adds."""
    return f"{stylesheet()}\n{part('page.css')}"


def document(*, is_shared: bool = False) -> str:
    """The page, with the methods, families and formats that there are.

    Parameters
    ----------
    is_shared : bool
        Whether other computers reach it.
    """
    from chartless.evidence.options import all_options
    from chartless.evidence.plan import AUTO, BOTH
    from chartless.evidence.registry import KINDS
    from chartless.formats import FORMATS
    from chartless.methods import CALIBRATORS
    from chartless.models import MODELS
    from chartless.workflow import DEFAULT_METHOD

    # The page takes no tables.
    elsewhere = {each.kind for each in all_options().values() if each.option.form == "file"}
    return (
        environment()
        .from_string(part("page.html"))
        .render(
            methods=list(CALIBRATORS),
            default_method=DEFAULT_METHOD,
            models=list(MODELS),
            kinds=[AUTO, *(name for name in KINDS if name not in elsewhere), BOTH],
            ticks=[each for each in all_options().values() if each.option.page],
            is_shared=is_shared,
            formats=[each for each in FORMATS.values() if each.is_written],
        )
    )
