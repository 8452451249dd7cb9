"""Portals: where paths cross from field to field, and shortest paths inside the fields.

Every legal move between two fields, those that meet at a point only included, belongs to one
portal: the moves between the same two fields whose lower cell lies in one square of a lattice. The
cells at their endpoints are the *border cells* of a field; some or all of them are *gates*, to
which the shortest paths from all cells of their field are stored.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.portals import _gate_kernels as kernels
from hybridnav.portals.crossings import find_crossings
from hybridnav.portals.fields import compact_labels
from hybridnav.portals.layout import Layout, offsets_of, starts_of
from hybridnav.search.moves import legal_moves

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import ByteArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid


class PortalsTooLargeError(InvalidValueError):
    """Portals would take more memory than is allowed."""


class PathTooLongError(InvalidValueError):
    """A path inside a field may be longer than 6,600 cells, or a field is not connected."""


# Compiled kernels know the fields of named tuples by position: after reordering them, numba's
# caches in `__pycache__` must go, as those of unchanged kernel files stay valid in its eyes.
class Portals(NamedTuple):
    """Portals of a partition of the cells that may be entered, and the paths inside its fields.

    F fields, G gates, R sides, S sources. Costs are the integers of `search.moves`. A portal has
    two sides, one in each of its fields. Flat cells are `row * cols + col`; gates are sorted by
    field, sides too: those of field f are `side_start[f]` to `side_start[f + 1]`, and likewise for
    gates.
    """

    position: IntArray
    """int32, cells sorted by field: where each cell stands, -1 if it is not entered. Squares of
    8 x 8 cells stand together, row by row, here and in that order: paths stay in few of them."""
    field_start: LongArray
    """int64 (F + 1,), first position of each field."""
    gate_start: LongArray
    """int64 (F + 1,), first gate of each field."""
    gate_cell: IntArray
    """int32 (G,), flat cell of each gate."""
    first_move_start: LongArray
    """int64 (G + 1,), first byte of each gate's row of `first_move`."""
    first_move: ByteArray
    """uint8, for each cell of the gate's field four bits: direction of the path to the gate, 8 more
    where its next eight moves are that way; anything at the gate itself."""
    clique_start: LongArray
    """int64 (F + 1,), where the costs between the gates of each field begin, row by row."""
    clique: IntArray
    """int32, those costs: exact, of paths inside the field."""
    exit_start: LongArray
    """int64 (G + 1,), the moves out of each gate's field are positions of the next two."""
    exit_gate: IntArray
    """int32, the gate that each of these moves leads to."""
    exit_cost: IntArray
    """int32, its cost."""
    side_start: LongArray
    """int64 (F + 1,)."""
    side_gates_start: LongArray
    """int64 (R + 1,), where the gates of each side begin."""
    side_gates: IntArray
    """int32, the gates from which moves of the side's portal lead to gates."""
    side_cost_start: LongArray
    """int64 (F + 1,), where the rows of `side_cost` begin, one a cell, one column a side."""
    side_cost_shift: LongArray
    """int64 (F,), bits that `side_cost` lacks."""
    side_cost: NDArray[np.uint16]
    """uint16, costs from each cell to the nearest gate of its field's sides, rounded down to so
    many bits."""
    source_gate: IntArray
    """int32 (S,), gates in the lower field of a move to another gate: every such move begins or
    ends at one."""
    portal_sides: IntArray
    """int32 (P, 2), the two sides of each portal."""
    side_box: IntArray
    """int32 (R, 4), first and last row, first and last column of each side's border cells."""

    @property
    def n_fields(self) -> int:
        """Number of fields, F."""
        return len(self.field_start) - 1

    @property
    def gate_field(self) -> IntArray:
        """int32 (G,), the field of each gate."""
        return np.repeat(np.arange(self.n_fields, dtype=np.int32), np.diff(self.gate_start))

    @property
    def n_gates(self) -> int:
        """Number of gates, G."""
        return len(self.gate_cell)

    @property
    def n_sides(self) -> int:
        """Number of sides, R."""
        return len(self.side_gates_start) - 1


def build_portals(  # noqa: PLR0913 - independent choices
    grid: OccupancyGrid,
    field_of: NDArray[np.int16 | np.int32],
    *,
    spacing_cells: int = 16,
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
    gate_spacing_cells
        1 makes every border cell a gate, so that nothing is lost; more keeps, of the moves in each
        square of this side, only the middle one.
    allow_unexplored
        Whether unexplored cells are entered too.
    max_bytes
        Most memory of portals, and of a table from all sources to all gates.

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

    Examples
    --------
    >>> from hybridnav.portals import build_portals
    >>> grid = hn.OccupancyGrid(np.zeros((2, 4)), robot_radius_m=0)
    >>> portals = build_portals(grid, np.array([[0, 0, 1, 1], [0, 0, 1, 1]], dtype=np.int32))
    >>> portals.n_fields, portals.n_gates
    (2, 4)
    """
    spacings = spacing_cells, gate_spacing_cells
    if min(spacings) < 1 or spacing_cells % gate_spacing_cells:
        raise InvalidValueError(
            "portals and gates need spacings of at least one cell, the first a multiple of the "
            f"second, got {spacings}"
        )
    free = grid.enterable(allow_unexplored=allow_unexplored)
    label = compact_labels(field_of, free).astype(np.int32).ravel()
    cols = grid.shape[1]
    moves = legal_moves(np.ascontiguousarray(free), grid.corner_cutting).ravel()
    layout = Layout(label, cols, find_crossings(moves, label, cols, *spacings))
    if layout.n_bytes > max_bytes:
        raise PortalsTooLargeError(f"portals would take {layout.n_bytes / 1e6:.0f} MB")
    return _assembled(layout, _filled(layout, moves))


def _filled(layout: Layout, moves: ByteArray) -> dict[str, NDArray[Any]]:
    """Return the arrays that need searches inside the fields, field by field."""
    sizes, gate_start = np.diff(layout.field_start), layout.gate_start
    clique_start = offsets_of(np.diff(gate_start) ** 2)
    side_cost_start = offsets_of(sizes * np.diff(layout.side_start))
    first_move = np.empty(layout.first_move_start[-1], dtype=np.uint8)
    clique = np.empty(clique_start[-1], dtype=np.int32)
    side_cost = np.empty(side_cost_start[-1], dtype=np.uint16)
    shift = np.zeros(layout.n_fields, dtype=np.int64)
    busy = np.flatnonzero(np.diff(gate_start))
    largest = int(sizes[busy].max(initial=0))
    near, leaps = (np.empty((largest + 1, 8), dtype=np.int32) for _ in range(2))
    scratch = _scratch(largest)
    index = layout.index
    side_gates_start, side_gates = layout.side_gates
    for f in busy.tolist():
        first, last = layout.field_start[f : f + 2]
        gates, sides = slice(*gate_start[f : f + 2]), slice(*layout.side_start[f : f + 2])
        own = layout.cells[first:last]
        kernels.neighbours_in_field(moves, layout.cols, index, own, first, near)
        kernels.leaps_in_field(near, last - first, leaps)
        n_gates = gates.stop - gates.start
        of_sides = side_gates_start[sides.start : sides.stop + 1]
        members = side_gates[of_sides[0] : of_sides[-1]] - gates.start
        order = np.argsort(members, kind="stable")
        side = np.repeat(np.arange(len(of_sides) - 1), np.diff(of_sides))[order]
        shift[f] = kernels.fill_field(
            near,
            leaps,
            last - first,
            index[layout.gate_cell[gates]] - first,
            first_move[slice(*layout.first_move_start[[gates.start, gates.stop]])].reshape(
                n_gates, -1
            ),
            clique[clique_start[f] : clique_start[f + 1]].reshape(n_gates, n_gates),
            starts_of(members[order], n_gates),
            side,
            side_cost[side_cost_start[f] : side_cost_start[f + 1]].reshape(last - first, -1),
            scratch,
        )
        if shift[f] < 0:
            raise PathTooLongError(
                "a field is not connected, or a path inside it may be longer than 6,600 cells"
            )
    return {
        "first_move": first_move,
        "clique_start": clique_start,
        "clique": clique,
        "side_cost_start": side_cost_start,
        "side_cost_shift": shift,
        "side_cost": side_cost,
    }


def _scratch(largest: int) -> tuple[NDArray[Any], ...]:
    """Return work arrays of `fill_field` for fields of at most `largest` cells."""
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
    crossings = layout.crossings
    tail, head = layout.gate_of[crossings.endpoints].reshape(2, -1)
    tail, head = np.concatenate([tail, head]), np.concatenate([head, tail])
    kept = np.flatnonzero(np.tile(layout.is_exit, 2))
    order = kept[np.argsort(tail[kept], kind="stable")]
    side_gates_start, side_gates = layout.side_gates
    n_portals = crossings.n_portals
    return Portals(
        position=_tiled(layout.index.reshape(-1, layout.cols)),
        field_start=layout.field_start,
        gate_start=layout.gate_start,
        gate_cell=layout.gate_cell.astype(np.int32),
        first_move_start=layout.first_move_start,
        exit_start=starts_of(tail[order], len(layout.gate_cell)),
        exit_gate=head[order],
        exit_cost=np.tile(crossings.cost, 2)[order],
        side_start=layout.side_start,
        side_gates_start=side_gates_start,
        side_gates=side_gates.astype(np.int32),
        source_gate=layout.source_gate,
        portal_sides=np.ascontiguousarray(layout.side_rank.reshape(2, n_portals).T, dtype=np.int32),
        side_box=layout.side_box,
        **filled,
    )


def _tiled(index: IntArray) -> IntArray:
    """Return the same with the cells of each square of 8 x 8 together."""
    rows, cols = index.shape
    padded = np.full((-(-rows // 8) * 8, -(-cols // 8) * 8), -1, dtype=np.int32)
    padded[:rows, :cols] = index
    tiled: IntArray = padded.reshape(-1, 8, padded.shape[1] // 8, 8).swapaxes(1, 2).ravel()
    return tiled
