"""Other programs that estimate a response from an exposure bracket; `brackets.py` runs this.

    PYTHON benchmarks/bracket_rivals.py CASES.npz ANSWERS.npz

PYTHON is that of an environment with the packages in `rivals.txt`; nothing of chartless is needed.
Each case has a key K, and CASES.npz holds

K.methods    names in `RIVALS`
K.times      exposures of J frames
K.frames     uint8 or uint16, shape (J, M, N, 3), or
K.paths      J PNG files of 8 bits, which OpenCV reads
K.n_levels   256, or as many as the frames have

ANSWERS.npz holds for each case and method

K.METHOD.curve           inverse response, float, shape (3, n_levels), linear, any scale; NaN if
                         there is none
K.METHOD.seconds         what the estimate took
K.METHOD.read_seconds    what reading the files took, 0 if there were none
K.METHOD.problem         why there is no curve, else empty

Methods are what their users call, with their defaults and all pixels; a number behind a name is
that of samples. `brackets.py` gives linear algebra one core, as to our methods; OpenCV sets its own
threads.
"""

import argparse
import time
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # packages for figures, which it lacks here
    import colour_hdri

Frames = list[npt.NDArray[Any]]
Curve = npt.NDArray[np.float64]
Rival = Callable[[Frames, list[float], int], Curve]


def opencv(calibration: Callable[[], Any], frames: Frames, times: list[float], _: int) -> Curve:
    """One of OpenCV's two; it takes 8 bits only."""
    table = calibration().process(frames, times=np.array(times, dtype=np.float32))
    return np.asarray(table, dtype=np.float64)[:, 0, :].T


def debevec(samples: int) -> Rival:
    """Return OpenCV's method of Debevec and Malik (1997) with another number of samples."""
    return partial(opencv, partial(cv2.createCalibrateDebevec, samples=samples))


def colour(frames: Frames, times: list[float], n_levels: int) -> Curve:
    """Return what colour-hdri makes of the method of Debevec and Malik (1997)."""
    stack = colour_hdri.ImageStack()
    for frame, t in zip(frames, times, strict=True):
        metadata = colour_hdri.Metadata(f_number=1.0, exposure_time=t, iso=100.0)
        stack.append(colour_hdri.Image(data=frame / (n_levels - 1), metadata=metadata))
    curves = colour_hdri.camera_response_functions_Debevec1997(
        stack, sampling_function_kwargs={"n": n_levels}, n=n_levels
    )
    return np.asarray(curves, dtype=np.float64).T


RIVALS: dict[str, Rival] = {
    "OpenCV Debevec": partial(opencv, cv2.createCalibrateDebevec),
    "OpenCV Robertson": partial(opencv, cv2.createCalibrateRobertson),
    "colour-hdri Debevec": colour,
    "OpenCV Debevec 30": debevec(30),
    "OpenCV Debevec 200": debevec(200),
    "OpenCV Debevec 500": debevec(500),
}


def read(paths: list[str]) -> Frames:
    """Frames in RGB."""
    return [np.ascontiguousarray(cv2.imread(path)[..., ::-1]) for path in paths]  # type: ignore[index, unused-ignore]


def answer(case: dict[str, Any]) -> dict[str, Any]:
    """All that the methods say about one case."""
    n_levels, times = int(case["n_levels"]), [float(t) for t in case["times"]]
    answers: dict[str, Any] = {}
    for name in case["methods"]:
        start = time.perf_counter()
        frames = read(list(case["paths"])) if "paths" in case else list(case["frames"])
        loaded = time.perf_counter()
        problem = ""
        try:
            curve = RIVALS[name](frames, times, n_levels)
        except Exception as error:  # noqa: BLE001 - whatever stops it is its answer
            problem = repr(error)
            curve = np.full((3, n_levels), np.nan)
        answers[f"{name}.curve"] = curve
        answers[f"{name}.seconds"] = time.perf_counter() - loaded
        answers[f"{name}.read_seconds"] = loaded - start if "paths" in case else 0.0
        answers[f"{name}.problem"] = problem
    return answers


def main() -> None:
    """Read the cases, write the answers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases")
    parser.add_argument("answers")
    options = parser.parse_args()
    with np.load(options.cases) as stored:
        keys = sorted({name.partition(".")[0] for name in stored.files})
        answers: dict[str, Any] = {}
        for key in keys:
            case = {
                name.partition(".")[2]: stored[name]
                for name in stored.files
                if name.startswith(f"{key}.")
            }
            answers |= {f"{key}.{name}": value for name, value in answer(case).items()}
    np.savez(options.answers, **answers)


if __name__ == "__main__":
    main()
