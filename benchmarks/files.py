"""Brackets and bursts as files: what compression, white and hard shoulders do to a calibration.

    python benchmarks/files.py [--rivals PYTHON] [--answers FILE.npz] [--data FOLDER]
                               [--n CASES] [--skip CASES] [--formats png,jpeg95,...]
                               [--kinds bracket,...] [--json]

Data are in FOLDER, or in the one that CHARTLESS_DATA names. PYTHON is that of an environment with
the packages in `rivals.txt`; without it only chartless is measured.

A case is a scene before a camera. Scenes are, in turn, crops of HDR maps (folders hdr_polyhaven_1k,
linear_hdr_world) and photographs (exr_linear_photos; scenery_1600x900 with sRGB undone), 640 × 480.
Curves are, in turn, of digital cameras (folder modern_curves, one for all channels) and of DoRF
(the three channels of a film or camera, or one for all); the prior is made without the camera
under test. Noise is that of a sensor of 10,000 electrons that is read with 6.

bracket    five exposures two stops apart, a middle grey of 0.18 in the middle one, exposures given
noisy      the same, noise of 1,000 electrons read with 6
unknown    the same with --times unknown
exif       the same, exposures known as well as EXIF tells them
unaligned  the same, levels matched by rank
burst      two frames of the middle exposure, noise of 1,000 electrons read with 6

Every file is written and read again: PNG, or JPEG of a quality with or without reduced chroma
(`jpeg90-420`); `regrid` is JPEG 90 4:2:0 saved as PNG. Of each channel the table has medians of

shape      root mean square of f(s x) − y at the best scale s, as in `brackets.py`
light      root mean square of g − truth over the levels, no scale
white      how far ln g is off at a brightness of 0.8: the error of the scale
white band the deviation that the calibration claims for that
band       the root mean square that the calibration claims for g
cover      share of levels 1 … 254 at which the truth lies within two deviations of g
at best    root mean square of g − truth where g is brought closest by one factor
claimed    what the calibration claims for that: the deviation of the shape
held       mean share of levels 1 … 254 at which it holds, within two deviations

and over all calibrations of a row, how many were called good, with care, not to be trusted, or
were refused; `wrong` is the share of those called good that are off by more than 0.02 in a
channel's light.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before NumPy starts

import argparse
import json
import re
import statistics
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from brackets import DEFAULTS, Bracket, Rivals, Truth, error, print_table, without_infinity
from PIL import Image
from priors import digital_prior, mixture
from scipy.ndimage import zoom

from chartless import calibrate
from chartless.curves import SampledCurve
from chartless.curves.prior import CurvePrior
from chartless.datasets import Dorf, load_dorf
from chartless.errors import ChartlessError
from chartless.evidence.exposures import EXIF_ERROR
from chartless.experiments.noise import curve_prior
from chartless.images import read_values
from chartless.methods import LikelihoodSearch
from chartless.noise import AffineNoise
from chartless.result.calibration import Calibration
from chartless.result.response import Response
from chartless.result.verdict import verdict
from chartless.types import Floats, JsonObject, Levels

SIZE = (480, 640)
TIMES = [1.0, 4.0, 16.0, 64.0, 256.0]
GREY = 0.18
"""Median of the light in the middle exposure."""
NOISE = AffineNoise.of_sensor(10_000, 6)
HIGH_ISO = AffineNoise.of_sensor(1_000, 6)
FORMATS = ("png", "jpeg100", "jpeg95", "jpeg95-420", "jpeg90-420", "jpeg80-420", "regrid")
KINDS = ("bracket", "noisy", "exif", "unknown", "unaligned", "burst")
CHANNELS = "RGB"
WRONG = 0.02
"""Error of light from which a calibration that is called good is wrong."""
MEDIANS = ("shape", "light", "white", "white_band", "band", "cover", "at_best", "claimed")
REFERENCE = 0.8
"""Brightness at which the scale is compared."""


@dataclass(frozen=True, eq=False)
class Case:
    """A scene before a camera."""

    name: str
    scene: Floats
    """Light, shape (M, N, 3), its median `GREY`."""
    curves: tuple[SampledCurve, SampledCurve, SampledCurve]
    prior: CurvePrior
    """Without the camera."""
    is_digital: bool
    seed: int

    def levels(self, exposure: float, noise: AffineNoise, seed: int) -> Levels:
        """Frame of 8 bits."""
        generator = np.random.default_rng([self.seed, seed])
        light = np.maximum(self.scene * exposure, 0.0)
        light = light + generator.standard_normal(light.shape) * noise.std(light)
        shown = [curve.response(light[..., c].clip(0, 1)) for c, curve in enumerate(self.curves)]
        frame: Levels = np.rint(255 * np.stack(shown, axis=-1)).astype(np.uint8)
        return frame

    def truth(self, channel: int) -> Floats:
        """Irradiance at the levels, shape (256,)."""
        return np.asarray(self.curves[channel].inverse(np.arange(256) / 255))


def cases(data: Path, n: int) -> Iterator[Case]:
    """So many cases, digital cameras and DoRF in turn."""
    scenes, cameras = list(_scenes(data)), list(_cameras(data))
    generator = np.random.default_rng(7)
    scene_order = [int(k) for k in generator.permutation(len(scenes) // 2)]
    for place in range(n):
        # Maps and photographs in turn of each kind of camera.
        scene_name, path = scenes[
            (2 * scene_order[(place // 4) % len(scene_order)] + place // 2) % len(scenes)
        ]
        camera_name, curves, prior = cameras[place % len(cameras)]
        digital = place % 2 == 0
        yield Case(f"{scene_name}, {camera_name}", _light(path), curves, prior, digital, place)


def _scenes(data: Path) -> Iterator[tuple[str, Path]]:
    """Maps and photographs in turn."""
    maps = sorted((data / "hdr_polyhaven_1k").glob("*.hdr"))
    maps += sorted((data / "linear_hdr_world").glob("*.exr"))
    photographs = sorted((data / "scenery_1600x900").glob("*.jpg"))
    photographs[::4] = sorted((data / "exr_linear_photos").glob("*.exr"))[: len(photographs[::4])]
    for pair in zip(maps, photographs, strict=False):
        yield from ((path.stem, path) for path in pair)


def _light(path: Path) -> Floats:
    values = read_values(path).values.astype(np.float64)
    if path.suffix == ".jpg":
        values = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)  # noqa: PLR2004 - sRGB
    values = np.maximum(values, 0.0)
    scale = max(rows / have for rows, have in zip(SIZE, values.shape, strict=False))
    if scale > 1 or path.suffix == ".jpg":
        values = np.maximum(zoom(values, (scale, scale, 1), order=1), 0.0)
    down, right = ((have - wanted) // 2 for have, wanted in zip(values.shape, SIZE, strict=False))
    values = values[down : down + SIZE[0], right : right + SIZE[1]]
    # Maps store mantissas of 8 bits: the noise of a camera hides their steps.
    return np.asarray(values / np.median(values) * GREY / TIMES[len(TIMES) // 2])


def _cameras(
    data: Path,
) -> Iterator[tuple[str, tuple[SampledCurve, SampledCurve, SampledCurve], CurvePrior]]:
    """Digital cameras and DoRF in turn."""
    with np.load(data / "modern_curves" / "responses_1024.npz") as stored:
        names = [str(name) for name in stored["names"]]
        light, brightness = stored["E"].astype(float), stored["f"].astype(float)
    order = np.random.default_rng(1).permutation(len(names))
    dorf = load_dorf(data / "dorf" / "dorf_named.npz")
    triples = [row for row in range(len(dorf.names) - 2) if _is_triple(dorf, row)]
    rows = np.random.default_rng(2).permutation(triples)
    for modern, row in zip(order, rows, strict=False):
        curve = _sampled(light, brightness[modern])
        yield names[modern], (curve,) * 3, mixture(digital=digital_prior(data, names[modern]))
        red, green, blue = (_sampled(dorf.irradiance, dorf.curves[row + c]) for c in range(3))
        name = re.sub("[-_]?(Red|R)$", "", dorf.names[row])
        yield name, (red, green, blue), mixture(dorf=curve_prior(dorf, int(row)))


def _is_triple(dorf: Dorf, row: int) -> bool:
    """Whether red, green and blue of one camera begin at a row."""
    ends = zip(dorf.names[row : row + 3], ("red", "green", "blue"), strict=True)
    return len(set(dorf.cameras[row : row + 3])) == 1 and all(
        name.lower().endswith(end) for name, end in ends
    )


def _sampled(irradiance: Floats, brightness: Floats) -> SampledCurve:
    rising = np.maximum.accumulate(brightness)
    return SampledCurve(
        tuple(irradiance.tolist()),
        tuple(((rising - rising[0]) / (rising[-1] - rising[0])).tolist()),
    )


# --- files


def written(folder: Path, stem: str, levels: Levels, form: str) -> Path:
    """File of a frame in one of `FORMATS`."""
    picture = Image.fromarray(levels)
    if form == "png":
        path = folder / f"{stem}.png"
        picture.save(path)
        return path
    quality, _, chroma = form.removeprefix("jpeg").partition("-")
    if form == "regrid":
        quality, chroma = "90", "420"
    path = folder / f"{stem}.jpg"
    picture.save(path, quality=int(quality), subsampling=2 if chroma else 0)
    if form == "regrid":
        with Image.open(path) as read:
            read.load()
            return written(folder, stem, np.asarray(read), "png")
    return path


@dataclass(frozen=True, eq=False)
class Shot:
    """Files of a case, and how they are given to `calibrate`."""

    case: Case
    kind: str
    form: str
    paths: tuple[Path, ...]

    @cached_property
    def settings(self) -> JsonObject:
        """Arguments of `calibrate` besides the files."""
        settings: dict[str, JsonObject] = {
            "bracket": {"times": TIMES},
            "noisy": {"times": TIMES},
            "unknown": {"times": "unknown"},
            "exif": {"times": TIMES, "time_error": EXIF_ERROR},
            "unaligned": {"times": TIMES, "aligned": False},
            "burst": {},
        }
        return {**settings[self.kind], "method": LikelihoodSearch(prior=self.case.prior)}


def shots(case: Case, kinds: Iterable[str], forms: Iterable[str], folder: Path) -> Iterator[Shot]:
    """Files of one case, written when they are asked for."""
    for form in forms:
        made: dict[str, tuple[Path, ...]] = {}
        for kind in kinds:
            what = kind if kind in {"burst", "noisy"} else "bracket"
            if what not in made:
                if what == "burst":
                    frames = [case.levels(TIMES[2], HIGH_ISO, 10 + k) for k in range(2)]
                else:
                    noise = HIGH_ISO if what == "noisy" else NOISE
                    frames = [case.levels(t, noise, k) for k, t in enumerate(TIMES)]
                made[what] = tuple(
                    written(folder, f"{case.seed}-{form}-{what}-{k}", frame, form)
                    for k, frame in enumerate(frames)
                )
            yield Shot(case, kind, form, made[what])


# --- measures


@dataclass(frozen=True, slots=True)
class Measured:
    """One channel."""

    shape: float
    light: float
    white: float
    white_band: float
    band: float
    cover: float
    at_best: float
    claimed: float
    held: float


def scale_of(inverse: Floats, truth: Floats) -> float:
    """Ln of g over the truth at `REFERENCE`: how far the light at white is off."""
    place = round(REFERENCE * 255)
    return float(np.log(inverse[place] / truth[place]))


def error_of(case: Case, channel: int, inverse: Floats) -> float:
    """Error of the level at the best scale."""
    grid = np.linspace(0.0, 1.0, 1024)
    brightness = case.curves[channel].response(grid)
    return error(inverse, Truth(grid, brightness, np.zeros(grid.size, dtype=np.intp)))


def measured(case: Case, channel: int, response: Response) -> Measured:
    """Errors of a channel."""
    inverse, std = response.inverse_lut, response.inverse_lut_std
    truth = case.truth(channel)
    known = np.full(256, np.nan) if std is None else std
    scale = scale_of(inverse, truth)
    inner = slice(1, 255)
    off = np.abs(inverse - truth)[inner]
    at_best = np.abs(inverse * (truth @ inverse) / (inverse @ inverse) - truth)
    shape_std = known if response.shape_std is None else response.shape_std
    return Measured(
        shape=error_of(case, channel, inverse),
        light=float(np.sqrt(np.mean((inverse - truth) ** 2))),
        white=abs(scale),
        white_band=float("nan") if response.white_std is None else response.white_std,
        band=float(np.sqrt(np.mean(known**2))),
        cover=float(np.mean(off <= 2 * known[inner])),
        at_best=float(np.sqrt(np.mean(at_best**2))),
        claimed=float(np.sqrt(np.mean(shape_std**2))),
        held=float(np.mean(at_best[inner] <= 2 * shape_std[inner])),
    )


def calibrated(shot: Shot) -> Calibration | str:
    """Calibration of some files, or why there is none."""
    try:
        return calibrate(list(shot.paths), **shot.settings)
    except ChartlessError as reason:
        return str(reason)


def channel_truths(shot: Shot, calibration: Calibration) -> list[Measured]:
    """Errors of all channels."""
    return [
        measured(shot.case, place, response) for place, response in enumerate(calibration.channels)
    ]


def ours(shot: Shot) -> JsonObject:
    """What chartless makes of some files."""
    start = time.perf_counter()
    found = calibrated(shot)
    seconds = time.perf_counter() - start
    about: JsonObject = {
        "case": shot.case.name,
        "kind": shot.kind,
        "form": shot.form,
        "seconds": seconds,
    }
    if isinstance(found, str):
        return {**about, "verdict": "refused", "reason": found, "channels": []}
    return {
        **about,
        "verdict": verdict(found.channels).grade.value,
        "reason": str(verdict(found.channels)),
        "flags": sorted({flag.code for each in found.channels for flag in each.flags}),
        "stops": [
            float(np.ptp(np.log2(each.account("bracket")["exposures"])))
            for each in found.channels
            if "bracket" in each.kinds
        ],
        "channels": [
            {name: getattr(each, name) for name in Measured.__dataclass_fields__}
            for each in channel_truths(shot, found)
        ],
    }


def row(results: Sequence[JsonObject]) -> JsonObject:
    """Summary of the results of one kind and form."""
    channels = [each for result in results for each in result["channels"]]

    def middle(name: str) -> float:
        values = [each[name] for each in channels if np.isfinite(each[name])]
        return statistics.median(values) if values else float("nan")

    good = [result for result in results if result["verdict"] == "good"]
    wrong = sum(max(each["light"] for each in result["channels"]) > WRONG for result in good)
    return {
        **{name: middle(name) for name in MEDIANS},
        "held": float(np.mean([each["held"] for each in channels] or [float("nan")])),
        "mean cover": float(np.mean([each["cover"] for each in channels] or [float("nan")])),
        "worst shape": max((each["shape"] for each in channels), default=float("nan")),
        "worst light": max((each["light"] for each in channels), default=float("nan")),
        "channels": len(channels),
        **{
            grade: sum(result["verdict"] == grade for result in results)
            for grade in ("good", "usable with care", "do not trust", "refused")
        },
        "wrong": wrong,
        "seconds": statistics.median(result["seconds"] for result in results),
    }


def rival_rows(asked: Sequence[Shot], rivals: Rivals) -> dict[str, JsonObject]:
    """Median and worst shape of other programs, on the files of brackets with exposures given."""
    own = [shot for shot in asked if shot.kind == "bracket"]
    brackets = [Bracket(f"{k}", TIMES, paths=shot.paths) for k, shot in enumerate(own)]
    estimates = rivals.ask(brackets, DEFAULTS)
    errors: dict[tuple[str, str], list[float]] = {}
    for (name, method), estimate in estimates.items():
        shot = own[int(name)]
        for channel, inverse in enumerate(estimate.inverse):
            grid = np.linspace(0.0, 1.0, 1024)
            brightness = shot.case.curves[channel].response(grid)
            truth = Truth(grid, brightness, np.zeros(grid.size, dtype=np.intp))
            errors.setdefault((shot.form, method), []).append(error(inverse, truth))
    return {
        form: {
            method: {"shape": statistics.median(values), "worst shape": max(values)}
            for (own_form, method), values in errors.items()
            if own_form == form
        }
        for form in dict.fromkeys(form for form, _ in errors)
    }


def print_page(rows: dict[str, dict[str, JsonObject]], peers: dict[str, JsonObject]) -> None:
    """Everything, aligned."""
    for kind, forms in rows.items():
        print(f"\n{kind}")
        names = ["shape", "worst shape", "light", "worst light", "white", "white_band", "band"]
        shape_names = ["at_best", "claimed"]
        counts = ["good", "usable with care", "do not trust", "refused", "wrong"]
        head = [
            *(name.replace("_", " ") for name in names), "cover", "mean cover",
            *(name.replace("_", " ") for name in shape_names), "held",
            "good", "care", "distrust", "refused", "wrong", "seconds",
        ]  # fmt: skip
        table = [["", *head]]
        for form, own in forms.items():
            cells = [f"{own[name]:.4f}" for name in names]
            cells += [f"{own[name]:.2f}" for name in ("cover", "mean cover")]
            cells += [f"{own[name]:.4f}" for name in shape_names] + [f"{own['held']:.2f}"]
            cells += [f"{own[name]}" for name in counts]
            table.append([form, *cells, f"{own['seconds']:.2f}"])
        print_table(table)
    for form, methods in peers.items():
        print(f"\nother programs, {form}")
        print_table(
            [["", "shape", "worst shape"]]
            + [
                [name, f"{own['shape']:.4f}", f"{own['worst shape']:.4f}"]
                for name, own in methods.items()
            ]
        )


def main() -> None:
    """Write files, calibrate them, print what came out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("CHARTLESS_DATA", "data")))
    parser.add_argument("--rivals")
    parser.add_argument("--answers", type=Path)
    parser.add_argument("--n", type=int, default=16)
    parser.add_argument("--skip", type=int, default=0)
    parser.add_argument("--formats", default=",".join(FORMATS))
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    kinds, forms = options.kinds.split(","), options.formats.split(",")
    results: list[JsonObject] = []
    asked: list[Shot] = []
    with tempfile.TemporaryDirectory() as folder:
        for case in islice(cases(options.data, options.skip + options.n), options.skip, None):
            own = list(shots(case, kinds, forms, Path(folder)))
            asked += own
            results += [ours(shot) for shot in own]
        peers = rival_rows(asked, Rivals(options.rivals, options.answers))
    rows = {
        kind: {
            form: row([each for each in results if (each["kind"], each["form"]) == (kind, form)])
            for form in forms
        }
        for kind in kinds
    }
    if options.json:
        found: dict[str, Any] = {"rows": rows, "rivals": peers, "results": results}
        print(json.dumps(without_infinity(found), indent=1))
    else:
        print_page(rows, peers)


if __name__ == "__main__":
    main()
