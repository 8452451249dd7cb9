"""Names for the types of arrays that the layers exchange."""

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

BoolArray = NDArray[np.bool_]
ByteArray = NDArray[np.uint8]
SignArray = NDArray[np.int8]
IntArray = NDArray[np.int32]
LongArray = NDArray[np.int64]
KeyArray = NDArray[np.uint64]
FloatArray = NDArray[np.float64]
AnyArray = NDArray[Any]
PathLike = str | os.PathLike[str]
