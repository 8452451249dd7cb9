"""Free space as the builder of route graphs sees it: cells, sight, exact shortest paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.maps.geometry import cells_of_line, walks_clear
from hybridnav.maps.orientation import Orientation
from hybridnav.refine import Sight
from hybridnav.rooms import Rooms
from hybridnav.rooms.find import outside_of
from hybridnav.search.directed import DirectedSides
from hybridnav.search.mesh import DetourSearch, MeshPaths, MeshSearch, build_mesh, shortest_paths
from hybridnav.search.mesh.search import rounded_into

LEAST_AREA_M2 = 1.0
"""Area in square metres below which a part of free space gets no nodes: scans have many."""
RIM_CELLS = 2.0**-6
"""Least distance of a node from the sides of its cell, in cells: a point on a side belongs to the
cell above or to the right, which may be blocked, and readers keep 32 bits of a number. On three
buildings routes are 0.06 % longer on average with four times as much."""


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """The cells that the robot may enter, with exact tests and searches."""

    grid: OccupancyGrid
    free: BoolArray
    """bool (rows, cols)."""
    component_of: IntArray
    """int32 (rows, cols), the connected part of each free cell, -1 elsewhere."""
    sight: Sight
    search: MeshSearch
    turn: Orientation
    """How the cells are turned; the grid is not."""

    @classmethod
    def of(cls, grid: OccupancyGrid) -> FreeSpace:
        """Prepare the free space of a map.

        Raises `InvalidValueError` when the map allows corner cutting.
        """
        if grid.corner_cutting:
            raise InvalidValueError(
                "edges of a route graph do not pass between two blocked cells that meet at a "
                "corner, and this map allows that (corner_cutting): load it without"
            )
        free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
        mesh = build_mesh(free)
        component_of = np.full(free.shape, -1, dtype=np.int32)
        component_of[free] = mesh.component[mesh.polygon_at[free]]
        return cls(grid, free, component_of, Sight(free), MeshSearch(mesh), Orientation(free.shape))

    def turned(self, turn: Orientation) -> FreeSpace:
        """Return this free space turned, with the same numbers of its parts."""
        free, component_of = turn.turned(self.free), turn.turned(self.component_of)
        return FreeSpace(
            self.grid, free, component_of, Sight(free), MeshSearch(build_mesh(free)), turn
        )

    def outside(self, rooms: RoomLabels | None = None) -> BoolArray:
        """Return which parts of free space lie outside the building, bool (n_components,).

        No door joins them with it, as the margin of its image; none do where no other part is as
        large as 1 m².

        `rooms`: the rooms, if there are some: a part that holds cells of one is inside.
        """
        part_of = self.component_of[self.free]
        is_inside = ~outside_of(self.grid)[self.free]
        if rooms is not None:
            is_inside |= rooms.label_of[self.free] >= 0
        outside: BoolArray = np.bincount(part_of, weights=is_inside, minlength=1) == 0
        return outside & (self._is_large & ~outside).any()

    def kept(self, rooms: Rooms | None = None) -> BoolArray:
        """Return which parts of free space get nodes, bool (n_components,).

        They have 1 m² or more, and lie neither outside the building nor in rooms alone that lists
        leave out.

        `rooms`: the rooms, if there are some.
        """
        if rooms is None:
            return self._is_large & ~self.outside()
        is_kept: BoolArray = self._is_large & ~self.outside(rooms.labels)
        begins = rooms.begin_cells[self.free]
        is_kept &= np.bincount(self.component_of[self.free], weights=begins, minlength=1) > 0
        return is_kept

    @property
    def _is_large(self) -> BoolArray:
        sizes = np.bincount(self.component_of[self.free], minlength=1)
        return sizes * self.grid.cell_area_m2 >= LEAST_AREA_M2

    def cells_at(self, positions: FloatArray) -> LongArray:
        """Return the cell that each position lies in, int64 (n, 2)."""
        return np.floor(positions).astype(np.int64)

    def joins(self, tails: FloatArray, heads: FloatArray) -> BoolArray:
        """Return which positions an edge may join, there and back.

        `tails`, `heads`: float64 (n, 2), positions inside free cells, as for `Sight.clear`. Returns
        bool (n,), whether the segment stays in free space, and Nav2's walks between the cells of
        its ends too.
        """
        joined = self.sight.clear(tails, heads)
        ends = self.cells_at(tails), self.cells_at(heads)
        for one, other in (ends, ends[::-1]):
            joined[joined] = walks_clear(self.free, one[joined], other[joined])
        return joined

    def joinable(self, path: FloatArray) -> FloatArray:
        """Return positions on the cells of a path that edges may join one after the other.

        `path`: float64 (n, 2), a path in free space; its ends lie inside cells. Returns float64 (k,
        2), both ends, and as few centres of cells as are found between.
        """
        centres = cells_of_line(self.free, path) + 0.5
        chain = np.concatenate([path[:1], centres, path[-1:]])
        kept = [0]
        while kept[-1] < len(chain) - 1:
            rest = chain[kept[-1] + 1 :]
            # Neighbours are always joined: no step past a corner has two blocked cells beside.
            seen = self.joins(np.repeat(chain[kept[-1:]], len(rest), axis=0), rest)
            kept.append(kept[-1] + 1 + int(np.flatnonzero(seen)[-1]))
        return chain[kept]

    def components_at(self, positions: FloatArray) -> IntArray:
        """Return the connected part of free space that each position lies in, int32 (n,)."""
        return self.component_of[tuple(self.cells_at(positions).T)]

    def paths(self, starts: FloatArray, goals: FloatArray) -> MeshPaths:
        """Return the shortest paths of many pairs of positions."""
        cells = self.cells_at(starts), self.cells_at(goals)
        return shortest_paths(self.search, cells, (starts, goals))

    def lengths(
        self, starts: FloatArray, goals: FloatArray, one_way: DirectedSides | None
    ) -> FloatArray:
        """Return the lengths of the shortest paths, in cells, infinite for none; by the directions
        of some sides."""
        found, ends = self.paths(starts, goals), list(zip(starts, goals, strict=True))
        if one_way is None:
            return found.length_cells
        closed = np.empty(0, np.int64)
        around = DetourSearch(self.search, self.free, closed, sides=one_way.sides)
        lengths = found.length_cells.copy()
        for k in np.flatnonzero(around.are_met_by(found)).tolist():
            one, two = ((int(end[0]), int(end[1])) for end in ends[k])
            lengths[k] = around.search.path((one, two), ends[k]).length_cells
        return lengths

    def random_pairs(
        self, count: int, rng: np.random.Generator, is_kept: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """Draw pairs of centres of free cells with a path between them.

        `count`: number of pairs; `is_kept`: bool (n_components,), the parts of free space that they
        are drawn in, as of `kept`. Returns float64 (count, 2) starts and goals; empty where no part
        has two cells.
        """
        cells = np.argwhere(self.free)
        component = self.component_of[self.free]
        size = np.bincount(component, minlength=1)
        large = is_kept[component] & (size[component] > 1)
        cells, component = cells[large], component[large]
        order = np.argsort(component, kind="stable")
        cells, component = cells[order], component[order]
        if not len(cells):
            return np.empty((0, 2)), np.empty((0, 2))
        first = rng.integers(len(cells), size=count)
        # The other end is one of the other cells of the same part.
        low = np.searchsorted(component, component[first])
        others = size[component[first]] - 1
        other = low + (first - low + 1 + rng.integers(others)) % (others + 1)
        centres = np.asarray(cells + 0.5, dtype=np.float64)
        return centres[first], centres[other]


def checked_position(space: FreeSpace, point: tuple[float, float]) -> FloatArray | None:
    """Return the position of a point in metres in grid units, moved off the sides of its cell, None
    where it is not free."""
    cell = np.floor(space.turn.there(np.array(space.grid.frame.cell_of(*point)) + 0.5))
    cell = cell.astype(np.int64)
    if not ((cell >= 0) & (cell < space.free.shape)).all() or not space.free[tuple(cell)]:
        return None
    at = space.turn.there(np.array([space.grid.frame.position_of(*point)]))
    at = np.clip(at, cell + RIM_CELLS, cell + 1 - RIM_CELLS)
    return rounded_into(cell[None], at)[0]
