"""The types of arrays: of numbers, of truth values, of indices, of anything."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int_]
AnyArray = npt.NDArray[Any]
