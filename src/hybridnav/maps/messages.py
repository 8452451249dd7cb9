"""Grids as messages of ROS: `nav_msgs/OccupancyGrid`, read and made without ROS."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.typing import ByteArray, LongArray, SignArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.cells import MAX_CELLS, CellClass
from hybridnav.maps.frame import Frame
from hybridnav.messages import count_of, header_message, number_of, pose_message, pose_of, value_of

_UNKNOWN, _FULL = -1, 100


def read_cells(message: Any, what: str = "occupancy grid") -> tuple[SignArray, Frame]:
    """Return the cells of a `nav_msgs/OccupancyGrid`.

    `message`: an object or a mapping with its fields, `data` as any sequence of integers; `what`:
    name of the message in errors. Returns int8 (rows, cols), 0 to 100, or -1 for unknown, row 0 at
    the lowest y; and their frame. Raises `InvalidValueError` when a field is missing or out of
    range, `data` has not width x height values, one of them is not within -1 to 100, or the pose of
    the origin is tilted.
    """
    cols, rows = (count_of(message, f"info.{name}", what) for name in ("width", "height"))
    if cols * rows > MAX_CELLS:
        raise InvalidValueError(
            f"{what}: {cols} x {rows} cells, at most {MAX_CELLS} are read: cut the map"
        )
    resolution_m = _as_sent(number_of(message, "info.resolution", what))
    x, y, yaw = pose_of(message, "info.origin", what)
    try:
        frame = Frame(resolution_m, (x, y), yaw)
    except InvalidValueError as error:
        raise InvalidValueError(f"{what}: {error}") from None
    values = _integers(value_of(message, "data", what), what)
    if values.size != rows * cols:
        raise InvalidValueError(
            f"{what}: data has {values.size} values, expected width {cols} x height {rows} = "
            f"{rows * cols}"
        )
    wrong = (values < _UNKNOWN) | (values > _FULL)
    if wrong.any():
        first = int(wrong.argmax())
        raise InvalidValueError(
            f"{what}: data[{first}] is {values[first]}, expected 0 to 100, or -1 for unknown"
        )
    return values.astype(np.int8).reshape(rows, cols), frame


def read_probability(message: Any) -> tuple[NDArray[np.float32], Frame]:
    """Return the occupancies of a message, NaN for unknown, and their frame; see `read_cells`."""
    values, frame = read_cells(message)
    table = np.append(np.arange(_FULL + 1) / _FULL, np.nan).astype(np.float32)  # -1 is the last
    probability: NDArray[np.float32] = table[values]
    return probability, frame


def grid_message(values: SignArray, frame: Frame, frame_id: str, stamp_ns: int) -> dict[str, Any]:
    """Return cells as a `nav_msgs/OccupancyGrid` of plain values.

    `values`: int8 (rows, cols), 0 to 100, or -1 for unknown; `frame_id`, `stamp_ns`: see
    `header_message`. Raises `InvalidValueError` as for `header_message`.
    """
    header = header_message(frame_id, stamp_ns)
    rows, cols = values.shape
    return {
        "header": header,
        "info": {
            "map_load_time": header["stamp"],
            "resolution": frame.resolution_m,
            "width": cols,
            "height": rows,
            "origin": pose_message((*frame.origin_m, frame.yaw_rad)),
        },
        "data": values.ravel().tolist(),
    }


def percentages(
    probability: NDArray[np.float32], measured: ByteArray, thresholds: tuple[float, float]
) -> SignArray:
    """Return occupancies as percentages, int8 (rows, cols), -1 for unknown.

    They are rounded, but never across a threshold; what has no percentage is unknown.

    `probability`: float32 (rows, cols), NaN for cells that were never measured; `measured`: uint8
    (rows, cols), their class by the thresholds; `thresholds`: U1 and U2.
    """
    occupancy = (np.arange(_FULL + 1) / _FULL).astype(np.float32)
    percent = np.rint(probability.astype(np.float64) * _FULL)
    values = np.full(probability.shape, _UNKNOWN, dtype=np.int8)
    for kind, allowed in levels_by_class(occupancy, thresholds).items():
        cells = (measured == kind) & ~np.isnan(percent)
        if allowed.size:  # none between two thresholds of less than a percent: unknown
            values[cells] = np.clip(percent[cells], allowed[0], allowed[-1]).astype(np.int8)
    return values


def levels_by_class(
    occupancy: NDArray[np.float32], thresholds: tuple[float, float]
) -> dict[CellClass, LongArray]:
    """Return the indices of the occupancies, float32 (n,), that U1 and U2 take for each class."""
    low, high = (np.float32(threshold) for threshold in thresholds)
    return {
        CellClass.FREE: np.flatnonzero(occupancy <= low),
        CellClass.OCCUPIED: np.flatnonzero((occupancy >= high) & (occupancy > low)),
        CellClass.UNEXPLORED: np.flatnonzero((occupancy > low) & (occupancy < high)),
    }


def _as_sent(resolution: float) -> float:
    """Return the decimal number that a float32 was made of; messages hold resolutions as such."""
    with np.errstate(over="ignore"):
        single = np.float32(resolution)
    return float(str(single)) if float(single) == resolution else resolution


def _integers(data: Any, what: str) -> NDArray[np.integer[Any]]:
    """Return data as an array, of the caller's type: that of a large map is not copied."""
    try:
        array = np.asarray(data)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(())
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise InvalidValueError(
            f"{what}: data must be a flat sequence of integers, got {array.dtype} of shape "
            f"{array.shape} from a {type(data).__name__}"
        )
    return array if array.size else array.astype(np.int8)  # an empty list becomes floats
