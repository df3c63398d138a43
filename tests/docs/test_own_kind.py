"""The tutorial on kinds of evidence: its blocks are a module, and its tests pass."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
PAGE = Path(__file__).parents[2] / "docs" / "own-kind.md"


@pytest.mark.slow
def test_the_tutorial_runs(tmp_path: Path) -> None:
    """In a process of its own, as it registers a kind."""
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    (tmp_path / "light_sums.py").write_text("\n\n".join(blocks), encoding="utf-8")

    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist",
         "light_sums.py"],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip

    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 passed" in done.stdout
