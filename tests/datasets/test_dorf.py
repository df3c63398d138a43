"""The Database of Response Functions: its two forms, damaged files, and which curves belong."""

import zipfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chartless.datasets import DatasetError, Dorf, camera_of, kind_of, load_dorf

IRRADIANCE = np.linspace(0, 1, 1024)
Record = tuple[str, str, Any]  # name, scale label, curve


def made_up_records() -> list[Record]:
    """As many records as the published file has, labelled as there; powers for curves."""
    colours = ("Red", "Green", "Blue")
    labels = [(f"Film-{n}-100CD{c}", "graph-log-log-neg") for n in range(34) for c in colours]
    labels += [("Pan-25", "graph-log-log-neg"), ("Pan-400", "graph-log-log-neg")]
    labels += [(f"Slide-{n}{c}", "graph-log-log-pos") for n in range(16) for c in colours]
    labels += [(f"Neg-{n:02d}min", "graph-log-log-pos") for n in (4, 12)]
    labels += [(f"KAF-{n}", "graph-lin-lin") for n in range(5)]
    labels += [(f"gamma{n / 5}", "gamma-lin-lin") for n in range(1, 14)]
    labels += [(f"dscs315_{n}{c}", "mlab-lin-lin") for n in range(1, 7) for c in "RGB"]
    labels += [(f"FP2900Z{c}", "mlab-lin-lin") for c in "RGB"]
    labels += [("unnamed", "mlab-lin-lin")]
    labels += [(name, "mlab-lin-lin") for name in ("981111", "981113", "981114", "981111.SLRR")]
    labels += [(f"FP2900Z{c}", "mlab-lin-lin-sparse") for c in "RGB"]
    exponents = np.linspace(0.2, 3, len(labels))
    exponents[-3:] = exponents[-11:-8]
    powers = zip(labels, exponents, strict=True)
    return [(*label, (IRRADIANCE**exponent).astype(np.float32)) for label, exponent in powers]


def as_lines(records: list[Record]) -> list[str]:
    irradiance = " ".join(f"{value:.8e}" for value in IRRADIANCE.astype(np.float32))
    lines = []
    for name, scale, curve in records:
        brightness = " ".join(f"{value:.8e}" for value in curve)
        lines += [name, scale, "I = ", f"   {irradiance}", "B = ", f"   {brightness}"]
    return lines


@pytest.fixture(scope="module")
def lines() -> list[str]:
    return as_lines(made_up_records())


@pytest.fixture(scope="module")
def measured(data_path: Path) -> Dorf:
    return load_dorf(data_path / "dorf")


# The text as it is published


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_the_published_text(lines: list[str], newline: str, tmp_path: Path) -> None:
    path = tmp_path / "dorfCurves.txt"
    path.write_text("\n".join(lines) + "\n", newline=newline)

    dorf = load_dorf(path)

    records = made_up_records()
    assert dorf.names == tuple(name for name, _, _ in records)
    assert dorf.scales == tuple(scale for _, scale, _ in records)
    assert dorf.curves.shape == (201, 1024)
    assert dorf.curves.dtype == dorf.irradiance.dtype == np.float64
    np.testing.assert_allclose(dorf.irradiance, IRRADIANCE, atol=1e-7)
    np.testing.assert_allclose(dorf.curves, [curve for _, _, curve in records], atol=1e-7)
    assert Counter(dorf.kinds) == {"film": 154, "digital": 34, "gamma": 13}


@pytest.mark.slow
def test_the_published_archive_and_folders_with_any_form(lines: list[str], tmp_path: Path) -> None:
    text = "\n".join(lines)
    (tmp_path / "text").mkdir()
    (tmp_path / "text" / "dorfCurves.txt").write_text(text)
    (tmp_path / "text" / "SOURCE.txt").write_text("where it comes from")
    (tmp_path / "zip").mkdir()
    archive = tmp_path / "zip" / "dorfCurves.zip"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as content:
        content.writestr("dorf/dorfCurves.txt", text)

    expected = load_dorf(tmp_path / "text")

    for path in (archive, str(archive), tmp_path / "zip", tmp_path / "text" / "dorfCurves.txt"):
        dorf = load_dorf(path)
        assert np.array_equal(dorf.curves, expected.curves)
        assert dorf.names == expected.names


def test_cameras_of_the_published_spelling(lines: list[str], tmp_path: Path) -> None:
    path = tmp_path / "dorfCurves.txt"
    path.write_text("\n".join(lines))

    dorf = load_dorf(path)

    sizes = Counter(dorf.cameras)
    assert {sizes[f"Film-{n}-100"] for n in range(34)} == {3}
    assert {sizes[f"Slide-{n}"] for n in range(16)} == {3}
    assert {sizes[f"gamma{n / 5}"] for n in range(1, 14)} == {1}
    assert {sizes[f"KAF-{n}"] for n in range(5)} == {1}
    assert (sizes["Pan-25"], sizes["Pan-400"], sizes["Neg"]) == (1, 1, 2)
    assert (sizes["Kodak_dscs315"], sizes["FP2900Z"], sizes["Canon_Optura"]) == (18, 6, 4)
    assert sizes["unnamed_193"] == 1
    assert dorf.duplicates == ((190, 198), (191, 199), (192, 200))


def test_the_arrays_cannot_be_changed(measured: Dorf) -> None:
    for array in (measured.irradiance, measured.curves):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


# Damaged text


def replace(number: int, text: str) -> Callable[[list[str]], list[str]]:
    return lambda lines: [*lines[: number - 1], text, *lines[number:]]


def change_number(number: int, place: int, value: str) -> Callable[[list[str]], list[str]]:
    def change(lines: list[str]) -> list[str]:
        numbers = lines[number - 1].split()
        numbers[place] = value
        return replace(number, " ".join(numbers))(lines)

    return change


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damage", "why"),
    [
        (lambda _: [], "it has 1 lines, not 1206"),
        (lambda _: ["<html>", "Please log in", "</html>"], "it has 3 lines, not 1206"),
        (lambda lines: lines[:-6], "it has 1200 lines, not 1206: six for each of 201 curves"),
        (lambda lines: lines[:-1], "it has 1205 lines"),
        (lambda lines: [*lines, *lines[:6]], "it has 1212 lines"),
        (lambda lines: [*lines[1:], "end"], "line 3 should be 'I' and an equals sign: '   0.0"),
        (replace(11, "C ="), "line 11 should be 'B' and an equals sign: 'C ='"),
        (replace(12, "0 0.5 1"), "line 12 has 3 numbers, not 1024"),
        (lambda lines: [*lines[:-1], lines[-1][:9002]], "line 1206 has 600 numbers, not 1024"),
        (change_number(6, 3, "x"), "line 6 has something that is not a number"),
        (change_number(6, 500, "nan"), r"curve 0 \(Film-0-100CDRed\) should go from 0 to 1 and n"),
        (change_number(12, 500, "inf"), r"curve 1 \(Film-0-100CDGreen\) should"),
        (change_number(12, 500, "1e300"), r"curve 1 \(Film-0-100CDGreen\) should"),
        (change_number(12, 500, "0.01"), r"curve 1 \(Film-0-100CDGreen\) should .* never decrease"),
        (change_number(1206, 0, "-0.1"), r"curve 200 \(FP2900ZB\) should go from 0 to 1"),
        (change_number(1206, -1, "0.99999"), r"curve 200 \(FP2900ZB\) should go from 0 to 1"),
        (change_number(1206, -1, "255"), r"curve 200 \(FP2900ZB\) should go from 0 to 1"),
        (change_number(10, 500, "0.7"), "line 10 holds a different irradiance from line 4"),
        (change_number(1204, 500, "nan"), "line 1204 holds a different irradiance from line 4"),
    ],
)
def test_text_that_is_damaged(
    damage: Callable[[list[str]], list[str]], why: str, lines: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "dorfCurves.txt"
    path.write_text("\n".join(damage(lines)))

    with pytest.raises(DatasetError, match=why) as caught:
        load_dorf(path)

    assert str(caught.value).startswith(f"{path}: cannot be read as DoRF: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", ["0", "nan", "0.7"])
def test_an_irradiance_that_does_not_increase(value: str, lines: list[str], tmp_path: Path) -> None:
    path = tmp_path / "dorfCurves.txt"
    bad = change_number(4, 500, value)(lines)[3]
    path.write_text("\n".join(bad if n % 6 == 3 else line for n, line in enumerate(lines)))

    why = (
        "line 4 holds a different"
        if value == "nan"
        else "the irradiance should increase from 0 to 1"
    )
    with pytest.raises(DatasetError, match=why):
        load_dorf(path)


def test_archives_that_are_damaged(lines: list[str], tmp_path: Path) -> None:
    path = tmp_path / "dorfCurves.zip"
    with zipfile.ZipFile(path, "w") as content:
        content.writestr("readme.txt", "nothing")
    with pytest.raises(DatasetError, match=r"it holds no dorfCurves\.txt"):
        load_dorf(path)

    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as content:
        content.writestr("dorfCurves.txt", "\n".join(lines))
    whole = path.read_bytes()
    middle = len(whole) // 2
    for damaged in (whole[:middle], b"", whole[:middle] + b"x" * 99 + whole[middle + 99 :]):
        path.write_bytes(damaged)
        with pytest.raises(DatasetError) as caught:
            load_dorf(path)
        assert str(caught.value).startswith(f"{path}: cannot be read as DoRF: ")


# The arrays


def arrays(**others: Any) -> dict[str, Any]:
    records = made_up_records()
    content = {
        "I": IRRADIANCE.astype(np.float32),
        "B": np.array([curve for _, _, curve in records], dtype=np.float32),
        "name": np.array([name for name, _, _ in records]),
        "scale_class": np.array([scale for _, scale, _ in records]),
    }
    return {**content, **others}


def test_both_forms_give_the_same(lines: list[str], tmp_path: Path) -> None:
    np.savez(tmp_path / "dorf_any.npz", **arrays())
    (tmp_path / "curves.txt").write_text("\n".join(lines))

    one, other = load_dorf(tmp_path), load_dorf(tmp_path / "curves.txt")

    assert np.array_equal(one.irradiance, other.irradiance)
    assert np.array_equal(one.curves, other.curves)
    assert (one.names, one.scales, one.cameras) == (other.names, other.scales, other.cameras)


@pytest.mark.parametrize(
    ("others", "why"),
    [
        ({"B": np.zeros((200, 1024), np.float32)}, r"B should be numbers of shape \(201, 1024\)"),
        ({"I": np.zeros(1000)}, r"I should be numbers of shape \(1024,\): float64 \(1000,\)"),
        ({"I": np.zeros(1024)}, "the irradiance should increase from 0 to 1"),
        ({"I": np.full(1024, np.nan)}, "the irradiance should increase from 0 to 1"),
        ({"B": np.full((201, 1024), "x")}, "B should be numbers"),
        ({"B": np.full((201, 1024), 1e300)}, r"curve 0 \(Film-0-100CDRed\) should go"),
        ({"name": np.zeros(201)}, r"name should be texts of shape \(201,\)"),
        ({"name": np.full(201, None)}, "cannot be read as DoRF: .*allow_pickle=False"),
    ],
)
def test_arrays_that_are_damaged(others: dict[str, Any], why: str, tmp_path: Path) -> None:
    path = tmp_path / "dorf.npz"
    np.savez(path, **arrays(**others))

    with pytest.raises(DatasetError, match=why) as caught:
        load_dorf(path)

    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_files_that_hold_no_arrays(tmp_path: Path) -> None:
    path = tmp_path / "dorf.npz"
    np.savez(path, B=np.zeros(3))
    with pytest.raises(DatasetError, match="it holds no array I"):
        load_dorf(path)

    whole = path.read_bytes()
    path.write_bytes(whole[:-30])
    with pytest.raises(DatasetError, match=r"it is not an \.npz archive"):
        load_dorf(path)

    path.write_bytes(b"cos\nsystem\n(S'true'\ntR.")
    with pytest.raises(DatasetError, match=r"it is not an \.npz archive"):
        load_dorf(path)


def test_files_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"dorfCurves\.txt: .*No such file or directory"):
        load_dorf(tmp_path / "dorfCurves.txt")
    with pytest.raises(DatasetError, match=r"it should contain one of dorfCurves\.zip, dorfCurves"):
        load_dorf(tmp_path)
    with pytest.raises(DatasetError, match=r"curves\.mat: .* give a file in \.zip, \.txt, \.npz"):
        load_dorf(tmp_path / "curves.mat")


# Labels


@pytest.mark.parametrize(
    ("name", "scale", "kind"),
    [
        ("Gold_100CDRed", "graph-log-log-neg", "film"),
        ("Gold_100CDRed", "film log-log (graph-log-log-neg or -pos)", "film"),
        ("unnamed_048", "graph-log-log-pos", "film"),
        ("KAF-2001", "graph-lin-lin", "digital"),
        ("FP2900ZR", "mlab-lin-lin-sparse", "digital"),
        ("FP2900ZR", "mlab-lin-lin or mlab-lin-lin-sparse", "digital"),
        ("g2", "gamma-lin-lin", "gamma"),
        ("Gamma 2.2", "", "gamma"),
        ("Gold_100CDRed", "", "unknown"),
        ("", "", "unknown"),
    ],
)
def test_kinds(name: str, scale: str, kind: str) -> None:
    assert kind_of(name, scale) == kind


@pytest.mark.parametrize(
    ("name", "kind", "camera"),
    [
        ("Agfacolor_futura_100CDRed", "film", "Agfacolor_futura_100"),
        ("Agfacolor_ultra_050_CDBlue", "film", "Agfacolor_ultra_050"),
        ("Kodachrome-25Red", "film", "Kodachrome-25"),
        ("Kodachrome-25CDBlue", "film", "Kodachrome-25"),
        ("Portra_100TCDRed", "film", "Portra_100T"),
        ("Portra_400VCCDGreen", "film", "Portra_400VC"),
        ("Ektachrome_100_plusCDGreen", "film", "Ektachrome_100_plus"),
        ("Ektachrome_100CDGreen", "film", "Ektachrome_100"),
        ("FCICDRed", "film", "FCI"),
        ("Eastman_DoubleX_neg_04min", "film", "Eastman_DoubleX_neg"),
        ("Agfapan_apx_025", "film", "Agfapan_apx_025"),
        ("Red", "film", "Red"),
        ("gamma_1.0", "gamma", "gamma_1.0"),
        ("Kodak_CCD_2_of_5 (KAF-2001,KAF-3000; order unknown)", "digital", "Kodak_CCD"),
        ("KAI-0372", "digital", "KAI-0372"),
        ("Kodak_dscs315_1_R", "digital", "Kodak_dscs315"),
        ("dscs315_6B", "digital", "Kodak_dscs315"),
        ("FP2900ZG", "digital", "FP2900Z"),
        ("FP2900ZG_dup", "digital", "FP2900Z"),
        ("Canon_Optura_1_of_4 (981111,981113; order unknown)", "digital", "Canon_Optura"),
        ("981111.SLRR", "digital", "Canon_Optura"),
    ],
)
def test_cameras(name: str, kind: str, camera: str) -> None:
    assert camera_of(name, kind) == camera


def made_up(names: tuple[str, ...], exponents: tuple[float, ...]) -> Dorf:
    curves = np.stack([IRRADIANCE**exponent for exponent in exponents])
    return Dorf(IRRADIANCE, curves, names, ("graph-log-log-neg",) * len(names))


def test_equal_curves_unite_their_cameras() -> None:
    dorf = made_up(("ARed", "AGreen", "BRed", "BGreen", "CRed"), (1, 2, 2, 3, 4))

    assert dorf.duplicates == ((1, 2),)
    assert dorf.distinct == (0, 1, 3, 4)
    assert dorf.cameras == ("A", "A", "A", "A", "C")
    assert dorf.left_out(3).tolist() == [False, False, False, False, True]


def test_curves_without_a_name_join_their_equals_or_their_neighbours() -> None:
    names = ("unnamed_0", "", "ARed", "unnamed_3", "BRed", "unnamed_5", "unnamed_6")

    dorf = made_up(names, (1, 2, 3, 4, 5, 5, 6))

    assert dorf.cameras == ("unnamed_000",) * 2 + ("A", "unnamed_003") + ("B",) * 3


# The measured curves


def test_the_measured_curves(measured: Dorf) -> None:
    assert measured.curves.shape == (201, 1024)
    assert Counter(measured.kinds) == {"film": 154, "digital": 34, "gamma": 13}
    assert len(measured.distinct) == 190
    equal = [(184, 185, 186), (190, 198), (191, 199), (192, 200)]
    film = [(18, 20), (31, 32), (85, 86), (104, 105), (128, 129), (139, 141)]
    assert sorted(measured.duplicates) == sorted(equal + film)
    power = measured.curves[measured.names.index("gamma_0.6")]
    np.testing.assert_allclose(power, measured.irradiance**0.6, atol=1e-4)


def test_the_measured_cameras(measured: Dorf) -> None:
    sizes = Counter(measured.cameras)

    assert len(sizes) == 71
    assert Counter(sizes.values()) == {1: 18, 3: 47, 4: 2, 5: 2, 6: 1, 18: 1}
    assert (sizes["Kodak_dscs315"], sizes["FP2900Z"], sizes["Canon_Optura"]) == (18, 6, 4)
    assert (sizes["Kodak_CCD"], sizes["Eastman_DoubleX_neg"], sizes["Portra_400VC"]) == (5, 4, 3)
    assert sizes["unnamed_058"] == 5
    assert all(sizes[name] == 1 for name in measured.names if name.startswith("gamma"))


@pytest.mark.slow
def test_no_measured_camera_leaves_a_copy_behind(measured: Dorf) -> None:
    for row in range(201):
        remain = measured.left_out(row)
        assert not remain[row]
        assert not (measured.curves[remain] == measured.curves[row]).all(axis=1).any()
        kinds = {measured.kinds[other] for other in np.flatnonzero(~remain)}
        assert kinds == {measured.kinds[row]}


def test_the_measured_curves_as_text_are_the_same(measured: Dorf, tmp_path: Path) -> None:
    labels = zip(measured.names, measured.scales, measured.curves, strict=True)
    path = tmp_path / "dorfCurves.txt"
    path.write_text("\n".join(as_lines(list(labels))))

    dorf = load_dorf(path)

    assert np.array_equal(dorf.curves, measured.curves)
    assert (dorf.cameras, dorf.duplicates) == (measured.cameras, measured.duplicates)
