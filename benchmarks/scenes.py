"""Which frames are refused as different scenes, and how well their displacement is measured.

    python benchmarks/scenes.py [--data FOLDER] [--cases strangers,real,…] [--json]

Data are in FOLDER, or in the one that CHARTLESS_DATA names.

strangers   200 triples of different photographs posing as a bracket, of one size: with exposures
            1, 4, 16 or unknown ones, in random order or by brightness, half of them made brighter
            or darker as exposures would. Not two of a triple show the same test chart
bursts      100 pairs of them posing as a burst
noise       50 triples of independent random images
real        brackets of one scene: a room (hand-touched tripod), a church, nine cameras by two
            illuminants
simulated   208 brackets of HDR pictures by 26 + 201 measured curves in turn: steps of 1, 2, 3 and 4
            stops, noise, PNG and JPEG 95 and 80 (4:2:0); whole panoramas and parts of them
movers      100 of them, of which 5, 10, 20 or 30 % of the brighter frame is another picture
shifts      photographs taken twice, two stops apart, displaced by known amounts: the error
turns       the same, turned by 0.2 to 3 degrees
panorama    neighbours 20 degrees apart of a camera that turned, aligned and not
timing      seconds for one frame and one pair of 5 megapixels, best of 5

Refused are brackets by `screen_bracket`, for any reason and for showing different scenes or being
displaced. `stands out`, `agree` and `follow` are the lowest, 1 % and median values (for different
scenes the median, 99 % and highest) of what decides, over pairs of frames: see `SceneMatch`.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"  # before NumPy starts

import argparse
import io
import json
import time
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import shift as shifted

from chartless.curves import SrgbCurve
from chartless.errors import UnfitFramesError
from chartless.evidence.bracket.gather import bracket_evidence
from chartless.evidence.bracket.screening import screen_bracket
from chartless.evidence.noise.gather import noise_evidence
from chartless.evidence.noise.screening import screen
from chartless.frames.frame import Frame
from chartless.frames.same_scene import SceneMatch, chained, compare_scenes, glimpse
from chartless.images import read_values
from chartless.types import Bools, Floats, JsonObject, Levels

SRGB, SIZE = SrgbCurve(), (900, 600)
N_STRANGERS, N_BURSTS, N_NOISE, N_SIMULATED, N_MOVERS = 200, 100, 50, 208, 100
STEPS, EXPOSURES = (1, 2, 3, 4), {1: 5, 2: 4, 3: 3, 4: 3}
SLOPES, FLOORS = (0.003, 0.01, 0.03), (1.0, 4.0, 16.0)  # of the noise, levels of 8 bits
SHIFTS, TURNS = (0.0, 0.5, 1.0, 3.0, 10.0, 30.0, 0.05, 0.1), (0.2, 0.5, 1.0, 3.0)
"""Pixels, or below 0.2 shares of the width; degrees."""
MIDDLE_GREY = 0.18
LARGE = 1920, 2560
UNKNOWN = 1.5  # deviation of ln of unknown exposures
WORDS = ("do not show the same scene", "are displaced by")


# --- pictures


def decoded(path: Path, size: tuple[int, int] | None = None) -> Levels:
    """Levels of a file, shape (M, N, 3), of another size if wanted."""
    picture = Image.open(path).convert("RGB")
    return np.asarray(picture if size is None else picture.resize(size, Image.Resampling.LANCZOS))


@cache
def light_of(path: Path) -> Floats:
    """Light of an HDR picture, not negative, shape (M, N, 3)."""
    values = np.nan_to_num(read_values(path).values[..., :3].astype(np.float64), posinf=0.0)
    return np.asarray(np.maximum(values, 0.0))


def srgb(light: Floats) -> Levels:
    """Levels of light, 1 being white."""
    levels: Levels = np.rint(255 * SRGB.response(light.clip(0, 1))).astype(np.uint8)
    return levels


def maps(data: Path) -> list[Path]:
    """HDR panoramas."""
    hdr, exr = data / "hdr_polyhaven_1k", data / "linear_hdr_world"
    return [*sorted(hdr.glob("*.hdr")), *sorted(exr.glob("*.exr"))]


def photographs(data: Path) -> dict[str, Levels]:
    """Different pictures by their names, all of one size."""
    found = {}
    for folder, every in (
        ("scenery_1600x900", 1),
        ("drone_ae_brighton", 6),
        ("pano_rotating/parrington", 5),
        ("charts_cameras", 4),
    ):
        for path in sorted((data / folder).glob("*.jpg"))[::every]:
            found[f"{folder}/{path.stem}"] = decoded(path, SIZE)
    for path in [*maps(data), *sorted((data / "exr_linear_photos").glob("*.exr"))]:
        light = light_of(path)
        rows, columns = light.shape[:2]
        if columns >= 2 * rows:  # a panorama: its middle
            light = light[rows // 5 : rows * 4 // 5, columns // 4 : columns * 3 // 4]
        picture = Image.fromarray(srgb(light / np.percentile(light, 95)))
        found[path.stem] = np.asarray(picture.resize(SIZE, Image.Resampling.LANCZOS))
    return found


def curves(data: Path) -> list[tuple[Floats, Floats]]:
    """Measured response curves: light and brightness."""
    own = np.load(data / "modern_curves" / "responses_1024.npz")
    film = np.load(data / "dorf" / "dorf_named.npz", allow_pickle=True)
    return [*((own["E"], f) for f in own["f"]), *((film["I"], f) for f in film["B"])]


def compressed(levels: Levels, quality: int) -> Levels:
    """Levels after JPEG with 4:2:0; of quality 0 as they are."""
    if not quality:
        return levels
    held = io.BytesIO()
    Image.fromarray(levels).save(held, "JPEG", quality=quality, subsampling=2)
    return np.asarray(Image.open(held))


def simulated(data: Path, number: int, seed: int) -> Iterator[tuple[str, list[Levels]]]:
    """Brackets of one scene, from the darkest frame."""
    rng = np.random.default_rng(seed)
    scenes, measured = maps(data), curves(data)
    for place in range(number):
        path = scenes[place % len(scenes)]
        light = light_of(path)
        if place % 4:
            rows, columns = light.shape[0] // 2, light.shape[1] * 3 // 8
            top = rng.integers(0, light.shape[0] - rows)
            left = rng.integers(0, light.shape[1] - columns)
            light = light[top : top + rows, left : left + columns]
        irradiance, brightness = measured[rng.integers(len(measured))]
        step = STEPS[(place // len(scenes) + place) % len(STEPS)]
        grey = np.percentile(light[light > 0], rng.uniform(30, 70)) / MIDDLE_GREY
        slope, floor = rng.choice(SLOPES), rng.choice(FLOORS)
        quality = int(rng.choice([0, 95, 80]))
        frames = []
        for stop in step * (np.arange(EXPOSURES[step]) - (EXPOSURES[step] - 1) / 2):
            seen = light / grey * 2.0**stop
            deviation = np.sqrt(slope * seen / 255 + floor / 255**2)
            seen = (seen + deviation * rng.standard_normal(seen.shape)).clip(0, 1)
            levels = np.rint(255 * np.interp(seen, irradiance, brightness).clip(0, 1))
            frames.append(compressed(levels.astype(np.uint8), quality))
        yield f"{path.stem}, {step} stops, quality {quality or 'PNG'}", frames


def real(data: Path) -> Iterator[tuple[str, list[Levels], Bools | None]]:
    """Real brackets, from the darkest frame, with masks."""
    yield "room", by_brightness(data.glob("bracket_canon_t2i_room/*.jpg")), None
    church = by_brightness(data.glob("bracket_memorial/memorial00*.png"))
    blue = np.array([0, 0, 255])
    border = np.any([np.all(each == blue, axis=-1) for each in church], axis=0)
    yield "church", church, ~border
    for folder in sorted(path for path in (data / "middlebury").iterdir() if path.is_dir()):
        for light in (1, 2):
            names = folder.glob(f"wb1i{light}e?-jpg.png")
            yield f"{folder.name}, light {light}", by_brightness(names), None


def by_brightness(paths: Iterator[Path]) -> list[Levels]:
    """Levels of files, the darkest first."""
    return sorted((decoded(path) for path in paths), key=lambda levels: float(levels.mean()))


# --- what is measured


def framed(pictures: Sequence[Levels]) -> list[Frame]:
    """Frames with numbers for names."""
    return [Frame(Path(f"{number}.png"), levels.copy()) for number, levels in enumerate(pictures)]


def outcome(
    pictures: Sequence[Levels],
    log_exposures: Floats | None,
    *,
    mask: Bools | None = None,
    aligned: bool = True,
) -> tuple[str, list[str]]:
    """Refusal of a bracket, or nothing, and flags."""
    error = UNKNOWN if log_exposures is None else 0.0
    try:
        evidence = bracket_evidence(
            framed(pictures), log_exposures, exposure_error=error, mask=mask, aligned=aligned
        )
        flags = screen_bracket(evidence)
    except UnfitFramesError as refused:
        return str(refused), []
    return "", sorted({flag.code for own in flags.values() for flag in own})


def matches(pictures: Sequence[Levels], mask: Bools | None = None) -> tuple[SceneMatch, ...]:
    """Of the green channels, from the darkest to the brightest."""
    return chained([glimpse(levels[..., 1], 255, mask) for levels in pictures]).matches


def deciding(found: Sequence[SceneMatch], ranks: Sequence[float]) -> JsonObject:
    """Percentiles of what decides."""
    values = {
        "stands out": [match.standing_out for match in found],
        "agree": [match.agreement for match in found],
        "follow": [match.following for match in found],
    }
    return {name: np.percentile(own, ranks).tolist() for name, own in values.items()}


def counted(texts: Sequence[str]) -> JsonObject:
    """How many were refused, and why."""
    return {
        "brackets": len(texts),
        "refused": sum(bool(text) for text in texts),
        "other scene": sum(WORDS[0] in text for text in texts),
        "displaced": sum(WORDS[1] in text for text in texts),
    }


DIFFERENT, ALIKE = (50, 99, 100), (0, 1, 50)


def strangers(data: Path) -> JsonObject:
    """Different photographs posing as brackets."""
    rng = np.random.default_rng(5)
    pictures = photographs(data)
    texts: list[str] = []
    found: list[SceneMatch] = []
    while len(texts) < N_STRANGERS:
        names = rng.choice(list(pictures), 3, replace=False)
        if sum(name.startswith("charts") for name in names) > 1:
            continue
        chosen = [pictures[name] for name in names]
        number = len(texts)
        if number % 2:
            gains = rng.uniform(0.3, 2.5, 3)
            chosen = [srgb(g * (p / 255) ** 2.2) for g, p in zip(gains, chosen, strict=True)]
        if number % 4 < 2:  # noqa: PLR2004 - half of them
            chosen = sorted(chosen, key=lambda levels: float(levels.mean()))
        times = None if number % 8 < 4 else np.log([1.0, 4.0, 16.0])  # noqa: PLR2004
        texts.append(outcome(chosen, times)[0])
        found.extend(matches(chosen))
    return counted(texts) | deciding(found, DIFFERENT)


def bursts(data: Path) -> JsonObject:
    """Different photographs posing as a burst."""
    rng = np.random.default_rng(6)
    pictures = photographs(data)
    texts: list[str] = []
    while len(texts) < N_BURSTS:
        names = rng.choice(list(pictures), 2, replace=False)
        if all(name.startswith("charts") for name in names):
            continue
        try:
            evidence = noise_evidence(framed([pictures[name] for name in names]))
            screen(evidence.tables, evidence.checks)
            texts.append("")
        except UnfitFramesError as refused:
            texts.append(str(refused))
    return counted(texts)


def noise(_: Path) -> JsonObject:
    """Independent random images."""
    rng = np.random.default_rng(7)
    texts: list[str] = []
    found: list[SceneMatch] = []
    for _number in range(N_NOISE):
        chosen = [rng.integers(0, 256, (300, 400, 3), dtype=np.uint8) for _ in range(3)]
        texts.append(outcome(chosen, np.log([1.0, 4.0, 16.0]))[0])
        found.extend(matches(chosen))
    return counted(texts) | deciding(found, DIFFERENT)


def of_one_scene(brackets: Iterator[tuple[str, list[Levels], Bools | None, int]]) -> JsonObject:
    """Brackets with their masks and steps (0: unknown)."""
    texts: list[str] = []
    found: list[SceneMatch] = []
    why: dict[str, str] = {}
    moved = 0
    for name, frames, mask, step in brackets:
        times = np.log(2.0) * step * np.arange(len(frames)) if step else None
        text, flags = outcome(frames, times, mask=mask)
        texts.append(text)
        moved += "motion" in flags
        if text:
            why[name] = text
        found.extend(matches(frames, mask))
    return counted(texts) | {"motion": moved} | deciding(found, ALIKE) | {"why": why}


def real_ones(data: Path) -> JsonObject:
    """Real brackets."""
    return of_one_scene((name, frames, mask, 0) for name, frames, mask in real(data))


def simulated_ones(data: Path) -> JsonObject:
    """Simulated brackets."""
    return of_one_scene(
        (name, frames, None, int(name.split(", ")[1].split()[0]))
        for name, frames in simulated(data, N_SIMULATED, 1)
    )


def movers(data: Path) -> JsonObject:
    """Simulated pairs of which something moved."""
    rng = np.random.default_rng(9)
    others = list(photographs(data).values())

    def brackets() -> Iterator[tuple[str, list[Levels], Bools | None, int]]:
        for place, (name, frames) in enumerate(simulated(data, N_MOVERS, 3)):
            middle = len(frames) // 2
            dark, bright = frames[middle - 1], frames[middle].copy()
            side = (0.05, 0.1, 0.2, 0.3)[place % 4] ** 0.5
            rows, columns = (int(length * side) for length in dark.shape[:2])
            top = rng.integers(0, dark.shape[0] - rows + 1)
            left = rng.integers(0, dark.shape[1] - columns + 1)
            other = Image.fromarray(others[rng.integers(len(others))]).resize((columns, rows))
            bright[top : top + rows, left : left + columns] = np.asarray(other)
            yield f"{name}, {side**2:.2f} moved", [dark, bright], None, 0

    return of_one_scene(brackets())


def seen_twice(data: Path) -> Iterator[Floats]:
    """Light of photographs, green, of 1.4 to 5 megapixels."""
    for path in sorted((data / "scenery_1600x900").glob("*.jpg"))[::2]:
        yield (decoded(path)[..., 1] / 255) ** 2.2
    for path in sorted((data / "charts_cameras").glob("*.jpg"))[::5]:
        yield (decoded(path)[..., 1] / 255) ** 2.2


def shifts(data: Path) -> JsonObject:
    """Error of the displacement, in pixels."""
    rng = np.random.default_rng(10)
    errors: dict[str, list[float]] = {}
    for light in seen_twice(data):
        rows, columns = light.shape
        edge = int(0.1 * max(light.shape)) + 3
        if rows < 3 * edge:
            edge = rows // 3
        for wanted in SHIFTS:
            length = min(wanted if wanted >= 0.2 or not wanted else wanted * columns, edge - 3)  # noqa: PLR2004
            turn = rng.uniform(0, 2 * np.pi)
            moved = length * np.array([np.sin(turn), np.cos(turn)])
            whole = np.floor(moved).astype(int)
            top, left = edge - whole - 1
            size = rows - 2 * edge, columns - 2 * edge
            around = light[top : top + size[0] + 2, left : left + size[1] + 2]
            second = shifted(around, moved - whole, order=1)[1:-1, 1:-1]
            pair = (
                exposed(light[edge : rows - edge, edge : columns - edge], rng),
                exposed(second / 4, rng),
            )
            match = compare_scenes(*(glimpse(levels, 255) for levels in pair))
            error = float(np.hypot(match.down - moved[0], match.right - moved[1]))
            name = f"{wanted:g} px" if wanted >= 0.2 or not wanted else f"{wanted:.0%} of width"  # noqa: PLR2004
            errors.setdefault(name, []).append(error)
    return {name: np.percentile(own, [50, 90, 100]).tolist() for name, own in errors.items()}


def turns(data: Path) -> JsonObject:
    """Angle found, and what was true."""
    rng = np.random.default_rng(11)
    found: dict[str, list[float]] = {}
    for light in seen_twice(data):
        rows, columns = light.shape
        inner = np.s_[rows // 10 : rows * 9 // 10, columns // 10 : columns * 9 // 10]
        first, second = exposed(light, rng), Image.fromarray(exposed(light / 4, rng))
        for degrees in TURNS:
            turned = np.asarray(second.rotate(-degrees, Image.Resampling.BICUBIC))
            pair = (glimpse(levels[inner], 255) for levels in (first, turned))
            found.setdefault(f"{degrees:g} degrees", []).append(compare_scenes(*pair).turn)
    return {name: np.percentile(own, [10, 50, 90]).tolist() for name, own in found.items()}


def exposed(light: Floats, rng: np.random.Generator) -> Levels:
    """Levels of a camera with noise of two levels."""
    levels = srgb(light) + rng.normal(0, 2, light.shape)
    return np.rint(levels).clip(0, 255).astype(np.uint8)


def panorama(data: Path) -> JsonObject:
    """Neighbours of a camera that turned."""
    views = [decoded(path) for path in sorted((data / "pano_rotating/parrington").glob("*.jpg"))]
    pairs = [sorted(pair, key=lambda p: float(p.mean())) for pair in pairwise(views)]
    times = np.log([1.0, 2.0])
    return {
        how: counted([outcome(pair, times, aligned=how == "aligned")[0] for pair in pairs])
        for how in ("aligned", "unaligned")
    }


def timing(_: Path) -> JsonObject:
    """Milliseconds."""
    rng = np.random.default_rng(12)
    scene = rng.integers(0, 120, (*LARGE, 3), dtype=np.uint8)
    frames = [np.minimum(scene * k, 255).astype(np.uint8) for k in (1, 2)]

    def best(act: Callable[[], object]) -> float:
        took = []
        for _number in range(5):
            start = time.perf_counter()
            act()
            took.append(time.perf_counter() - start)
        return 1e3 * min(took)

    seen = [glimpse(levels[..., 1], 255) for levels in frames]
    return {
        "frame": best(lambda: glimpse(frames[0][..., 1], 255)),
        "pair": best(lambda: compare_scenes(*seen)),
    }


# --- the page

CASES: dict[str, Callable[[Path], JsonObject]] = {
    "strangers": strangers,
    "bursts": bursts,
    "noise": noise,
    "real": real_ones,
    "simulated": simulated_ones,
    "movers": movers,
    "shifts": shifts,
    "turns": turns,
    "panorama": panorama,
    "timing": timing,
}


def print_case(name: str, found: JsonObject) -> None:
    """One line for each figure."""
    print(f"\n{name}")
    for what, value in found.items():
        if isinstance(value, list):
            print(f"  {what:<14}", "  ".join(f"{each:7.2f}" for each in value))
        elif isinstance(value, dict):
            for own, text in value.items():
                print(f"  {what}: {own}: {text}")
        else:
            print(
                f"  {what:<14} {value:.5g}" if isinstance(value, float) else f"  {what:<14} {value}"
            )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--cases", default=",".join(CASES), help="subset of %(default)s")
    parser.add_argument("--data", type=Path, default=os.environ.get("CHARTLESS_DATA"))
    options = parser.parse_args()
    wanted = options.cases.split(",")
    if unknown := set(wanted) - set(CASES):
        parser.error(f"unknown cases {', '.join(sorted(unknown))}: {', '.join(CASES)}")
    if options.data is None:
        parser.error("no data: give --data FOLDER or set CHARTLESS_DATA")
    results: JsonObject = {}
    for name in wanted:
        results[name] = CASES[name](Path(options.data))
        if not options.json:
            print_case(name, results[name])
    if options.json:
        print(json.dumps(results))


if __name__ == "__main__":
    main()
