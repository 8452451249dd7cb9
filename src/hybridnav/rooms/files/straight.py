"""Sides of outlines brought into line with the walls, in every local direction."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from hybridnav._base.rows import unique_rows
from hybridnav._base.trig import atan2, cos, hypots, sin
from hybridnav._base.trig import directions as directions_of
from hybridnav._base.typing import BoolArray, FloatArray, LongArray

_FARTHEST_M = 0.05
"""How far a corner moves at most to bring sides into line, in each of two directions."""
_LEAST_WALL_M = 0.3
_SKEW = 0.1
"""Slope up to which a side counts as one along a wall: six degrees."""
_UNTURNED_RAD = math.radians(0.5)
"""Angle below which walls lie along the grid: rounding turns rows of cells by as much."""
_TRIES = 8


def straightened(
    lines: BaseGeometry, directions: Sequence[tuple[float, BoolArray]], resolution_m: float
) -> BaseGeometry:
    """Return chains whose sides along walls lie on common lines.

    The corners at both ends of a side along a direction of the walls come to lie on one line, as
    long as no corner moves far and no chain crosses another.

    `lines`: MultiLineString in cells, x along columns and y along rows; chains meet at common ends;
    `directions`: angles of walls against the rows, and bool (rows, cols), where walls have them;
    `resolution_m`: side of a cell in metres. Returns the chains in the same order; the same object
    if no corner has moved.
    """
    flat, chain = shapely.get_coordinates(shapely.get_parts(lines), return_index=True)
    points, _, of_corner, _ = unique_rows(flat)
    sides = np.stack([of_corner[:-1], of_corner[1:]], axis=1)[chain[1:] == chain[:-1]]
    sides = unique_rows(np.sort(sides, axis=1)).rows
    if not len(sides) or not directions:
        return lines
    moved = _in_line(points, sides, directions, resolution_m)
    for _ in range(_TRIES):
        straight = shapely.set_coordinates(lines, moved[of_corner])
        wrong = _crossed(straight, of_corner, chain)
        wrong = wrong[(moved[wrong] != points[wrong]).any(axis=1)]
        if not len(wrong):
            return straight
        moved[wrong] = points[wrong]
    return lines


def _in_line(
    points: FloatArray,
    sides: LongArray,
    directions: Sequence[tuple[float, BoolArray]],
    resolution_m: float,
) -> FloatArray:
    """Return points after bringing those along one wall into line."""
    step = points[sides[:, 1]] - points[sides[:, 0]]
    length = hypots(*step.T)
    heading = directions_of(step[:, 1], step[:, 0])
    off = np.full((len(directions), len(sides)), np.inf)
    middle = (points[sides[:, 0]] + points[sides[:, 1]]) / 2
    for number, (angle, within) in enumerate(directions):
        col, row = np.minimum(middle, np.array(within.shape[::-1]) - 1).astype(np.int64).T
        turned = np.abs((heading - angle + math.pi / 4) % (math.pi / 2) - math.pi / 4)
        off[number] = np.where(within[row, col], turned, np.inf)
    nearest = off.argmin(axis=0)
    is_wall = (off.min(axis=0) <= atan2(_SKEW, 1.0)) & (length * resolution_m >= _LEAST_WALL_M)
    most = _FARTHEST_M / resolution_m
    moved = points.copy()
    for number, (angle, _) in enumerate(directions):
        angle = 0.0 if abs(angle) < _UNTURNED_RAD else angle  # noqa: PLW2901
        own = sides[is_wall & (nearest == number)]
        turned, first = _turned(moved, -angle), _turned(points, -angle)
        for axis in (0, 1):
            across, along = np.abs(first[own[:, 1]] - first[own[:, 0]]).T[[axis, 1 - axis]]
            ordered = own[across < along][np.argsort(across[across < along], kind="stable")]
            turned[:, axis] = _lined_up(turned[:, axis], first[:, axis], ordered, most)
        moved = _turned(turned, angle)
    return moved


def _turned(points: FloatArray, angle_rad: float) -> FloatArray:
    """Return points turned about the origin."""
    cosine, sine = cos(angle_rad), sin(angle_rad)
    x, y = points.T
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)


def _lined_up(values: FloatArray, first: FloatArray, pairs: LongArray, most: float) -> FloatArray:
    """Return values in which the two of a pair are equal, unless one would move by more than
    `most` from its first value; pairs come first that differ least."""
    group = {n: n for n in np.unique(pairs).tolist()}
    members = {n: [n] for n in group}
    for one, other in pairs.tolist():
        kept, gone = group[one], group[other]
        if kept == gone:
            continue
        if len(members[kept]) < len(members[gone]):
            kept, gone = gone, kept
        joined = members[kept] + members[gone]
        if _middle(first[joined], most) is not None:
            members[kept] = joined
            group.update(dict.fromkeys(members.pop(gone), kept))
    lined = values.copy()
    for joined in members.values():
        middle = _middle(first[joined], most)
        if len(joined) > 1 and middle is not None:
            lined[joined] = middle
    return lined


def _middle(values: FloatArray, most: float) -> float | None:
    """Return the value nearest to the median from which none differs by more than `most`."""
    low, high = float(values.max()) - most, float(values.min()) + most
    return None if low > high else float(np.clip(np.median(values), low, high))


def _crossed(lines: BaseGeometry, of_corner: LongArray, chain: LongArray) -> LongArray:
    """Return the corners of sides that cross or touch others elsewhere than at a common corner."""
    flat = shapely.get_coordinates(lines)
    at = np.flatnonzero(chain[1:] == chain[:-1])
    sides = np.array(shapely.linestrings(np.stack([flat[at], flat[at + 1]], axis=1)), dtype=object)
    ends = np.stack([of_corner[at], of_corner[at + 1]], axis=1)
    tree = shapely.STRtree(sides)
    one, other = tree.query(sides, predicate="intersects")
    one, other = one[one < other], other[one < other]
    common = (ends[one][:, :, None] == ends[other][:, None, :]).any(axis=(1, 2))
    meet = shapely.intersection(sides[one], sides[other])
    wrong = ~(common & (shapely.get_type_id(meet) == shapely.GeometryType.POINT))
    return np.unique(np.concatenate([ends[one[wrong]].ravel(), ends[other[wrong]].ravel()]))
