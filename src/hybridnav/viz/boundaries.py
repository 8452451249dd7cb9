"""Dual edges as lines along their boundaries, continued inside holes to their dual vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from hybridnav._base.moves import STEPS
from hybridnav._base.trig import hypots
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray
from hybridnav.maps import CellClass
from hybridnav.pyramid import Level
from hybridnav.pyramid.graphs import FaceKind
from hybridnav.viz.fields import Field, WalkTree, distance_to_rim, rounded, smoothed

Corner = tuple[int, int]
"""A corner of cells: (row, col) in grid units, the lower left corner of cell (row, col)."""

_ALL_ROUND = np.ones((3, 3), dtype=np.bool_)
_SAMPLED_ENDS = 8
_SHORT = 100
"""Most cells of a line that is smoothed; a longer one follows walls and has few bends anyway."""
_TAUT = 0.5
"""Clearance of a line that is pulled straight as far as its field allows."""


def boundary_line(level: Level, arc: int) -> LongArray:
    """Return the line of a dual edge, along the sides between the cells of its boundary.

    `arc`: index of the arc that the dual edge crosses. Returns int64 (n_cracks + 1, 2), corners
    (row, col) in grid units, from the face of dart 2 arc to that of dart 2 arc + 1. The line of a
    ring ends at its start.
    """
    pairs = np.sort(level.boundary(arc), axis=1)
    sides = [_endpoints_of_side(*pair) for pair in pairs.tolist()]
    sides_at: dict[Corner, list[int]] = {}
    for side, endpoints in enumerate(sides):
        for corner in endpoints:
            sides_at.setdefault(corner, []).append(side)
    base = np.sort(level.base_pairs[arc], axis=0)
    first = int(np.flatnonzero((pairs == base).all(axis=(1, 2)))[0])

    def followed(corner: Corner) -> list[Corner]:
        line, side = [corner], first
        while len(sides_at[corner]) > 1 and _goes_on(level, corner):
            side = sum(sides_at[corner]) - side  # there are two
            if side == first:
                break
            corner = sides[side][corner == sides[side][0]]
            line.append(corner)
        return line

    right, left = sides[first]
    one = followed(right)
    other = [left] if one[-1] == left and len(one) == len(sides) else followed(left)
    return np.array(one[::-1] + other)


def _endpoints_of_side(low: Sequence[int], high: Sequence[int]) -> tuple[Corner, Corner]:
    """Return the endpoints of the side between two cells, right and left of a step up or east."""
    row, col = high
    return ((row, col), (row + 1, col)) if low[0] == row else ((row, col + 1), (row, col))


def _goes_on(level: Level, corner: Corner) -> bool:
    """Return whether a line continues at a corner: no boundaries meet and no hole is touched
    there."""
    row, col = corner
    block = level.field_of[max(row - 1, 0) : row + 1, max(col - 1, 0) : col + 1]
    if block.shape != (2, 2) or (block < 0).any():
        return False
    cracks = (block[0] != block[1]).sum() + (block[:, 0] != block[:, 1]).sum()
    return bool(cracks <= 2)  # noqa: PLR2004 - one boundary makes two


@dataclass(frozen=True, eq=False)
class Boundaries:
    """The dual of a level in the plane. Points are (row, col) in grid units."""

    level: Level

    @cached_property
    def _corners(self) -> list[LongArray]:
        """The line of each dual edge along its boundary; that of a self-loop may end at another
        boundary whose face it shares."""
        return [boundary_line(self.level, arc) for arc in range(self.level.n_arcs)]

    @cached_property
    def _hole_of(self) -> AnyArray:
        """Hole of each cell of the grid, padded with an occupied ring, from 1; 0 elsewhere."""
        occupied = np.pad(self.level.grid.classes == CellClass.OCCUPIED, 1, constant_values=True)
        return np.asarray(ndimage.label(occupied, structure=_ALL_ROUND)[0])

    @cached_property
    def _face_holes(self) -> dict[int, int]:
        holes: dict[int, int] = {}
        loops_last = np.argsort(self.level.is_self_loop, kind="stable")
        for arc in loops_last.tolist():
            for face, (row, col) in self._endpoints(arc):
                hole = int(self._hole_of[row : row + 2, col : col + 2].max())
                if hole and self.level.dual.kinds[face] != FaceKind.ORDINARY:
                    holes.setdefault(face, hole)
        return holes

    @cached_property
    def _face_corners(self) -> dict[int, LongArray]:
        """Corners at which each ordinary face may be drawn: a meeting point, or all of a ring."""
        corners: dict[int, LongArray] = {}
        for arc in np.flatnonzero(~self.level.is_self_loop).tolist():
            line, (one, other) = self._corners[arc], self._endpoints(arc)
            if self._is_ring(arc):
                corners[one[0]] = line[:-1]
                continue
            for face, corner in (one, other):
                if self.level.dual.kinds[face] == FaceKind.ORDINARY:
                    corners[face] = np.array([corner])
        return corners

    def _endpoints(self, arc: int) -> list[tuple[int, Corner]]:
        """Return the faces that a dual edge joins, with the endpoints of its line."""
        endpoints = self._corners[arc][[0, -1]].tolist()
        faces = self.level.dual.edges[arc].tolist()
        return [(face, (row, col)) for face, (row, col) in zip(faces, endpoints, strict=True)]

    def _is_ring(self, arc: int) -> bool:
        one, other = self._endpoints(arc)
        return one == other and _goes_on(self.level, one[1])

    @cached_property
    def lines(self) -> list[FloatArray]:
        """float64 (n, 2) per dual edge: a boundary, or for a self-loop a line across its place."""
        lines = [line.astype(np.float64) for line in self._corners]
        starts: dict[int, FloatArray] = {}
        for loop in np.flatnonzero(self.level.is_self_loop).tolist():
            lines[loop] = self._line_across(loop)
            for (face, _), point in zip(self._endpoints(loop), lines[loop][[0, -1]], strict=True):
                starts.setdefault(face, point)
        for arc in np.flatnonzero(~self.level.is_self_loop).tolist():
            face, _ = self._endpoints(arc)[0]
            if self._is_ring(arc) and face in starts:
                # A ring begins at its dual vertex, where another line meets it.
                at = int(np.abs(lines[arc] - starts[face]).sum(axis=1).argmin())
                lines[arc] = np.concatenate([lines[arc][at:-1], lines[arc][: at + 1]])
        return lines

    def _line_across(self, loop: int) -> FloatArray:
        """Return the shortest path inside its place between the endpoints of a self-loop's dual
        edge.

        The line of its boundary may end at another one, half-way along a shared face.
        """
        field = Field(self.level, int(self.level.arcs[loop, 0]), 1.0)
        middles = field.cells + field.corner + 0.5
        endpoints = []
        for face, _ in self._endpoints(loop):
            distance, nearest = self._tree(face).query(middles, p=np.inf, distance_upper_bound=1.5)
            touching = np.flatnonzero(distance <= 1)
            endpoints.append((touching, self._tree(face).data[np.asarray(nearest)[touching]]))
        (tails, starts), (heads, goals) = endpoints
        if len(tails) == 0 or len(heads) == 0:
            return self._corners[loop].astype(np.float64)
        walks = field.walks_from(tails)
        head = int(walks.length[heads].argmin())
        walk = walks.to(int(heads[head]))
        tail = int(np.flatnonzero((field.cells[tails] == walk[0]).all(axis=1))[0])
        middles = np.concatenate([starts[[tail]], goals[[head]]]) - field.corner - 0.5
        whole = np.concatenate([middles[:1], walk, middles[1:]])
        return smoothed(whole, field.distance, _TAUT) + field.corner + 0.5

    def _tree(self, face: int) -> KDTree:
        """Return the points at which a face may be drawn: its corners, or the cells of its hole."""
        if face not in self._trees:
            if face in self._face_holes:
                points = np.argwhere(self._hole_of == self._face_holes[face]) - 0.5
            else:
                points = self._face_corners[face].astype(np.float64)
            self._trees[face] = KDTree(points)
        return self._trees[face]

    @cached_property
    def _trees(self) -> dict[int, KDTree]:
        return {}

    @cached_property
    def positions(self) -> FloatArray:
        """float64 (n_faces, 2), positions of the dual vertices."""
        positions = np.zeros((self.level.dual.n_faces, 2))
        for line, (right, left) in zip(self.lines, self.level.dual.edges.tolist(), strict=True):
            positions[right], positions[left] = line[0], line[-1]
        for face, hole in self.holes.items():
            positions[face] = hole.position
        return positions

    @cached_property
    def holes(self) -> dict[int, Hole]:
        """The holes, by the index of their face."""
        endpoints: dict[int, list[FloatArray]] = {face: [] for face in self._face_holes}
        for line, faces in zip(self.lines, self.level.dual.edges.tolist(), strict=True):
            for face, point in zip(faces, line[[0, -1]], strict=True):
                if face in endpoints:
                    endpoints[face].append(point)
        windows = ndimage.find_objects(self._hole_of)
        holes = {}
        for face, points in endpoints.items():
            tree, at = self._tree(face), np.array(points)
            name = self._face_holes[face]
            window = windows[name - 1]
            # One cell each for the ring round the grid and the margin, half a cell to its centre.
            low = np.array([part.start for part in window]) - 1.5
            nearest = (tree.data[tree.query(at, p=np.inf)[1]] - low).astype(np.int64)
            outside = self.level.dual.kinds[face] == FaceKind.OUTSIDE
            mask = np.pad(self._hole_of[window] == name, 1)
            holes[face] = Hole.of(mask, nearest, at - low, outside=bool(outside)).moved(low)
        return holes


@dataclass(frozen=True, eq=False)
class Hole:
    """A hole with its dual vertex, and lines from the endpoints of dual edges to it."""

    position: FloatArray
    links: list[FloatArray]
    """One line for each end, from there to the dual vertex."""

    @classmethod
    def of(
        cls, mask: BoolArray, nearest: LongArray, endpoints: FloatArray, *, outside: bool
    ) -> Hole:
        """Find a place for the dual vertex: deep inside a hole, between the endpoints outside.

        `mask`: cells of the hole in a window with a margin of one cell; `nearest`: int64 (n, 2),
        the cell beside each end of a dual edge; `endpoints`: float64 (n, 2), these endpoints;
        `outside`: whether the vertex stands for the outside.
        """
        cells = np.argwhere(mask)
        number = np.full(mask.shape, -1, dtype=np.int64)
        number[tuple(cells.T)] = np.arange(len(cells))
        graph = _links(number)
        hole_of = number[tuple(nearest.T)]
        distance = distance_to_rim(mask)
        if outside:
            sampled = np.unique(hole_of)
            sampled = sampled[:: -(-len(sampled) // _SAMPLED_ENDS)]
            lengths = dijkstra(graph, directed=False, indices=sampled)
            centre = int(lengths.max(axis=0).argmin())
        else:
            centre = int(distance[tuple(cells.T)].argmax())
        length, before = dijkstra(
            graph, directed=False, indices=np.array([centre]), return_predecessors=True
        )
        walks = WalkTree(cells, length[0], before[0])
        links = []
        for cell, end in zip(hole_of.tolist(), endpoints, strict=True):
            walk = np.concatenate([end[None], walks.to(cell)[::-1]])
            short = len(walk) <= _SHORT
            links.append(smoothed(walk, distance, 1.0) if short else rounded(walk))
        return cls(cells[centre].astype(np.float64), links)

    def moved(self, by: FloatArray) -> Hole:
        """Return the hole, moved."""
        return Hole(self.position + by, [link + by for link in self.links])


def _links(number: LongArray) -> Any:
    """Return the moves between 8-neighbours of one hole, and their lengths."""
    padded = np.pad(number, 1, constant_values=-1)
    tails, heads, lengths = [], [], []
    for up, right in STEPS[[2, 0, 1, 3]].tolist():
        beyond = np.roll(padded, (-up, -right), axis=(0, 1))
        linked = (padded >= 0) & (beyond >= 0)
        tails.append(padded[linked])
        heads.append(beyond[linked])
        lengths.append(np.full(len(tails[-1]), hypots(up, right)))
    size = int(number.max()) + 1
    endpoints = np.concatenate(tails), np.concatenate(heads)
    return coo_array((np.concatenate(lengths), endpoints), shape=(size, size)).tocsr()
