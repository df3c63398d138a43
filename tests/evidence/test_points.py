"""Measured points: the table, the likelihood, and the curve that they give, alone and beside."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.stats import norm
from videos import grey_planes, write_video

from chartless import AffineNoise, calibrate, named_curve, rmse, simulate_frames
from chartless.curves import AbstractCurve
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.points.account import SeenPoints
from chartless.evidence.points.channel import MeasuredPoints
from chartless.evidence.points.figures import draw_points
from chartless.evidence.points.gather import USUAL_STD, Point, read_points
from chartless.evidence.points.likelihood import PointModel
from chartless.flags import Flag
from chartless.methods import LikelihoodSearch
from chartless.types import Floats

SRGB = named_curve("srgb")
LIGHT = np.geomspace(0.005, 0.95, 20)


def table(
    path: Path,
    curve: AbstractCurve = SRGB,
    *,
    factor: float = 1.0,
    error: float = 0.0,
    channel: str = "",
    light: Floats = LIGHT,
) -> Path:
    """Light of which a share is known, as a camera shows it."""
    off = np.exp(error * np.random.default_rng(1).standard_normal(light.size))
    rows = [
        f"{irradiance},{brightness},,{channel}"
        for irradiance, brightness in zip(factor * light, curve.response(light * off), strict=True)
    ]
    header = [] if path.exists() else ["irradiance,brightness,std,channel"]
    with path.open("a", encoding="utf-8") as file:
        file.write("\n".join([*header, *rows]) + "\n")
    return path


def shape_error(found: Any, curve: AbstractCurve) -> float:
    """Root mean square of g − truth where g is brought closest by one factor."""
    truth, light = curve.inverse(np.arange(256) / 255), found.inverse_lut
    return float(np.sqrt(np.mean((light * (light @ truth) / (light @ light) - truth) ** 2)))


# The table


@pytest.mark.parametrize(
    "text",
    [
        "irradiance,brightness\n0.2,0.4\n1,0.9\n",
        "brightness;irradiance\n0.4;0.2\n0.9;1\n",
        "Irradiance\tBrightness\n0.2\t0.4\n1\t0.9\n",
        "# a wedge\n0.2,0.4\n\n1,0.9\n",
        "\ufeffirradiance, brightness\r\n0.2, 0.4\r\n1, 0.9\r\n",
    ],
)
def test_a_table_may_be_written_in_several_ways(text: str, tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text(text, encoding="utf-8")

    assert read_points(path) == (Point(0.2, 0.4), Point(1.0, 0.9))


def test_deviations_and_channels_are_read(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("channel,irradiance,brightness,std\nr,0.2,0.4,0.01\n,1,0.9,\n")

    assert read_points(path) == (Point(0.2, 0.4, 0.01, "R"), Point(1.0, 0.9, USUAL_STD, ""))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds no points"),
        ("# nothing\n", "holds no points"),
        ("irradiance,brightness\n", "holds no points"),
        ("1,0.5,,R\n1,0.5,,Y\n", "channels are R, G and B, or Y, not both"),
        ("irradiance,level\n1,2\n", "it has no brightness"),
        ("irradiance,brightness,shade\n1,0.2,3\n", "others or some of them twice"),
        ("irradiance,brightness,irradiance\n1,0.2,3\n", "others or some of them twice"),
        ("irradiance,brightness\n0.2,0.4\n0.3,x\n", "line 3 is not a point"),
        ("irradiance,brightness\n0.2\n", "line 2 is not a point"),
        ("irradiance,brightness\n0.2,0.4,1\n", "line 2 has 3 cells"),
        ("0.2,128\n", "brightness must lie between 0 and 1, not 128: divide levels by"),
        ("-1,0.5\n", "irradiance must be 0 or above, not -1"),
        ("inf,0.5\n", "irradiance must be 0 or above, not inf"),
        ("nan,0.5\n", "irradiance must be 0 or above, not nan"),
        ("1,0.5,2\n", "std must lie between 0 and 1, not 2"),
        ("1,0.5,,purple\n", "channel must be R, G, B or Y, not 'purple'"),
    ],
)
def test_a_row_that_is_no_point_is_named(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text(text)

    with pytest.raises(ParameterError, match=f"^{path}: ") as caught:
        read_points(path)
    assert said in str(caught.value)


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00\x01"])
def test_a_file_that_cannot_be_read_is_named(content: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(ParameterError, match=r"points\.csv: cannot be read"):
        read_points(path)


# The likelihood


def test_the_likelihood_is_that_of_normal_errors() -> None:
    """Of light, with the deviation by brightness and that by scatter."""
    model = PointModel(np.array([0.2, 0.5]), np.array([0.45, 0.8]), np.array([0.01, 0.02]), 64)
    edges = SRGB.inverse((np.arange(63) + 0.5) / 63)
    slope = model.slope(edges)

    value = model.expand(edges, np.log([0.9, 0.03]), slope).value

    expected = 0.9 * np.array([0.2, 0.5])
    std = np.hypot(np.array([0.01, 0.02]) * slope, 0.03 * expected)
    # Of the irradiance that was measured, in the units of the table.
    logs = norm.logpdf(np.array([0.2, 0.5]), model.light(edges) / 0.9, std / 0.9)
    assert value == pytest.approx(logs.sum() + np.log(2 * np.pi))


def test_light_is_that_of_the_curve() -> None:
    brightness = np.linspace(0.02, 0.97, 40)
    model = PointModel(brightness, brightness, brightness, 256)
    edges = SRGB.inverse((np.arange(255) + 0.5) / 255)

    np.testing.assert_allclose(model.light(edges), SRGB.inverse(brightness), atol=2e-5)
    h = 1e-4
    slope = (SRGB.inverse(brightness + h) - SRGB.inverse(brightness - h)) / (2 * h)
    np.testing.assert_allclose(model.slope(edges), slope, rtol=0.03)


def test_information_is_the_variance_of_the_gradient() -> None:
    """Over draws of the light that is shown, at the truth."""
    model = PointModel(np.array([0.2, 0.5, 0.7]), np.array([0.5, 0.7, 0.9]), np.full(3, 0.01), 8)
    edges, own = np.linspace(0.1, 0.9, 7) ** 2, np.log([0.9, 0.1])
    slope = model.slope(edges)
    known = 0.9 * model.irradiance
    std = np.hypot(0.01 * slope, 0.1 * known)
    generator, draws = np.random.default_rng(4), []
    for _ in range(4000):
        # The same residuals by other irradiances, whose scatter stays that of `known`.
        shown = known + std * generator.standard_normal(3)
        shift = (shown - known) / std
        draws.append(_score(model, edges, own, slope, shift))

    information = model.expand(edges, own, slope).information

    seen = np.cov(np.array(draws).T)
    scale = np.sqrt(np.outer(np.diag(information) + 1e-9, np.diag(information) + 1e-9))
    assert np.abs((seen - information) / scale).max() < 0.1


def _score(model: PointModel, edges: Floats, own: Floats, slope: Floats, shift: Floats) -> Floats:
    """Gradient if residuals were so many deviations: −r r'/v + (r²/v − 1) v'/2v."""
    known = np.exp(own[0]) * model.irradiance
    by_scatter = (np.exp(own[1]) * known) ** 2
    variance = (model.std * slope) ** 2 + by_scatter
    moved = np.column_stack([model.by_edges, -known, np.zeros(known.size)])
    widened = np.zeros_like(moved)
    widened[:, -2:] = (2 * by_scatter / variance)[:, np.newaxis]
    return -(shift / np.sqrt(variance)) @ moved + 0.5 * (shift**2 - 1) @ widened


def test_points_that_are_black_or_white_say_nothing() -> None:
    irradiance = np.array([0.0, 1e-5, 0.2, 0.5, 3.0])
    brightness = np.array([0.0, 0.0, 0.4, 0.7, 1.0])

    points = MeasuredPoints(irradiance, brightness, np.full(5, 0.002), 256)

    assert points.is_used.tolist() == [False, False, True, True, False]
    assert points.n_pixels == 2
    assert points.observed_levels == (102, 178)


# The curve


@pytest.mark.parametrize("name", ["srgb", "gamma:0.6", "linear"])
def test_a_wedge_gives_the_shape_of_the_curve(name: str, tmp_path: Path) -> None:
    """Light is known up to a factor, so the light at white is what a prior expects above them."""
    curve = named_curve(name)
    found = calibrate(points=table(tmp_path / "wedge.csv", curve, factor=37.0, error=0.01))

    (response,) = found.channels
    std = response.shape_std
    assert std is not None
    error = shape_error(response, curve)
    assert error < 0.01
    assert error < 3 * np.sqrt(np.mean(std**2))
    account = response.account("points")
    assert account["number"] == 20
    assert account["white"] == pytest.approx(37, rel=0.1)
    assert account["scatter"] < 0.03
    assert response.kinds == ("points",)
    assert response.noise is None
    (reading,) = found.evidence
    assert (reading.kind, reading.inputs, reading.example) == ("points", (0,), None)


@pytest.mark.parametrize(("number", "brightest"), [(100, 0.9), (24, 0.5), (300, 0.9)])
def test_more_points_make_no_other_curve(number: int, brightest: float, tmp_path: Path) -> None:
    """Less light for everything would have smaller residuals, and is no better."""
    light = np.geomspace(0.03, brightest, number)
    (response,) = calibrate(points=table(tmp_path / "a.csv", light=light, error=0.01)).channels

    unseen = 1 - brightest
    assert response.account("points")["white"] == pytest.approx(1, rel=0.05 + 0.5 * unseen)
    assert shape_error(response, SRGB) < 0.01 + 0.05 * unseen
    assert response.account("points")["scatter"] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("unit", [1e-12, 1e12])
def test_any_unit_gives_the_same_curve(unit: float, tmp_path: Path) -> None:
    first = calibrate(points=table(tmp_path / "a.csv", error=0.01)).channel("Y")
    other = calibrate(points=table(tmp_path / "b.csv", factor=unit, error=0.01)).channel("Y")

    np.testing.assert_allclose(other.inverse_lut, first.inverse_lut, atol=1e-6)
    assert other.account("points")["white"] == pytest.approx(
        unit * first.account("points")["white"], rel=1e-4
    )


def test_where_light_is_absolute_white_is_known(tmp_path: Path) -> None:
    light = np.append(np.geomspace(0.005, 0.4, 20), 0.6)
    path = table(tmp_path / "wedge.csv", light=light)

    up_to_a_factor = calibrate(points=path).channel("Y")
    absolute = calibrate(points=path, points_absolute=True).channel("Y")

    assert rmse(absolute, SRGB) < 0.01
    assert absolute.white_std < 0.5 * up_to_a_factor.white_std
    assert absolute.account("points")["white"] == pytest.approx(1, abs=1e-3)


def test_channels_have_points_and_factors_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "chart.csv"
    for channel, name, factor in (("R", "srgb", 1), ("G", "gamma:0.6", 2), ("B", "gamma:0.5", 5)):
        table(path, named_curve(name), factor=factor, channel=channel)

    found = calibrate(points=path)

    assert [each.name for each in found.channels] == ["R", "G", "B"]
    scales = [each.account("points")["white"] for each in found.channels]
    assert scales == pytest.approx([1, 2, 5], rel=0.1)
    assert shape_error(found.channel("G"), named_curve("gamma:0.6")) < 0.005


def test_brighter_points_with_more_scatter_are_flagged(tmp_path: Path) -> None:
    found = calibrate(points=table(tmp_path / "chart.csv", error=0.2))

    assert Flag.UNEVEN_TONES in found.channel("Y").flags
    assert found.channel("Y").account("points")["scatter"] > 0.06


def test_points_that_show_little_leave_the_rest_to_the_prior(tmp_path: Path) -> None:
    light = SRGB.inverse(np.linspace(0.35, 0.85, 8))
    (response,) = calibrate(points=table(tmp_path / "chart.csv", light=light)).channels

    assert Flag.LEVELS_UNSEEN in response.flags
    assert response.observed_levels == (89, 217)


def exposures(tmp_path: Path) -> list[Path]:
    from chartless.images import write_image

    scene = np.random.default_rng(2).uniform(0, 1, size=(150, 200)) ** 2
    noise, paths = AffineNoise.of_sensor(5_000, 5), []
    for place, exposure in enumerate((0.25, 0.5, 1.0)):
        (levels,) = simulate_frames(scene * exposure, SRGB, noise, n_frames=1, seed=place)
        paths.append(tmp_path / f"{place}.png")
        write_image(paths[-1], levels[..., np.newaxis] / np.float32(255), data_type="uint8")
    return paths


def test_points_join_a_bracket(tmp_path: Path) -> None:
    frames, path = exposures(tmp_path), table(tmp_path / "chart.csv", factor=3, error=0.01)

    alone = calibrate(frames, times=[1, 2, 4]).channel("Y")
    both = calibrate(frames, times=[1, 2, 4], points=path)

    (response,) = both.channels
    assert set(response.kinds) == {"bracket", "points"}
    assert sum(each.share for each in response.accounts) == pytest.approx(1)
    assert shape_error(response, SRGB) < 1.1 * shape_error(alone, SRGB) + 2e-4
    assert [each.kind for each in both.evidence] == ["bracket", "points"]
    assert both.evidence[1].inputs == (3,)


@pytest.mark.slow
def test_points_join_the_noise_of_frames(tmp_path: Path) -> None:
    """Given both, both are read: nobody gives frames that are to be left out."""
    scene = np.random.default_rng(2).uniform(0, 1, size=(150, 200))
    frames = list(simulate_frames(scene, SRGB, AffineNoise.of_sensor(5_000, 5)))

    (response,) = calibrate(frames, points=table(tmp_path / "chart.csv")).channels

    assert set(response.kinds) == {"noise", "points"}
    assert response.noise is not None
    assert response.account("noise").share == 0
    assert response.account("points").share == 1
    assert shape_error(response, SRGB) < 0.005


@pytest.mark.slow
def test_points_have_as_many_levels_as_a_video(tmp_path: Path) -> None:
    """220 of luma, where points alone would have 256."""
    scene = np.random.default_rng(2).uniform(0, 1, size=(120, 160))
    frames = simulate_frames(scene, SRGB, AffineNoise.of_sensor(5_000, 5), n_frames=6)
    luma = [np.rint(16 + frame * (219 / 255)).astype(np.uint8) for frame in frames]
    clip = write_video(tmp_path / "clip.mkv", map(grey_planes, luma), colour_range=1)

    (response,) = calibrate([clip], points=table(tmp_path / "chart.csv")).channels

    assert response.n_levels == 220
    assert set(response.kinds) == {"noise", "points"}


@pytest.mark.slow
def test_exposures_of_unknown_ratio_are_told_by_points(tmp_path: Path) -> None:
    frames, path = exposures(tmp_path), table(tmp_path / "chart.csv", factor=3, error=0.01)

    (response,) = calibrate(frames, times="unknown", points=path).channels

    assert response.account("bracket")["exposures"] == pytest.approx((1, 2, 4), rel=0.1)
    assert Flag.EXPONENT_UNKNOWN not in response.flags


# Refusals


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0.1,0.3\n0.2,0.5\n0.4,0.7\n", "3 points are neither black nor white, too few"),
        ("0.1,0.7\n0.2,0.5\n0.4,0.3\n0.8,0.1\n", "brightness does not rise with irradiance"),
        ("0.1,0.5\n0.2,0.5\n0.4,0.5\n0.8,0.5\n", "the points cover 0% of the brightness range"),
        ("0.1,0.50\n0.2,0.51\n0.4,0.52\n0.8,0.53\n", "too little for a curve"),
        ("1,0.2\n1,0.4\n1,0.6\n1,0.8\n", "fewer than 4 points differ in irradiance"),
        ("0.1,0.3,,R\n0.2,0.5,,R\n0.4,0.7,,R\n0.8,0.9,,R\n", "no point of channel G, only of R"),
    ],
)
def test_points_that_tell_no_curve_are_refused(rows: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text(rows)

    with pytest.raises(UnfitFramesError, match=said):
        calibrate(points=path)


def test_light_beyond_white_is_not_absolute(tmp_path: Path) -> None:
    with pytest.raises(UnfitFramesError, match="an irradiance is 950 where brightness is below"):
        calibrate(points=table(tmp_path / "chart.csv", factor=1000), points_absolute=True)


@pytest.mark.parametrize("wrong", [3, ["a.csv"], np.ones((4, 2))])
def test_a_table_is_the_name_of_a_file(wrong: Any) -> None:
    with pytest.raises(ParameterError, match="`points` must be the name of a table, not"):
        calibrate(points=wrong)


def test_a_frame_that_would_be_left_out_is_refused(tmp_path: Path) -> None:
    (frame, *_) = exposures(tmp_path)

    with pytest.raises(UnfitFramesError, match="noise needs two or more frames"):
        calibrate([frame], points=table(tmp_path / "chart.csv"))


@pytest.mark.parametrize("argument", [{"mask": np.ones((2, 2), bool)}, {"channels": "rgb"}])
def test_what_is_for_frames_is_refused_without_any(
    argument: dict[str, Any], tmp_path: Path
) -> None:
    with pytest.raises(ParameterError, match=r"has no effect on points of chart\.csv"):
        calibrate(points=table(tmp_path / "chart.csv"), **argument)


def test_methods_of_the_literature_take_no_points(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="choose the method likelihood"):
        calibrate(points=table(tmp_path / "chart.csv"), method="debevec")


# The figure


def test_the_figure_shows_how_far_points_are_from_the_curve() -> None:
    brightness = SRGB.response(LIGHT)
    points = MeasuredPoints(LIGHT, brightness, np.full(LIGHT.size, 0.001), 256)
    response = LikelihoodSearch().calibrate(points)
    axes = Figure().subplots()

    draw_points(axes, [response])

    dots, _ = axes.lines
    np.testing.assert_allclose(dots.get_xdata(), brightness)
    record = response.account("points").record
    assert isinstance(record, SeenPoints)
    apart = response.curve.inverse(brightness) / np.array(record.irradiance) - 1
    np.testing.assert_allclose(dots.get_ydata(), apart)
