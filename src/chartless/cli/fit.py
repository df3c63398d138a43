"""``chartless fit``: a family fitted to a measured curve."""

import math
from pathlib import Path
from typing import Annotated

import typer

from chartless.cli._options import AsJson, parse_samples
from chartless.cli._terminal import naming, print_json, print_table, remark

_SHOWN = 24  # parameters; a table has hundreds


def fit(
    curve: Annotated[
        Path,
        typer.Argument(
            help="Two columns, irradiance and brightness, each in 0 to 1; or a name such as srgb.",
            show_default=False,
        ),
    ],
    model: Annotated[
        str, typer.Option(help="Family and order, such as ameegc2-exact, gumbel4, emor2.")
    ] = "ameegc2-exact",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Picture to draw: .png, .svg or .pdf.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fit a family of response curves to a measured one.

    By least squares on brightness. `chartless models` lists the families, `chartless compare`
    tries all of them.

    \b
    Example:
        chartless fit curve.csv
        chartless fit curve.csv --model gumbel4 -o fit.png
    """
    from chartless.curves.comparison import is_valid
    from chartless.curves.fitting import fit as fit_curve

    irradiance, brightness = parse_samples(curve)
    with naming(curve):
        found = fit_curve(model, irradiance, brightness)
    errors = [float(each) if math.isfinite(each) else None for each in found.standard_errors]
    names = found.model.parameter_names
    if output is not None:
        from chartless.plotting import fits_figure, save_figure

        save_figure(fits_figure(irradiance, brightness, [found], title=curve.name), output)
    if as_json:
        covariance = found.covariance.tolist() if None not in errors else None
        print_json(
            {
                "model": found.model.name,
                "formula": found.model.formula,
                "parameters": dict(zip(names, found.parameters.tolist(), strict=True)),
                "standard_errors": dict(zip(names, errors, strict=True)),
                "covariance": covariance,
                "rmse": found.rmse,
                "samples": found.n_samples,
                "converged": found.converged,
                "valid_response": is_valid(found),
            }
        )
        return
    print(f"{found.model.name}: f(I) = {found.model.formula}")
    rows = [
        [name, f"{value:.6g}", "-" if error is None else f"{error:.2g}"]
        for name, value, error in zip(names, found.parameters, errors, strict=True)
    ]
    print_table(["parameter", "value", "std error"], rows[:_SHOWN])
    if len(rows) > _SHOWN:
        print(f"… and {len(rows) - _SHOWN} more (see --json)")
    print(f"RMSE {found.rmse:.6f} over {found.n_samples} samples")
    if brightness[-1] < brightness[0]:
        remark("brightness falls as irradiance rises: check the order of columns and rows")
    if not found.converged:
        remark(
            "the search did not converge: it stopped at a limit of the family, or at a kink of "
            "its curves"
        )
    if not is_valid(found):
        remark(
            "the fitted curve is not a valid response: it decreases, or misses 0, 1 or the range"
        )
    if output is not None:
        print(f"picture written to {output}")
