"""Write docs/transfer-functions.md from the registry of transfer functions.

python scripts/write_transfer_functions.py
"""

from pathlib import Path

from chartless.curves.transfer import TRANSFER_FUNCTIONS, PublishedCurve, TransferFunction

TARGET = Path(__file__).parents[1] / "docs" / "transfer-functions.md"

INTRODUCTION = """\
# Transfer functions by name

    chartless linearize srgb photo.jpg -o linear.exr
    chartless linearize icc photo.jpg -o linear.exr
    chartless linearize slog3:limited clip.mp4 -o linear/
    chartless merge a.jpg b.jpg c.jpg -c rec709 -o scene.exr
    chartless show slog3 --truth rec709
    chartless export vlog --to cube
    chartless compare srgb

Where a calibration is taken, a name is as well. `chartless models` lists the names; in Python
`chartless.load_calibration("srgb")` makes the calibration and `chartless.named_curve("srgb")` the
curve alone. Capitals, hyphens and dots do not matter: `S-Log3` is `slog3`, `BT.709` is `rec709`.

**A file comes first.** If there is a file of that name, it is read; folders do not count.
Another spelling, such as `s-rgb`, is still the transfer function.

**It is an assumption.** Nothing is measured: the result has no error, its status is *assumed*, and
`linearize`, `merge`, `show` and `export` say so in one line. Log footage is meant to follow its
formula. The JPEGs of cameras do not follow sRGB: nine cameras are off by 0.045 in the median
([how that was measured](brackets.md)); `chartless calibrate` finds what they do follow.

**The scale.** Light is 1 at the highest level (brightness 1), whatever the formula has there, and
0 at the level of black and below, where formulas of log curves have negative light. The column
*white* is the light of brightness 1 in the units of the source: for curves of cameras the
reflectance, so that light times *white* is 0.18 for a grey card. One curve serves all channels.

**The range of video.** Formulas are for the code value over 1023 of 10 bits, full range. Programs
that read a recording of limited range put the code 64 to 0 and 940 to 1, as `linearize` does with
videos that are marked so. For pictures after that step add `:limited` to the names that have it,
`slog3:limited`: their makers list the codes of recordings. Brightness 1 is then the code 940, and
codes above it are clipped. The other range makes a grey card in S-Log3 4 % too dark, and black of
all below a reflectance of 0.7 %. ARRI, Blackmagic, RED and Apple define the signal after that step,
so their names are right as they are.
"""

FAMILIES = """
A member of a family of curves is a name with its parameters ([families](models.md)): `gamma:0.45`
is brightness = light^0.45. Pictures for a display of gamma 2.2 are `gamma:0.4545`.

`icc` is the profile in the pictures themselves, for `linearize` and `merge`; `icc:photo.jpg` that
of one picture, for all commands. A profile needs a curve for each channel, as matrix and
grey profiles have; tables that mix the channels are refused, and so are pictures without a profile.
Pictures given together need the same curves.

`typical` is [the typical curve of digital cameras](one-picture.md): the only name with a band.

A calibration that is saved (`chartless.save`) holds a table of 4096 levels, which is within 1.3
steps of 16 bits of the formula.
"""

HEADER = (
    "name",
    "also",
    "transfer function",
    "source",
    "black",
    "18 % grey",
    "white",
    "`:limited`",
)


def page() -> str:
    """Content of the page."""
    rows = [HEADER, ["---"] * len(HEADER), *map(row, TRANSFER_FUNCTIONS.values())]
    table = "\n".join(f"| {' | '.join(cells)} |" for cells in rows)
    return f"{INTRODUCTION}\n{table}\n{FAMILIES}"


def row(each: TransferFunction) -> list[str]:
    """Cells of the table; black and grey as brightness."""
    curve = each.curve
    white = curve.white if isinstance(curve, PublishedCurve) else 1.0
    return [
        f"`{each.name}`",
        ", ".join(f"`{alias}`" for alias in each.aliases),
        each.title,
        each.source,
        f"{curve.response(0.0):.4f}",
        f"{curve.response(0.18 / white):.4f}",
        f"{white:.4g}",
        "yes" if each.limited else "",
    ]


def main() -> None:
    """Write the page."""
    TARGET.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
