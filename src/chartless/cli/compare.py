"""``chartless compare``: all families fitted to measured curves."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chartless.cli._options import AsJson, parse_samples
from chartless.cli._terminal import case_bar, naming, print_json, print_table, remark

if TYPE_CHECKING:
    from chartless.curves.comparison import Candidate, Comparison
    from chartless.types import Floats, JsonObject

_DRAWN = 4


def compare(
    curves: Annotated[
        list[Path],
        typer.Argument(
            help="Files of two columns, irradiance and brightness, each in 0 to 1, or names such "
            "as srgb.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Picture of the first curve: .png, .svg or .pdf."),
    ] = None,
    every_order: Annotated[
        bool, typer.Option("--all", help="Show every order, not only the best of each family.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Fit every family to measured curves and recommend one.

    AICc and BIC weigh closeness against the number of parameters; lower is better, and they
    are shown as differences from the best. Recommended is the family of least BIC among
    those whose fits are valid responses of every curve.

    \b
    Example:
        chartless compare curve.csv
        chartless compare slog3
        chartless compare red.csv green.csv blue.csv -o compare.png
    """
    from chartless._files import require_writable
    from chartless.curves.comparison import compare as compare_families
    from chartless.curves.fitting import checked_samples

    samples = [parse_samples(path) for path in curves]
    for path, (irradiance, brightness) in zip(curves, samples, strict=True):
        with naming(path):
            checked_samples(irradiance, brightness)
    if output is not None:
        require_writable(output)
    with case_bar("fitting") as on_case:
        comparison = compare_families(samples, on_model=on_case)
    recommended = comparison.recommended
    if output is not None:
        from chartless.plotting import fits_figure, save_figure

        drawn = [each.fits[0] for each in _distinct(comparison)]
        save_figure(fits_figure(*samples[0], drawn, title=curves[0].name), output)
    if as_json:
        print_json(_as_json(comparison))
        return
    shown = comparison.candidates if every_order else _best(comparison)
    least = [min(getattr(each, what) for each in shown) for what in ("aicc", "bic")]
    rows = [
        [
            each.model.name,
            str(each.model.n_parameters),
            f"{each.rmse:.6f}",
            _difference(each.aicc, least[0]),
            _difference(each.bic, least[1]),
            "yes" if each.valid else "no",
        ]
        for each in shown
    ]
    print_table(["model", "parameters", "RMSE", "ΔAICc", "ΔBIC", "valid response"], rows)
    counts = ", ".join(f"{count:.0f}" for count in comparison.n_independent)
    remark(f"the criteria count {counts} independent samples of {_sizes(samples)}")
    if recommended is None and any(each.valid for each in comparison.candidates):
        remark("these are too few to recommend a family: choose by RMSE, or measure more samples")
    elif recommended is None:
        remark("no family gives a valid response: check the samples near black and white")
    else:
        print(f"\nrecommended: {recommended.model.name}")
    if output is not None:
        print(f"picture written to {output}")


def _best(comparison: "Comparison") -> "list[Candidate]":
    """Best order of each family by BIC, best family first."""
    families: dict[str, Candidate] = {}
    for each in sorted(comparison.candidates, key=lambda each: each.bic):
        families.setdefault(each.model.family, each)
    return list(families.values())


def _distinct(comparison: "Comparison") -> "list[Candidate]":
    """Return the recommended family, then the best others whose curves differ, valid ones first."""
    ranked = sorted(_best(comparison), key=lambda each: (not each.valid, each.bic))
    chief = comparison.recommended
    if chief is not None:
        ranked = [chief, *(each for each in ranked if each is not chief)]
    different = {f"{each.rmse:.3g}": each for each in reversed(ranked)}
    return [each for each in ranked if different[f"{each.rmse:.3g}"] is each][:_DRAWN]


def _difference(value: float, least: float) -> str:
    return f"{value - least:.1f}" if math.isfinite(value) else "-"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _sizes(samples: "list[tuple[Floats, Floats]]") -> str:
    return ", ".join(str(irradiance.size) for irradiance, _ in samples)


def _as_json(comparison: "Comparison") -> "JsonObject":
    recommended = comparison.recommended
    return {
        "recommended": None if recommended is None else recommended.model.name,
        "independent_samples": list(comparison.n_independent),
        "models": [
            {
                "model": each.model.name,
                "n_parameters": each.model.n_parameters,
                "rmse": each.rmse,
                "aicc": _finite(each.aicc),
                "bic": _finite(each.bic),
                "valid_response": each.valid,
                "converged": all(fit.converged for fit in each.fits),
                "parameters": [fit.parameters.tolist() for fit in each.fits],
            }
            for each in comparison.candidates
        ],
    }
