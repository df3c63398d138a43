"""``chartless data``: measured data that each user fetches."""

from collections import Counter
from typing import TYPE_CHECKING, Annotated

import typer

from chartless.cli._options import AsJson
from chartless.cli._terminal import print_json, print_table, remark

if TYPE_CHECKING:
    from chartless.datasets import Dorf

app = typer.Typer(rich_markup_mode=None)

Name = Annotated[str, typer.Argument(help="Name in chartless data list.", show_default=False)]


@app.callback()
def data() -> None:
    """Find and fetch measured data, such as curves of cameras.

    They are looked for in the folder that the environment variable CHARTLESS_DATA names,
    then in the cache of this user.

    \b
    Example:
        chartless data list
        chartless data fetch dorf
    """


@app.command("list")
def list_datasets(as_json: AsJson = False) -> None:
    """List the data sets, and where they are on this computer.

    \b
    Example:
        chartless data list
    """
    from chartless.datasets import DATASETS, locate

    found = {name: locate(name) for name in DATASETS}
    if as_json:
        content = [
            {
                "name": name,
                "path": None if found[name] is None else str(found[name]),
                "what": archive.what,
                "licence": archive.licence,
                "url": archive.url,
            }
            for name, archive in DATASETS.items()
        ]
        print_json({"datasets": content})
        return
    rows = [
        (name, str(found[name] or "not fetched"), archive.what, archive.licence)
        for name, archive in DATASETS.items()
    ]
    print_table(("name", "where", "what", "licence"), rows, left=range(4))


@app.command()
def fetch(name: Name) -> None:
    """Fetch a data set unless it is there; print its path.

    What was downloaded is checked against a known SHA-256.

    \b
    Example:
        chartless data fetch dorf
    """
    from chartless import datasets

    if datasets.locate(name) is not None:
        remark(f"{name} is on this computer already: nothing to download")
    else:
        remark(f"downloading {datasets.DATASETS[name].url}")
    path = datasets.fetch(name)
    dorf = datasets.load_dorf(path) if name == "dorf" else None
    print(path)
    if dorf is not None:
        _print_dorf(dorf)


@app.command()
def path(name: Name) -> None:
    """Print where a data set is, for scripts.

    \b
    Example:
        chartless data path dorf
    """
    from chartless.datasets import DatasetError, locate

    found = locate(name)
    if found is None:
        msg = f"{name} is not on this computer: run chartless data fetch {name}"
        raise DatasetError(msg)
    print(found)


def _print_dorf(dorf: "Dorf") -> None:
    from chartless.datasets import KINDS

    kinds = dorf.kinds
    curves = Counter(kinds)
    distinct = Counter(kinds[row] for row in dorf.distinct)
    groups = Counter(kind for kind, _ in set(zip(kinds, dorf.cameras, strict=True)))
    counts = (curves, distinct, groups)
    rows = [[kind, *(str(count[kind]) for count in counts)] for kind in KINDS if curves[kind]]
    rows.append(["all", *(str(count.total()) for count in counts)])
    print()
    print_table(("kind", "curves", "distinct", "cameras"), rows)
    if dorf.duplicates:
        print("\nequal curves, by row:")
    for equal in dorf.duplicates:
        print("  " + " = ".join(f"{row} {dorf.names[row]}" for row in equal))
