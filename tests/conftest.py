import os
from pathlib import Path

import pytest
from hypothesis import settings

# Time limits on examples would fail on a busy machine; CI draws the same examples on every run.
settings.register_profile("here", deadline=None)
settings.register_profile("unattended", deadline=None, derandomize=True)
settings.load_profile("unattended" if os.environ.get("CI") == "true" else "here")

# Looking for doctests, pytest would import each conftest.py as a module of that one name.
collect_ignore_glob = ["*conftest.py"]

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
