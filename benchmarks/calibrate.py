"""What `chartless calibrate` costs, against reading its two pictures at all.

    python benchmarks/calibrate.py [--json] [--repeats 5]

A pair of simulated 8-bit PNG frames of 1600 × 900 pixels, once in colour and once in grey.

decode       read both files
accumulate   count the level pairs of all channels and check the frames
search       the estimate by the default method, one channel after the other
process      `chartless calibrate A B -o camera.json`, start to end
least        start Python, import numpy and scipy.special, decode both with the same reader:
             what any program of this kind must do

Times are medians; ratios are medians of the ratios of neighbouring runs, so that a machine
whose speed drifts does not matter.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from skimage.data import astronaut

from chartless.curves import named_curve
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.gather import noise_evidence
from chartless.images import read_frame
from chartless.methods import CALIBRATORS
from chartless.noise import AffineNoise
from chartless.simulate.file import write_simulation
from chartless.types import Floats
from chartless.workflow import DEFAULT_METHOD, calibrate

HEIGHT, WIDTH = 900, 1600
TARGETS = {"process_over_least": 3.0, "accumulate_over_decode": 1.0}
LEAST = (
    "import sys, pathlib, numpy, scipy.special\n"
    "from chartless.images import read_frame\n"
    "frames = [read_frame(pathlib.Path(name)) for name in sys.argv[1:]]"
)


def photograph() -> Floats:
    """A scene of 1600 × 900 pixels in colour: a photograph mirrored at its edges."""
    light = named_curve("srgb").inverse(np.asarray(astronaut()) / 255)
    rows, columns, _ = light.shape
    margins = ((0, HEIGHT - rows), (0, WIDTH - columns), (0, 0))
    return np.pad(light, margins, mode="symmetric")


def seconds(run: Callable[[], object]) -> float:
    """Time of one run."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def measure(scene: Floats, repeats: int) -> dict[str, dict[str, float]]:
    """All figures for one pair of frames."""
    with tempfile.TemporaryDirectory() as folder:
        *paths, _ = write_simulation(
            Path(folder) / "frames",
            scene,
            named_curve("srgb"),
            AffineNoise.of_sensor(1_500, 5),
            n_frames=2,
            bit_depth=8,
            seed=1,
            settings={},
        )
        names = [str(path) for path in paths]
        frames = [read_frame(path) for path in paths]
        program = [str(Path(sys.executable).with_name("chartless")), "calibrate", *names]
        whole = [*program, "-o", str(Path(folder) / "camera.json")]
        least = [sys.executable, "-c", LEAST, *names]

        # Compiled modules are kept, as for any user, even where the environment forbids it.
        kept = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(Path(folder) / "kept")}
        environment = os.environ | kept

        def run(command: list[str]) -> None:
            subprocess.run(
                command,
                env=environment,
                check=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )

        inside: dict[str, Callable[[], object]] = {
            "decode": lambda: [read_frame(path) for path in paths],
            "accumulate": lambda: noise_evidence(frames),
            "estimate": lambda: calibrate([frame.levels for frame in frames]),
            "least": lambda: run(least),
            "process": lambda: run(whole),
        }
        times: dict[str, list[float]] = {name: [] for name in inside}
        for turn in range(repeats + 1):
            for name, step in inside.items():
                taken = seconds(step)
                if turn:  # the first turn warms the caches
                    times[name].append(taken)
        evidence = noise_evidence(frames)
        calibrator = CALIBRATORS[DEFAULT_METHOD]()
        evaluations = {
            name: calibrator.calibrate(LevelPairs(table)).history
            for name, table in evidence.tables.items()
        }

    def ratio(over: str, under: str) -> float:
        pairs = zip(times[over], times[under], strict=True)
        return statistics.median(a / b for a, b in pairs)

    median = {name: statistics.median(values) for name, values in times.items()}
    median["search"] = median.pop("estimate") - median["accumulate"]
    return {
        "seconds": median,
        "evaluations": {name: h.evaluations for name, h in evaluations.items() if h},
        "ratios": {
            "process_over_least": ratio("process", "least"),
            "accumulate_over_decode": ratio("accumulate", "decode"),
        },
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    scene = photograph()
    result = {
        "colour": measure(scene, arguments.repeats),
        "grey": measure(scene[..., 1:2], arguments.repeats),
    }
    if arguments.json:
        print(json.dumps({**result, "targets": TARGETS}))
        return
    for name, groups in result.items():
        print(name)
        for what, figures in groups.items():
            for key, value in figures.items():
                target = f"   target {TARGETS[key]:g}" if key in TARGETS else ""
                print(f"  {what:11} {key:23} {value:8.3f}{target}")


if __name__ == "__main__":
    main()
