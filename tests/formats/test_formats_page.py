"""docs/formats.md says what the registry says."""

import runpy
from pathlib import Path

from chartless.formats import FORMATS

ROOT = Path(__file__).parents[2]


def test_the_page_is_what_the_script_writes() -> None:
    script = runpy.run_path(str(ROOT / "scripts" / "write_formats.py"))
    page = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")

    assert page == script["page"]() + "\n", "run python scripts/write_formats.py"
    for name in FORMATS:
        assert f"\n## {name}\n" in page
