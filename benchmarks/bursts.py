"""Two frames of one exposure as cameras make them, against the typical curve.

    python benchmarks/bursts.py [--data FOLDER] [--n CASES] [--forms png,jpeg95,...] [--json]

Data are in FOLDER, or in the one that CHARTLESS_DATA names. Scenes and cameras are those of
`files.py`, digital cameras and DoRF in turn, each left out of every population of the prior. The
noise is that of sensors of 1,000, 4,000 and 300 electrons read with 6, 8 and 6, in turn.

A form is one or more steps, with `+` between them, and written to files at the end:

png              nothing
jpeg95, ...      JPEG of a quality, `-420` with reduced chroma
demosaic         one colour for each pixel (RGGB), the others interpolated bilinearly in light
bilateral, nlm   denoised by OpenCV: bilateral filter, non-local means

Of all channels the table has medians of

shape       root mean square of f(s x) − y at the best scale s, as in `files.py`
typical     that of the typical curve of digital cameras, the camera left out
ratio       of these two medians
light       root mean square of g − truth over the levels
band        the root mean square that the calibration claims for that
counts as   pairs that the level pairs count as at most; inf if in full

and the mean share of levels 1 … 254 at which g lies within two deviations (cover), then how many
calibrations were called good, with care, not to be trusted, or were refused, and how many of
those called good are off by more than 0.02 in a channel's light (wrong).

At the end, the real burst of folder burst_canon_s95_static: JPEG at ISO 3200, denoised by the
camera. Its curve is not known; how far the result is from the typical curve is printed.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before NumPy starts

import argparse
import json
import statistics
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
from brackets import print_table
from files import TIMES, WRONG, Case, cases, error_of, measured, written
from priors import digital_prior

from chartless import calibrate, load_calibration
from chartless.curves.prior import irradiance_at_edges
from chartless.errors import ChartlessError
from chartless.inference.posterior import at_levels
from chartless.methods import LikelihoodSearch
from chartless.noise import AffineNoise
from chartless.result.verdict import verdict
from chartless.types import Floats, JsonObject, Levels

FORMS = (
    "png", "jpeg100", "jpeg95", "jpeg95-420", "jpeg85", "bilateral", "nlm", "demosaic",
    "bilateral+jpeg95", "nlm+jpeg95-420", "demosaic+jpeg95",
)  # fmt: skip
SENSORS = tuple(AffineNoise.of_sensor(*each) for each in ((1_000, 6), (4_000, 8), (300, 6)))
GRADES = ("good", "usable with care", "do not trust", "refused")
_ROOM, _WHITE = 10_000, 40_000  # levels of 16 bits below black, and from black to white
_COLOURS = np.array([[0, 1], [1, 2]])  # of the pixels of a cell


@dataclass(frozen=True, slots=True)
class Channel:
    """What came out for one channel."""

    shape: float
    typical: float
    light: float
    band: float
    cover: float
    counts_as: float


def frame(case: Case, form: str, noise: AffineNoise, seed: int) -> Levels:
    """Frame of 8 bits, after all steps but JPEG."""
    levels = case.levels(TIMES[2], noise, seed)
    for step in form.split("+"):
        if step == "demosaic":
            levels = _demosaiced(case, noise, seed)
        elif step == "bilateral":
            levels = np.asarray(cv2.bilateralFilter(levels, 7, 25, 3), dtype=np.uint8)
        elif step == "nlm":
            smooth = cv2.fastNlMeansDenoisingColored(levels, None, 5, 5, 5, 13)
            levels = np.asarray(smooth, dtype=np.uint8)
    return levels


def _demosaiced(case: Case, noise: AffineNoise, seed: int) -> Levels:
    light = np.maximum(case.scene * TIMES[2], 0.0)
    generator = np.random.default_rng([case.seed, seed])
    light = light + generator.standard_normal(light.shape) * noise.std(light)
    rows, columns = np.indices(light.shape[:2]) % 2
    sites = np.take_along_axis(light, _COLOURS[rows, columns][..., np.newaxis], axis=2)[..., 0]
    mosaic = np.clip(sites * _WHITE + _ROOM, 0, 65535).astype(np.uint16)
    colours = cv2.cvtColor(mosaic, cv2.COLOR_BayerRGGB2RGB).astype(np.float64)
    whole = ((colours - _ROOM) / _WHITE).clip(0, 1)
    shown = [curve.response(whole[..., c]) for c, curve in enumerate(case.curves)]
    return np.rint(255 * np.stack(shown, axis=-1)).astype(np.uint8)


def result(case: Case, form: str, folder: Path, data: Path) -> JsonObject:
    """What chartless makes of two files, and what the typical curve would be."""
    noise = SENSORS[case.seed % len(SENSORS)]
    last = form.rsplit("+", maxsplit=1)[-1]
    paths = [
        written(
            folder,
            f"{case.seed}-{form}-{k}",
            frame(case, form, noise, 10 + k),
            last if last.startswith("jpeg") else "png",
        )
        for k in range(2)
    ]
    about: JsonObject = {"case": case.name, "form": form, "digital": case.is_digital}
    method = LikelihoodSearch(prior=case.prior)
    try:
        found = calibrate(paths, evidence="noise", method=method)
    except ChartlessError as reason:
        return {**about, "verdict": "refused", "reason": str(reason), "channels": []}
    name = case.name.rpartition(", ")[2]
    typical = light_of(digital_prior(data, name).mean)
    channels = []
    for place, response in enumerate(found.channels):
        own, account = measured(case, place, response), response.account("noise")
        known = account["counts_as"] if "counts_as" in account else float("inf")
        channels.append(
            Channel(
                own.shape, error_of(case, place, typical), own.light, own.band, own.cover, known
            )
        )
    grade = verdict(found.channels).grade.value
    return {**about, "verdict": grade, "channels": [asdict(each) for each in channels]}


def light_of(log_slopes: Floats) -> Floats:
    """Irradiance at the levels, shape (256,)."""
    return at_levels(irradiance_at_edges(log_slopes)[1:-1])


def table(results: Sequence[JsonObject]) -> list[list[str]]:
    """One row for each form."""
    head = ["", "n", "shape", "typical", "ratio", "light", "band", "cover", "counts as"]
    rows = [[*head, "good", "care", "distrust", "refused", "wrong"]]
    for form in dict.fromkeys(each["form"] for each in results):
        own = [each for each in results if each["form"] == form]
        channels = [channel for each in own for channel in each["channels"]]

        def middle(name: str, channels: list[JsonObject] = channels) -> float:
            return float(np.median([each[name] for each in channels]))

        good = [each for each in own if each["verdict"] == "good"]
        wrong = sum(max(c["light"] for c in each["channels"]) > WRONG for each in good)
        figures = [str(len(channels)), *["-"] * 7]
        if channels:
            shape, typical = middle("shape"), middle("typical")
            cover = statistics.fmean(each["cover"] for each in channels)
            figures = [
                str(len(channels)), f"{shape:.4f}", f"{typical:.4f}", f"{shape / typical:.2f}",
                f"{middle('light'):.4f}", f"{middle('band'):.4f}", f"{cover:.2f}",
                f"{middle('counts_as'):.1f}",
            ]  # fmt: skip
        counts = [str(sum(each["verdict"] == grade for each in own)) for grade in GRADES]
        rows.append([form, *figures, *counts, str(wrong)])
    return rows


def of_s95(data: Path) -> list[list[str]]:
    """Distance of the real burst from the typical curve."""
    found = calibrate(sorted((data / "burst_canon_s95_static").glob("*.JPG")))
    typical = load_calibration("typical").channels[0].inverse_lut
    rows = [["", "from typical", "largest", "band", "typical held"]]
    for channel in found.channels:
        assert channel.inverse_lut_std is not None
        off = np.abs(channel.inverse_lut - typical)[1:-1]
        within = float(np.mean(off <= 2 * channel.inverse_lut_std[1:-1]))
        band = float(np.sqrt(np.mean(channel.inverse_lut_std**2)))
        rms = float(np.sqrt(np.mean(off**2)))
        rows.append(
            [channel.name, f"{rms:.4f}", f"{off.max():.4f}", f"{band:.4f}", f"{within:.2f}"]
        )
    return [*rows, [str(verdict(found.channels).grade.value), *[""] * 4]]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("CHARTLESS_DATA", "data")))
    parser.add_argument("--n", type=int, default=16, help="cases [16]")
    parser.add_argument("--forms", default=",".join(FORMS), help="forms, with commas [all]")
    parser.add_argument("--json", action="store_true", help="print every result as JSON")
    options = parser.parse_args()
    forms = options.forms.split(",")
    with tempfile.TemporaryDirectory() as folder:
        results = [
            result(case, form, Path(folder), options.data)
            for case in cases(options.data, options.n)
            for form in forms
        ]
    if options.json:
        print(json.dumps(results))
        return
    for digital in (True, False):
        own = [each for each in results if each["digital"] is digital]
        if own:
            print("\ndigital cameras" if digital else "\nDoRF")
            print_table(table(own))
    print("\nCanon S95, a real burst of six JPEGs")
    print_table(of_s95(options.data))


if __name__ == "__main__":
    main()
