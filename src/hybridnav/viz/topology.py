"""Pictures of graphs over their map: the topological map, and its simple graph."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from hybridnav._base.rows import unique_rows
from hybridnav._base.trig import hypots
from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.pyramid import Level
from hybridnav.pyramid.graphs import report_of
from hybridnav.topology import TopologicalMap
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, known_view
from hybridnav.viz.fields import Field, Loops, distance_to_rim, smoothed
from hybridnav.viz.layout import Entry, finish
from hybridnav.viz.places import are_large
from hybridnav.viz.style import Sizes

MAX_VERTICES = 20_000
"""Vertices of a level beyond which its graph is not drawn: it would be one grey area."""
LEAST_AREA_M2 = 0.1
"""Area in square metres below which places, and the holes inside self-loops, are noise."""
FAINT = 0.4
"""Share of its colour that the map keeps under a graph."""
_DASHED: dict[str, Any] = {"linestyles": [style.SELF_LOOP_DASHES], "capstyle": "butt"}
_CLEARANCE = 3.2  # points on a picture of full width
_LEAST_CLEARANCE = 1.5  # cells: less would follow their steps


@dataclass(frozen=True, eq=False)
class Graph:
    """The visible part of a level: places and arcs that are no noise."""

    level: Level
    least_area_m2: float

    @cached_property
    def positions(self) -> FloatArray:
        """float64 (n_vertices, 2), surviving cells, `(x, y)` in metres."""
        return self.level.grid.frame.points_of(self.level.cells)

    @cached_property
    def seen(self) -> BoolArray:
        """Mask of the drawn vertices, always including the largest."""
        return are_large(self.level, self.least_area_m2)

    @cached_property
    def plain(self) -> BoolArray:
        """Arcs drawn between two vertices."""
        return self.seen[self.level.arcs].all(axis=1) & ~self.level.is_self_loop

    @cached_property
    def parallel(self) -> BoolArray:
        """Mask of the arcs with others between the same two vertices."""
        groups = report_of(self.level.arcs, self.level.n_vertices).parallel
        parallel = np.zeros(self.level.n_arcs, dtype=np.bool_)
        parallel[[arc for group in groups for arc in group.arcs]] = True
        return parallel & self.plain

    def kinds(self) -> list[tuple[BoolArray, str, str]]:
        """Return the masks of arcs with colours and names, the most visible ones last."""
        explored = (self.level.classes == CellClass.FREE)[self.level.arcs].all(axis=1)
        single = self.plain & ~self.parallel
        return [
            (single & ~explored, style.RIM_ARC, "unexplored-arcs"),
            (single & explored, style.INK, "arcs"),
            (self.parallel, style.PARALLEL, "parallel-arcs"),
            (self.level.is_self_loop, style.SELF_LOOP, "self-loops"),
        ]

    def curves(self, clearance_m: float) -> dict[int, FloatArray]:
        """Return a curve for each arc and self-loop drawn, `(x, y)` in metres.

        `clearance_m`: distance that curves keep from obstacles, where there is room.
        """
        level, cell_m = self.level, self.level.grid.resolution_m
        least = self.least_area_m2 / cell_m**2
        endpoints = level.arcs[self.plain | level.is_self_loop]
        wide = max(clearance_m / cell_m, _LEAST_CLEARANCE)
        fields = {vertex: Field(level, vertex, wide) for vertex in np.unique(endpoints).tolist()}
        curves = {}
        for arc in np.flatnonzero(self.plain).tolist():
            one, other = (fields[vertex] for vertex in level.arcs[arc].tolist())
            curves[arc] = Arc(one, other, level.boundary(arc)).curve()
        looped = level.arcs[level.is_self_loop, 0]
        for vertex in np.unique(looped[self.seen[looped]]).tolist():
            loops = Loops(fields[vertex])
            large = [arc for arc, inside in loops.enclosed.items() if inside.sum() >= least]
            curves |= {arc: loops.curve(arc) for arc in large}
        return {arc: level.grid.frame.points_of_grid(curve) for arc, curve in curves.items()}


def plot_topology(  # noqa: PLR0913 - all but the first have defaults
    places: Level | TopologicalMap,
    *,
    ax: Axes | None = None,
    simple: bool = False,
    least_area_m2: float = LEAST_AREA_M2,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the graph of places over a faint map: free places black, unexplored ones grey.

    An arc runs from one position to the other inside its two places and across its own boundary,
    straight if there is room. Parallel arcs pass the obstacle between them on different sides. A
    self-loop is a closed curve inside its place round the holes that it encloses, or a petal
    towards holes that are too small to go round. Arcs to unexplored places are lighter.

    Parameters
    ----------
    places
        The topological map, or any level of a pyramid.
    ax
        Axes to draw on; by default new ones in a new figure. Leave room below for the legend.
    simple
        Whether to draw the simple graph: one straight line for two adjacent places, no self-loops.
    least_area_m2
        Places under this area in square metres, their arcs, and self-loops round less than it are
        not drawn; the title counts such places.
    title
        Title instead of the map's name and the counts; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Raises
    ------
    InvalidValueError
        When the level has more than 20,000 vertices.

    Examples
    --------
    >>> from hybridnav.viz import plot_topology
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"))
    >>> plot_topology(hn.TopologicalMap(pyramid), title="graph").get_title()
    'graph'
    """
    level = drawable(places)
    canvas = Canvas.opened(ax, width_in, known_view(level.grid))
    draw_ground(canvas, level.grid, level.grid.classes, style.class_rgb())
    graph = Graph(level, least_area_m2)
    draw_graph(canvas, graph, simple=simple)
    words = _words(graph, simple=simple) if title is None else [title]
    return finish(canvas, graph_entries(graph, canvas.sizes, simple=simple), words, framed=True)


def drawable(places: Level | TopologicalMap) -> Level:
    """Return the level to draw, after a check of its number of vertices."""
    level = places.level if isinstance(places, TopologicalMap) else places
    if level.n_vertices > MAX_VERTICES:
        raise InvalidValueError(
            f"a graph is drawn up to {MAX_VERTICES} vertices, level {level.index} has "
            f"{level.n_vertices}: draw a higher level, or plot_level, which draws fields"
        )
    return level


def draw_ground(
    canvas: Canvas, grid: OccupancyGrid, index: AnyArray, colours: ByteArray, share: float = FAINT
) -> None:
    """Draw the cells, `colours[index]` each, with a share of their colour."""
    draw_cells(canvas, grid, index, colours)
    canvas.ax.images[-1].set_alpha(share)


def draw_graph(canvas: Canvas, graph: Graph, *, simple: bool) -> None:
    """Draw arcs, self-loops and places."""
    sizes, level = canvas.sizes, graph.level
    width, metre = 1.1 * sizes.line, sizes.points_per_metre
    look = {"linewidths": width, "capstyle": "round", "joinstyle": "round", "zorder": 3}
    if simple:
        pairs = unique_rows(np.sort(level.arcs[graph.plain], axis=1)).rows
        canvas.add_lines(graph.positions[pairs], colors=style.INK, **look, gid="edges")
    else:
        curves = graph.curves(_CLEARANCE * sizes.line / metre)
        for mask, colour, gid in graph.kinds():
            own = _DASHED if gid == "self-loops" else {}
            lines = [curves[arc] for arc in np.flatnonzero(mask).tolist() if arc in curves]
            canvas.add_lines(lines, colors=colour, **look | own, gid=gid)
    free = level.classes == CellClass.FREE
    for mask, colour, size, gid in (
        (~free, style.UNEXPLORED_NODE, 4.2, "unexplored-dots"),
        (free, style.INK, 5.2, "free-dots"),
    ):
        at, rim = graph.positions[mask & graph.seen], 0.5 * sizes.line
        dots = {"c": colour, "edgecolors": style.FREE, "linewidths": rim}
        canvas.add_dots(at, size * sizes.line, **dots, zorder=4, gid=gid)


def _words(graph: Graph, *, simple: bool) -> list[str]:
    """Return the parts of the title."""
    level = graph.level
    n_free = int((level.classes == CellClass.FREE).sum())
    words = [level.grid.name, f"{n_free} free and {level.n_vertices - n_free} unexplored places"]
    report = report_of(level.arcs, level.n_vertices)
    if simple:
        words.append(f"{report.n_edges} edges")
        words.append(f"parallel arcs dropped: {report.n_parallel_dropped}")
        words.append(f"self-loops dropped: {report.n_self_loops_dropped}")
    else:
        words.append(f"{level.n_arcs} arcs")
    hidden = int((~graph.seen).sum())
    if hidden:
        words.append(f"places under {graph.least_area_m2:g} m² not drawn: {hidden}")
    return words


def graph_entries(graph: Graph, sizes: Sizes, *, simple: bool) -> list[Entry]:
    """Return the legend entries for places and arcs."""
    free = graph.level.classes == CellClass.FREE
    entries: list[Entry] = []
    for mask, colour, label in (
        (free, style.INK, "free place"),
        (~free, style.UNEXPLORED_NODE, "unexplored place"),
    ):
        if (mask & graph.seen).any():
            dot = Line2D([], [], ls="", marker="o", ms=5.0 * sizes.line, color=colour, mec="none")
            entries.append((dot, label))
    width = 1.4 * sizes.line
    plain = graph.plain & ~graph.parallel | simple
    if plain.any():
        entries.append((Line2D([], [], color=style.INK, lw=width), "edge" if simple else "arc"))
    if not simple and graph.parallel.any():
        entries.append((Line2D([], [], color=style.PARALLEL, lw=width), "parallel arcs"))
    if not simple and graph.level.is_self_loop.any():
        loop = Line2D([], [], color=style.SELF_LOOP, lw=width, ls=style.SELF_LOOP_DASHES)
        entries.append((loop, "self-loop"))
    return entries


# Arcs as curves: inside their two places, across their own boundary.

_WIDER = 1.5
"""Factor on the clearance of arcs over that of self-loops, so that one may pass the other."""
_PER_CELL = 4
"""Points per cell at which a straight arc is tested."""
_NEAR_END = 2.0
"""Clearances from its ends within which a straight arc may come close to a wall."""
_SLIPPED = 2.0
"""Cells from its boundary beyond which a crossing belongs to another boundary."""


@dataclass(frozen=True, eq=False)
class Arc:
    """An arc between two places, drawn inside their fields."""

    one: Field
    other: Field
    boundary: LongArray
    """int64 (n, 2, 2), pairs of cells in the grid, the first in the field of `one`."""

    @property
    def clearance(self) -> float:
        """Distance that a curve keeps from cells in neither field where there is room, in cells."""
        return _WIDER * self.one.clearance

    @cached_property
    def corner(self) -> LongArray:
        """(row, col) of the first cell of the window round both fields."""
        return np.minimum(self.one.corner, self.other.corner)

    @cached_property
    def owner(self) -> LongArray:
        """Field of each cell in the window: 1, 2, or 0 for neither."""
        endpoints = [field.corner + field.mask.shape for field in (self.one, self.other)]
        owner = np.zeros(np.maximum(*endpoints) - self.corner, dtype=np.int64)
        for name, field in ((1, self.one), (2, self.other)):
            owner[tuple((field.cells + field.corner - self.corner).T)] = name
        return owner

    @cached_property
    def distance(self) -> FloatArray:
        """Distance of each cell to the nearest one in neither field."""
        return distance_to_rim(self.owner > 0)

    def curve(self) -> FloatArray:
        """Return a curve from one surviving cell to the other.

        The curve is straight if both fields have room for it, else it is the smoothed shortest walk
        across the boundary, so that arcs on two sides of an obstacle run on two sides of it.

        Returns float64 (n, 2), (row, col) in grid units, where cell (0, 0) spans [0, 1] x [0, 1].
        """
        line = self._straight()
        if self._has_room(line) and self._crosses(line):
            return line[[0, -1]] + self.corner + 0.5
        walk = self._walk()
        curve = smoothed(walk, self.distance, self.clearance)
        return (curve if self._crosses(curve) else walk) + self.corner + 0.5

    def _straight(self) -> FloatArray:
        fields = (self.one, self.other)
        start, end = (field.level.cells[field.vertex] - self.corner for field in fields)
        count = int(_PER_CELL * hypots(*(end - start))) + 2
        return np.linspace(start, end, count)

    def _has_room(self, line: FloatArray) -> bool:
        """Return whether a straight line keeps the clearance of a curve."""
        along = hypots(*(line - line[0]).T)
        inner = np.minimum(along, along[-1] - along) > _NEAR_END * self.clearance
        room = self.distance[tuple(np.rint(line).astype(np.int64).T)]
        return bool((room > 0).all() and (room[inner] >= self.clearance).all())

    def _crosses(self, curve: FloatArray) -> bool:
        """Return whether a curve crosses the boundary, and any other boundary there and back."""
        cells = np.rint(curve).astype(np.int64)
        owner = self.owner[tuple(cells.T)]
        cells, owner = cells[owner > 0], owner[owner > 0]
        at = np.flatnonzero(np.diff(owner))
        middles = self.boundary.mean(axis=1) - self.corner
        off = (cells[at] + cells[at + 1])[:, None] / 2 - middles
        own = hypots(*np.moveaxis(off, -1, 0)).min(axis=1) <= _SLIPPED
        return bool(own.sum() % 2 == 1)

    def _walk(self) -> FloatArray:
        """Return the cells of the shortest walk across the boundary."""
        halves = []
        for field, cells in zip((self.one, self.other), self.boundary.swapaxes(0, 1), strict=True):
            halves.append(field.number[tuple((cells - field.corner).T)])
        lengths = self.one.walks.length[halves[0]] + self.other.walks.length[halves[1]]
        best = int(lengths.argmin())
        out = self.one.walks.to(int(halves[0][best])) + self.one.corner
        back = self.other.walks.to(int(halves[1][best])) + self.other.corner
        return np.concatenate([out, back[::-1]]) - self.corner
