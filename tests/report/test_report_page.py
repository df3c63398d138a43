"""The report: one page that says everything, loads nothing, and believes no file name."""

import base64
import io
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from slow_cases import slow_but

from chartless import Calibration, Cooccurrence, load, named_curve, save
from chartless.evidence.bracket.account import (
    SeenTransfer,
    SeenTransfers,
    account_of_bracket,
    exposure_table,
)
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.noise.misfit import Pattern
from chartless.evidence.raw.account import account_of_raw
from chartless.flags import Flag
from chartless.formats import export_response, import_response
from chartless.frames.frame import Frame
from chartless.report import render
from chartless.result.account import Account, Column, Fact, Fit, Reading, Table

Element = Any
Parse = Callable[[str], Element]


def text_of(element: Element) -> str:
    return " ".join("".join(element.itertext()).split())


def by_id(tree: Element, name: str) -> Element:
    (found,) = (each for each in tree.iter() if each.get("id") == name)
    return found


def elements(tree: Element, tag: str) -> list[Element]:
    """Elements of HTML or SVG."""
    return [each for each in tree.iter() if str(each.tag).split("}")[-1] == tag]


def content_of(uri: str) -> bytes:
    return base64.b64decode(uri.partition(";base64,")[2], validate=True)


def rows_of(table: Element) -> list[list[str]]:
    return [[text_of(cell) for cell in row] for row in elements(table, "tr")]


@pytest.fixture(scope="module", params=["page", "bracket_page"])
def tree(request: pytest.FixtureRequest, parsed: Parse) -> Element:
    return parsed(request.getfixturevalue(request.param))


def test_the_verdict_comes_first(page: str, bracket_page: str, parsed: Parse) -> None:
    for source in (page, bracket_page):
        tree = parsed(source)
        first, second, *_ = (text_of(each) for each in tree.iter() if each.tag in ("h1", "h2"))
        assert first == "Camera response"
        assert second == "✓ Good"
        assert text_of(elements(tree, "title")[0]) == "Camera response: good"


def test_headings_are_in_order(tree: Element) -> None:
    ranks = [int(each.tag[1]) for each in tree.iter() if re.fullmatch("h[1-6]", str(each.tag))]

    assert ranks[0] == 1
    assert ranks.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(ranks))


def test_it_has_landmarks_and_a_language(tree: Element) -> None:
    assert tree.get("lang") == "en"
    for tag in ("header", "main"):
        assert len(elements(tree, tag)) == 1
    for section in elements(tree, "section"):
        assert text_of(by_id(tree, section.get("aria-labelledby")))


def test_every_name_is_given_once(tree: Element) -> None:
    names = [each.get("id") for each in tree.iter() if each.get("id")]

    assert len(names) == len(set(names))


def test_every_reference_inside_the_page_has_an_end(tree: Element) -> None:
    names = {each.get("id") for each in tree.iter()}
    used = {
        value
        for each in tree.iter()
        for key, text in each.attrib.items()
        for value in [
            *re.findall(r"url\(#([^)]*)\)", text),
            *(re.findall("^#(.*)", text) if str(key).endswith("href") else []),
        ]
    }

    assert used
    assert used <= names


def test_nothing_is_loaded(page: str, bracket_page: str, parsed: Parse) -> None:
    for source in (page, bracket_page):
        assert "http:" not in source
        assert "https:" not in source
        tree = parsed(source)
        addresses = [
            text
            for each in tree.iter()
            for key, text in each.attrib.items()
            if str(key).split("}")[-1] in ("src", "href", "srcset", "poster", "action")
        ]
        assert all(text.startswith(("data:", "#")) for text in addresses)
        style = "".join(text_of(each) for each in elements(tree, "style"))
        assert "@import" not in style
        assert "url(" not in style
        assert not elements(tree, "script")
        assert not elements(tree, "link")


def test_every_figure_says_in_numbers_what_it_shows(tree: Element) -> None:
    figures = elements(tree, "svg")

    assert figures
    for figure in figures:
        assert figure.get("role") == "img"
        assert re.search(r"\d", text_of(by_id(tree, figure.get("aria-labelledby"))))
    for picture in elements(tree, "img"):
        assert re.search(r"\d", picture.get("alt"))


def test_figures_of_noise(page: str, parsed: Parse) -> None:
    tree = parsed(page)

    figures = {each.get("id"): text_of(each) for each in elements(tree, "figure")}
    assert [*figures][:5] == ["response", "error", "noise", "pairs", "rest"]
    # f = √I: half the brightness is a quarter of the light; the deviation there is the largest.
    assert "G 0.250 ± 0.010" in figures["response"]
    assert "R ± 0.010 at level 127" in figures["error"]
    assert "120,000 pairs" not in figures["pairs"]
    assert "60,000 pairs of one pixel in two frames, channel B" in figures["pairs"]
    assert "1.34 times that of chance alone" in figures["rest"]


def test_the_noise_in_words_is_that_of_the_camera(page: str, parsed: Parse) -> None:
    """σ_O = f′(I) √(uI + v) at level 128 of f = √I, with the rounding to levels."""
    words = text_of(by_id(parsed(page), "noise-text"))

    levels, red = re.findall(r"(?:[\d.]+ / ){2}[\d.]+", words)[:2]
    assert levels == "64 / 128 / 191"
    light = (128 / 255) ** 2
    slope = 0.5 / np.sqrt(light)
    expected = np.sqrt(slope**2 * (0.05 * 255 * light + 9) + 1 / 12)
    assert float(red.split(" / ")[1]) == pytest.approx(expected, rel=0.1)


def test_figures_of_a_bracket(bracket_page: str, parsed: Parse) -> None:
    figures = {each.get("id"): text_of(each) for each in elements(parsed(bracket_page), "figure")}

    assert [*figures] == ["response", "error", "transfer", "ratio"]
    # f = √I: half the light is the level over √2.
    assert "level 128 of an exposure show level 91 in one 2 times shorter" in figures["transfer"]
    assert "differs by 0.0% from their ratio" in figures["ratio"]
    assert "scatter by 3.0%" in figures["ratio"]
    assert "colours as in “Exposure to exposure”" in figures["ratio"]


@pytest.mark.slow
def test_verdict_and_figure_say_one_number_of_a_bracket(
    of_bracket: Calibration, parsed: Parse
) -> None:
    """Whichever channel the middle one is by its misfit."""
    (grey,) = of_bracket.channels
    channels = []
    for name, misfit in zip("RGB", (0.058, 0.018, 0.091), strict=True):
        seen = SeenTransfer(4 * np.exp(misfit), (100.0, 200.0), (50.0, 100.0))
        account = account_of_bracket(
            name,
            grey.curve,
            exposures=(1.0, 4.0),
            transfers=SeenTransfers(256, (seen,)),
            scatter=0.03,
        )
        channels.append(replace(grey, name=name, accounts=(account,)))

    tree = parsed(render(Calibration(channels=tuple(channels), bit_depth=8)))

    figures = {each.get("id"): text_of(each) for each in elements(tree, "figure")}
    (judged,) = (each for each in elements(tree, "section") if "care" in each.get("class", ""))
    assert "from their ratio by 5.8% (channel R" in text_of(judged)
    assert "differs by R 5.8%, G 1.8%, B 9.1% from their ratio" in figures["ratio"].replace(
        "\xa0", " "
    )
    assert "Channel R, the middle one, by which the bracket is judged" in figures["ratio"]
    assert "Channel R;" in figures["transfer"]


def test_tables_have_headers_with_a_scope(tree: Element) -> None:
    tables = elements(tree, "table")

    assert len(tables) >= 4
    for table in tables:
        assert text_of(elements(table, "caption")[0])
        headers = elements(table, "th")
        assert headers
        assert {each.get("scope") for each in headers} <= {"row", "col"}
        assert all(text_of(each) for each in headers)


def test_the_table_of_light_is_the_inverse_response(
    page: str, parsed: Parse, of_noise: Calibration
) -> None:
    (table,) = (each for each in elements(parsed(page), "table") if "Light" in text_of(each[0]))

    header, *rows = rows_of(table)
    assert header == ["Level", "R", "G", "B"]
    assert [row[0] for row in rows][:: len(rows) - 1] == ["0", "255"]
    for level, *cells in rows:
        brightness = int(level) / 255
        deviation = 0.01 * np.sin(np.pi * brightness)
        assert cells == [f"{brightness**2:.3f} ± {abs(deviation):.3f}"] * 3


def test_numbers_of_each_channel(page: str, parsed: Parse) -> None:
    rows = numbers_of(page, parsed)
    assert rows["Noise slope U"] == ["0.050 ± 0.010"] * 3
    assert rows["Noise floor V"] == ["9.00 ± 0.90"] * 3
    assert rows["Levels seen"] == ["3 to 250"] * 3
    assert rows["Pixels compared"] == ["123,456"] * 3
    assert rows["Excluded pairs"] == ["0.25%"] * 3
    assert rows["Deviance of the level pairs, relative to chance"] == ["1.01", "1.02", "1.34"]


def numbers_of(page: str, parsed: Parse) -> dict[str, list[str]]:
    (table,) = (each for each in elements(parsed(page), "table") if "Each" in text_of(each[0]))
    return {name: cells for name, *cells in rows_of(table)}


def test_exposures_of_a_bracket_are_listed(bracket_page: str, parsed: Parse) -> None:
    assert rows_of(exposures_of(bracket_page, parsed))[1:] == [
        ["e0.png", "1", "25.0%", "10.0%"],
        ["e1.png", "2", "12.5%", "10.0%"],
        ["e2.png", "4", "50.0%", "10.0%"],
    ]


def exposures_of(page: str, parsed: Parse) -> Element:
    (table,) = (each for each in elements(parsed(page), "table") if "xposures" in text_of(each[0]))
    return table


@pytest.mark.parametrize(
    "found", slow_but([(1.0, 2.0, 4.0), (1.0, 2.0004, 4.0), (1.0, 2.0)], (1.0, 2.0004, 4.0))
)
def test_exposures_as_given_are_not_listed_twice(
    found: tuple[float, ...], of_bracket: Calibration, parsed: Parse
) -> None:
    table = exposures_of(render(told_of(of_bracket, exposures=found)), parsed)

    assert rows_of(table)[0] == ["Exposure", "Relative", "Black", "White"]


def test_exposures_that_were_found_stand_beside_those_given(
    of_bracket: Calibration, parsed: Parse
) -> None:
    """In units of the exposure that is given as 1, here the first and not the least found."""
    table = exposures_of(render(told_of(of_bracket, exposures=(1.25, 1.0, 12500.0))), parsed)

    header, *rows = rows_of(table)
    assert header == ["Exposure", "Relative", "Found (Y)", "Black", "White"]
    assert [row[2] for row in rows] == ["1", "0.8", "10000"]


@pytest.mark.slow
def test_of_three_channels_the_middle_one_says_which_exposures_were_found(
    of_bracket: Calibration, parsed: Parse
) -> None:
    rows = rows_of_exposures(of_bracket)
    accounts = {}
    for name, last in zip("RGB", (3.0, 5.0, 6.0), strict=True):
        told = told_of(of_bracket, exposures=(1.0, 2.0, last))
        accounts[name] = told.channels[0].account("bracket")

    table = exposures_of(render(with_tables(of_bracket, *exposure_table(rows, accounts))), parsed)

    header, *found = rows_of(table)
    assert header[2] == "Found (G)"
    assert [row[2] for row in found] == ["1", "2", "5"]


def test_what_neighbouring_exposures_share_is_listed(
    of_bracket: Calibration, parsed: Parse
) -> None:
    """The last has no next one."""
    first, second, last = rows_of_exposures(of_bracket)
    rows = [
        {**first, "overlap": 0.416, "displacement": 0.25},
        {**second, "overlap": 0.5, "displacement": 1.0},
        last,
    ]

    table = exposures_of(render(with_tables(of_bracket, *exposure_table(rows, {}))), parsed)

    header, *found = rows_of(table)
    assert header[-2:] == ["Shared with next", "Displaced, px"]
    assert [row[-2:] for row in found] == [["42%", "0.2"], ["50%", "1.0"], ["", ""]]


@pytest.mark.slow
def test_what_raw_files_tell_is_in_the_table(of_noise: Calibration, parsed: Parse) -> None:
    gains = (1.0, 1.254, 1.1, 1.2)
    raw = account_of_raw(matrix=(0.9, 0.15, -0.05), gains=gains, corner_gain=1.187, scatter=0.0123)
    red, *others = of_noise.channels
    told = replace(of_noise, channels=(replace(red, accounts=(*red.accounts, raw)), *others))

    rows = numbers_of(render(told), parsed)

    assert rows["Weights of raw red, green, blue"] == ["0.90 0.15 -0.05", "-", "-"]
    assert rows["Gains of the shots"] == ["1.000 to 1.254", "-", "-"]
    assert rows["Gain of the corners"] == ["1.187", "-", "-"]
    assert rows["Scatter of greys"] == ["1.2%", "-", "-"]
    assert "Gain of the corners" not in numbers_of(render(of_noise), parsed)


@pytest.mark.slow
@pytest.mark.parametrize(("error", "shown"), [(None, None), (0.0345, ["3.5%"])])
def test_what_is_unknown_of_the_exponent_is_in_the_table(
    error: float | None, shown: list[str] | None, of_bracket: Calibration, parsed: Parse
) -> None:
    rows = numbers_of(render(told_of(of_bracket, exponent_error=error)), parsed)

    assert rows.get("Error of the exponent") == shown
    assert rows["Scatter between exposures"] == ["3.0%"]


def told_of(calibration: Calibration, **changes: Any) -> Calibration:
    """The bracket with something else in its account, and in its table."""
    (response,) = calibration.channels
    account = response.account("bracket")
    told = {
        "exposures": account["exposures"],
        "transfers": account.record,
        "scatter": account["scatter"],
    }
    account = account_of_bracket("Y", response.curve, **{**told, **changes})
    channels = (replace(response, accounts=(account,)),)
    tables = exposure_table(rows_of_exposures(calibration), {"Y": account})
    return with_tables(replace(calibration, channels=channels), *tables)


def rows_of_exposures(calibration: Calibration) -> list[dict[str, Any]]:
    """What each exposure showed, by the names of the columns."""
    ((table,),) = (each.tables for each in calibration.evidence)
    codes = [column.code for column in table.columns]
    return [dict(zip(codes, row, strict=True)) for row in table.rows]


def with_tables(calibration: Calibration, *tables: Table) -> Calibration:
    (reading,) = calibration.evidence
    return replace(calibration, evidence=(replace(reading, tables=tables),))


def test_lines_break_between_channels_only(page: str) -> None:
    text = page.partition('id="response-text">')[2].partition("<")[0]

    assert (
        "R 0.250 ± 0.010, G 0.250 ± 0.010".replace(" ", "\N{NO-BREAK SPACE}").replace(
            ",\N{NO-BREAK SPACE}", ", "
        )
        in text
    )


@pytest.mark.slow
def test_the_weight_is_explained(of_noise: Calibration, parsed: Parse) -> None:
    known = {**of_noise.provenance, "settings": {"weight": 0.2}}

    rows = [
        row
        for table in elements(parsed(render(replace(of_noise, provenance=known))), "table")
        for row in rows_of(table)
    ]

    assert ["Weight of a pixel pair, 1 for a perfect model", "0.2"] in rows


def test_it_says_where_it_comes_from(page: str, parsed: Parse) -> None:
    tree = parsed(page)
    words = text_of(tree)

    for text in ("0.1.0", "2026-01-02T03:04:05+00:00", "likelihood", "d1, d2"):
        assert text in words
    assert "Found by chartless from 12 pictures, the first in a0.png." in words
    assert "a0.png: dropped the alpha channel." in words
    assert "0" * 12 in words
    assert "0" * 13 not in words
    (folded,) = elements(tree, "details")
    assert "a11.png" in text_of(folded)
    assert "a7.png" not in text_of(folded)


def test_every_flag_and_pattern_has_its_advice(of_noise: Calibration, parsed: Parse) -> None:
    patterns = [Pattern.PEAKED, Pattern.LEVEL_WISE, Pattern.NOISE_LEVEL]
    accounts = [
        account_of_pairs(None, deviance=2.5, pattern=pattern, errors_by_dark=(0.0071, 0.0035))
        for pattern in patterns
    ]
    channels = tuple(
        replace(each, flags=tuple(Flag), accounts=(account,))
        for each, account in zip(of_noise.channels, accounts, strict=True)
    )

    tree = parsed(render(replace(of_noise, channels=channels)))

    said = dict(
        zip(map(text_of, elements(tree, "dt")), map(text_of, elements(tree, "dd")), strict=True)
    )
    assert len(said) == len(Flag)
    for flag in Flag:
        words = said[f"{flag.code.replace('-', ' ').capitalize()} R, G, B"]
        assert words.startswith(f"{flag.advice[0].upper()}{flag.advice[1:]}.".replace("`", ""))
    for pattern, name in zip(patterns, "RGB", strict=True):
        advice = f"{name}: the pattern is {pattern.code}: {pattern.advice}.".replace("`", "")
        assert advice in said["Misfit R, G, B"]
    assert "from ± 0.007 to ± 0.004" in said["Dark levels unseen R, G, B"]
    assert text_of(by_id(tree, "verdict")) == "✕ Do not trust"


def test_nothing_doubtful_nothing_said(page: str, parsed: Parse) -> None:
    assert not elements(parsed(page), "dt")


HOSTILE = '<script>alert(1)</script>"><img src=x onerror=alert(2)>&amp;.png'


def test_texts_from_files_are_only_texts(of_bracket: Calibration, parsed: Parse) -> None:
    hostile = {
        "chartless": HOSTILE,
        "created": HOSTILE,
        "inputs": [{"file": HOSTILE, "sha256": HOSTILE}],
        "settings": {HOSTILE: HOSTILE, "list": [HOSTILE]},
        "remarks": [HOSTILE],
    }
    account = Account(
        kind=HOSTILE,
        facts=(Fact(HOSTILE, HOSTILE, HOSTILE),),
        fits=(Fit(HOSTILE, HOSTILE, 1.0, good=0.5, remark=HOSTILE),),
        details={Flag.MISFIT.code: HOSTILE},
        share=0.5,
    )
    response = of_bracket.channels[0].with_flags(Flag.MISFIT)
    response = replace(response, method=HOSTILE, accounts=(*response.accounts, account))
    name = Path(HOSTILE).name  # what follows the slash
    frame = Frame(Path(HOSTILE), np.zeros((4, 4, 1), np.uint8))
    columns = (Column(HOSTILE, HOSTILE, "file"), Column(HOSTILE, HOSTILE))
    told = with_tables(of_bracket, Table(HOSTILE, HOSTILE, columns, ((HOSTILE, HOSTILE),)))

    tree = parsed(render(replace(told, channels=(response,), provenance=hostile), frame))

    assert not elements(tree, "script")
    first, _ = elements(tree, "img")
    assert first.get("alt").startswith(name)
    assert not [key for each in tree.iter() for key in each.attrib if str(key).startswith("on")]
    assert text_of(tree).count("<script>alert(1)</script>") >= 15


@pytest.mark.slow
def test_the_calibration_can_be_saved_from_it(
    page: str, parsed: Parse, of_noise: Calibration, tmp_path: Path
) -> None:
    link, *others = elements(parsed(page), "a")

    content = content_of(link.get("href"))

    save(of_noise, tmp_path / "saved.json")
    assert content == (tmp_path / "saved.json").read_bytes()
    assert link.get("download") == "camera.json"
    (tmp_path / "from_page.json").write_bytes(content)
    loaded = load(tmp_path / "from_page.json")
    assert loaded.channels[2].account("noise")["deviance"] == 1.34
    for other, name in zip(others, ("csv", "cube", "spi1d", "clf", "opencv"), strict=True):
        path = tmp_path / other.get("download")
        path.write_bytes(content_of(other.get("href")))
        again = import_response(path)
        assert again.channels[0].method == name
        given = of_noise.channels[0].inverse_lut
        assert np.abs(again.channels[0].inverse_lut - given).max() < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("n_levels", [1024, 65536])
def test_large_calibrations_make_small_pages(
    n_levels: int, of_noise: Calibration, parsed: Parse
) -> None:
    """Pairs are left out of the file in the page, or the file where that is not enough."""
    large = tuple(each.at_levels(n_levels) for each in of_noise.channels)
    if n_levels == 1024:
        table = of_noise.channels[0].account("noise").record
        assert isinstance(table, Cooccurrence)
        counts = np.kron(table.counts, np.ones((4, 4), dtype=np.int64))
        account = account_of_pairs(Cooccurrence(counts), deviance=1.01)
        large = tuple(replace(each, accounts=(account,)) for each in large)

    page = render(replace(of_noise, channels=large))

    assert len(page.encode()) < 2e6
    labels = [text_of(each) for each in elements(parsed(page), "a")]
    json = [label for label in labels if label.startswith("JSON")]
    bare = "JSON, calibration without records of the evidence"
    assert json == ([bare] if n_levels == 1024 else [])
    # OpenCV's is of 256 levels always.
    assert labels[-1].startswith(".yml")


def test_pages_are_small(page: str, bracket_page: str) -> None:
    assert len(page.encode()) < 1e6
    assert len(bracket_page.encode()) < 5e5


@pytest.mark.slow
def test_one_calibration_makes_one_page(page: str, of_noise: Calibration, frame: Frame) -> None:
    assert render(of_noise, frame) == page


def test_what_another_program_made_is_reported_too(
    linear_camera: Calibration, parsed: Parse
) -> None:
    """No error, no noise, no pairs, no provenance."""
    tree = parsed(render(linear_camera))

    assert text_of(by_id(tree, "verdict")) == "! Usable with care"
    assert [each.get("id") for each in elements(tree, "figure")] == ["response"]
    assert "Read by chartless from the file of another program." in text_of(tree)
    assert not elements(tree, "img")
    assert "-" not in {cell for row in rows_of(elements(tree, "table")[0]) for cell in row}


def test_of_an_imported_curve_no_search_is_reported(
    of_noise: Calibration, parsed: Parse, tmp_path: Path
) -> None:
    """Nobody saw its levels, and there is no table without rows."""
    export_response(of_noise, tmp_path / "other.yml", "opencv")

    tree = parsed(render(import_response(tmp_path / "other.yml")))

    words = text_of(tree)
    for text in ("evels seen", "Dots:", "converged", "deviation", "Quantity"):
        assert text not in words
    assert "The error of this curve is unknown." in words
    assert all(len(elements(table, "tbody")[0]) for table in elements(tree, "table"))


def pictures_of(page: str, parsed: Parse) -> list[Image.Image]:
    return [
        Image.open(io.BytesIO(content_of(each.get("src"))))
        for each in elements(parsed(page), "img")
    ]


def test_a_frame_is_shown_before_and_after(
    page: str, parsed: Parse, of_noise: Calibration, frame: Frame
) -> None:
    before, after = pictures_of(page, parsed)

    assert before.size == after.size == (500, 250)  # half of 1000 × 500
    light = of_noise.linearize(frame.levels)
    expected = (frame.levels / 255, named_curve("srgb").response(light))
    for picture, brightness in zip((before, after), expected, strict=True):
        column = np.asarray(picture)[120, 300] / 255
        np.testing.assert_allclose(column, brightness[240, 600], atol=0.02)


def test_a_frame_is_averaged_in_light(of_bracket: Calibration, parsed: Parse) -> None:
    """Stripes of black and white are half the light, which sRGB shows as 0.735.

    Their mean level would be a quarter of the light by this camera's curve.
    """
    stripes = np.zeros((960, 960, 1), dtype=np.uint16)
    stripes[::2] = 65535

    before, after = pictures_of(render(of_bracket, Frame(Path("a.tif"), stripes)), parsed)

    assert before.mode == "L"
    assert np.asarray(before).mean() / 255 == pytest.approx(0.5, abs=0.01)
    assert np.asarray(after).mean() / 255 == pytest.approx(0.735, abs=0.01)


def test_a_frame_is_shown_upright(linear_camera: Calibration, parsed: Parse) -> None:
    """Orientation 6: the first row of the file is the right-hand column of the picture."""
    levels = np.zeros((40, 80, 1), dtype=np.uint8)
    levels[:10] = 255

    before, _ = pictures_of(
        render(linear_camera, Frame(Path("a.jpg"), levels, orientation=6)), parsed
    )

    assert before.size == (40, 80)
    assert np.asarray(before)[:, -8:].min() > 240
    assert np.asarray(before)[:, :24].max() < 15


def test_the_size_of_a_frame_is_that_shown(linear_camera: Calibration, parsed: Parse) -> None:
    turned = Frame(Path("a.jpg"), np.zeros((40, 80, 1), dtype=np.uint8), orientation=6)

    first, _ = elements(parsed(render(linear_camera, turned)), "img")

    assert first.get("alt").startswith("a.jpg, 40 × 80 pixels")


# Kinds of evidence that this version does not know


def wedge(misfit: float = 0.2) -> Account:
    """Account of a kind that is registered nowhere."""
    return Account(
        kind="wedge",
        facts=(Fact("steps", "Steps of the wedge", 21.0, ".0f"),),
        fits=(
            Fit(
                "distance", "Distance from the steps", misfit, ".1%", good=0.3,
                remark="The steps of the wedge are off: clean it.",
            ),
        ),
    )  # fmt: skip


def with_wedge(calibration: Calibration, **changes: Any) -> Calibration:
    columns = (
        Column("file", "Picture", "file"), Column("density", "Density", ".2f"),
        Column("dust", "Dust"),
    )  # fmt: skip
    rows = (("frames/w0.png", 0.05, None), ("frames/w1.png", 1.234, None))
    reading = Reading(
        kind="wedge", title="steps of a wedge", sentence="a wedge",
        tables=(Table("steps", "Steps of the wedge as photographed", columns, rows),),
    )  # fmt: skip
    channels = tuple(
        replace(each, accounts=(*each.accounts, wedge(**changes))) for each in calibration.channels
    )
    return replace(calibration, channels=channels, evidence=(*calibration.evidence, reading))


@pytest.mark.slow
def test_an_account_of_an_unknown_kind_is_shown(of_noise: Calibration, parsed: Parse) -> None:
    page = render(with_wedge(of_noise))

    rows = numbers_of(page, parsed)
    assert rows["Steps of the wedge"] == ["21"] * 3
    assert rows["Distance from the steps"] == ["20.0%"] * 3
    assert rows["Excluded pairs"] == ["0.25%"] * 3


@pytest.mark.slow
def test_a_table_of_an_unknown_kind_is_shown(of_noise: Calibration, parsed: Parse) -> None:
    tree = parsed(render(with_wedge(of_noise)))

    (table,) = (each for each in elements(tree, "table") if "wedge" in text_of(each[0]))
    assert text_of(table[0]) == "Steps of the wedge as photographed."
    assert rows_of(table) == [["Picture", "Density"], ["w0.png", "0.05"], ["w1.png", "1.23"]]


@pytest.mark.slow
def test_the_verdict_says_what_a_fit_of_an_unknown_kind_remarks(
    of_noise: Calibration, parsed: Parse
) -> None:
    good, beyond = (parsed(render(with_wedge(of_noise, misfit=each))) for each in (0.3, 0.31))

    assert text_of(by_id(good, "verdict")) == "✓ Good"
    assert "clean it" not in text_of(good)
    assert text_of(by_id(beyond, "verdict")) == "! Usable with care"
    assert text_of(beyond).count("The steps of the wedge are off: clean it.") == 1


@pytest.mark.slow
def test_a_calibration_of_an_unknown_kind_is_saved_from_its_page(
    of_noise: Calibration, parsed: Parse, tmp_path: Path
) -> None:
    link, *_ = elements(parsed(render(with_wedge(of_noise))), "a")

    (tmp_path / "camera.json").write_bytes(content_of(link.get("href")))

    found = load(tmp_path / "camera.json").channels[0].account("wedge")
    assert found.facts == wedge().facts
    assert found.fits == wedge().fits
