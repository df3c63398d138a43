"""``chartless models``: the catalogue of families and of named transfer functions."""

from typing import TYPE_CHECKING

from chartless.cli._options import AsJson
from chartless.cli._terminal import print_json, print_table

if TYPE_CHECKING:
    from chartless.models import AbstractModel, Property


def models(as_json: AsJson = False) -> None:
    """List families of response curves, and named calibrations.

    A family of order N has N + 1 parameters; its members are named by family and order, such
    as eegc4 or emor2-monotone. With parameters, gamma:0.45, a member is a name as well. Where a
    file has the same name, it is taken: names are looked up where there is no such file.

    \b
    Example:
        chartless models
        chartless models --json
        chartless linearize slog3 a.png -o linear.exr
    """
    from chartless.formats import known_names
    from chartless.models import MODELS, Property

    if as_json:
        listed = [{"name": name, "title": title} for name, title in known_names().items()]
        print_json({"models": [_as_json(model) for model in MODELS.values()], "named": listed})
        return
    families: dict[str, list[AbstractModel]] = {}
    for model in MODELS.values():
        families.setdefault(model.family, []).append(model)
    header = ["family", "orders", *(each.name.lower() for each in Property), "f(I)"]
    rows = [
        [
            family,
            _ranges([model.order for model in members]),
            *(_holds(members, each) for each in Property),
            members[0].formula,
        ]
        for family, members in families.items()
    ]
    print_table(header, rows, left=range(len(header)))
    print()
    for each in Property:
        print(f"{each.name.lower():10}  {each.value}")
    print()
    print_table(["name", "calibration"], [*map(list, known_names().items())], left=(0, 1))


def _as_json(model: "AbstractModel") -> dict[str, object]:
    return {
        "name": model.name,
        "family": model.family,
        "order": model.order,
        "n_parameters": model.n_parameters,
        "formula": model.formula,
        "properties": sorted(each.name.lower() for each in model.properties),
    }


def _holds(members: "list[AbstractModel]", what: "Property") -> str:
    orders = [model.order for model in members if what in model.properties]
    if len(orders) == len(members):
        return "yes"
    return f"order {_ranges(orders)}" if orders else "-"


def _ranges(orders: list[int]) -> str:
    """Orders as a text: ``0-6``, ``0, 2``."""
    runs: list[list[int]] = []
    for order in orders:
        if runs and order == runs[-1][-1] + 1:
            runs[-1].append(order)
        else:
            runs.append([order])
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
