"""Strands: lines in the middle of corridors, and nets of lines in halls, as chains of cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from hybridnav.ext.graphs.kernels import spread, thinned
from hybridnav.ext.graphs.segments import turn_of
from hybridnav.maps.clearance import clearance_cells

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray

_HALL = 1.5
"""Width from which on free space is a hall, in distances between lanes: it gets two lanes or
more."""
_OFF = 0.6
"""Least clearance of a pillar, in distances between lanes."""
_STEP = 1.2
"""Length of a step of `spread` in cells, on average."""
_COVER = 1.1
"""Distance from strands from which on free space gets one of its own, in distances between
lanes."""
_ROOM = 0.75
"""The same for the point of a room that a strand passes already."""
_MIDDLE_CELLS = 0.6
"""How much less clearance an end may have than any cell of its part, in cells."""
_ROUNDS = 12


@dataclass(frozen=True)
class Layout:
    """What strands are to be like, in cells."""

    apart: float
    """Distance between the lanes of a hall."""
    speck: float
    """Side of the largest obstacle, with the robot's radius round it, that lanes do not ring."""
    least: float
    """Clearance below which free space gets no strand for its own sake."""
    angle_rad: float
    """Angle that turns the rows of the grid into the main direction of walls."""


@dataclass(frozen=True, eq=False)
class RoomAnchors:
    """The rooms of a map."""

    label_of: IntArray
    """int32 (rows, cols), the room of each cell, -1 for none."""
    cells: LongArray
    """int64 (k, 2), a cell in each room that the robot fits into."""


@dataclass(frozen=True)
class Strand:
    """A chain of cells between two nodes."""

    tail: int
    head: int
    cells: FloatArray
    """float64 (k, 2), centres of cells from tail to head, with both."""


def lines_of(
    part_of: IntArray, clearance: FloatArray, rooms: RoomAnchors, layout: Layout
) -> tuple[BoolArray, BoolArray]:
    """Find the cells of strands.

    Parameters
    ----------
    part_of
        int32 (rows, cols), the connected part of each free cell, -1 elsewhere and along the rim.
    clearance
        float64 (rows, cols), distance to the next cell that is not free, in cells.
    rooms
        The rooms, each of which gets a strand if it has room for one.
    layout
        What strands are to be like.

    Returns
    -------
    tuple
        bool (rows, cols), the cells of the lines, 4-connected and one cell wide; bool (rows, cols),
        those at which lines end on purpose.
    """
    free = part_of >= 0
    inside = _without_specks(part_of, layout.speck)
    pillars = _pillars(clearance_cells(~inside), layout)
    ordered = clearance
    if len(pillars):
        whole = inside.copy()
        inside[tuple(pillars.T)] = False
        ordered = np.minimum(clearance, clearance_cells(inside != whole))
    order = np.flatnonzero(inside)
    order = order[np.argsort(ordered.ravel()[order], kind="stable")].astype(np.int64)
    ends = np.zeros_like(inside)
    for tries in range(_ROUNDS):
        lines = inside.copy()
        thinned(lines, ordered, order, ends)
        away = spread(free, np.flatnonzero(lines & free).astype(np.int64)) * _STEP
        new = np.empty(0, dtype=np.int64)
        if not tries:
            at = tuple(rooms.cells.T)
            is_bare = ~np.isin(rooms.label_of[at], rooms.label_of[lines])
            is_bare |= away[at] > _ROOM * layout.apart
            is_bare &= clearance[at] >= layout.least
            new = rooms.cells[is_bare] @ np.array([free.shape[1], 1])
        if not len(new):
            new = _uncovered(away, clearance, layout)
        if not len(new):
            break
        ends.ravel()[new] = True
    return lines, ends


def _without_specks(part_of: IntArray, most: float) -> BoolArray:
    """Return free cells, with obstacles that are no larger than some cells and part nothing."""
    holes, count = ndimage.label(part_of < 0, structure=np.ones((3, 3)))
    is_speck = np.zeros(count + 1, dtype=np.bool_)
    for hole, (rows, cols) in enumerate(ndimage.find_objects(holes), start=1):
        if max(rows.stop - rows.start, cols.stop - cols.start) <= most:
            around = part_of[
                max(rows.start - 1, 0) : rows.stop + 1, max(cols.start - 1, 0) : cols.stop + 1
            ]
            is_speck[hole] = len(np.unique(around[around >= 0])) == 1
    is_speck[holes[0, 0]] = False
    filled: BoolArray = (part_of >= 0) | is_speck[holes]
    return filled


def _pillars(clearance: FloatArray, layout: Layout) -> LongArray:
    """Return the cells round which the lanes of halls run, int64 (k, 2).

    Lanes lie midway between them and from the walls, so a lattice of pillars makes a net.
    """
    half = _HALL * layout.apart / 2
    wide = clearance >= half
    if not wide.any():
        return np.empty((0, 2), dtype=np.int64)
    halls, _ = ndimage.label(clearance_cells(wide) < half)
    turn = turn_of(layout.angle_rad)
    found = []
    for hall, box in enumerate(ndimage.find_objects(halls), start=1):
        cells = np.argwhere(halls[box] == hall) + [side.start for side in box]
        turned = cells @ turn.T
        low, high = turned.min(axis=0), turned.max(axis=0)
        counts = np.maximum(np.round((high - low) / layout.apart), 1).astype(int)
        # A hall with room for one lane only has its pillars in its middle.
        axes = [
            low[k] + (high[k] - low[k]) * np.arange(1, max(n, 2)) / max(n, 2)
            for k, n in enumerate(counts.tolist())
        ]
        lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2) @ turn
        at = np.round(lattice).astype(np.int64)
        at = at[((at > 0) & (at < np.array(halls.shape) - 1)).all(axis=1)]
        is_off = clearance[tuple(at.T)] >= _OFF * layout.apart
        found.append(at[is_off & (halls[tuple(at.T)] == hall)])
    return np.concatenate(found)


def _uncovered(away: FloatArray, clearance: FloatArray, layout: Layout) -> LongArray:
    """Return a cell of each part that lies far from strands, flat."""
    cover = _COVER * layout.apart
    far = (away > cover) & (clearance >= layout.least)
    parts, count = ndimage.label(far)
    flat = np.flatnonzero(far)
    part = parts.ravel()[flat]
    # The farthest cell of those in the middle, so that the line there is straight.
    room = np.minimum(clearance.ravel()[flat], cover / 3)
    most = np.zeros(count + 1)
    np.maximum.at(most, part, room)
    score = np.where(room >= most[part] - _MIDDLE_CELLS, away.ravel()[flat], 0.0)
    order = np.lexsort((flat, -score, part))
    found: LongArray = flat[order[np.flatnonzero(np.diff(part[order], prepend=0))]]
    return found


_SIDES = ((0, 1), (-1, 0), (0, -1), (1, 0))


def strands_of(lines: BoolArray, marks: BoolArray) -> tuple[LongArray, list[Strand]]:
    """Return lines as a graph.

    Parameters
    ----------
    lines
        bool (rows, cols), 4-connected lines one cell wide.
    marks
        bool (rows, cols), cells of lines that are nodes, beside crossings and ends.

    Returns
    -------
    tuple
        int64 (n, 2), the cell of each node; the strands between them, of which some may be rings.
    """
    lines = np.pad(lines, 1)
    cols = lines.shape[1]
    cells = np.argwhere(lines)
    flat: list[int] = (cells @ np.array([cols, 1])).tolist()
    on = lines.ravel()
    near = {
        cell: [cell + row * cols + col for row, col in _SIDES if on[cell + row * cols + col]]
        for cell in flat
    }
    is_marked = np.pad(marks, 1).ravel()
    nodes = {cell: 0 for cell in flat if len(near[cell]) != 2 or is_marked[cell]}  # noqa: PLR2004
    strands: list[tuple[list[int], int, int]] = []
    passed: set[int] = set(nodes)
    done: set[tuple[int, int]] = set()

    def walk(start: int) -> None:
        for first in near[start]:
            if (start, first) in done:
                continue
            chain = [start, first]
            while chain[-1] not in nodes:
                one, other = near[chain[-1]]
                chain.append(other if one == chain[-2] else one)
            done.add((chain[-1], chain[-2]))
            passed.update(chain)
            strands.append((chain, start, chain[-1]))

    for start in list(nodes):
        walk(start)
    for cell in flat:  # rings without a node
        if cell not in passed:
            nodes[cell] = 0
            walk(cell)
    index = {cell: k for k, cell in enumerate(nodes)}
    at = np.stack(np.divmod(np.array(list(nodes), dtype=np.int64), cols), axis=1) - 1
    return at, [
        Strand(index[one], index[other], np.stack(np.divmod(np.array(chain), cols), axis=1) - 0.5)
        for chain, one, other in strands
    ]
