"""Consistency of a topological and a metric layer, checked by its definition.

S. Thrun: Learning metric-topological maps for indoor mobile robot navigation, 1998: the two layers
are consistent when each path of one has its counterpart in the other. Nothing here is the planners'
own code: connectivity comes from scipy.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from hybridnav._base.moves import legal_moves, moves_along
from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import BoolArray, IntArray, LongArray
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]


class Consistency:
    """The two layers of one method on one map, and the three questions to them.

    `grid`: the map; its free cells are the metric layer; `region_of`: int32 (rows, cols), the
    region of each cell, -1 for none; `topology`: the topological map of the regions, with its arcs;
    with None the edges of the topological layer are all pairs of regions that a legal move joins.
    """

    def __init__(
        self, grid: OccupancyGrid, region_of: IntArray, *, topology: TopologicalMap | None = None
    ) -> None:
        self._shape = grid.shape
        self._cols = grid.shape[1]
        self._region = region_of.ravel()
        self._free = grid.classes == CellClass.FREE
        self._count = int(region_of.max(initial=-1)) + 1
        masks = legal_moves(self._free, grid.corner_cutting).ravel()
        along = [moves_along(masks, self._cols, direction) for direction in (0, 2, 1, 3)]
        moves = np.concatenate([np.stack(endpoints, axis=1) for endpoints in along])
        region = self._region[moves]
        same = (region[:, 0] == region[:, 1]) & (region[:, 0] >= 0)
        self._component = _components(moves[same], grid.classes.size)
        self._whole = _components(moves, grid.classes.size)
        if topology is None:
            crossings = moves[~same & (region >= 0).all(axis=1)]
            arcs = np.zeros(len(crossings), dtype=np.int64)
        else:
            crossings, arcs = self._arc_crossings(topology)
        keys = self._keys(self._region[crossings])
        components = np.sort(self._component[crossings], axis=1)
        one = unique_rows(np.column_stack([keys, arcs, components])).first
        of_regions = self._keys(region)
        by_key = np.argsort(of_regions, kind="stable")
        self._moves, self._of_regions = moves[by_key], of_regions[by_key]
        self._order = np.argsort(self._region, kind="stable")
        # One crossing for each arc and pair of components, sorted by pair of regions, then arc.
        self._arc, self._crossings, crossing_keys = arcs[one], crossings[one], keys[one]
        self._key = crossing_keys
        self._links = np.unique(crossing_keys)

    def _arc_crossings(self, topology: TopologicalMap) -> tuple[LongArray, LongArray]:
        """Return the cell pairs on the boundaries between free places, and the arc of each."""
        base, arc = topology.level.boundary_table
        cell = base >> 1
        crossings = np.stack([cell, cell + np.where(base & 1, self._cols, 1)], axis=1)
        kept = self._free.ravel()[crossings].all(axis=1) & ~topology.level.is_self_loop[arc]
        return crossings[kept], arc[kept]

    def _keys(self, regions: IntArray) -> LongArray:
        """Return one number for each unordered pair of regions."""
        low, high = regions.min(axis=1), regions.max(axis=1)
        return low.astype(np.int64) * self._count + high

    def check_regions(self) -> list[tuple[str, tuple[Cell, Cell]]]:
        """Check that every region is connected, and that solvability agrees for every pair of free
        cells.

        Returns the faults, each with two cells that show it.
        """
        free = np.flatnonzero(self._free)
        region, component, whole = self._region[free], self._component[free], self._whole[free]
        homeless = np.flatnonzero(region < 0)
        if homeless.size:
            shown = self._cells(free[homeless[0]], free[homeless[-1]])
            return [(f"{homeless.size} free cells are in no region", shown)]
        faults = []
        first = np.zeros(self._count, dtype=np.int64)
        first[region[::-1]] = np.arange(len(free))[::-1]
        torn = np.flatnonzero(component[first[region]] != component)
        if torn.size:
            name = region[torn[0]]
            shown = self._cells(free[first[name]], free[torn[0]])
            faults.append((f"region {name}, and maybe others, is not connected", shown))
        endpoints = np.stack(divmod(self._links, self._count), axis=1)
        joined = _components(endpoints, self._count)[region]
        for one, other, text in (
            (whole, joined, "moves join two cells, regions do not"),
            (joined, whole, "regions join two cells, moves do not"),
        ):
            leader = np.zeros(int(one.max(initial=0)) + 1, dtype=np.int64)
            leader[one[::-1]] = np.arange(len(free))[::-1]
            apart = np.flatnonzero(other[leader[one]] != other)
            if apart.size:
                shown = self._cells(free[leader[one[apart[0]]]], free[apart[0]])
                faults.append((f"solvability: {text}", shown))
        return faults

    def _cells(self, *flat: int) -> tuple[Cell, Cell]:
        first, second = (divmod(int(cell), self._cols) for cell in flat)
        return first, second

    def check_plan(
        self, start: Cell, goal: Cell, nodes: Sequence[int], arcs: Sequence[int] | None
    ) -> str | None:
        """Check that a topological plan has a metric path inside its regions, in order.

        `start`, `goal`: cells (row, col); `nodes`: regions in the order passed; `arcs`: dense
        indices of the arcs between them; None allows any legal crossing. Returns what is wrong.
        """
        unknown = [node for node in nodes if not 0 <= node < self._count]
        if unknown:
            return f"the plan names region {unknown[0]}, which there is not"
        first, last = start[0] * self._cols + start[1], goal[0] * self._cols + goal[1]
        if self._region[first] != nodes[0] or self._region[last] != nodes[-1]:
            return "the plan does not start and end in the regions of start and goal"
        reached = {int(self._component[first])}
        for step, (here, there) in enumerate(itertools.pairwise(nodes)):
            reached = self._cross(reached, here, there, None if arcs is None else arcs[step])
            if not reached:
                return f"no metric path inside regions {here} and {there}, step {step} of the plan"
        if int(self._component[last]) not in reached:
            return f"the goal cannot be reached inside its region {nodes[-1]}"
        return None

    def _cross(self, reached: set[int], here: int, there: int, arc: int | None) -> set[int]:
        """Return the components of a region that a crossing from the reached components of another
        leads to."""
        key = min(here, there) * self._count + max(here, there)
        rows = slice(*np.searchsorted(self._key, [key, key + 1]))
        crossings, component = self._crossings[rows], self._component
        if arc is not None:
            crossings = crossings[self._arc[rows] == arc]
        # A crossing is stored in one direction only.
        turned = self._region[crossings[:, 0]] != here
        tails = np.where(turned, crossings[:, 1], crossings[:, 0])
        heads = np.where(turned, crossings[:, 0], crossings[:, 1])
        return {
            int(component[b])
            for a, b in zip(tails, heads, strict=True)
            if int(component[a]) in reached
        }

    def shortest_in_order(self, start: Cell, goal: Cell, nodes: Sequence[int]) -> float:
        """Return the length of the shortest path of cells that passes regions in their order, in
        cells, by scipy's Dijkstra; infinite for none.

        Each stay in a region is a graph of its own, and any legal move leads from one to the next.

        `start`, `goal`: cells (row, col); `nodes`: regions in the order passed, no two alike in a
        row; one may come again.
        """
        tails, heads, base = [], [], 0
        starts = np.searchsorted(self._region[self._order], np.arange(self._count + 1))
        cells = [self._order[starts[node] : starts[node + 1]] for node in nodes]
        for step, node in enumerate(nodes):
            here = base + np.searchsorted(cells[step], self._between(node, node))
            tails += [here[:, 0], here[:, 1]]
            heads += [here[:, 1], here[:, 0]]
            following = base + len(cells[step])
            for other in nodes[step + 1 : step + 2]:
                over = self._between(node, other)
                over = np.where((self._region[over[:, 0]] == node)[:, None], over, over[:, ::-1])
                tails.append(base + np.searchsorted(cells[step], over[:, 0]))
                heads.append(following + np.searchsorted(cells[step + 1], over[:, 1]))
            base = following
        tail, head, flat = np.concatenate(tails), np.concatenate(heads), np.concatenate(cells)
        rows, cols = np.abs(
            np.stack(divmod(flat[tail], self._cols)) - divmod(flat[head], self._cols)
        )
        lengths = np.sqrt(rows + cols)
        graph = sparse.coo_array((lengths, (tail, head)), (base, base)).tocsr()
        first, last = start[0] * self._cols + start[1], goal[0] * self._cols + goal[1]
        distances = csgraph.dijkstra(graph, indices=np.searchsorted(cells[0], [first]))[0]
        return float(distances[base - len(cells[-1]) + np.searchsorted(cells[-1], last)])

    def _between(self, one: int, other: int) -> LongArray:
        """Return the moves between two regions, or inside one, each in one direction."""
        key = min(one, other) * self._count + max(one, other)
        return self._moves[slice(*np.searchsorted(self._of_regions, [key, key + 1]))]

    def check_walk(self, cells: LongArray) -> str | None:
        """Check that a metric path maps to a walk in the topological layer.

        A diagonal between two regions may pass either of its side cells.

        `cells`: int64 (n, 2), the path. Returns what is wrong.
        """
        flat = cells[:, 0] * self._cols + cells[:, 1]
        region = self._region[flat]
        if (region < 0).any():
            return "the path leaves the regions"
        pairs = np.stack([region[:-1], region[1:]], axis=1)
        for step in np.flatnonzero(~self._linked(pairs)):
            side_cells = np.array(
                [[cells[step, 0], cells[step + 1, 1]], [cells[step + 1, 0], cells[step, 1]]]
            )
            inside = self._free[side_cells[:, 0], side_cells[:, 1]]
            via = self._region[side_cells @ [self._cols, 1]][inside]
            endpoints = np.broadcast_to(pairs[step], (len(via), 2))
            there = (
                np.stack([endpoints[:, 0], via], axis=1),
                np.stack([via, endpoints[:, 1]], axis=1),
            )
            if not (self._linked(there[0]) & self._linked(there[1])).any():
                a, b = pairs[step]
                row, col = cells[step]
                return f"the path passes from region {a} to {b} at cell ({row}, {col}): no edge"
        return None

    def _linked(self, pairs: IntArray) -> BoolArray:
        keys = self._keys(pairs)
        at = np.minimum(np.searchsorted(self._links, keys), max(len(self._links) - 1, 0))
        linked = self._links[at] == keys if len(self._links) else np.zeros(len(keys), np.bool_)
        return linked | (pairs[:, 0] == pairs[:, 1])

    def joined(self, start: Cell, goal: Cell) -> bool:
        """Return whether the metric layer joins two cells, by scipy's connected components."""
        first, last = start[0] * self._cols + start[1], goal[0] * self._cols + goal[1]
        return bool(self._whole[first] == self._whole[last])


def _components(links: LongArray, count: int) -> LongArray:
    """Return the label of the connected component of each thing, by the linked pairs."""
    ones = np.ones(len(links), dtype=np.int8)
    graph = sparse.coo_array((ones, (links[:, 0], links[:, 1])), (count, count))
    return csgraph.connected_components(graph, directed=False)[1].astype(np.int64)
