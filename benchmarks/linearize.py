"""What `chartless linearize` costs, against reading its pictures and writing others at all.

    python benchmarks/linearize.py [--json] [--frames 100] [--format exr]

Pictures of 3840 × 2160 in 8-bit colour, a photograph with noise, as PNG files. They are made linear
ten at a time by the command, in this process, and its results removed:

command   `chartless linearize camera.json … -o FOLDER`
least     read the same files with the same reader and write ready pictures with the same writer,
          one after the other
table     apply the look-up tables to pictures in memory; its limit is to move what comes in and
          what goes out, here as one copy of so many bytes (`copy`)

Seconds are totals over all pictures; ratios are the medians of those of the tens. The command works
on two pictures at a time, so that it may take less time than `least`; the ratio of what processors
spent, `cpu_over_least`, shows the work itself and suffers less from what else they do.
"""

import argparse
import contextlib
import io
import json
import shutil
import statistics
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import numpy as np
from skimage.data import astronaut

from chartless.cli import main as chartless
from chartless.curves import named_curve
from chartless.formats.calibration_file import save
from chartless.images import read_frame, write_image
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status
from chartless.types import Levels

HEIGHT, WIDTH, TEN = 2160, 3840, 10
TARGET = 1.5


def seconds(run: Callable[[], object]) -> tuple[float, float]:
    """Time of one run, by the clock and of all processors."""
    start, spent = time.perf_counter(), time.process_time()
    run()
    return time.perf_counter() - start, time.process_time() - spent


def picture() -> Levels:
    """Levels of a photograph mirrored at its edges, with noise."""
    small = np.asarray(astronaut()).astype(np.float64)
    margins = ((0, HEIGHT - len(small)), (0, WIDTH - small.shape[1]), (0, 0))
    large = np.pad(small, margins, mode="symmetric")
    noisy = large + np.random.default_rng(0).normal(0, 2, large.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def camera() -> Calibration:
    """Three channels of three curves."""
    curves = zip("RGB", ("srgb", "gamma:0.5", "ameegc2-exact:0,1.2,0.4"), strict=True)
    channels = tuple(
        Response(
            name=name,
            curve=named_curve(curve),
            noise=None,
            n_levels=256,
            observed_levels=(0, 255),
            n_pairs=0,
            method="likelihood",
            status=Status.CONVERGED,
        )
        for name, curve in curves
    )
    return Calibration(channels=channels, bit_depth=8)


def measure(n_frames: int, suffix: str) -> dict[str, float]:
    """All figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        levels, calibration = picture(), camera()
        save(calibration, folder / "camera.json")
        sources = [folder / f"{number}.png" for number in range(TEN)]
        write_image(sources[0], levels / 255, data_type="uint8", linear=False)
        for each in sources[1:]:
            shutil.copy(sources[0], each)
        light = calibration.linearize(levels)
        out = folder / "out"
        times: dict[str, list[float]] = defaultdict(list)

        def command() -> None:
            given = ["linearize", str(folder / "camera.json"), *map(str, sources)]
            with contextlib.redirect_stdout(io.StringIO()):
                status = chartless([*given, "-o", str(out), "--format", suffix])
            if status:
                raise SystemExit(status)

        def least() -> None:
            for number, source in enumerate(sources):
                read_frame(source)
                write_image(out / f"{number}.{suffix}", light)

        for _ in range(max(n_frames // TEN, 1)):
            for what, run in (("command", command), ("least", least)):
                out.mkdir()
                taken, spent = seconds(run)
                shutil.rmtree(out)
                times[what].append(taken)
                times[f"{what} cpu"].append(spent)
            times["table"].append(TEN * seconds(lambda: calibration.linearize(levels))[0])
            times["copy"].append(TEN * seconds(lambda: (levels.copy(), light.copy()))[0])
    return {
        "frames": TEN * max(n_frames // TEN, 1),
        **{what: round(sum(each), 3) for what, each in times.items()},
        "command_over_least": ratio(times["command"], times["least"]),
        "cpu_over_least": ratio(times["command cpu"], times["least cpu"]),
        "table_over_copy": ratio(times["table"], times["copy"]),
    }


def ratio(above: list[float], below: list[float]) -> float:
    """Median of the ratios."""
    return statistics.median(a / b for a, b in zip(above, below, strict=True))


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--format", default="exr", choices=("exr", "tif", "png"))
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    found = measure(asked.frames, asked.format)
    if asked.json:
        print(json.dumps({"linearize": found, "format": asked.format, "target": TARGET}))
        return
    print(f"{found.pop('frames'):.0f} pictures of {WIDTH} × {HEIGHT} to {asked.format}")
    for name, value in found.items():
        target = f"  (target {TARGET})" if name == "command_over_least" else ""
        print(f"{name:20} {value:8.2f}{target}")


if __name__ == "__main__":
    main()
