"""The report in a browser: on a phone, in the dark, without JavaScript or network, on paper."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chartless import Calibration, load
from chartless.flags import Flag
from chartless.frames.frame import Frame
from chartless.report import save

pytestmark = pytest.mark.slow

Browser, Page = Any, Any


@pytest.fixture(scope="module")
def reports(
    of_noise: Calibration, of_bracket: Calibration, frame: Frame, tmp_path_factory: Any
) -> dict[str, Path]:
    """A good one of noise, and one of a bracket with a dozen doubts."""
    folder = tmp_path_factory.mktemp("reports")
    (response,) = of_bracket.channels
    doubtful = Calibration(
        channels=(response.with_flags(*list(Flag)[:12]),),
        bit_depth=8,
        evidence=of_bracket.evidence,
        provenance=of_bracket.provenance,
    )
    grey = Frame(frame.path, np.ascontiguousarray(frame.levels[..., :1]))
    save(of_noise, folder / "noise.html", frame)
    save(doubtful, folder / "bracket.html", grey)
    return {path.stem: path for path in folder.iterdir()}


@pytest.fixture(params=["noise", "bracket"])
def report(request: pytest.FixtureRequest, reports: dict[str, Path]) -> str:
    return reports[request.param].as_uri()


@pytest.fixture
def opened(browser: Browser) -> Iterator[Callable[..., Page]]:
    contexts = []

    def open_page(address: str, **settings: Any) -> Page:
        context = browser.new_context(offline=True, **settings)
        contexts.append(context)
        page = context.new_page()
        page.goto(address)
        return page

    yield open_page
    for context in contexts:
        context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_axe_finds_no_fault(
    opened: Callable[..., Page], report: str, width: int, scheme: str
) -> None:
    axe = pytest.importorskip(
        "axe_playwright_python.sync_playwright",
        reason="no axe-core: pip install '.[browser]'",
    )
    page = opened(report, viewport={"width": width, "height": 844}, color_scheme=scheme)

    found = axe.Axe().run(page).response

    assert len(found["passes"]) > 20
    assert [(each["id"], each["impact"]) for each in found["violations"]] == []


def test_nothing_is_asked_of_the_network(browser: Browser, report: str) -> None:
    context = browser.new_context()
    page = context.new_page()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(report)
    page.wait_for_load_state("networkidle")
    context.close()

    assert asked[0] == report
    assert all(url.startswith("data:image/") for url in asked[1:])


def test_everything_is_there_without_javascript(opened: Callable[..., Page], report: str) -> None:
    page = opened(report, java_script_enabled=False)

    assert page.get_by_role("heading", level=2).first.is_visible()
    for tag in ("svg", "table", "img", "figcaption"):
        for element in page.locator(f"{tag}:not(details *)").all():
            box = element.bounding_box()
            assert box is not None, tag
            assert box["width"] > 100, tag
            assert box["height"] > 10, tag
    assert page.locator("svg path").first.is_visible()


def test_pictures_are_decoded(opened: Callable[..., Page], report: str) -> None:
    page = opened(report)

    widths = page.evaluate("[...document.images].map(image => image.naturalWidth)")
    assert len(widths) == 2
    assert min(widths) > 100
    drawn = page.evaluate(
        "Promise.all([...document.querySelectorAll('svg image')].map(async each => {"
        "  const image = new Image(); image.src = each.href.baseVal;"
        "  await image.decode(); return image.naturalWidth }))"
    )
    assert all(width > 10 for width in drawn)
    assert drawn or "bracket" in report


@pytest.mark.parametrize("width", [320, 390, 768])
def test_no_screen_has_to_scroll_sideways(
    opened: Callable[..., Page], report: str, width: int
) -> None:
    page = opened(report, viewport={"width": width, "height": 844})

    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_text_in_figures_can_be_read_on_a_phone(opened: Callable[..., Page], report: str) -> None:
    page = opened(report, viewport={"width": 390, "height": 844})

    heights = page.evaluate(
        "[...document.querySelectorAll('svg')].map(svg => 10.5 * svg.clientWidth / "
        "svg.viewBox.baseVal.width)"
    )
    assert min(heights) > 9


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_figures_stand_out_from_the_page(
    opened: Callable[..., Page], report: str, scheme: str
) -> None:
    """Of lines WCAG 2.2 asks a contrast of 3, of text 4.5."""
    page = opened(report, color_scheme=scheme)

    paper, lines, texts = page.evaluate(
        "[getComputedStyle(document.body).backgroundColor,"
        " [...document.querySelectorAll('#response path, #noise path, #transfer path')]"
        "  .map(each => getComputedStyle(each)).filter(style => style.stroke != 'none'"
        "   && style.strokeOpacity == 1 && parseFloat(style.strokeWidth) >= 1)"
        "  .map(style => style.stroke),"
        " [...document.querySelectorAll('svg text')].map(each => getComputedStyle(each).fill)]"
    )

    assert len(lines) >= 2
    assert min(contrast(paper, line) for line in lines) >= 3
    assert min(contrast(paper, text) for text in texts) >= 4.5


def contrast(first: str, second: str) -> float:
    """Contrast ratio of two CSS colours (WCAG 2.2, "contrast ratio")."""

    def luminance(colour: str) -> float:
        values = np.array([float(part) for part in re.findall(r"[\d.]+", colour)[:3]]) / 255
        linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    dark, bright = sorted((luminance(first), luminance(second)))
    return (bright + 0.05) / (dark + 0.05)


def test_the_keyboard_reaches_every_control(
    opened: Callable[..., Page], reports: dict[str, Path]
) -> None:
    page = opened(reports["noise"].as_uri())

    reached = []
    for _ in range(2):
        page.keyboard.press("Tab")
        reached.append(page.evaluate("document.activeElement.tagName"))

    assert reached == ["SUMMARY", "A"]


def test_the_calibration_is_downloaded(
    opened: Callable[..., Page], reports: dict[str, Path], tmp_path: Path
) -> None:
    page = opened(reports["noise"].as_uri())

    with page.expect_download() as waiting:
        page.get_by_role("link", name="JSON").click()
    waiting.value.save_as(tmp_path / "camera.json")

    assert waiting.value.suggested_filename == "camera.json"
    accounts = [each.account("noise") for each in load(tmp_path / "camera.json").channels]
    assert [account["deviance"] for account in accounts] == [1.01, 1.02, 1.34]


def test_it_prints_on_two_pages(opened: Callable[..., Page], report: str) -> None:
    page = opened(report, color_scheme="dark")

    paper = page.pdf(prefer_css_page_size=True)

    assert 1 <= len(re.findall(rb"/Type\s*/Page\b", paper)) <= 2
    boxes = [
        [float(x) for x in box.split()] for box in re.findall(rb"/MediaBox \[([^]]*)\]", paper)
    ]
    assert all(box == pytest.approx([0, 0, 595, 842], abs=1) for box in boxes)
    assert boxes
