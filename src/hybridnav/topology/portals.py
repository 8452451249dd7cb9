"""Portals: where paths cross from field to field, and shortest paths inside the fields.

Every legal move between two fields, those that meet at a point only included, belongs to one
portal: the moves between the same two fields whose lower cell lies in one square of a lattice. The
cells at their ends are the *border cells* of a field; some or all of them are *gates*, from which
the shortest paths to all cells of their field are stored.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.search._kernels import legal_moves
from hybridnav.topology import _gate_kernels as kernels
from hybridnav.topology.crossings import find_crossings
from hybridnav.topology.portal_layout import Layout, offsets_of, starts_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, ByteArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid


class PortalsTooLargeError(InvalidValueError):
    """Portals would take more memory than is allowed."""


class PathTooLongError(InvalidValueError):
    """A path inside a field may be longer than 6,600 cells, or a field is not connected."""


# Compiled kernels know the fields of named tuples by position: after reordering them, numba's
# caches in `__pycache__` must go, as those of unchanged kernel files stay valid in its eyes.
class Portals(NamedTuple):
    """Portals of a partition of the cells that may be entered, and the paths inside its fields.

    F fields, G gates, P portals, S sources. Costs are the integers of `search._costs`. A portal
    has two sides, one in each of its fields. Flat cells are `row * cols + col`; gates are sorted by
    field, sides too: those of field f are `side_start[f]` to `side_start[f + 1]`, and likewise for
    gates.
    """

    position: IntArray
    """int32, cells sorted by field: where each cell stands, -1 if it is not entered. Squares of
    8 x 8 cells stand together, row by row, here and in that order: paths stay in few of them."""
    field_start: LongArray
    """int64 (F + 1,), first position of each field."""
    gate_start: LongArray
    gate_cell: IntArray
    """int32 (G,), flat cell of each gate."""
    row_start: LongArray
    """int64 (G + 1,), first byte of each gate's row of `rows`."""
    rows: ByteArray
    """uint8, for each cell of the gate's field four bits: direction of the path to the gate."""
    clique_start: LongArray
    """int64 (F + 1,), where the costs between the gates of each field begin, row by row."""
    clique: IntArray
    """int32, those costs: exact, of paths inside the field."""
    exit_start: LongArray
    """int64 (G + 1,), the moves out of each gate's field are positions of the next three."""
    exit_gate: IntArray
    exit_cost: IntArray
    exit_portal: IntArray
    side_start: LongArray
    side_portal: IntArray
    side_gate: IntArray
    """int32 (2 P,), the gate that stands for the portal on this side."""
    side_radius: IntArray
    """int32 (2 P,), no border cell of the side is farther from that gate, inside the field."""
    side_gates_start: LongArray
    side_gates: IntArray
    """int32, the gates of each side from which a move of its portal leads to a gate."""
    side_gates_source: IntArray
    """int32, source beside each of these gates."""
    side_gates_cost: IntArray
    """int32, cost of a path from that source to the gate."""
    steps_start: LongArray
    """int64 (F + 1,), where the rows of `steps` begin, one a cell, one column a side."""
    steps_shift: LongArray
    """int64 (F,), bits that `steps` lack."""
    steps: NDArray[np.uint16]
    """uint16, costs from each cell to its field's sides, rounded down to so many bits."""
    portal_sides: IntArray
    """int32 (P, 2), the sides of each portal, in its lower and its higher field."""
    portal_cost: IntArray
    """int32 (P,), of the move between the gates that stand for it."""
    portal_source: IntArray
    """int32 (P,), the source at the lower of these gates."""
    source_gate: IntArray
    """int32 (S,), gates in the lower field of their portal, a few cells apart, from which costs to
    all gates of the map are worth knowing."""

    @property
    def n_fields(self) -> int:
        """F."""
        return len(self.field_start) - 1

    @property
    def n_gates(self) -> int:
        """G."""
        return len(self.gate_cell)

    @property
    def n_portals(self) -> int:
        """P."""
        return len(self.portal_cost)


def build_portals(  # noqa: PLR0913 - independent choices
    grid: OccupancyGrid,
    field_of: NDArray[np.int16 | np.int32],
    *,
    spacing_cells: int = 16,
    source_spacing_cells: int = 4,
    gate_spacing_cells: int = 1,
    allow_unexplored: bool = False,
    max_bytes: float = math.inf,
) -> Portals:
    """Place portals along all borders of a partition and compute the paths inside its fields.

    Parameters
    ----------
    grid
        The map; its free cells are planned on.
    field_of
        (rows, cols), the field of each free cell, such as `Level.field_of`.
    spacing_cells
        Side of the lattice squares of portals.
    source_spacing_cells
        Side of the squares in each of which a portal has one source; it divides `spacing_cells`.
    gate_spacing_cells
        1 makes every border cell a gate, so that nothing is lost; more keeps, of the moves in each
        square of this side, only the middle one.
    allow_unexplored
        Whether unexplored cells are entered too.
    max_bytes
        What portals, and a table from all sources to all gates, may take.

    Returns
    -------
    Portals
        Time and memory grow with the sum, over the fields, of cells times gates.

    Raises
    ------
    InvalidValueError
        When a spacing is not positive, or a cell that may be entered is in no field.
    PortalsTooLargeError
        When they would take more than `max_bytes`.
    PathTooLongError
        When a path inside a field may be longer than 6,600 cells, or a field is not connected.
    """
    spacings = spacing_cells, source_spacing_cells, gate_spacing_cells
    if min(spacings) < 1 or spacing_cells % source_spacing_cells:
        raise InvalidValueError(
            "portals, sources and gates need spacings of at least one cell, the second a divisor "
            f"of the first, got {spacings}"
        )
    free = grid.enterable(allow_unexplored=allow_unexplored)
    label = compact_labels(field_of, free).astype(np.int32).ravel()
    cols = grid.shape[1]
    moves = legal_moves(np.ascontiguousarray(free), grid.corner_cutting).ravel()
    layout = Layout(label, cols, find_crossings(moves, label, cols, spacings))
    if layout.n_bytes > max_bytes:
        raise PortalsTooLargeError(f"portals would take {layout.n_bytes / 1e6:.0f} MB")
    return _assembled(layout, _filled(layout, moves))


def compact_labels(
    field_of: NDArray[np.int16 | np.int32], enterable: BoolArray
) -> NDArray[np.int16 | np.int32]:
    """Number the fields of the cells that may be entered from 0, in their order.

    Parameters
    ----------
    field_of
        int32 (rows, cols), the field of each of these cells.
    enterable
        bool (rows, cols).

    Returns
    -------
    NDArray
        (rows, cols), -1 for all other cells; int16 where that is enough.

    Raises
    ------
    InvalidValueError
        When a cell that may be entered is in no field.
    """
    if field_of.shape != enterable.shape or (field_of[enterable] < 0).any():
        raise InvalidValueError("every cell that may be entered must be in a field")
    is_used = np.zeros(int(field_of.max(initial=-1)) + 1, dtype=np.bool_)
    is_used[field_of[enterable]] = True
    number = np.cumsum(is_used) - 1
    fits = len(is_used) == 0 or number[-1] <= np.iinfo(np.int16).max
    label = np.full(field_of.shape, -1, dtype=np.int16 if fits else np.int32)
    label[enterable] = number[field_of[enterable]]
    return label


def _filled(layout: Layout, moves: ByteArray) -> dict[str, NDArray[Any]]:
    """The arrays that need searches inside the fields, field by field."""
    sizes, gate_start = np.diff(layout.field_start), layout.gate_start
    clique_start = offsets_of(np.diff(gate_start) ** 2)
    steps_start = offsets_of(sizes * np.diff(layout.side_start))
    rows = np.empty(layout.row_start[-1], dtype=np.uint8)
    clique = np.empty(clique_start[-1], dtype=np.int32)
    steps = np.empty(steps_start[-1], dtype=np.uint16)
    radius = np.empty(layout.side_start[-1], dtype=np.int32)
    shift = np.zeros(layout.n_fields, dtype=np.int64)
    border_start = starts_of(layout.label[layout.border], layout.n_fields)
    busy = np.flatnonzero(np.diff(border_start))
    largest = int(sizes[busy].max(initial=0))
    near = np.empty((largest + 1, 8), dtype=np.int32)
    scratch = _scratch(largest)
    index = layout.index
    for f in busy.tolist():
        first, last = layout.field_start[f : f + 2]
        gates, sides = slice(*gate_start[f : f + 2]), slice(*layout.side_start[f : f + 2])
        borders = slice(*border_start[f : f + 2])
        own = layout.cells[first:last]
        kernels.neighbours_in_field(moves, layout.cols, index, own, first, near)
        stands = layout.side_gate[sides] - gate_start[f]
        columns = np.argsort(stands, kind="stable")
        costs = np.empty((gates.stop - gates.start, borders.stop - borders.start), dtype=np.int32)
        shift[f] = kernels.fill_field(
            near,
            last - first,
            index[layout.gate_cell[gates]] - first,
            layout.row_start[gates],
            rows,
            index[layout.border[borders]] - first,
            costs,
            starts_of(stands[columns], len(costs)),
            columns,
            steps[steps_start[f] : steps_start[f + 1]],
            scratch,
        )
        if shift[f] < 0:
            raise PathTooLongError(
                "a field is not connected, or a path inside it may be longer than 6,600 cells"
            )
        clique[clique_start[f] : clique_start[f + 1]] = costs[:, layout.is_gate[borders]].ravel()
        start, member = layout.side_border
        at = start[sides.start : sides.stop + 1]
        of_side = np.repeat(stands, np.diff(at))
        far = costs[of_side, member[at[0] : at[-1]] - borders.start]
        radius[sides] = np.maximum.reduceat(far, at[:-1] - at[0])
    return {
        "rows": rows,
        "clique_start": clique_start,
        "clique": clique,
        "steps_start": steps_start,
        "steps_shift": shift,
        "steps": steps,
        "side_radius": radius,
    }


def _scratch(largest: int) -> tuple[NDArray[Any], ...]:
    """Arrays that `fill_field` works in, for fields of at most so many cells."""
    lanes = kernels.LANES
    return (
        np.empty((largest + 1) * lanes, np.int32),
        np.empty(largest + 1, np.int32),
        np.empty((3, 4 * largest + 8), np.int32),
        np.empty(largest + 1, np.int32),
        np.empty(lanes, np.int32),
        np.empty(largest + 1, np.uint8),
        np.empty((lanes, largest + 1), np.uint8),
        np.empty(lanes, np.int64),
        np.empty(largest + 1, np.int32),
    )


def _assembled(layout: Layout, filled: dict[str, NDArray[Any]]) -> Portals:
    crossings, n_portals = layout.crossings, layout.crossings.n_portals
    cost, stands = crossings.cost, crossings.stands
    portal_cost, portal_source = (np.empty(n_portals, dtype=np.int32) for _ in range(2))
    portal_cost[crossings.portal[stands]] = cost[stands]
    portal_source[crossings.portal[stands]] = crossings.source[stands]
    return Portals(
        position=_tiled(layout.index.reshape(-1, layout.cols)),
        field_start=layout.field_start,
        gate_start=layout.gate_start,
        gate_cell=layout.gate_cell.astype(np.int32),
        row_start=layout.row_start,
        side_start=layout.side_start,
        side_portal=(layout.side_order % max(n_portals, 1)).astype(np.int32),
        side_gate=layout.side_gate,
        source_gate=layout.source_gate,
        portal_sides=np.ascontiguousarray(layout.side_rank.reshape(2, -1).T, dtype=np.int32),
        portal_cost=portal_cost,
        portal_source=portal_source,
        **_exits(layout),
        **_beside(layout, filled),
        **filled,
    )


def _exits(layout: Layout) -> dict[str, NDArray[Any]]:
    """Moves between gates, by the gate they start from."""
    crossings = layout.crossings
    tail, head = layout.gate_of[crossings.ends].reshape(2, -1)
    tail, head = np.concatenate([tail, head]), np.concatenate([head, tail])
    kept = np.flatnonzero((tail >= 0) & (head >= 0))
    order = kept[np.argsort(tail[kept], kind="stable")]
    return {
        "exit_start": starts_of(tail[order], len(layout.gate_cell)),
        "exit_gate": head[order],
        "exit_cost": np.tile(crossings.cost, 2)[order],
        "exit_portal": np.tile(crossings.portal, 2)[order].astype(np.int32),
    }


def _beside(layout: Layout, filled: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Gates of each side, and for each a source with the cost of a path between the two."""
    crossings = layout.crossings
    low, high = layout.gate_of[crossings.ends].reshape(2, -1)
    kept = np.flatnonzero((low >= 0) & (high >= 0))
    field = layout.label[crossings.low[kept]]
    first = layout.gate_start[field]
    other = layout.source_gate[crossings.source[kept]] - first
    row = (low[kept] - first) * np.diff(layout.gate_start)[field]
    leg = filled["clique"][filled["clique_start"][field] + row + other].astype(np.int64)
    costs = np.concatenate([leg, leg + crossings.cost[kept]])
    side = layout.side_of_end.reshape(2, -1)[:, kept].ravel()
    gate = np.concatenate([low[kept], high[kept]])
    order = np.lexsort((costs, gate, side))
    new = np.ones(len(order), dtype=np.bool_)
    new[1:] = (np.diff(side[order]) != 0) | (np.diff(gate[order]) != 0)
    best = order[new]
    return {
        "side_gates_start": starts_of(side[best], 2 * crossings.n_portals),
        "side_gates": gate[best],
        "side_gates_source": np.tile(crossings.source[kept], 2)[best].astype(np.int32),
        "side_gates_cost": costs[best].astype(np.int32),
    }


def _tiled(index: IntArray) -> IntArray:
    """The same with squares of 8 x 8 cells together."""
    rows, cols = index.shape
    padded = np.full((-(-rows // 8) * 8, -(-cols // 8) * 8), -1, dtype=np.int32)
    padded[:rows, :cols] = index
    tiled: IntArray = padded.reshape(-1, 8, padded.shape[1] // 8, 8).swapaxes(1, 2).ravel()
    return tiled
