"""Effects of a laser scanner on a floor plan: glimpses, shadows, thin walls, noise.

Masks are drawn with sums, products, quotients and square roots only, which IEEE 754 rounds alike
everywhere: sines differ in the last digit between processors, and the committed maps must not.
"""

import math

import numpy as np

from benchmarks.worlds.world import FREE, OCCUPIED, UNEXPLORED
from hybridnav._base.typing import BoolArray, ByteArray, FloatArray
from hybridnav.maps import Frame

Point = tuple[float, float]
Rect = tuple[float, float, float, float]
"""`(x0, y0, x1, y1)` in metres, map frame."""

_WOBBLES = ((7, 0.12), (3, 0.06))
"""Side in cells of the patches that a scan displaces by one cell, and the share displaced."""


def window(frame: Frame, rect: Rect, *, grow_m: float = 0.0) -> tuple[slice, slice]:
    """Return the rows and columns of a rectangle whose sides lie on cell sides."""
    x0, y0, x1, y1 = rect
    corners = [(x0 - grow_m, y0 - grow_m), (x1 + grow_m, y1 + grow_m)]
    (row0, col0), (row1, col1) = frame.cells_of(corners).tolist()
    return slice(row0, row1), slice(col0, col1)


def glimpse(
    points: FloatArray,
    view: Point,
    jambs: tuple[Point, Point],
    *,
    reach_m: float,
    rng: np.random.Generator,
) -> BoolArray:
    """Return the cells seen from a point through a gap, with an uneven far end.

    `points`: cell centres, shape `(rows, cols, 2)`, metres; `view`: position of the scanner;
    `jambs`: the endpoints of the gap, the right one as seen from the scanner first; `reach_m`:
    reach of the longest beam; the shortest reaches seven tenths of it; `rng`: generator for the
    lengths of 24 beams.
    """
    offset = points - np.asarray(view)
    from_right = _cross(np.asarray(jambs[0]) - np.asarray(view), offset)
    from_left = _cross(offset, np.asarray(jambs[1]) - np.asarray(view))
    inside = (from_right > 0) & (from_left > 0)
    across = np.divide(from_right, from_right + from_left, where=inside, out=np.zeros(inside.shape))
    beams = reach_m * (0.7 + 0.3 * rng.random(24))
    reach = beams[(across * len(beams)).astype(np.int64).clip(0, len(beams) - 1)]
    seen: BoolArray = inside & ((offset**2).sum(axis=-1) < reach**2)
    return seen


def shadow(
    points: FloatArray, view: Point, centre: Point, *, width_m: float, length_m: float
) -> BoolArray:
    """Return the cells behind a pillar that were never seen, a wedge of a given length."""
    axis = np.asarray(centre) - np.asarray(view)
    offset = points - np.asarray(centre)
    distance = math.sqrt(float((axis**2).sum()))
    behind = (offset * axis).sum(axis=-1)
    # Other views of the robot cover it from both sides, so the wedge narrows to a point.
    half_width = width_m / 2 * (distance - behind / length_m)
    hidden: BoolArray = (behind > 0) & (np.abs(_cross(axis, offset)) < half_width)
    return hidden


def wobble(cells: ByteArray, rng: np.random.Generator) -> ByteArray:
    """Displace patches by one cell: the ragged edges of walls and unexplored ground."""
    for size, share in _WOBBLES:
        for axis in (0, 1):
            for step in (-1, 1):
                displaced = _patches(cells.shape, size, rng) < share
                cells = np.where(displaced, np.roll(cells, step, axis=axis), cells)
    return cells


def hide_depths(cells: ByteArray, rng: np.random.Generator) -> ByteArray:
    """Keep only the skin of every obstacle that the scan can have hit, 2 or 3 cells deep."""
    seen = grown(cells == FREE, 2)
    seen |= grown(seen, 1) & (_patches(cells.shape, 6, rng) < 0.3)
    return np.where((cells == OCCUPIED) & ~seen, UNEXPLORED, cells)


def speckle(cells: ByteArray, rng: np.random.Generator) -> ByteArray:
    """Scatter single wrong cells: many on the walls and beside them, few in the open."""
    wall = cells == OCCUPIED
    beside = grown(wall, 4) & (cells == FREE)
    in_the_open = (cells == FREE) & ~grown(cells != FREE, 12)
    draw = rng.random(cells.shape)
    noisy = cells.copy()
    noisy[(wall & (draw < 0.02)) | (beside & (draw < 0.006))] = UNEXPLORED
    noisy[beside & (draw > 0.994)] = OCCUPIED
    noisy[in_the_open & (draw < 0.0001)] = UNEXPLORED
    noisy[in_the_open & (draw > 0.99992)] = OCCUPIED
    return noisy


def grown(mask: BoolArray, steps: int) -> BoolArray:
    """Return the cells within `steps` king's moves of a cell of the mask."""
    for axis in (0, 1):
        spread = mask.copy()
        for step in range(1, steps + 1):
            ahead: list[slice] = [slice(None), slice(None)]
            behind = ahead.copy()
            ahead[axis], behind[axis] = slice(step, None), slice(None, -step)
            spread[tuple(ahead)] |= mask[tuple(behind)]
            spread[tuple(behind)] |= mask[tuple(ahead)]
        mask = spread
    return mask


def _patches(shape: tuple[int, ...], size: int, rng: np.random.Generator) -> FloatArray:
    rows, cols = shape
    coarse = rng.random((rows // size + 1, cols // size + 1))
    return coarse.repeat(size, axis=0)[:rows].repeat(size, axis=1)[:, :cols]


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    product: FloatArray = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product
