"""The page in a browser, as people use it."""

import base64
import itertools
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from web_client import Client, serving

from chartless import AffineNoise, named_curve, simulate_frames
from chartless.cli import main

pytestmark = pytest.mark.slow

Browser, Page = Any, Any
LONG = 30_000  # milliseconds


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with serving(tmp_path_factory.mktemp("desk")) as client:
        yield client


@pytest.fixture
def visit(browser: Browser, server: Client) -> Iterator[Callable[..., Page]]:
    """Open the page as a browser that was never here; whatever its script cannot handle fails."""
    contexts, faults = [], []

    def open_page(**settings: Any) -> Page:
        context = browser.new_context(**settings)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(LONG)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(f"http://127.0.0.1:{server.port}/")
        page.wait_for_load_state("networkidle")
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert faults == []


def until(page: Page, condition: str) -> None:
    """Wait until an expression is true; the page's policy keeps Playwright's own way out."""
    deadline = time.monotonic() + LONG / 1000
    while not page.evaluate(condition):
        assert time.monotonic() < deadline, condition
        page.wait_for_timeout(50)


def drop(page: Page, paths: list[Path]) -> None:
    """Drop files on the page, as from a folder."""
    files = [(path.name, base64.b64encode(path.read_bytes()).decode()) for path in paths]
    page.evaluate(
        """files => {
          const transfer = new DataTransfer();
          for (const [name, content] of files) {
            const bytes = Uint8Array.from(atob(content), each => each.charCodeAt(0));
            transfer.items.add(new File([bytes], name));
          }
          const event = { dataTransfer: transfer, bubbles: true, cancelable: true };
          document.getElementById('drop').dispatchEvent(new DragEvent('dragover', event));
          document.getElementById('drop').dispatchEvent(new DragEvent('drop', event));
        }""",
        files,
    )


def drop_two(page: Page, frames: list[Path]) -> None:
    """Drop two frames and wait until they are listed."""
    drop(page, frames)
    page.wait_for_selector("#uploads li:nth-child(2)")


def calibrated(page: Page, frames: list[Path], method: str = "nlf") -> Page:
    """Drop frames and wait for the report."""
    if method:
        page.select_option("[name=method]", method)
    drop_two(page, frames)
    page.click("#calibrate")
    page.wait_for_selector("#report svg")
    return page


def test_frames_dropped_become_a_curve(
    visit: Callable[..., Page],
    frames: list[Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Drop, progress, curve, another method, downloads equal to what the command line writes."""
    page = visit()
    assert page.is_disabled("#calibrate")
    drop_two(page, frames)
    assert page.locator("#uploads span").all_inner_texts() == ["shot_1.png", "shot_2.png"]

    page.select_option("[name=method]", "ism-bin")
    page.click("#calibrate")
    until(page, "document.getElementById('bar').value > 0.1")
    assert page.locator("#running").is_visible()
    assert page.inner_text("#stage") != ""
    page.wait_for_selector("#report svg")

    assert page.locator("#running").is_hidden()
    assert page.locator("#verdict-first .verdict").is_visible()
    assert page.locator("#report #response svg path").count() > 3
    first = page.inner_text("#shown-title")

    page.select_option("[name=method]", "nlf")
    page.wait_for_selector("#cameras li:nth-child(2)")
    page.wait_for_selector("#report svg")
    until(page, f"document.getElementById('shown-title').textContent != {first!r}")
    page.wait_for_selector("#take:not([hidden])")

    monkeypatch.chdir(frames[0].parent)
    names = [path.name for path in frames]
    own = tmp_path / "camera.json"
    assert main(["calibrate", *names, "--method", "nlf", "-o", str(own)]) == 0
    assert main(["export", str(own), "--to", "cube", "-o", f"{tmp_path}/camera.cube"]) == 0
    with page.expect_download() as given:
        page.click("#json")
    assert given.value.suggested_filename == "camera.json"
    ours, theirs = (json.loads(Path(each).read_text()) for each in (given.value.path(), own))
    for each in (ours, theirs):
        each["provenance"].pop("created")
    assert ours == theirs
    page.select_option("#format", "cube")
    with page.expect_download() as given:
        page.click("#export")
    assert given.value.suggested_filename == "camera.cube"
    assert given.value.path().read_bytes() == (tmp_path / "camera.cube").read_bytes()
    until(page, "document.getElementById('lost').textContent.includes('band')")
    with page.expect_download() as given:
        page.click("#keep")
    assert given.value.suggested_filename == "report.html"


def test_a_wrong_file_is_explained(visit: Callable[..., Page], tmp_path: Path) -> None:
    page = visit()
    text = tmp_path / "notes.txt"
    text.write_text("these are no pictures")
    drop(page, [text])
    page.wait_for_selector("#message:not([hidden])")

    assert "notes.txt: is not a picture in a known format" in page.inner_text("#message")
    assert page.get_by_role("alert").is_visible()
    assert page.locator("#uploads li").count() == 0


def test_of_many_wrong_files_some_are_explained(
    visit: Callable[..., Page], frames: list[Path], tmp_path: Path
) -> None:
    page = visit()
    for number in range(8):
        (tmp_path / f"{number}.txt").write_text("these are no pictures")
    drop(page, [*sorted(tmp_path.glob("*.txt")), frames[0]])
    page.wait_for_selector("#message:not([hidden])")

    lines = page.inner_text("#message").splitlines()
    assert [line[:6] for line in lines[:-1]] == [f"{number}.txt:" for number in range(5)]
    assert lines[-1] == "And 3 more."
    assert page.locator("#uploads li").count() == 1


def test_an_option_that_is_refused_can_be_mended(
    visit: Callable[..., Page], frames: list[Path]
) -> None:
    page = visit()
    drop_two(page, frames)
    page.click("summary")
    page.fill("[name=times]", "1, zwei")
    page.click("#calibrate")
    page.wait_for_selector("#message:not([hidden])")

    assert "zwei" in page.inner_text("#message")
    page.fill("[name=times]", "")
    page.select_option("[name=method]", "nlf")
    page.dblclick("#calibrate")
    page.wait_for_selector("#report svg")
    assert page.locator("#cameras li").count() == 1


def test_frames_that_tell_nothing_are_explained(
    visit: Callable[..., Page], frames: list[Path], tmp_path: Path
) -> None:
    page = visit()
    twin = tmp_path / "twin.png"
    twin.write_bytes(frames[0].read_bytes())
    drop_two(page, [frames[0], twin])
    page.click("#calibrate")
    page.wait_for_selector("#failed:not([hidden])")

    assert "identical pixels" in page.inner_text("#reason")
    assert "/" not in page.inner_text("#reason")


def test_what_to_do_is_found_on_the_page(visit: Callable[..., Page], tmp_path: Path) -> None:
    """A bracket without EXIF: the message names --times, which is among the options."""
    scene = np.random.default_rng(3).uniform(size=(240, 320)) * 0.25
    for number in range(3):
        light = np.clip(scene * 2**number, 0, 1)
        Image.fromarray(np.rint(255 * light**0.5).astype(np.uint8)).save(tmp_path / f"{number}.png")
    page = visit()
    drop(page, sorted(tmp_path.glob("*.png")))
    page.wait_for_selector("#uploads li:nth-child(3)")
    page.click("#calibrate")
    page.wait_for_selector("#failed:not([hidden])")

    assert "--times" in page.inner_text("#reason")
    assert page.locator("#hint").is_visible()
    page.fill("[name=times]", "1, 2, 4")
    page.click("#calibrate")
    page.wait_for_selector("#report svg")

    page.click("#clear")
    page.wait_for_selector("#uploads li", state="detached")
    assert page.is_disabled("#calibrate")


def test_a_reload_in_the_middle_loses_nothing(
    visit: Callable[..., Page], frames: list[Path]
) -> None:
    page = visit()
    page.select_option("[name=method]", "ism-bin")
    drop_two(page, frames)
    page.click("#calibrate")
    until(page, "document.getElementById('bar').value > 0")

    page.reload()

    page.wait_for_selector("#uploads li:nth-child(2)")
    page.wait_for_selector("#report svg")
    page.reload()
    page.wait_for_selector("#report svg")
    assert page.locator("#cameras li").count() == 1


def test_two_browsers_do_not_meet(visit: Callable[..., Page], frames: list[Path]) -> None:
    one, other = visit(), visit()
    drop_two(one, frames)
    drop(other, frames[:1])
    other.wait_for_selector("#uploads li")
    for page in (one, other):
        page.select_option("[name=method]", "nlf")
        page.click("#calibrate")
    one.wait_for_selector("#report svg")
    other.wait_for_selector("#failed:not([hidden])")

    assert "two or more frames" in other.inner_text("#reason")
    assert one.locator("#cameras li").count() == 1


def test_work_is_stopped(visit: Callable[..., Page], frames: list[Path]) -> None:
    page = visit()
    page.select_option("[name=method]", "ism-bin")
    drop_two(page, frames)
    page.click("#calibrate")
    page.click("#stop")

    page.wait_for_selector("#welcome:not([hidden])")
    assert page.locator("#cameras li").count() == 0


def test_curves_are_compared(
    visit: Callable[..., Page], frames: list[Path], data_path: Path
) -> None:
    page = calibrated(visit(), frames)
    sample = next((data_path / "format_samples").rglob("*.cube"))
    drop(page, [sample])
    page.wait_for_selector("#cameras li:nth-child(2)")
    until(page, "document.querySelectorAll('#cameras input').length == 2")
    assert page.locator("#compare").is_disabled()
    assert page.inner_text("#compare") == "Compare (tick two)"
    for place in range(2):
        page.locator("#cameras input").nth(place).check()
    page.click("#compare")
    page.wait_for_selector("#report table")

    assert page.inner_text("#shown-title") == "Comparison"
    assert page.locator("#report tbody tr").count() == 2
    assert sample.name in page.inner_text("#report table")


def test_the_way_back_leads_to_what_was_shown_before(
    visit: Callable[..., Page], frames: list[Path]
) -> None:
    page = calibrated(visit(), frames)
    first = page.inner_text("#shown-title")
    page.select_option("[name=model]", "gumbel4")
    page.wait_for_selector("#failed:not([hidden])")
    page.select_option("[name=model]", "")
    page.wait_for_selector("#report svg")
    assert page.inner_text("#shown-title") == first
    page.select_option("[name=method]", "")
    until(page, "document.querySelectorAll('#cameras input').length == 2")
    page.wait_for_selector("#report svg")
    for tick in page.locator("#cameras input").all():
        tick.check()
    page.click("#compare")
    page.wait_for_selector("#report table")
    assert page.inner_text("#shown-title") == "Comparison"
    page.reload()
    page.wait_for_selector("#report table")
    assert page.inner_text("#shown-title") == "Comparison"
    assert all(tick.is_checked() for tick in page.locator("#cameras input").all())

    titles = []
    for _ in range(4):
        page.evaluate("history.back()")
        page.wait_for_timeout(200)
        titles.append(page.inner_text("#shown-title"))
    assert titles == [first.removesuffix(", nlf"), first, f"{first}, gumbel4", first]
    page.evaluate("history.back()")
    page.wait_for_selector("#welcome:not([hidden])")


def test_the_form_says_how_the_result_in_sight_was_made(
    visit: Callable[..., Page], frames: list[Path]
) -> None:
    page = calibrated(visit(), frames)
    page.select_option("[name=method]", "")
    until(page, "document.querySelectorAll('#cameras input').length == 2")
    page.reload()
    page.wait_for_selector("#report svg")
    assert page.input_value("[name=method]") == ""

    page.locator("#cameras .open").first.click()
    assert page.input_value("[name=method]") == "nlf"
    page.reload()
    page.wait_for_selector("#report svg")
    assert page.input_value("[name=method]") == "nlf"
    assert page.locator("#cameras li").count() == 2


def test_the_option_that_is_missed_has_the_focus(
    visit: Callable[..., Page], frames: list[Path]
) -> None:
    page = visit()
    drop_two(page, frames)
    page.click("summary")
    page.select_option("[name=evidence]", "bracket")
    page.click("summary")
    page.click("#calibrate")
    page.wait_for_selector("#failed:not([hidden])")
    page.wait_for_timeout(100)

    assert "--times" in page.inner_text("#reason")
    assert page.evaluate("document.activeElement.name") == "times"


def test_the_focus_stays(visit: Callable[..., Page], frames: list[Path]) -> None:
    """Rows are drawn anew while somebody goes through them with the keyboard."""
    page = calibrated(visit(), frames)
    page.focus("#cameras input")
    page.keyboard.press("Space")
    assert page.evaluate("document.activeElement.type") == "checkbox"
    assert page.is_checked("#cameras input")

    page.focus("#uploads li:first-child select")
    page.keyboard.type("lens")
    until(page, "fetch('api/state').then(it => it.json()).then(it => it.files[0].role == 'dark')")
    page.wait_for_timeout(200)
    assert page.evaluate("document.activeElement.value") == "dark"

    page.focus("#uploads li:first-child button")
    page.keyboard.press("Enter")
    page.wait_for_selector("#uploads li:nth-child(2)", state="detached")
    assert page.evaluate("document.activeElement.title") == "Remove shot_2.png"


def test_on_paper_is_the_report(visit: Callable[..., Page], frames: list[Path]) -> None:
    page = calibrated(visit(), frames)
    page.emulate_media(media="print")

    for part in ("#drop", "#options", "#cameras", "#take", "#live-start"):
        assert page.locator(part).is_hidden(), part
    for part in ("#shown-title", "#verdict-first .verdict", "#report #response svg"):
        assert page.locator(part).is_visible(), part


def test_a_calibration_that_means_harm_is_text(
    visit: Callable[..., Page], frames: list[Path], tmp_path: Path
) -> None:
    page = calibrated(visit(), frames)
    with page.expect_download() as given:
        page.click("#json")
    content = json.loads(given.value.path().read_text())
    harm = "<img src=x onerror=alert(1)><script>alert(2)</script>$\\frac$"
    content["method"] = harm
    known = content["provenance"]
    known["remarks"] = [harm, "long " * 50_000]
    known["settings"] = {harm: harm}
    known["inputs"][0]["file"] = f"/{harm}.png"
    file = tmp_path / f"{harm.replace('/', '')}.json"
    file.write_text(json.dumps(content))
    drop(page, [file])
    page.wait_for_selector("#cameras li:nth-child(2)")
    until(page, "document.querySelectorAll('#cameras input').length == 2")
    page.wait_for_selector("#report svg")

    harmful = "document.querySelectorAll('[onerror], [src=x], main script').length"
    assert "onerror" in page.inner_text("#report")
    assert page.evaluate(harmful) == 0
    for tick in page.locator("#cameras input").all():
        tick.check()
    page.click("#compare")
    page.wait_for_selector("#report table")
    assert "onerror" in page.inner_text("#report")
    assert page.evaluate(harmful) == 0


def test_axe_finds_no_fault(visit: Callable[..., Page], frames: list[Path]) -> None:
    axe = pytest.importorskip(
        "axe_playwright_python.sync_playwright",
        reason="no axe-core: pip install '.[browser]'",
    )
    page = visit(bypass_csp=True)

    def require_no_faults() -> None:
        for width, scheme in itertools.product((1280, 390), ("light", "dark")):
            page.set_viewport_size({"width": width, "height": 844})
            page.emulate_media(color_scheme=scheme)
            found = axe.Axe().run(page).response
            assert len(found["passes"]) > 15
            assert [(each["id"], each["impact"]) for each in found["violations"]] == []
            assert page.evaluate("document.documentElement.scrollWidth") <= width

    require_no_faults()
    calibrated(page, frames)
    page.click("summary")
    require_no_faults()


def test_the_keyboard_does_it_all(visit: Callable[..., Page], frames: list[Path]) -> None:
    page = visit()
    page.set_input_files("#files", [str(path) for path in frames])
    page.wait_for_selector("#uploads li:nth-child(2)")
    page.focus("[name=method]")
    page.keyboard.type("nlf")
    for _ in range(6):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "calibrate":
            break
    page.keyboard.press("Enter")
    page.wait_for_selector("#report svg")

    assert page.evaluate("document.activeElement.id") == "shown-title"


def test_nothing_is_asked_of_the_network(
    visit: Callable[..., Page], frames: list[Path], server: Client
) -> None:
    page = visit()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.reload()
    calibrated(page, frames)

    own = (f"http://127.0.0.1:{server.port}/", "data:", "blob:")
    assert [url for url in asked if not url.startswith(own)] == []
    assert len(asked) > 5


def test_another_site_cannot_do_anything(browser: Browser, server: Client, tmp_path: Path) -> None:
    """A page of another origin tries what browsers let it try."""
    context = browser.new_context()
    page = context.new_page()
    page.goto(f"http://127.0.0.1:{server.port}/")
    page.wait_for_load_state("networkidle")
    foreign = tmp_path / "evil.html"
    foreign.write_text("<!doctype html><title>evil</title><p>evil")
    evil = context.new_page()
    evil.goto(foreign.as_uri())
    address = f"http://127.0.0.1:{server.port}"
    outcomes = evil.evaluate(
        """async address => {
          const outcomes = [];
          const requests = [
            ['api/state', {credentials: 'include'}],
            ['api/state', {mode: 'no-cors', credentials: 'include'}],
            ['api/session', {method: 'POST', mode: 'no-cors', credentials: 'include'}],
            ['api/files?name=a.png', {method: 'PUT', body: 'x', headers: {'X-Chartless': '1'}}],
            ['api/cameras', {method: 'POST', body: '{}', mode: 'no-cors', credentials: 'include'}],
          ];
          for (const [path, settings] of requests) {
            try {
              const answer = await fetch(`${address}/${path}`, settings);
              outcomes.push(answer.type == 'opaque' ? 'opaque' : answer.status);
            } catch { outcomes.push('refused'); }
          }
          const frame = document.createElement('iframe');
          frame.src = address;
          document.body.append(frame);
          await new Promise(resolve => setTimeout(resolve, 500));
          try { outcomes.push(frame.contentDocument === null ? 'refused' : 'embedded'); }
          catch { outcomes.push('refused'); }
          return outcomes;
        }""",
        address,
    )
    state = page.evaluate("fetch('api/state').then(answer => answer.json())")
    context.close()

    assert set(outcomes) <= {"refused", "opaque"}
    assert state == {"files": [], "cameras": []}


def test_the_camera_is_watched(
    launch: Callable[..., Browser], server: Client, tmp_path: Path
) -> None:
    """Chromium's pretended camera plays frames that are made here, and the curve is found."""
    scene = np.random.default_rng(3).uniform(size=(240, 320))
    noise, grey = AffineNoise.of_sensor(1_500, 5), np.full(2 * 120 * 160, 128, np.uint8).tobytes()
    film = tmp_path / "film.y4m"
    with film.open("wb") as file:
        file.write(b"YUV4MPEG2 W320 H240 F15:1 Ip A1:1 C420jpeg\n")
        for levels in simulate_frames(scene, named_curve("srgb"), noise, n_frames=30, seed=1):
            file.write(b"FRAME\n" + levels.tobytes() + grey)
    browser = launch(
        "--use-fake-ui-for-media-stream",
        "--use-fake-device-for-media-stream",
        f"--use-file-for-fake-video-capture={film}",
    )
    page = browser.new_page()
    page.set_default_timeout(LONG)
    page.goto(f"http://127.0.0.1:{server.port}/")
    page.click("#live-start")
    page.wait_for_selector("#live-curve svg")
    page.fill("#live-until", "0.05")
    until(page, "document.getElementById('live-verdict').textContent == 'Good enough.'")
    page.check("#live-auto")
    page.wait_for_selector("#report svg")

    assert page.locator("#live").is_hidden()
    assert page.inner_text("#shown-title") == "camera, live"
    state = page.evaluate("fetch('api/state').then(answer => answer.json())")
    key = state["cameras"][0]["id"]
    kept = page.evaluate(f"fetch('api/cameras/{key}/camera.json').then(answer => answer.json())")
    (channel,) = kept["channels"]
    n_levels = len(channel["inverse_lut"])
    # Chromium does not say that the film is of full range: it is read as limited.
    level = 16 + np.arange(n_levels) if n_levels == 220 else np.arange(n_levels)
    truth = named_curve("srgb").inverse(level / 255)
    truth = (truth - truth[0]) / (truth[-1] - truth[0])
    assert np.sqrt(np.mean((np.array(channel["inverse_lut"]) - truth) ** 2)) < 0.05
    browser.close()


def test_a_camera_that_cannot_be_used_after_all_is_let_go(
    launch: Callable[..., Browser], server: Client
) -> None:
    browser = launch("--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream")
    page = browser.new_page()
    page.set_default_timeout(LONG)
    page.add_init_script(
        """
        window.tracks = [];
        const media = navigator.mediaDevices, ask = media.getUserMedia.bind(media);
        media.getUserMedia = async (...given) => {
          const stream = await ask(...given);
          window.tracks.push(...stream.getTracks());
          return stream;
        };
        """
    )
    page.goto(f"http://127.0.0.1:{server.port}/")
    page.wait_for_load_state("networkidle")
    page.route("**/api/live", lambda route: route.abort())
    page.click("#live-start")
    page.wait_for_selector("#message:not([hidden])")
    assert page.evaluate("tracks.map(each => each.readyState)") == ["ended"]
    assert page.locator("#live").is_hidden()

    page.unroute("**/api/live")
    page.click("#live-start")
    page.wait_for_selector("#live:not([hidden])")
    page.click("#live-start")
    until(page, "tracks.length == 3")
    until(page, "!document.getElementById('live-start').disabled")
    assert page.evaluate("tracks.map(each => each.readyState)") == ["ended", "ended", "live"]
    page.evaluate("tracks[2].dispatchEvent(new Event('ended'))")
    page.wait_for_selector("#message:not([hidden])")
    assert "camera has stopped" in page.inner_text("#message")
    assert page.locator("#live").is_hidden()
    browser.close()


def test_without_a_camera_it_says_so(visit: Callable[..., Page]) -> None:
    page = visit()
    page.click("#live-start")
    page.wait_for_selector("#message:not([hidden])")

    assert "camera cannot be used" in page.inner_text("#message")
    assert page.locator("#live").is_hidden()


def test_a_server_that_has_ended_is_noticed(
    browser: Browser, tmp_path: Path, frames: list[Path]
) -> None:
    context = browser.new_context()
    page = context.new_page()
    with serving(tmp_path) as client:
        page.goto(f"http://127.0.0.1:{client.port}/")
        page.wait_for_load_state("networkidle")
    time.sleep(0.2)
    drop(page, frames)
    page.wait_for_selector("#message:not([hidden])")

    assert "start it again" in page.inner_text("#message")
    context.close()
