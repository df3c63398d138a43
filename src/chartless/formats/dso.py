"""DSO and the TUM monocular visual odometry benchmark: ``pcalib.txt`` and ``vignette.png``.

One line of 256 numbers, strictly increasing: irradiance at each level of a grey camera. Readers set
the first to 0 and the last to 255. They take the response only with a picture of the lens's
attenuation, of exactly the camera's size; where none is, one without attenuation is written.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._tables import (
    MOST_LEVELS,
    UNMEASURED_VIGNETTING,
    calibration_of,
    inverse_table,
    luma,
    strictly_increasing,
)
from chartless.result.calibration import Calibration

_LEVELS, _WHITE = 256, 255.0
_VIGNETTE = "vignette.png"
_NUMBERS = b"0123456789.+-eE \t\r"
_LONGEST_LINE = 32 * MOST_LEVELS


@final
@dataclass(frozen=True, slots=True)
class Dso(AbstractFormat):
    """The photometric calibration of DSO and of mono_dataset_code.

    Vignetting is not measured: the ``vignette.png`` beside the file says that there is none, unless
    there is one already. With a lens that darkens the corners put a measured one in its place.
    """

    name: ClassVar[str] = "dso"
    title: ClassVar[str] = "DSO response"
    suffix: ClassVar[str] = ".txt"
    programs: ClassVar[str] = "DSO (pcalib.txt and vignette.png), mono_dataset_code"
    tested_with: ClassVar[str] = "reference parser"
    precision: ClassVar[float] = 1e-7
    keeps: ClassVar[Keeps] = Keeps(channels="one, their luma", scale="255 at white")
    takes: ClassVar[frozenset[str]] = frozenset({"size"})

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Luma of three channels, as these programs make pictures grey before they look at them."""
        if settings.size is None:
            msg = (
                "DSO needs a picture of the camera's size beside the response: "
                "give its `size`, such as 640x480"
            )
            raise ParameterError(msg)
        width, height = settings.size
        rising = strictly_increasing(_WHITE * luma(inverse_table(calibration, _LEVELS)))
        values = _WHITE * (rising[:, 0] / np.float64(rising[-1, 0]))
        return Encoded(
            "".join([*(f"{each:.8e} " for each in values), "\n"]).encode(),
            lost=(UNMEASURED_VIGNETTING,),
            pictures={_VIGNETTE: np.ones((height, width, 1), dtype=np.float32)},
        )

    @override
    def recognises(self, source: Source) -> bool:
        line = source.content.partition(b"\n")[0][: _LONGEST_LINE + 1]
        return not line.translate(None, _NUMBERS) and len(line.split()) >= _LEVELS

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of one channel, Y; the first line alone counts."""
        line = source.content.partition(b"\n")[0]
        words = line.split() if len(line) <= _LONGEST_LINE else []
        if not _LEVELS <= len(words) <= MOST_LEVELS:
            msg = f"its first line does not have {_LEVELS} to {MOST_LEVELS} numbers"
            raise ValueError(msg)
        values = np.array([float(word) for word in words])
        if not np.all(np.isfinite(values)):
            msg = "not all its numbers are finite"
            raise ValueError(msg)
        return calibration_of((values - values[0])[:, np.newaxis], source, self.name)


register_format(Dso())
