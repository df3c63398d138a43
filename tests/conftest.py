import os

# Before NumPy is there: as many threads as processors in each of as many workers cost half again.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# Time limits on examples would fail on a busy machine. CI draws the same examples on every run,
# and more of them.
settings.register_profile("here", deadline=None, max_examples=10)
settings.register_profile("unattended", deadline=None, derandomize=True)
settings.load_profile("unattended" if os.environ.get("CI") == "true" else "here")

# Looking for doctests, pytest would import each conftest.py as a module of that one name.
collect_ignore_glob = ["*conftest.py"]

Browser = Any
Launch = Callable[..., Browser]
_BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_DATA = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def data_path() -> Path:
    """Directory of the real pictures and measured curves, which are not in the repository."""
    path = Path(os.environ.get("CHARTLESS_DATA") or _DATA)
    if path.is_dir():
        return path
    why = f"no measured data in {path}: name their directory in CHARTLESS_DATA"
    if os.environ.get("CI") == "true":
        pytest.fail(why)
    pytest.skip(why)


@pytest.fixture(scope="module")
def launch() -> Iterator[Launch]:
    """Start headless Chromium, with further arguments for its command line."""
    api = pytest.importorskip(
        "playwright.sync_api", reason="no Playwright: pip install '.[browser]'"
    )
    program = next(filter(None, map(shutil.which, _BROWSERS)), None)
    if program is None:
        pytest.skip(f"no browser: install one of {', '.join(_BROWSERS)}")
    with api.sync_playwright() as playwright, ExitStack() as opened:
        # Its sandbox refuses to run as root, as containers do.
        sandbox = [] if os.geteuid() else ["--no-sandbox"]

        def start(*arguments: str) -> Browser:
            started = playwright.chromium.launch(
                executable_path=program, args=[*sandbox, *arguments]
            )
            opened.callback(started.close)
            return started

        yield start


@pytest.fixture(scope="module")
def browser(launch: Launch) -> Browser:
    """Headless Chromium."""
    return launch()
