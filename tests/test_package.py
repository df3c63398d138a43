import subprocess
import sys
from pathlib import Path

import pytest

import chartless

HEAVY = ("numpy", "scipy", "matplotlib", "OpenImageIO", "skimage", "rich", "typer")


def modules_after(statement: str) -> set[str]:
    code = f"{statement}\nimport sys\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    return set(done.stdout.split())


def test_importing_the_package_loads_no_library():
    assert modules_after("import chartless; dir(chartless)").isdisjoint(HEAVY)


def test_a_name_loads_what_it_needs_and_no_more():
    loaded = modules_after("from chartless import Cooccurrence, AffineNoise")

    assert "numpy" in loaded
    assert loaded.isdisjoint({"matplotlib", "OpenImageIO", "skimage", "rich", "typer"})
    assert "scipy.optimize" not in loaded


@pytest.mark.slow
def test_calibrating_waits_for_no_library_that_few_calibrations_need():
    loaded = modules_after("import chartless.workflow")

    assert "scipy.linalg" in loaded
    rare = {"scipy.fft", "scipy.ndimage", "scipy.optimize", "scipy.sparse", "OpenImageIO", "joblib"}
    assert loaded.isdisjoint(rare)


@pytest.mark.slow
def test_values_that_notebooks_show_load_no_plot_until_they_are_shown():
    loaded = modules_after("from chartless import Calibration, Response, load")

    assert loaded.isdisjoint({"matplotlib", "jinja2", "PIL", "chartless.report"})


@pytest.mark.parametrize("name", chartless.__all__)
def test_public_names_resolve(name: str):
    assert getattr(chartless, name) is not None
    assert name in dir(chartless)


def test_an_unknown_name_is_no_attribute():
    with pytest.raises(AttributeError, match="'chartless' has no attribute 'calibrat'"):
        chartless.calibrat  # noqa: B018


def test_no_message_asks_an_index_for_the_package():
    sources = Path(chartless.__file__).parent.rglob("*.py")
    asking = [path.name for path in sources if "chartless[" in path.read_text(encoding="utf-8")]

    assert asking == []
