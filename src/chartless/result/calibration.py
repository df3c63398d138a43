"""A calibrated camera: the responses of its channels, and applying them to pictures."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from chartless.curves import AbstractCurve
from chartless.errors import ParameterError
from chartless.flags import Flag
from chartless.result.account import Reading
from chartless.result.response import Response, html_card
from chartless.types import Floats32, JsonObject, Levels

_PART = 1 << 12  # pixels


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Calibration:
    """What calibrating a camera gives: one `Response` for each channel, and where from.

    `chartless.formats.calibration_file` saves and loads it.
    """

    channels: tuple[Response, ...]
    """One named "Y", or three named "R", "G" and "B"."""
    bit_depth: int
    """Bit depth of the frames it was made from."""
    evidence: tuple[Reading, ...] = ()
    """What was read, by kind; empty if another program made the curves."""
    provenance: JsonObject = field(default_factory=dict)
    """Version, time, inputs with their SHA-256, settings."""

    def channel(self, name: str) -> Response:
        """Response of the channel of this name; LookupError if there is none."""
        for response in self.channels:
            if response.name == name:
                return response
        msg = f"no channel {name!r} in {', '.join(each.name for each in self.channels)}"
        raise LookupError(msg)

    @property
    def flags(self) -> dict[Flag, list[str]]:
        """What is doubtful, with the names of the channels concerned."""
        return {
            flag: names
            for flag in Flag
            if (names := [each.name for each in self.channels if flag in each.flags])
        }

    def linearize(self, levels: Levels, *, white: int | None = None) -> Floats32:
        """Irradiance of a picture: g of every level.

        Parameters
        ----------
        levels : ndarray of uint8 or uint16, shape (M, N) or (M, N, C)
            A picture of the same camera; its bit depth may be another. A calibration of
            luma applies to every channel.
        white : int, optional
            The level of brightness 1 (see `chartless.frames.frame.Frame`), 4095 of 12 bits.
            Without, the largest that the type of the levels holds.

        Returns
        -------
        ndarray of float32, shape of `levels`, 0 … 1
            Proportional to the light within each channel.

        Raises
        ------
        ParameterError
            If these are no levels, if one is above `white`, or the channels do not correspond.
        """
        if levels.dtype not in (np.uint8, np.uint16):
            msg = f"levels must be uint8 or uint16, not {levels.dtype}"
            raise ParameterError(msg)
        if white is None:
            white = int(np.iinfo(levels.dtype).max)
        elif levels.size and levels.max() > white:
            msg = f"level {levels.max()} is above white, which is {white}"
            raise ParameterError(msg)
        brightness = np.linspace(0.0, 1.0, white + 1)
        tables = [each.inverse(brightness) for each in self._curves_for(levels)]
        return _looked_up(np.array(tables, dtype=np.float32), levels)

    def delinearize(self, irradiance: npt.NDArray[np.floating]) -> Floats32:
        """Brightness that the camera would show for light: f of every value.

        Parameters
        ----------
        irradiance : ndarray of float, shape (M, N) or (M, N, C)
            Values outside [0, 1] are clipped.

        Returns
        -------
        ndarray of float32, shape of `irradiance`, 0 … 1
        """
        curves = self._curves_for(irradiance)
        planes = irradiance.reshape(-1, len(curves))
        brightness = np.empty(planes.shape, dtype=np.float32)
        for c, curve in enumerate(curves):
            brightness[:, c] = curve.response(planes[:, c])
        return brightness.reshape(irradiance.shape)

    def __repr__(self) -> str:
        """One line for each channel."""
        rows = "".join(f"\n  {each!r}" for each in self.channels)
        return f"<Calibration of {self.bit_depth}-bit frames:{rows}>"

    def _repr_html_(self) -> str:
        return html_card(self.channels)

    def _curves_for(self, picture: npt.NDArray[np.generic]) -> tuple[AbstractCurve, ...]:
        """One curve for each channel of the picture; a single one serves all of them."""
        n_channels = picture.shape[-1] if picture.ndim == 3 else 1  # noqa: PLR2004 - (M, N, C)
        if len(self.channels) not in (1, n_channels):
            msg = (
                f"the calibration has the channels {', '.join(r.name for r in self.channels)}, "
                f"the picture has {n_channels}"
            )
            raise ParameterError(msg)
        return tuple(response.curve for response in self.channels)


def _looked_up(tables: Floats32, levels: Levels) -> Floats32:
    """Entries of the tables, shape (C, L), at levels whose channels are last.

    A part at a time: NumPy makes an index of eight bytes of each level, and an array of them for a
    whole picture would leave the cache.
    """
    n_channels, n_levels = tables.shape
    starts = np.tile(np.arange(n_channels) * n_levels, _PART)
    samples, values = levels.ravel(), np.empty(levels.size, dtype=np.float32)
    for at in range(0, samples.size, starts.size):
        part = samples[at : at + starts.size]
        # Levels are known to lie in the table: "clip" spares a copy.
        tables.take(part + starts[: part.size], out=values[at : at + part.size], mode="clip")
    return values.reshape(levels.shape)
