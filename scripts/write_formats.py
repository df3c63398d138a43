"""Write docs/formats.md from the registry of formats.

    python scripts/write_formats.py

The table and the paragraphs say what the classes in src/chartless/formats say of themselves.
"""

import inspect
from pathlib import Path

from chartless.formats import FORMATS, AbstractFormat

TARGET = Path(__file__).parents[1] / "docs" / "formats.md"

INTRODUCTION = """\
# Formats of other programs

    chartless export camera.json --to cube
    chartless export --list
    chartless import response.yml -o camera.json

`export` writes a calibration for another program and reports what its file does not hold; `import`
makes a calibration from the response of another program, which all commands accept. The format of a
file to import is recognised by its content, or named by `--from`; that of a file to write is named
by `--to`, or by the extension if only one format has it. In Python:
`chartless.formats.export_response` and `import_response`.

`export`, `linearize` and `merge` print one line on how far to trust a curve that is not good.
Formats with room for a text carry that verdict in the file: `cube` and `resolve` as a comment,
`clf` and `icc` as a description, `csp` in its metadata, `ppisp` as an entry, `npz` as an array. The
others have no comments, or not all of their readers skip them (spreadsheets, pandas and R do not in
`csv`). The verdict in a file becomes a remark when chartless reads it again.

All formats are tables of the inverse response, from brightness to light, unless their paragraph
states otherwise. The largest error is that of irradiance, white being 1, at any level of a
calibration of 8 bits that was written and read again. What is named under *tested with* reads our
files in the tests and agrees with `chartless linearize` within that error.
"""

HEADER = (
    "format", "file", "in", "out", "tested with", "channels", "irradiance", "largest error",
    "always lost",
)  # fmt: skip


def page() -> str:
    """Content of the page."""
    rows = [HEADER, ["---"] * len(HEADER), *map(row, FORMATS.values())]
    table = "\n".join(f"| {' | '.join(cells)} |" for cells in rows)
    return "\n".join([INTRODUCTION, table, *map(paragraph, FORMATS.values())])


def row(each: AbstractFormat) -> list[str]:
    """Cells of the table."""
    keeps = each.keeps
    held = {"error band": keeps.band, "levels seen": keeps.range, "verdict": keeps.verdict}
    if keeps.curves:
        held[f"all but the {keeps.curves}"] = ""
    return [
        f"[{each.name}](#{each.name})",
        f"`{each.suffix}`",
        "yes" if each.is_read else "",
        "yes" if each.is_written else "",
        each.tested_with,
        keeps.channels,
        keeps.scale,
        f"{each.precision:.2g}" if each.is_read and each.is_written else "",
        ", ".join(what for what, how in held.items() if not how),
    ]


def paragraph(each: AbstractFormat) -> str:
    """Heading and what the class says of the format."""
    about = inspect.getdoc(type(each))
    return f"\n## {each.name}\n\n**{each.title}** — {each.programs}.\n\n{about}"


def main() -> None:
    """Write the page."""
    TARGET.write_text(page() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
