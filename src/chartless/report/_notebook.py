"""A calibration where it is looked at first: the output of a cell in a notebook."""

import hashlib
from collections.abc import Sequence

from markupsafe import Markup

from chartless.plotting import draw_response
from chartless.report import _captions
from chartless.report._svg import inline_svg
from chartless.result.response import Response
from chartless.result.verdict import verdict

_SIZE = (360, 270)
_FRAME = Markup(
    '<div style="max-width: 30rem"><p><strong>Camera response: {grade}.</strong> {reasons}</p>'
    "{svg}</div>"
)


def card(channels: Sequence[Response]) -> str:
    """The verdict on channels with their curves, as an HTML fragment.

    Parameters
    ----------
    channels : sequence of Response
        At least one.
    """
    judged = verdict(channels)
    # Outputs of one notebook share a page: names inside the drawing must not.
    digest = hashlib.sha256(b"".join(each.inverse_lut.tobytes() for each in channels))
    svg = inline_svg(
        lambda axes: draw_response(axes, channels),
        _SIZE,
        salt=digest.hexdigest(),
        aria_label=_captions.of_response(channels),
    )
    reasons = _captions.unbroken(" ".join(judged.reasons))
    return str(_FRAME.format(grade=judged.grade.value, reasons=reasons, svg=svg))
