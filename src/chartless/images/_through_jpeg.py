"""What JPEG compression makes of levels."""

import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does

from chartless.errors import ParameterError
from chartless.images._read import read_frame


def through_jpeg(levels: npt.NDArray[np.uint8], quality: int) -> npt.NDArray[np.uint8]:
    """Compress a grey picture and bring it back.

    Parameters
    ----------
    levels : ndarray of uint8, shape (M, N)
    quality : int
        1 … 100, of the Independent JPEG Group's encoder.

    Returns
    -------
    ndarray of uint8, shape (M, N)

    Raises
    ------
    ParameterError
        If the quality is out of range.
    """
    if not 1 <= quality <= 100:  # noqa: PLR2004 - the encoder's scale
        msg = f"JPEG quality runs from 1 to 100, not {quality}"
        raise ParameterError(msg)
    height, width = levels.shape
    spec = oiio.ImageSpec(width, height, 1, "uint8")
    spec.attribute("Compression", f"jpeg:{quality}")
    with tempfile.TemporaryDirectory(prefix="chartless-") as folder:
        path = Path(folder, "frame.jpg")
        buffer = oiio.ImageBuf(spec)
        buffer.set_pixels(oiio.ROI(), np.ascontiguousarray(levels[..., np.newaxis]))
        buffer.write(str(path))
        return np.asarray(read_frame(path).levels[..., 0], dtype=np.uint8)
