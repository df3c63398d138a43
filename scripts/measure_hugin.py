"""Measure the response curves inside Hugin and write src/chartless/formats/hugin.npz.

    python scripts/measure_hugin.py [--compare EMOR]

Hugin holds a response as coefficients of a mean curve and components that are compiled into it:
the published EMoR of Columbia University, which is not quite that of ``fit_emor.py``. Its stitcher
nona (Debian: hugin-tools) applies the response of the first picture of a project to a second,
linear one. Given the irradiances k/1023 as floats, it returns the nodes of that response itself.

The mean is what all coefficients 0 give. A component is half the difference between two curves of
opposite coefficients: small enough that no curve falls, which nona would repair, and large enough
that rounding to float32 matters little.

With --compare, the largest differences from a file emor.txt of Columbia University are printed.
"""

import argparse
import json
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does

from chartless.images import write_image
from chartless.types import Floats, JsonObject

TARGET = Path(__file__).parents[1] / "src" / "chartless" / "formats" / "hugin.npz"
SIDE = 32
STEPS = np.array([3, 1, 0.3, 0.1, 0.1])

PROJECT = """\
p f0 w{side} h{side} v50 E0 R0 T"FLOAT" n"TIFF c:NONE"
m i6
i w{side} h{side} f0 v50 {response} Eev0 Er1 Eb1 r0 p0 y0 Vm5 n"ramp.tif"
i w{side} h{side} f0 v50 Rt1 Eev0 Er1 Eb1 r0 p0 y0 Vm5 n"ramp.tif"
"""


def nodes(folder: Path, coefficients: Floats) -> Floats:
    """Brightness at the irradiances k/1023, shape (1024,), as nona has it in a folder."""
    named = zip("abcde", coefficients, strict=True)
    response = " ".join(f"R{name}{value:g}" for name, value in named)
    (folder / "ramp.pto").write_text(PROJECT.format(side=SIDE, response=response))
    command = ["nona", "-i", "1", "-o", "out.tif", "ramp.pto"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)  # noqa: S603
    picture = np.asarray(oiio.ImageBuf(str(folder / "out.tif")).get_pixels("double"))
    return np.asarray(picture[..., 0].ravel(), dtype=np.float64)


def measure() -> Floats:
    """Mean and components in rows, shape (6, 1024)."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        ramp = np.linspace(0, 1, SIDE**2).reshape(SIDE, SIDE, 1)
        write_image(folder / "ramp.tif", np.repeat(ramp, 3, axis=2))
        mean = nodes(folder, 0 * STEPS)
        pairs = [nodes(folder, each) - nodes(folder, -each) for each in np.diag(STEPS)]
    return np.array([mean, *(pairs / (2 * STEPS[:, np.newaxis]))])


def published(path: Path) -> Floats:
    """First rows of emor.txt: blocks of a title and 1024 numbers, the irradiances first."""
    blocks: list[list[float]] = []
    for line in path.read_text(encoding="ascii").splitlines():
        if "=" in line:
            blocks.append([])
        elif line.strip():
            blocks[-1].extend(map(float, line.split()))
    return np.array(blocks[1 : 2 + STEPS.size])


def main() -> None:
    """Measure, write, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--compare", type=Path, help="file emor.txt")
    options = parser.parse_args()
    rows = measure()
    command = ["nona", "--help"]
    told = subprocess.run(command, check=True, capture_output=True, text=True)  # noqa: S603
    version = next(line for line in told.stdout.splitlines() if line.startswith("nona version"))
    provenance: JsonObject = {
        "script": "scripts/measure_hugin.py",
        "data": "EMoR, Computer Vision Laboratory, Columbia University, as Hugin holds it",
        "program": version,
        "what": f"mean and {STEPS.size} components of f at the irradiances k/1023",
    }
    np.savez_compressed(
        TARGET,
        allow_pickle=False,
        response=rows.astype(np.float32),
        provenance=np.array(json.dumps(provenance)),
    )
    print(f"{TARGET.name}: {TARGET.stat().st_size / 1000:.0f} kB, {version}")
    products = rows[1:] @ rows[1:].T
    print(f"orthonormal within {np.abs(products - np.eye(STEPS.size)).max():.1e}")
    if options.compare is not None:
        differences = np.abs(rows - published(options.compare)).max(axis=1)
        print("differs by at most", *(f"{each:.1e}" for each in differences))


if __name__ == "__main__":
    main()
