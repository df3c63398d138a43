"""Inverse responses estimated from exposure brackets: ours, and those of other programs.

    python benchmarks/brackets.py [--rivals PYTHON] [--answers FILE.npz] [--data FOLDER]
                                  [--cases real,offset,samples,simulated,deep,timing] [--json]

Data are in FOLDER, or in the one that CHARTLESS_DATA names. PYTHON is that of an environment with
the packages in `rivals.txt`, in which `bracket_rivals.py` runs; without it only our methods are
measured. FILE.npz keeps what rivals answered, except in `timing`, and spares asking again.

real        nine cameras, a chart at four exposures, 27 camera-channels (folders middlebury and
            middlebury_response), each left out of the prior. Methods get all pixels of the crops
            and the exposures as measured from the raw files. Truth are the grey patches: light
            from raw against mean level, in each frame
offset      the same with exposures and light measured anew. The raw files are of 8 bits, and of
            most cameras they read 0.2 to 0.5 levels too low, as if cut off and not rounded, so
            exposures as measured are too large. A black level for each camera is fitted with them
samples     as real, for OpenCV's Debevec with other numbers of samples
simulated   a photograph and a panorama, sRGB and film, noise U = 0.03 and V = 16, exposures 1, 2,
            4 and 8. Truth is the curve at 1024 irradiances
deep        the same photograph by sRGB at 1024 and 4096 levels
timing      9 frames of 4.9 megapixels on disk as PNG: seconds to read, seconds to estimate, one
            run each

The error is the root mean square of f(s x) − y over the truth (x, y), in units of full range,
with the best scale s: x is known up to one. f joins the points (g, level) of the estimate by
straight lines, and steps where several levels share an irradiance. A g that decreases
anywhere or is not a number somewhere is a failure and counted as such; it is measured as well,
after filling gaps by straight lines between neighbours and taking the running maximum. Where no
number is left at all the error is infinite in medians and ratios, and missing from mean and worst.

Patches are left out where the level is below 3 or above 252, where it does not vary from pixel to
pixel (deviation below 0.1: clipped), or where the raw file is saturated. Some rows of the real
cameras estimate nothing:

sRGB assumed        its curve
truth, isotonic     the best increasing f of all, the floor set by the truth not being one curve
truth, smooth       cubic spline of ln x with nine coefficients, increasing, fitted to the truth:
                    what a method can hope for
truth, own gains    the same when each frame may have a gain of its own, in each channel. Where
                    this is much less, the camera set white balance or tone anew for each frame,
                    and exposures as measured are not those of the file. The gains, in stops,
                    stand beside the levels that the patches cover

`steady` is the summary of the channels whose smooth truth is within 0.006.

Rivals are compared at their defaults. `best` is the best of them for that camera-channel, which
nobody knows beforehand.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"  # before NumPy starts

import argparse
import csv
import hashlib
import json
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from priors import digital_prior, mixture
from scipy.interpolate import BSpline
from scipy.optimize import isotonic_regression, minimize, minimize_scalar, nnls

from chartless import calibrate
from chartless.curves import AbstractCurve, SrgbCurve, named_curve
from chartless.curves.prior import CurvePrior
from chartless.images import read_frame, read_values, write_image
from chartless.methods import LikelihoodSearch
from chartless.noise import AffineNoise
from chartless.simulate import simulate_frames
from chartless.types import Floats, Indices, JsonObject, Levels


class Method(Protocol):
    """An estimator of the inverse response."""

    def __call__(
        self, frames: Sequence[Levels | Path], times: list[float], *, n_levels: int
    ) -> Floats:
        """Inverse response, shape (3, n_levels), linear, any scale.

        Frames are files, or have the shape (M, N, 3) and `n_levels` levels: 256 are uint8, more
        are uint16.
        """


def of_chartless(method: str, prior: CurvePrior | None = None) -> Method:
    """One of our methods, as its users would call it; likelihood with another prior."""
    by_prior = LikelihoodSearch(prior=prior) if method == "likelihood" and prior else method

    def inverse(frames: Sequence[Levels | Path], times: list[float], *, n_levels: int) -> Floats:
        shown = [
            frame if isinstance(frame, Path) or n_levels == 1 << 8 else _of_16_bits(frame, n_levels)
            for frame in frames
        ]
        found = calibrate(shown, times=times, method=by_prior, evidence="bracket")
        brightness = np.linspace(0, 1, n_levels)
        return np.stack([channel.curve.inverse(brightness) for channel in found.channels])

    return inverse


def _of_16_bits(frame: Levels, n_levels: int) -> Levels:
    """Levels spread over 16 bits, as files hold them."""
    spread: Levels = np.rint(frame * (65535 / (n_levels - 1))).astype(np.uint16)
    return spread


OURS = {
    f"chartless {method}": partial(of_chartless, method)
    for method in ("likelihood", "debevec", "mitsunaga", "robertson")
}
"""Our methods by name, the default first. Nothing else in this file needs to know them."""

DEFAULTS = ("OpenCV Debevec", "OpenCV Robertson", "colour-hdri Debevec")
SAMPLES = ("OpenCV Debevec 30", "OpenCV Debevec", "OpenCV Debevec 200", "OpenCV Debevec 500")
TIMED = ("OpenCV Debevec", "OpenCV Robertson")
DEEP = ("colour-hdri Debevec",)  # OpenCV takes 8 bits only
DEEPEST = 1024  # a rival that needs minutes here needs hours at 4096

CHANNELS = "RGB"
GREY = range(18, 24)
LOWEST, HIGHEST, LEAST_DEVIATION = 3.0, 252.0, 0.1
RAW_FROM, RAW_TO, ROUNDS = 0.1, 235.0, 50
N_COEFFICIENTS, GAIN_STEP, STEADY = 9, 0.05, 0.006
DARKEST = 1e-6  # of the brightest: a scale that leaves all patches below is none
NOISE = AffineNoise.from_8bit(0.03, 16.0)
CURVES = {
    "sRGB": SrgbCurve(),
    "film": named_curve("ameegc2-exact:0.48,-2.26,0.37"),  # about Kodachrome 64, green, of DoRF
}
EXPOSURES = [1.0, 2.0, 4.0, 8.0]
HIGHLIGHTS = 99.9  # per cent of the pixels that the shortest exposure holds
LARGE, N_LARGE = (1920, 2560), 9
KINDS = ("real", "offset", "samples", "simulated", "deep", "timing")


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """Light x, up to a scale, and the brightness y that a camera makes of it in some frame."""

    x: Floats
    y: Floats
    frame: Indices


@dataclass(frozen=True, slots=True, eq=False)
class Bracket:
    """Frames of one still scene, in memory or on disk, and what is true of each channel."""

    name: str
    times: list[float]
    truth: tuple[Truth, ...] = ()
    frames: tuple[Levels, ...] = ()
    paths: tuple[Path, ...] = ()
    n_levels: int = 256
    prior: CurvePrior | None = None
    """Without the camera; None for that of all cameras."""

    @property
    def key(self) -> str:
        """Digest of the frames and their exposures."""
        digest = hashlib.sha256(repr((self.times, self.n_levels)).encode())
        for frame in self.frames:
            digest.update(np.ascontiguousarray(frame).data)
        for path in self.paths:
            digest.update(str(path).encode())
        return digest.hexdigest()[:20]


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """What a method says about one bracket."""

    inverse: Floats  # (3, n_levels)
    seconds: float
    read_seconds: float = 0.0
    problem: str = ""


# --- the measure


def failure(inverse: Floats) -> str:
    """What is wrong with an inverse response; empty if nothing is."""
    if not np.isfinite(inverse).all():
        return "not a number"
    return "decreases" if np.any(np.diff(inverse) < 0) else ""


def repaired(inverse: Floats) -> Floats:
    """Gaps filled by straight lines, then the running maximum."""
    known = np.isfinite(inverse)
    levels = np.arange(inverse.size)
    filled = np.interp(levels, levels[known], inverse[known])
    return np.asarray(np.maximum.accumulate(filled))


def error(inverse: Floats, truth: Truth) -> float:
    """Root mean square of f(s x) − y with the best scale s."""
    if not np.isfinite(inverse).any():
        return float("inf")
    curve = repaired(inverse)
    brightness = np.linspace(0.0, 1.0, curve.size)

    def loss(log_scale: float) -> float:
        seen = np.interp(np.exp(log_scale) * truth.x, curve, brightness)
        return float(np.mean((seen - truth.y) ** 2))

    light = truth.x[truth.x > 0]
    positive = curve[curve > 0]
    if not positive.size:
        return float("inf")
    darkest = max(positive[0], DARKEST * positive[-1])
    grid = np.linspace(np.log(darkest / light.max()), np.log(positive[-1] / light.min()), 1 + 2000)
    best = int(np.argmin([loss(value) for value in grid]))
    around = (grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)])
    refined = minimize_scalar(loss, bounds=around, method="bounded", options={"xatol": 1e-9})
    return float(np.sqrt(min(refined.fun, loss(grid[best]))))


def held(inverse: Floats, shape_std: Floats, truth: Truth) -> float:
    """Share of the truth within two deviations of the shape, where one factor brings g closest."""
    grid = np.linspace(0.0, 1.0, inverse.size)
    light = np.interp(truth.y, grid, inverse)
    off = np.abs(light - truth.x * (light @ truth.x) / (truth.x @ truth.x))
    return float(np.mean(off < 2 * np.interp(truth.y, grid, shape_std)))


def isotonic(truth: Truth) -> float:
    """Root mean square that no increasing curve goes below."""
    order = np.argsort(truth.x)
    fit = isotonic_regression(truth.y[order])
    return float(np.sqrt(np.mean((fit.x - truth.y[order]) ** 2)))


def smooth(truth: Truth) -> float:
    """Root mean square of an increasing cubic spline of ln x, fitted to the truth."""
    log_x = np.log(truth.x)
    inner = np.quantile(log_x, np.linspace(0.0, 1.0, N_COEFFICIENTS - 2))
    knots = np.r_[[inner[0]] * 3, inner, [inner[-1] + 1e-9] * 3]
    splines = BSpline.design_matrix(log_x, knots, 3).toarray()
    rising = np.cumsum(splines[:, ::-1], axis=1)[:, ::-1]  # sums of all splines from one on
    return float(nnls(rising, truth.y)[1] / np.sqrt(truth.y.size))


def frame_gains(truth: Truth) -> tuple[float, Floats]:
    """Root mean square of `smooth` with a gain for each frame but the first, and the gains."""
    n_gains = int(truth.frame.max())

    def loss(gains: Floats) -> float:
        light = truth.x * np.exp(np.r_[0.0, gains][truth.frame])
        return smooth(Truth(light, truth.y, truth.frame))

    none = np.zeros(n_gains)
    found = minimize(
        loss,
        none,
        method="Nelder-Mead",
        options={
            "initial_simplex": np.vstack([none, GAIN_STEP * np.eye(n_gains)]),
            "xatol": 1e-4,
            "fatol": 1e-7,
        },
    )
    return float(found.fun), np.asarray(found.x)


# --- the brackets


def real_brackets(data: Path, *, offset: bool = False) -> list[Bracket]:
    """Chart crops of nine cameras, first illuminant, with the levels of the grey patches.

    Parameters
    ----------
    data : Path
    offset : bool
        Measure exposures and light anew, with a black level.
    """
    with (data / "middlebury_response" / "patch_levels.csv").open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["illuminant"] == "1"]
    brackets = []
    for camera in sorted({row["camera"] for row in rows}):
        own = [row for row in rows if row["camera"] == camera]
        if offset:
            own = with_black_level(own)
        times = {row["exposure"]: float(row["rel_exposure_measured"]) for row in own}
        frames = tuple(
            read_frame(data / "middlebury" / camera / f"wb1i1e{exposure}-jpg.png").levels
            for exposure in sorted(times)
        )
        grey = [row for row in own if int(row["patch"]) in GREY]
        brackets.append(
            Bracket(
                name=camera,
                times=[times[exposure] for exposure in sorted(times)],
                truth=tuple(patch_truth(grey, channel) for channel in CHANNELS),
                frames=frames,
            )
        )
    return brackets


def with_black_level(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    """Replace exposures and light of one camera by those that raw + b = s t fits best.

    Light s belongs to a patch and channel, exposure t to a frame (1 for the first), the black
    level b to the camera. Readings are weighted as if they deviate by 0.1 level and 1 %.
    """
    kept = [
        row
        for row in rows
        if row["raw_saturated"] == "0" and RAW_FROM < float(row["raw_mean"]) < RAW_TO
    ]
    names = sorted({(row["patch"], row["channel"]) for row in kept})
    which = {name: k for k, name in enumerate(names)}
    used = [
        (which[row["patch"], row["channel"]], int(row["exposure"]) - 1, float(row["raw_mean"]))
        for row in kept
    ]
    patch, frame = np.array([entry[:2] for entry in used]).T
    raw = np.array([entry[2] for entry in used])
    weight = 1 / (0.1 + 0.01 * raw) ** 2

    def fit(black: float) -> tuple[float, Floats, Floats]:
        exposure = 2.0 ** np.arange(frame.max() + 1.0)
        reading, light = weight * (raw + black), np.zeros(len(names))
        for _ in range(ROUNDS):
            light = np.bincount(patch, reading * exposure[frame], light.size) / np.bincount(
                patch, weight * exposure[frame] ** 2, light.size
            )
            exposure = np.bincount(frame, reading * light[patch]) / np.bincount(
                frame, weight * light[patch] ** 2
            )
            exposure, light = exposure / exposure[0], light * exposure[0]
        misfit = raw + black - light[patch] * exposure[frame]
        return float(np.sum(weight * misfit**2)), exposure, light

    black = float(minimize_scalar(lambda b: fit(b)[0], bounds=(-1, 1), method="bounded").x)
    _, exposure, light = fit(black)

    def changed(row: dict[str, str]) -> dict[str, str]:
        t = exposure[int(row["exposure"]) - 1]
        x = t * light[which[row["patch"], row["channel"]]]
        return {**row, "rel_exposure_measured": str(t), "exposure_x_irradiance": str(x)}

    return [changed(row) for row in rows if (row["patch"], row["channel"]) in which]


def patch_truth(grey: Iterable[dict[str, str]], channel: str) -> Truth:
    """Light and brightness of the grey patches that are not clipped in one channel."""
    kept = [
        (float(row["exposure_x_irradiance"]), float(row["jpg_mean"]), int(row["exposure"]))
        for row in grey
        if row["channel"] == channel
        and LOWEST <= float(row["jpg_mean"]) <= HIGHEST
        and float(row["jpg_std"]) >= LEAST_DEVIATION
        and row["raw_saturated"] == "0"
    ]
    x, levels, exposures = np.array(sorted(kept)).T
    return Truth(x, levels / 255, exposures.astype(np.intp) - 1)


def taken(
    name: str, scene: Floats, curve: AbstractCurve, times: list[float], *, bit_depth: int = 8
) -> Bracket:
    """Simulate a bracket of a scene whose highlights the shortest exposure just holds."""
    generator = np.random.default_rng(0)
    light = scene / np.percentile(scene, HIGHLIGHTS) / min(times)
    grid = np.linspace(0.0, 1.0, 1024)
    frames = [
        next(
            simulate_frames(
                light * t, curve, NOISE, n_frames=1, bit_depth=bit_depth, seed=generator
            )
        )
        for t in times
    ]
    truth = Truth(grid, curve.response(grid), np.zeros(grid.size, dtype=np.intp))
    return Bracket(name, times, (truth,) * 3, tuple(frames), n_levels=1 << bit_depth)


def photograph(data: Path) -> Floats:
    """Light of a photograph, sRGB undone, every other row and column."""
    values = read_values(data / "scenery_1600x900" / "01_beacon-street-sunset.jpg").values
    return np.asarray(SrgbCurve().inverse(values[::2, ::2].astype(np.float64)))


def panorama(data: Path) -> Floats:
    """Light of a room, measured, with lamps and windows in it."""
    values = read_values(data / "linear_hdr_world" / "interior.exr").values
    return np.asarray(np.maximum(values.astype(np.float64), 0.0))


def simulated_brackets(data: Path) -> list[Bracket]:
    """Two scenes by two curves."""
    scenes = {"photograph": photograph(data), "panorama": panorama(data)}
    return [
        taken(f"{scene_name}, {curve_name}", scene, curve, EXPOSURES)
        for scene_name, scene in scenes.items()
        for curve_name, curve in CURVES.items()
    ]


def deep_brackets(data: Path) -> list[Bracket]:
    """One scene with 10 and with 12 bits."""
    scene = photograph(data)
    return [
        taken(f"{1 << bits} levels", scene, CURVES["sRGB"], EXPOSURES, bit_depth=bits)
        for bits in (10, 12)
    ]


def large_bracket(data: Path, folder: Path) -> Bracket:
    """Nine large frames on disk."""
    scene = photograph(data)
    repeats = [-(-wanted // size) for wanted, size in zip(LARGE, scene.shape, strict=False)]
    tiled = np.tile(scene, (*repeats, 1))[: LARGE[0], : LARGE[1]]
    times = [2.0 ** (k / 2) for k in range(N_LARGE)]
    shots = taken("large", tiled, CURVES["sRGB"], times)
    paths = tuple(folder / f"{k}.png" for k in range(N_LARGE))
    for path, frame in zip(paths, shots.frames, strict=True):
        write_image(path, frame / 255.0, data_type="uint8", linear=False)
    return Bracket("large", times, shots.truth, paths=paths)


# --- asking the methods


def ask_ours(name: str, bracket: Bracket) -> Estimate:
    """Estimate by one of our methods."""
    start = time.perf_counter()
    problem = ""
    try:
        frames = bracket.paths or bracket.frames
        inverse = OURS[name](bracket.prior)(frames, bracket.times, n_levels=bracket.n_levels)
    except Exception as reason:  # noqa: BLE001 - as rivals are treated
        problem = repr(reason)
        inverse = np.full((3, bracket.n_levels), np.nan)
    # Files are read while others are counted: the whole is one figure.
    return Estimate(inverse, time.perf_counter() - start, 0.0, problem)


@dataclass(frozen=True, slots=True)
class Rivals:
    """Other programs, in an environment of their own.

    Parameters
    ----------
    python : str, optional
        Its interpreter; without it nobody answers.
    kept : Path, optional
        File of earlier answers.
    """

    python: str | None
    kept: Path | None

    def ask(
        self, brackets: Iterable[Bracket], methods: tuple[str, ...], *, keep: bool = True
    ) -> dict[tuple[str, str], Estimate]:
        """Estimates by bracket and method."""
        if self.python is None:
            return {}
        brackets = list(brackets)
        known: dict[str, Any] = {}
        if keep and self.kept is not None and self.kept.exists():
            with np.load(self.kept) as stored:
                known = dict(stored)
        wanted: dict[str, Any] = {}
        for bracket in brackets:
            missing = [name for name in methods if f"{bracket.key}.{name}.curve" not in known]
            if missing:
                wanted |= {
                    f"{bracket.key}.methods": np.array(missing),
                    f"{bracket.key}.times": np.array(bracket.times),
                    f"{bracket.key}.n_levels": np.array(bracket.n_levels),
                }
                if bracket.paths:
                    wanted[f"{bracket.key}.paths"] = np.array([str(p) for p in bracket.paths])
                else:
                    wanted[f"{bracket.key}.frames"] = np.stack(bracket.frames)
        if wanted:
            known |= self._run(wanted)
            if keep and self.kept is not None:
                np.savez(self.kept, **known)

        def estimate(bracket: Bracket, name: str) -> Estimate:
            start = f"{bracket.key}.{name}"
            return Estimate(
                known[f"{start}.curve"],
                float(known[f"{start}.seconds"]),
                float(known[f"{start}.read_seconds"]),
                str(known[f"{start}.problem"]),
            )

        return {(b.name, name): estimate(b, name) for b in brackets for name in methods}

    def _run(self, wanted: dict[str, Any]) -> dict[str, Any]:
        environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        script = str(Path(__file__).with_name("bracket_rivals.py"))
        with tempfile.TemporaryDirectory() as folder:
            cases, answers = Path(folder, "cases.npz"), Path(folder, "answers.npz")
            np.savez(cases, **wanted)
            command = [str(self.python), script, str(cases), str(answers)]
            subprocess.run(command, check=True, env=environment)
            with np.load(answers) as stored:
                return dict(stored)


# --- figures


def summary(errors: Iterable[float], failures: Iterable[str]) -> JsonObject:
    """Median, mean and worst error, and how many estimates failed and how."""
    errors, failures = list(errors), list(failures)
    numbers = [value for value in errors if value < float("inf")] or [float("inf")]
    return {
        "median": statistics.median(errors),
        "mean": statistics.fmean(numbers),
        "worst": max(numbers),
        "channels": len(errors),
        "no error": errors.count(float("inf")),
        "decreases": failures.count("decreases"),
        "not a number": failures.count("not a number"),
    }


def figures(
    brackets: list[Bracket],
    estimates: dict[tuple[str, str], Estimate],
    references: dict[str, Callable[[Truth], float]],
) -> JsonObject:
    """Errors of every channel by every method, and their summary."""
    errors: dict[str, dict[str, float]] = {}
    failures: dict[str, dict[str, str]] = {}
    for name in dict.fromkeys(method for _, method in estimates):
        errors[name], failures[name] = {}, {}
        for bracket in brackets:
            if (bracket.name, name) not in estimates:
                continue
            inverse = estimates[bracket.name, name].inverse
            for channel, truth in enumerate(bracket.truth):
                where = f"{bracket.name} {CHANNELS[channel]}"
                errors[name][where] = error(inverse[channel], truth)
                failures[name][where] = failure(inverse[channel])
    for name, reference in references.items():
        errors[name] = {
            f"{bracket.name} {CHANNELS[channel]}": reference(truth)
            for bracket in brackets
            for channel, truth in enumerate(bracket.truth)
        }
        failures[name] = dict.fromkeys(errors[name], "")
    rivals = [errors[name] for name in DEFAULTS if name in errors]
    ratios = {
        name: {
            where: value / best
            for where, value in errors[name].items()
            if (best := min((r[where] for r in rivals if where in r), default=0.0))
        }
        for name in OURS
        if name in errors
    }
    return {
        "summary": {
            name: summary(errors[name].values(), failures[name].values()) for name in errors
        },
        "errors": errors,
        "failures": failures,
        "ratio to the best rival": ratios,
        "seconds": {
            name: statistics.median(e.seconds for (_, m), e in estimates.items() if m == name)
            for name in errors
            if name not in references
        },
        "problems": {
            f"{name}, {bracket}": e.problem for (bracket, name), e in estimates.items() if e.problem
        },
    }


def ours(brackets: Iterable[Bracket]) -> dict[tuple[str, str], Estimate]:
    """Estimates by all our methods."""
    return {(bracket.name, name): ask_ours(name, bracket) for bracket in brackets for name in OURS}


def real(data: Path, rivals: Rivals, *, offset: bool = False) -> JsonObject:
    """Nine cameras."""
    brackets = [
        replace(bracket, prior=mixture(digital=digital_prior(data, bracket.name)))
        for bracket in real_brackets(data, offset=offset)
    ]
    srgb = np.asarray(SrgbCurve().inverse(np.linspace(0.0, 1.0, 1024)))
    references: dict[str, Callable[[Truth], float]] = {
        "sRGB assumed": lambda truth: error(srgb, truth),
        "truth, isotonic": isotonic,
        "truth, smooth": smooth,
        "truth, own gains": lambda truth: frame_gains(truth)[0],
    }
    found = figures(brackets, ours(brackets) | rivals.ask(brackets, DEFAULTS), references)
    found["exposures"] = {bracket.name: bracket.times for bracket in brackets}
    found["truth"] = {
        f"{bracket.name} {CHANNELS[channel]}": {
            "from": 255 * float(truth.y.min()),
            "to": 255 * float(truth.y.max()),
            "number": truth.y.size,
            "gains": (frame_gains(truth)[1] / np.log(2)).tolist(),
        }
        for bracket in brackets
        for channel, truth in enumerate(bracket.truth)
    }
    floor = found["errors"]["truth, smooth"]
    steady = [where for where in floor if floor[where] <= STEADY]
    found["steady"] = {
        name: summary(
            [errors[where] for where in steady],
            [found["failures"][name][where] for where in steady],
        )
        for name, errors in found["errors"].items()
    }
    return found


def samples(data: Path, rivals: Rivals) -> JsonObject:
    """OpenCV's Debevec with more and fewer samples, and where its highest level goes."""
    brackets = [*real_brackets(data), taken("simulated", photograph(data), SrgbCurve(), EXPOSURES)]
    estimates = rivals.ask(brackets, SAMPLES)
    found = figures([b for b in brackets if b.name != "simulated"], estimates, {})
    found["g(255) / g(128), green"] = {
        name: {
            b.name: float(np.divide(*estimates[b.name, name].inverse[1, [255, 128]]))
            for b in brackets
        }
        for name in SAMPLES
        if estimates
    }
    return found


def simulated(data: Path, rivals: Rivals) -> JsonObject:
    """Known curves."""
    brackets = simulated_brackets(data)
    return figures(brackets, ours(brackets) | rivals.ask(brackets, DEFAULTS), {})


def deep(data: Path, rivals: Rivals) -> JsonObject:
    """More levels than 256."""
    brackets = deep_brackets(data)
    few = [bracket for bracket in brackets if bracket.n_levels <= DEEPEST]
    return figures(brackets, ours(brackets) | rivals.ask(few, DEEP), {})


def timing(data: Path, rivals: Rivals) -> JsonObject:
    """Large frames from disk."""
    with tempfile.TemporaryDirectory() as folder:
        bracket = large_bracket(data, Path(folder))
        estimates = ours([bracket]) | rivals.ask([bracket], TIMED, keep=False)
    return {
        **figures([bracket], estimates, {}),
        "read seconds": {name: e.read_seconds for (_, name), e in estimates.items()},
        "seconds": {name: e.seconds for (_, name), e in estimates.items()},
    }


# --- the page


def without_infinity(value: Any) -> Any:  # noqa: ANN401 - anything that JSON holds
    """Replace infinite numbers by None: JSON has no infinity."""
    if isinstance(value, dict):
        return {key: without_infinity(item) for key, item in value.items()}
    if isinstance(value, list):
        return [without_infinity(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def print_table(rows: list[list[str]]) -> None:
    """Print columns, the first to the left and the others to the right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for first, *others in rows:
        cells = [f"{cell:>{width}}" for cell, width in zip(others, widths[1:], strict=True)]
        print("  ".join([f"  {first:<{widths[0]}}", *cells]))


def print_summary(found: JsonObject) -> None:
    """One row for each method."""
    rows = [
        ["", "median", "mean", "worst", "of", "no error", "decrease", "not a number", "seconds"]
    ]
    for name, figure in found["summary"].items():
        time_taken = found["seconds"].get(name)
        rows.append(
            [
                name,
                *(f"{figure[key]:.4f}" for key in ("median", "mean", "worst")),
                *(
                    str(figure[key])
                    for key in ("channels", "no error", "decreases", "not a number")
                ),
                "" if time_taken is None else f"{time_taken:.2f}",
            ]
        )
    print_table(rows)
    for what, reason in found["problems"].items():
        print(f"  {what}: {reason}")


def print_channels(found: JsonObject) -> None:
    """One row for each camera-channel: errors, `*` where the estimate failed, and ratios."""
    names, ratios = list(found["errors"]), found["ratio to the best rival"]
    rows = [["", *names, *(f"{name} / best" for name in ratios if ratios[name])]]
    wheres = dict.fromkeys(where for name in names for where in found["errors"][name])
    for where in wheres:
        cells = []
        for name in names:
            value = found["errors"][name].get(where)
            mark = "*" if found["failures"][name].get(where) else " "
            cells.append("" if value is None else f"{value:.4f}{mark}")
        of_ours = [f"{ratios[name][where]:.2f}" for name in ratios if where in ratios[name]]
        rows.append([where, *cells, *of_ours])
    print_table(rows)
    for name, values in ratios.items():
        if values:
            won = sum(value < 1 for value in values.values())
            middle = statistics.median(values.values())
            print(f"  {name}: {middle:.2f} of the best rival's, better in {won} of {len(values)}")


def print_truth(found: JsonObject) -> None:
    """What the truth allows: the steady channels, levels covered, gains of the frames."""
    print(f"\n  steady: truth, smooth at most {STEADY}")
    print_summary({"summary": found["steady"], "seconds": {}, "problems": {}})
    print("\n  levels of the grey patches, and gains of the frames in stops")
    n_gains = max(len(own["gains"]) for own in found["truth"].values())
    rows = [["", "from", "to", "number", *(f"gain {2 + k}" for k in range(n_gains))]]
    for where, own in found["truth"].items():
        gains = [f"{gain:+.3f}" for gain in own["gains"]]
        levels = [f"{own[end]:.1f}" for end in ("from", "to")]
        rows.append([where, *levels, str(own["number"]), *gains])
    print_table(rows)
    print("\n  exposures")
    print_table([[camera, *(f"{t:.3f}" for t in ts)] for camera, ts in found["exposures"].items()])


def print_page(results: JsonObject) -> None:
    """Everything, aligned."""
    if not results["rivals"]:
        print("no --rivals: only our own methods were run")
    if not OURS:
        print("no methods of our own yet")
    for kind in KINDS:
        if kind not in results:
            continue
        found = results[kind]
        print(f"\n{kind}")
        if not found["summary"]:
            print("  nobody to measure")
            continue
        print_summary(found)
        if kind != "samples" and found["errors"]:
            print()
            print_channels(found)
        if "g(255) / g(128), green" in found:
            drift = found["g(255) / g(128), green"]
            wheres = dict.fromkeys(where for values in drift.values() for where in values)
            print("\n  g(255) / g(128), green")
            print_table(
                [["", *drift], *([w, *(f"{drift[name][w]:.2f}" for name in drift)] for w in wheres)]
            )
        if "truth" in found:
            print_truth(found)
        for name, read in found.get("read seconds", {}).items():
            print(f"  {name}: {read:.2f} s reading, {found['seconds'][name]:.2f} s estimating")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--cases", default=",".join(KINDS), help="subset of %(default)s")
    parser.add_argument("--rivals", metavar="PYTHON", help="interpreter with rivals.txt")
    parser.add_argument("--answers", type=Path, metavar="FILE.npz", help="keeps rivals' answers")
    parser.add_argument("--data", type=Path, default=os.environ.get("CHARTLESS_DATA"))
    options = parser.parse_args()
    wanted = options.cases.split(",")
    if unknown := set(wanted) - set(KINDS):
        parser.error(f"unknown cases {', '.join(sorted(unknown))}: {', '.join(KINDS)}")
    if options.data is None:
        parser.error("no data: give --data FOLDER or set CHARTLESS_DATA")
    measures: dict[str, Callable[[Path, Rivals], JsonObject]] = {
        "real": real,
        "offset": partial(real, offset=True),
        "samples": samples,
        "simulated": simulated,
        "deep": deep,
        "timing": timing,
    }
    rivals = Rivals(options.rivals, options.answers)
    results: JsonObject = {"rivals": options.rivals is not None, "methods": list(OURS)}
    results |= {kind: measures[kind](Path(options.data), rivals) for kind in wanted}
    if options.json:
        print(json.dumps(without_infinity(results)))
    else:
        print_page(results)


if __name__ == "__main__":
    main()
