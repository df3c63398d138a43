"""Names in place of calibration files."""

import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms
from test_icc import curv, para, profile

import chartless
from chartless.curves import SrgbCurve, named_curve
from chartless.curves.transfer import TRANSFER_FUNCTIONS
from chartless.errors import CalibrationFileError, ImageError, ParameterError, UnknownNameError
from chartless.formats import FORMATS, ExportSettings, encode_response, export_response, known_names
from chartless.formats.named import NAMED, NamedCalibration, Request
from chartless.formats.named._base import register_named
from chartless.images import read_profile
from chartless.result.calibration import Calibration
from chartless.result.response import Status
from chartless.result.verdict import Grade, known_verdict, verdict

BRIGHTNESS = np.arange(256) / 255
RAMP = np.arange(256, dtype=np.uint8).reshape(1, 256)
SRGB = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
Photo = Callable[..., Path]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def photo(tmp_path: Path) -> Photo:
    def write(icc: bytes | None = SRGB, name: str = "photo.tif", *, grey: bool = False) -> Path:
        picture = Image.fromarray(RAMP if grey else np.dstack([RAMP] * 3))
        picture.save(tmp_path / name, icc_profile=icc)
        return Path(name)

    return write


# Transfer functions


@pytest.mark.parametrize("name", [*TRANSFER_FUNCTIONS, "slog3:limited", "gamma:0.45", "S-Log3"])
def test_a_name_is_a_calibration_of_one_assumed_curve(name: str) -> None:
    calibration = chartless.load_calibration(name)
    (response,) = calibration.channels

    assert response.name == "Y"
    assert response.curve == named_curve(name)
    assert response.status is Status.ASSUMED
    assert (response.n_pairs, response.noise, response.inverse_lut_std) == (0, None, None)
    assert calibration.provenance["settings"] == {"method": "named", "name": name}
    (remark,) = calibration.provenance["remarks"]
    assert remark.startswith(f"{name}: named ")
    assert remark.endswith(": assumed, not measured")


def test_its_provenance_names_the_standard() -> None:
    (remark,) = chartless.load_calibration("srgb").provenance["remarks"]

    assert "named transfer function sRGB (IEC 61966-2-1:1999, 5.2)" in remark


def test_colours_of_16_bits_are_linearised_by_the_formula() -> None:
    levels = np.random.default_rng(0).integers(0, 1 << 16, (9, 7, 3), np.uint16)

    light = chartless.load_calibration("srgb").linearize(levels)

    v = levels / 65535
    wanted = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
    assert np.abs(light - wanted).max() < 1e-7


def test_log_levels_are_light_of_the_formula() -> None:
    """S-Log3, as Sony prints its inverse, over that of the code 1023."""
    codes = np.arange(1024, dtype=np.uint16)

    light = chartless.load_calibration("slog3").linearize(codes[np.newaxis], white=1023)[0]

    code = codes.astype(float)
    linear = (code - 95) * 0.01125 / (171.2102946929 - 95)
    reflectance = np.where(
        code >= 171.2102946929, 10 ** ((code - 420) / 261.5) * 0.19 - 0.01, linear
    ).clip(0)
    assert light == pytest.approx(reflectance / reflectance[-1], abs=1e-7)


def test_nobody_vouches_for_it() -> None:
    channels = chartless.load_calibration("srgb").channels

    judged = verdict(channels)
    assert judged.grade is Grade.CARE
    assert judged.chief == (
        "The curve is assumed, not measured: its error for this camera is not known.",
    )
    assert known_verdict(channels) is None


def test_gamma_of_a_display_comes_with_advice() -> None:
    _, advice = chartless.load_calibration("gamma:2.2").provenance["remarks"]

    assert advice.endswith("of pictures for a display of gamma 2.2 the curve is gamma:0.4545")


def test_it_is_saved_and_loaded(tmp_path: Path) -> None:
    for name in ("srgb", "slog3", "nlog"):
        calibration = chartless.load_calibration(name)
        chartless.save(calibration, tmp_path / "a.json")

        again = chartless.load_calibration(tmp_path / "a.json")

        assert again.channels[0].status is Status.ASSUMED
        assert again.provenance == calibration.provenance
        levels = np.arange(1 << 16, dtype=np.uint16)[np.newaxis]
        off = np.abs(again.linearize(levels) - calibration.linearize(levels))
        assert off.max() < 1.3 / 65535


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_takes_it(name: str, tmp_path: Path) -> None:
    calibration = chartless.load_calibration("rec709")

    settings = ExportSettings(size=(64, 48) if "size" in FORMATS[name].takes else None)
    assert encode_response(calibration, name, settings).content


def test_an_exported_log_curve_is_the_formula(tmp_path: Path) -> None:
    vlog = chartless.load_calibration("vlog")
    export_response(vlog, tmp_path / "a.cube", "cube")

    again = chartless.load_calibration(tmp_path / "a.cube")

    x = np.linspace(0, 1, 4096)
    assert again.channels[0].curve.inverse(x) == pytest.approx(
        vlog.channels[0].curve.inverse(x), abs=1e-6
    )


# Files and names


def test_a_file_of_that_name_comes_first(tmp_path: Path) -> None:
    chartless.save(chartless.load_calibration("gamma:0.5"), tmp_path / "srgb")

    light = chartless.load_calibration("srgb").channels[0].curve.inverse(0.5)
    assert light == pytest.approx(0.25, abs=1e-6)
    assert chartless.load_calibration("s-rgb").channels[0].curve == SrgbCurve()


def test_a_folder_of_that_name_does_not(tmp_path: Path) -> None:
    (tmp_path / "linear").mkdir()

    assert chartless.load_calibration("linear").channels[0].curve.inverse(0.3) == pytest.approx(0.3)


@pytest.mark.parametrize("path", ["./srgb", "shots/srgb", "srgb.json", "https://example.org/srgb"])
def test_a_path_is_no_name(path: str) -> None:
    with pytest.raises(CalibrationFileError, match=r"check the name|is an address"):
        chartless.load_calibration(path)


@pytest.mark.parametrize(
    ("text", "close"), [("sgrb", "srgb"), ("slog4", "slog3"), ("gama:0.45", "gamma")]
)
def test_an_unknown_name_lists_what_is_close_and_what_there_is(text: str, close: str) -> None:
    with pytest.raises(UnknownNameError) as caught:
        chartless.load_calibration(text)

    told = str(caught.value)
    assert told.startswith(f"unknown file or transfer function {text.partition(':')[0]!r}. ")
    assert f"Did you mean {close!r}?" in told
    for name in ("linear", "srgb", "rec709", "slog3", "icc", "gamma"):
        assert name in told


@pytest.mark.parametrize("text", ["slog3:full", "srgb:1", "gamma:a", "gamma", "icc"])
def test_useless_parameters_are_refused(text: str) -> None:
    with pytest.raises(ParameterError):
        chartless.load_calibration(text)


def test_a_name_can_make_a_whole_calibration(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a band, for example: the registry is for that."""
    seen = []

    def make(request: Request) -> Calibration:
        seen.append(request)
        made = chartless.load_calibration("gamma:0.5")
        (response,) = made.channels
        return replace(made, channels=(replace(response, inverse_lut_std=np.full(4096, 0.04)),))

    monkeypatch.setattr(NAMED, "_items", dict(NAMED))
    register_named(NamedCalibration("plain", "a plain camera", make))

    calibration = chartless.load_calibration("plain:8", pictures=[Path("a.jpg")])

    assert seen == [Request("plain:8", "8", (Path("a.jpg"),))]
    assert known_names()["plain"] == "a plain camera"
    judged = verdict(calibration.channels)
    assert judged.brief.startswith("usable with care: The curve is assumed, not measured")
    assert "The curve is known to ± 0.040" in judged.brief
    assert known_verdict(calibration.channels) == judged


# The profile in a picture


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif", "webp"])
def test_the_profile_of_a_picture_is_found(suffix: str, photo: Photo) -> None:
    assert read_profile(photo(name=f"a.{suffix}")) == SRGB
    assert read_profile(photo(None, name=f"b.{suffix}")) is None


def test_the_profile_of_a_picture_is_its_curve(photo: Photo) -> None:
    """That of LittleCMS for sRGB, whose formula has parameters of 16 bits."""
    calibration = chartless.load_calibration("icc", pictures=[photo()])
    (response,) = calibration.channels

    assert response.status is Status.ASSUMED
    assert response.curve.inverse(BRIGHTNESS) == pytest.approx(
        SrgbCurve().inverse(BRIGHTNESS), abs=3e-5
    )
    (remark,) = calibration.provenance["remarks"]
    assert remark == "icc: the ICC profile 'sRGB built-in' in photo.tif: assumed, not measured"


def test_one_picture_can_be_named_for_all_commands(photo: Photo) -> None:
    first = chartless.load_calibration("icc", pictures=[photo()])

    named = chartless.load_calibration(f"icc:{photo()}")

    assert named.linearize(RAMP).tolist() == first.linearize(RAMP).tolist()
    (given,) = named.provenance["inputs"]
    assert given["file"] == "photo.tif"


def test_channels_of_a_profile_are_kept_apart(photo: Photo) -> None:
    tags = {b"rTRC": curv(256), b"gTRC": curv(512), b"bTRC": para(0, 3.0)}

    calibration = chartless.load_calibration("icc", pictures=[photo(profile(tags))])

    assert [each.name for each in calibration.channels] == ["R", "G", "B"]
    for response, power in zip(calibration.channels, (1, 2, 3), strict=True):
        assert response.curve.inverse(BRIGHTNESS) == pytest.approx(BRIGHTNESS**power, abs=1e-6)


def test_a_grey_profile_is_one_curve(photo: Photo) -> None:
    path = photo(profile({b"kTRC": curv(563)}), grey=True)

    (response,) = chartless.load_calibration("icc", pictures=[path]).channels

    assert response.curve.inverse(0.5) == pytest.approx(0.5 ** (563 / 256), abs=1e-6)


@pytest.mark.parametrize(
    ("description", "shown"),
    [
        (struct.pack(">4s4xI9s", b"desc", 9, b"My camera"), " 'My camera'"),
        (
            struct.pack(">4s4xII4sII", b"mluc", 1, 12, b"enUS", 18, 28)
            + "Cam\u00e9ra 35".encode("utf-16-be"),
            " 'Cam\u00e9ra 35'",
        ),
        (b"mluc", ""),
    ],
)
def test_a_profile_is_called_what_it_calls_itself(
    description: bytes, shown: str, photo: Photo
) -> None:
    tags = {b"desc": description, **dict.fromkeys((b"rTRC", b"gTRC", b"bTRC"), curv(512))}

    calibration = chartless.load_calibration("icc", pictures=[photo(profile(tags))])

    (remark,) = calibration.provenance["remarks"]
    assert remark == f"icc: the ICC profile{shown} in photo.tif: assumed, not measured"


@pytest.mark.parametrize(
    ("icc", "told"),
    [
        (None, "has no ICC profile: name its transfer function instead, such as srgb"),
        (
            profile({b"A2B0": b"mft2" + b"\0" * 50}),
            "ICC profile: has no curve for each channel (rTRC, gTRC, bTRC): its tables mix them",
        ),
        (profile({b"kTRC": curv(0)})[:140], "ICC profile: is cut short"),
        (profile({b"kTRC": curv(0, 0, 0)}), "ICC profile: channel Y has no irradiance above 0"),
    ],
)
def test_pictures_without_curves_are_refused(icc: bytes | None, told: str, photo: Photo) -> None:
    with pytest.raises(ImageError) as caught:
        chartless.load_calibration("icc", pictures=[photo(icc)])

    assert str(caught.value).startswith(f"photo.tif: {told}")


def test_pictures_of_different_curves_are_refused(photo: Photo) -> None:
    other = profile(dict.fromkeys((b"rTRC", b"gTRC", b"bTRC"), curv(512)))
    pictures = [photo(), photo(name="same.tif"), photo(other, name="other.tif")]

    assert chartless.load_calibration("icc", pictures=pictures[:2])
    with pytest.raises(ParameterError, match=r"photo\.tif and other\.tif have ICC profiles of"):
        chartless.load_calibration("icc", pictures=pictures)


def test_a_missing_picture_is_refused() -> None:
    with pytest.raises(ImageError, match=r"photo\.jpg: does not exist"):
        chartless.load_calibration("icc:photo.jpg")
