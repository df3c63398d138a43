"""ICC profiles: what LittleCMS and OpenColorIO make of ours, and we of others'."""

import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from cameras import CURVES, make_camera
from PIL import Image, ImageCms
from programs import LEVELS, ocio_processor

from chartless.curves import ModelCurve, SrgbCurve
from chartless.errors import CalibrationFileError, ParameterError
from chartless.formats import (
    FORMATS,
    ExportSettings,
    encode_response,
    export_response,
    import_response,
)

Floats = npt.NDArray[np.float64]
X = np.arange(256) / 255
PRECISION = FORMATS["icc"].precision


def profile(tags: dict[bytes, bytes]) -> bytes:
    """A profile of these tags, its header empty but for the mark."""
    at, entries, data = 132 + 12 * len(tags), b"", b""
    for name, content in tags.items():
        entries += struct.pack(">4sII", name, at + len(data), len(content))
        data += content
    return b"\0" * 36 + b"acsp" + b"\0" * 88 + struct.pack(">I", len(tags)) + entries + data


def curv(*entries: int) -> bytes:
    return struct.pack(f">4s4xI{len(entries)}H", b"curv", len(entries), *entries)


def para(function: int, *parameters: float) -> bytes:
    fixed = [round(each * 65536) for each in parameters]
    return struct.pack(f">4s4xH2x{len(fixed)}i", b"para", function, *fixed)


def read(folder: Path, content: bytes) -> list[Floats]:
    (folder / "a.icc").write_bytes(content)
    return [each.curve.inverse(X) for each in import_response(folder / "a.icc").channels]


# What other programs make of our files


def test_littlecms_linearises_with_it(tmp_path: Path) -> None:
    """To its own sRGB, which has our primaries: within half a level, and some of its rounding."""
    camera = make_camera(*CURVES)
    export_response(camera, tmp_path / "camera.icc", "icc")
    ramp = Image.fromarray(LEVELS)

    seen = ImageCms.profileToProfile(
        ramp,
        str(tmp_path / "camera.icc"),
        ImageCms.createProfile("sRGB"),
        renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC,
    )

    wanted = SrgbCurve().response(camera.linearize(LEVELS)[0])
    assert np.abs(np.asarray(seen)[0] - 255 * wanted).max() < 0.6


def test_littlecms_reads_what_it_is(tmp_path: Path) -> None:
    export_response(make_camera(*CURVES), tmp_path / "camera.icc", "icc")

    ours = ImageCms.ImageCmsProfile(str(tmp_path / "camera.icc")).profile

    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).profile
    assert ours.profile_description == (
        "Camera response by chartless, primaries of sRGB assumed; verdict: good"
    )
    assert ours.model.startswith("Verdict of chartless: good: The curve is known to +-0.00")
    assert (ours.device_class, ours.xcolor_space, ours.version) == ("scnr", "RGB ", 2.4)
    assert ours.creation_date is not None
    for colour in ("red_colorant", "green_colorant", "blue_colorant"):
        assert getattr(ours, colour)[0] == pytest.approx(getattr(srgb, colour)[0], abs=2e-4)


@pytest.mark.parametrize("curves", [CURVES, CURVES[:1]])
def test_opencolorio_holds_its_curves(curves: tuple[SrgbCurve, ...], tmp_path: Path) -> None:
    camera = make_camera(*curves)
    export_response(camera, tmp_path / "camera.icc", "icc")

    lut, *_ = ocio_processor(tmp_path / "camera.icc", inverse=True).createGroupTransform()

    entries = np.array([lut.getValue(i) for i in range(lut.getLength())])
    assert np.abs(entries - camera.linearize(LEVELS)[0]).max() <= PRECISION


def test_it_tells_what_16_bits_lost(tmp_path: Path) -> None:
    *_, primaries = encode_response(make_camera(*CURVES), "icc").lost
    steep = encode_response(make_camera(ModelCurve("gamma", (0.25,))), "icc").lost
    deep = encode_response(make_camera(CURVES[0], n_levels=65536), "icc").lost

    assert primaries == "the camera's primaries, which are unknown: those of sRGB stand in"
    n_fallen = np.sum(np.diff(np.rint(65535 * X**4)) == 0)
    assert n_fallen > 5
    assert steep[1:] == (f"levels that 16 bits cannot distinguish from the one below: {n_fallen}",)
    assert deep[1:] == ("levels between its 4096 entries",)
    with pytest.raises(ParameterError, match="up to 4096 levels, not 4097"):
        encode_response(make_camera(*CURVES), "icc", ExportSettings(n_levels=4097))


# What we make of the files of others


def test_a_sample(data_path: Path) -> None:
    camera = import_response(data_path / "format_samples" / "gamma_t.icc")

    for response, gamma in zip(camera.channels, (2.2, 2.0, 1.8), strict=True):
        assert response.method == "icc"
        assert response.inverse_lut == pytest.approx(X**gamma, abs=PRECISION)


def test_the_srgb_of_littlecms(tmp_path: Path) -> None:
    """Its curves are formulas of the type 3."""
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()

    for column in read(tmp_path, srgb):
        assert column == pytest.approx(SrgbCurve().inverse(X), abs=3e-5)


@pytest.mark.parametrize(
    ("curve", "wanted"),
    [
        (curv(), X),
        (curv(round(2.2 * 256)), X ** (563 / 256)),
        (curv(0, 65535), X),
        (curv(0, 13107, 65535), np.interp(X, [0, 0.5, 1], [0, 0.2, 1])),
        (para(0, 2.5), X**2.5),
        (para(1, 2, 1.25, -0.25), np.maximum(1.25 * X - 0.25, 0) ** 2),
        (para(2, 2, 0.5, 0.5, -0.25), ((0.5 * X + 0.5) ** 2 - 0.25) / 0.75),
        (para(3, 2, 1, 0, 0.25, 0.25), np.where(X >= 0.25, X**2, X / 4)),
        (para(4, 2, 1, 0, 0.25, 0.25, 0.5, 0.5), None),
    ],
)
def test_curves_of_every_kind(curve: bytes, wanted: Floats | None, tmp_path: Path) -> None:
    (column,) = read(tmp_path, profile({b"kTRC": curve}))

    if wanted is None:
        wanted = np.where(X >= 0.25, X**2 + 0.5, X / 4 + 0.5) / 1.5
        column, wanted = column[1:], wanted[1:]  # black is 0 whatever the curve
    assert column == pytest.approx(wanted, abs=2e-5)


def test_curves_of_different_lengths(tmp_path: Path) -> None:
    tags = {b"rTRC": curv(), b"gTRC": curv(0, 16384, 65535), b"bTRC": para(0, 2)}

    red, green, blue = read(tmp_path, profile(tags))

    assert red == pytest.approx(X, abs=1e-8)
    assert green == pytest.approx(np.interp(X, [0, 0.5, 1], [0, 16384 / 65535, 1]), abs=1e-4)
    assert blue == pytest.approx(X**2, abs=1e-6)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (profile({}), "has no curve for each channel"),
        (profile({b"rTRC": curv(), b"gTRC": curv()}), "has no curve for each channel"),
        (profile({b"kTRC": b"mft2" + b"\0" * 40}), "of the type 'mft2'"),
        (profile({b"kTRC": curv(1, 2)[:-1]}), "should have 2 entries, and its tag has fewer"),
        (profile({b"kTRC": curv()[:9]}), "is cut short"),
        (profile({b"kTRC": struct.pack(">4s4xI", b"curv", 2**31)}), "should have 2147483648"),
        (profile({b"kTRC": para(5, 1)}), "of the unknown function 5"),
        (profile({b"kTRC": para(4, 1, 2)}), "is cut short"),
        (profile({b"kTRC": curv(0, 0, 0)}), "has no irradiance above 0"),
        (profile({b"kTRC": curv(0, 1)})[:-1], "its tag 'kTRC' is cut short"),
        (profile({b"kTRC": curv(0, 1)})[:130], "is cut short"),
        (profile({b"%04d" % i: b"" for i in range(101)}), "lists 101 tags"),
    ],
)
def test_what_is_no_curve_is_refused(content: bytes, message: str, tmp_path: Path) -> None:
    with pytest.raises(CalibrationFileError) as caught:
        read(tmp_path, content)

    assert str(caught.value).startswith(f"{tmp_path / 'a.icc'}: not a sound ICC input profile")
    assert message in str(caught.value)
