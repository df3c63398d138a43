"""docs/transfer-functions.md says what the registry says."""

import runpy
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_page_is_what_the_script_writes() -> None:
    script = runpy.run_path(str(ROOT / "scripts" / "write_transfer_functions.py"))
    page = (ROOT / "docs" / "transfer-functions.md").read_text(encoding="utf-8")

    assert page == script["page"](), "run python scripts/write_transfer_functions.py"
