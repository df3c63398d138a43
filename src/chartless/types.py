"""Names for the arrays that pass between modules; no logic."""

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
"""Array of float64, any shape."""

Floats32: TypeAlias = npt.NDArray[np.float32]
"""Array of float32: pictures."""

Bools: TypeAlias = npt.NDArray[np.bool_]
"""Array of truth values."""

Counts: TypeAlias = npt.NDArray[np.int64]
"""Array of int64 that counts pixels."""

Indices: TypeAlias = npt.NDArray[np.intp]
"""Array of integers that index another array."""

Levels: TypeAlias = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
"""Array of unsigned integers as a picture file stores them."""

JsonObject: TypeAlias = dict[str, Any]
"""What `json.load` returns for an object."""
