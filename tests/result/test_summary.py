"""Short texts about a calibration."""

import pytest

from chartless import AffineNoise, Response, named_curve
from chartless.evidence.noise.estimates import NoiseError
from chartless.result.response import Status
from chartless.result.summary import noise_text


def response_of(slope: float, log_slope: float | None) -> Response:
    error = None if log_slope is None else NoiseError(log_slope, 1.0, 0.0)
    return Response(
        name="G", curve=named_curve("srgb"), noise=AffineNoise.from_8bit(slope, 1.0), n_levels=256,
        observed_levels=(0, 255), n_pairs=1, method="likelihood", status=Status.CONVERGED,
        noise_error=error,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("value", "relative", "said"),
    [
        (0.25, 0.2, "0.250 ± 0.050"),
        (1234.5, 0.5, "1234 ± 617"),
        (9.0, 0.1, "9.00 ± 0.90"),
        (0.00046, 0.7, "0.00046 ± 0.00032"),
        (0.0000613, 0.2, "0.00006 ± 0.00001"),
        (0.000001, 0.5, "< 0.00001"),
        (0.1, 0.0, "0.10000 ± 0.00000"),
        (0.1, None, "0.1000"),
    ],
)
def test_noise_has_two_digits_of_its_deviation(
    value: float, relative: float | None, said: str
) -> None:
    assert noise_text("slope", response_of(value, relative), 3) == said
