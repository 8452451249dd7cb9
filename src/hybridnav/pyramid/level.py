"""One level of a dual graph pyramid, rebuilt from the record on demand, and its arcs as
arguments.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.kernels.moves import field_distances
from hybridnav._base.moves import STRAIGHT, length_in_cells
from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.pyramid import CombinatorialMap
from hybridnav.pyramid.cracks import boundaries_of, cell_pairs, endpoints_of, middles_of, sides_of
from hybridnav.pyramid.graphs import (
    DualGraph,
    FaceKind,
    SimpleGraph,
    multigraph,
    simple_graph,
    vertices_with_attributes,
)
from hybridnav.pyramid.islands import LazyIslands
from hybridnav.pyramid.kernels import fields as _field_kernels
from hybridnav.pyramid.kernels import hulls as _hull_kernels
from hybridnav.pyramid.record import SURVIVES, Record

if TYPE_CHECKING:
    import networkx as nx


@dataclass(frozen=True, order=True)
class LevelArc:
    """An arc together with its level: at another level, the same index is another arc.

    Examples
    --------
    >>> hn.LevelArc(0, 7)
    LevelArc(level=0, index=7)
    """

    level: int
    """Index of the level in its pyramid."""
    index: int
    """Dense index of the arc at that level."""


_SOUTH = 3


@copies_alike
class Level:
    """A plane graph of connected sets of cells, and its dual.

    Vertices are numbered in the order of their surviving cells, arcs in the order of the base edges
    that represent them. Everything is computed on first use and then kept; arrays are not
    writeable.

    Examples
    --------
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> level = pyramid[-1]
    >>> level.n_vertices, level.n_arcs, level.areas
    (10, 15, array([ 76,  61,  47, 124,  61,  45,  99,  56,  39,  63]))
    """

    def __init__(
        self, grid: OccupancyGrid, record: Record, index: int, islands: LazyIslands
    ) -> None:
        self.index = index
        self._grid = grid
        self._record = record
        self._islands = islands

    @property
    def grid(self) -> OccupancyGrid:
        """The map that it was grown from."""
        return self._grid

    def __repr__(self) -> str:
        return f"Level(index={self.index}, n_vertices={self.n_vertices}, n_arcs={self.n_arcs})"

    @cached_property
    def _labels(self) -> tuple[IntArray, LongArray]:
        record = self._record
        field_of, survivors = _field_kernels.label_fields(
            record.vertex_end, record.vertex_parent, self.index
        )
        return frozen(field_of), frozen(survivors)

    @property
    def field_of(self) -> IntArray:
        """int32 (rows, cols), the vertex whose field holds each cell; -1 for occupied cells."""
        return self._labels[0].reshape(self._grid.shape)

    @cached_property
    def cells(self) -> LongArray:
        """int64 (n_vertices, 2), surviving cell of each vertex as (row, col)."""
        return frozen(np.stack(divmod(self._labels[1], self._grid.shape[1]), axis=1))

    @property
    def n_vertices(self) -> int:
        """Vertices of the level."""
        return len(self._labels[1])

    @cached_property
    def classes(self) -> ByteArray:
        """uint8 (n_vertices,), `CellClass` of each field."""
        return frozen(self._grid.classes.ravel()[self._labels[1]])

    @cached_property
    def _extents(self) -> tuple[LongArray, IntArray]:
        areas, boxes = _field_kernels.field_extents(
            self._labels[0], self._grid.shape[1], self.n_vertices
        )
        return frozen(areas), frozen(boxes)

    @cached_property
    def _cells_by_field(self) -> tuple[LongArray, LongArray]:
        """Flat cells sorted by field, and where each field starts among them."""
        order = np.argsort(self._labels[0], kind="stable")
        order = order[len(order) - int(self.areas.sum()) :]  # cells without a field are first
        return order, np.concatenate([[0], np.cumsum(self.areas)])

    def receptive_field(self, vertex: int) -> LongArray:
        """Return the cells of the receptive field of a vertex, in the order of rows.

        Parameters
        ----------
        vertex
            Index of the vertex, 0 <= vertex < n_vertices.

        Returns
        -------
        LongArray
            int64 (n, 2), (row, col).

        Raises
        ------
        InvalidValueError
            When there is no such vertex.
        """
        if not 0 <= vertex < self.n_vertices:
            raise InvalidValueError(f"vertex must be from 0 to {self.n_vertices - 1}, got {vertex}")
        order, start = self._cells_by_field
        flat = order[start[vertex] : start[vertex + 1]]
        return np.stack(np.divmod(flat, self._grid.shape[1]), axis=1)

    @property
    def areas(self) -> LongArray:
        """int64 (n_vertices,), cells in each receptive field."""
        return self._extents[0]

    @property
    def boxes(self) -> IntArray:
        """int32 (n_vertices, 4), the least row and column of each field, and the greatest."""
        return self._extents[1]

    @cached_property
    def base_edges(self) -> LongArray:
        """int64 (n_arcs,), base edge that represents each arc: 2 * flat cell, + 1 for north."""
        end = self._record.edge_end
        return frozen(np.flatnonzero(end >= min(2 * self.index + 2, SURVIVES)))

    @property
    def n_arcs(self) -> int:
        """Arcs of the level, self-loops included."""
        return len(self.base_edges)

    @cached_property
    def base_pairs(self) -> LongArray:
        """int64 (n_arcs, 2, 2), the two cells (row, col) of the base edge of each arc."""
        return frozen(cell_pairs(self.base_edges, self._grid.shape[1]))

    @cached_property
    def arcs(self) -> IntArray:
        """int32 (n_arcs, 2), the vertices that each arc joins: where darts 2a and 2a + 1 start."""
        rows, cols = np.moveaxis(self.base_pairs, -1, 0)
        return frozen(self.field_of[rows, cols])

    @property
    def is_self_loop(self) -> BoolArray:
        """bool (n_arcs,), arcs that join a vertex to itself."""
        return self.arcs[:, 0] == self.arcs[:, 1]

    @cached_property
    def darts(self) -> CombinatorialMap:
        """The graph and its dual as permutations of darts."""
        record = self._record
        rows, cols = self._grid.shape
        sigma, origin, protected = _field_kernels.level_darts(
            self.base_edges,
            record.edge_end,
            record.vertex_end,
            self._labels[0],
            self.index,
            rows,
            cols,
        )
        return CombinatorialMap(
            sigma, origin, protected, self.base_edges.astype(np.int32), self.n_vertices
        )

    @property
    def sigma(self) -> IntArray:
        """int32 (2 n_arcs,), next dart counter-clockwise round the vertex."""
        return self.darts.sigma

    @property
    def protected(self) -> BoolArray:
        """bool (2 n_arcs,), whether the face on the right of each dart is protected."""
        return self.darts.protected

    def face_darts(
        self, cells: LongArray, direction: int, *, among: BoolArray | None = None
    ) -> LongArray:
        """Return one dart on the face that a direction at each cell points into.

        Parameters
        ----------
        cells
            int64 (n,), flat cells that are vertices of the base.
        direction
            0 east, 1 north, 2 west, 3 south; no vertex lies there.
        among
            bool (rows, cols), the vertices that count, in whole fields; None for all. The face is
            that of the map without the other vertices.

        Returns
        -------
        LongArray
            int64 (n,), -1 where the vertex that holds the cell has no arc.
        """
        edge_end = self._record.edge_end
        if among is not None:
            ends = np.zeros((among.size, 2), dtype=np.bool_)
            ends[:-1, 0] = among.ravel()[:-1] & among.ravel()[1:]
            ends[: -among.shape[1], 1] = (among[:-1] & among[1:]).ravel()
            edge_end = np.where(ends.ravel(), edge_end, 0).astype(np.uint8)
        return _field_kernels.darts_at_corners(
            cells, direction, self.base_edges, edge_end, self.index, self._grid.shape[1]
        )

    @cached_property
    def dual(self) -> DualGraph:
        """The dual graph: faces, their kinds, and the dual edge of each arc."""
        # The outer face lies south of the first cell of a component, in the order of rows.
        outer = self.face_darts(self._islands.found.component_cell, _SOUTH)
        return DualGraph.of_map(self.darts, outer[outer >= 0])

    def to_networkx(self) -> nx.MultiGraph[int]:
        """Return the level as a multigraph, with its parallel arcs and self-loops.

        Returns
        -------
        networkx.MultiGraph
            Nodes are the vertices, by index: `cell` [row, col] (the surviving cell), `position` [x,
            y] (its centre in metres, map frame), `class` ("free" or "unexplored"), `area_m2`. Edges
            are the arcs, their key the index of the arc: `max_distance_m`, `through_m`, `n_cracks`
            (cell sides of the boundary) and `base_pair`. The last has [[row, col], [row, col]], the
            two cells of the base edge that stands for the arc. The graph has the `name` of the map,
            the index of the `level` and `resolution_m`; all attributes survive JSON.
        """
        return multigraph(
            self._about(),
            vertices_with_attributes(self._grid, self.cells, self.classes, self.areas),
            self.arcs,
            max_distance_m=self.max_distance_m.tolist(),
            through_m=self.through_m.tolist(),
            n_cracks=self.n_cracks.tolist(),
            base_pair=self.base_pairs.tolist(),
        )

    def dual_to_networkx(self) -> nx.MultiGraph[int]:
        """Return the dual as a multigraph: meeting points and holes, joined by boundaries.

        A vertex without an arc has no face here, although the plane round it is one. `n_isolated`
        of the graph counts these vertices: vertices - edges + faces = 2 components - `n_isolated`.

        Returns
        -------
        networkx.MultiGraph
            Nodes are the faces, by index in `dual`: `kind` ("ordinary", "protected" or "outside").
            Edges are the dual edges, one for each arc and with its index as key. They have
            `length_m` and `n_cracks` of the boundary, and `vertices` [u, v] on its two sides. A
            self-loop has those of the line of its dual edge through its own field. The graph has
            the attributes of `to_networkx` and `n_isolated`.
        """
        isolated = self.n_vertices - len(np.unique(self.arcs))
        kinds = [FaceKind(kind).name.lower() for kind in self.dual.kinds.tolist()]
        return multigraph(
            {**self._about(), "n_isolated": isolated},
            ((face, {"kind": kind}) for face, kind in enumerate(kinds)),
            self.dual.edges,
            length_m=(self.n_cracks * np.float64(self._grid.resolution_m)).tolist(),
            n_cracks=self.n_cracks.tolist(),
            vertices=self.arcs.tolist(),
        )

    def to_simple_graph(self) -> SimpleGraph:
        """Return the level as a simple graph: at most one edge between two vertices, no self-loop.

        The result has a report of the arcs that this drops.
        """
        nodes = vertices_with_attributes(self._grid, self.cells, self.classes, self.areas)
        return simple_graph(self._about(), nodes, self.arcs, self.max_distance_m, self.through_m)

    def _about(self) -> dict[str, Any]:
        grid = self._grid
        return {"name": grid.name, "level": self.index, "resolution_m": grid.resolution_m}

    @cached_property
    def hulls(self) -> tuple[LongArray, IntArray]:
        """The convex hulls of the fields: int64 (n_vertices + 1,), where each begins among the
        next, and int32 (n, 2), cells (row, col)."""
        return _hull_kernels.field_hulls(self._labels[0], self._grid.shape[1], self.boxes)

    @cached_property
    def max_distance_m(self) -> FloatArray:
        """float64 (n_arcs,), largest distance between the centre of a cell of one field and the
        centre of a cell of the other; for a self-loop the diameter of its field. In metres."""
        squared = _hull_kernels.hull_distances(*self.hulls, self.arcs)
        return frozen(np.sqrt(squared) * self._grid.resolution_m)

    @cached_property
    def through_m(self) -> FloatArray:
        """float64 (n_arcs,), length in metres of the shortest path of 8-neighbour moves from one
        surviving cell to the other. It runs inside the first field to the boundary, across it by a
        side, and on inside the other field.

        Diagonals need both side cells: free ones in a free field, free or unexplored ones in an
        unexplored field. For a self-loop it is the shortest closed walk from its surviving cell
        across one of the cell pairs of its boundary.
        """
        distance = field_distances(self._grid.classes, self._labels[0], self._labels[1])
        edges, arc = self.boundary_table
        first, second = endpoints_of(edges, self._grid.shape[1])
        across = distance[first] + distance[second] + STRAIGHT
        least = np.full(self.n_arcs, np.iinfo(np.int64).max)
        np.minimum.at(least, arc, across)
        return frozen(length_in_cells(least) * self._grid.resolution_m)

    def boundary(self, arc: int) -> LongArray:
        """Return the cell pairs of the boundary of one arc.

        Parameters
        ----------
        arc
            Index of the arc, 0 <= arc < n_arcs.

        Returns
        -------
        LongArray
            int64 (n_cracks, 2, 2): 4-adjacent cells (row, col), the first in the field of
            `arcs[arc, 0]`, the second in that of `arcs[arc, 1]`. For a self-loop both lie in the
            same field, and the line of its dual edge passes between them.

        Raises
        ------
        InvalidValueError
            When there is no such arc.
        """
        if not 0 <= arc < self.n_arcs:
            raise InvalidValueError(f"arc must be from 0 to {self.n_arcs - 1}, got {arc}")
        edges, of_arc = self.boundary_table
        low, high = np.searchsorted(of_arc, [arc, arc + 1])
        pairs = cell_pairs(edges[low:high], self._grid.shape[1])
        turned = self.field_of[tuple(pairs[:, 0].T)] != self.arcs[arc, 0]
        pairs[turned] = pairs[turned, ::-1]
        return pairs

    @cached_property
    def boundary_middles(self) -> FloatArray:
        """float64 (n_arcs, 2), the middle of each arc's boundary, through which to draw the arc.

        `(x, y)` in metres, map frame, on the boundary: the middle of the side between two cells
        that is nearest the mean of all sides.
        """
        edges, arc = self.boundary_table
        middles = middles_of(sides_of(edges, self._grid.shape[1]), arc, self.n_arcs)
        return frozen(self._grid.frame.points_of_grid(middles))

    @cached_property
    def n_cracks(self) -> LongArray:
        """int64 (n_arcs,), cell sides of each boundary: the length of the arc's dual edge.

        Only a dual graph has it: neither an adjacency of fields nor their distances contain the
        length of the line between two fields.
        """
        counts: LongArray = np.bincount(self.boundary_table[1], minlength=self.n_arcs)
        return frozen(counts)

    @cached_property
    def boundary_table(self) -> tuple[LongArray, LongArray]:
        """Return all boundaries at once: int64 base edges, and the arc of each, sorted by arc."""
        level = self._labels[0], self._record.edge_end, self.index, self._grid.shape[1]
        return boundaries_of(self.base_edges, self.is_self_loop, level)
