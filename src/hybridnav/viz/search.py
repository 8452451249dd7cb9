"""Pictures of the convex mesh, and of searches by OMPL."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hybridnav._base.typing import BoolArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.planning import Path
from hybridnav.refine.ompl import Search
from hybridnav.search.mesh import ConvexMesh, build_mesh
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, draw_classes, known_view
from hybridnav.viz.layout import Entry, finish
from hybridnav.viz.maps import ground_entries

_POLYGON, _SIDE = style.PLACES[4], style.PARALLEL
_FULL = 0.45
"""Opacity of polygons."""


def plot_mesh(
    grid: OccupancyGrid,
    mesh: ConvexMesh | None = None,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the convex mesh of free space: its polygons, their sides, and the corners of walls.

    Parameters
    ----------
    grid
        The map. The picture is cropped to its known part.
    mesh
        The mesh of the map; None builds that of its free cells.
    ax
        Axes to draw on; by default new ones in a new figure. Leave room below for the legend.
    title
        Title instead of the counts of polygons and corners; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Raises
    ------
    InvalidValueError
        When the mesh belongs to a map of another size.

    Examples
    --------
    >>> from hybridnav.viz import plot_mesh
    >>> plot_mesh(hn.example_map("figure1"), title="mesh").get_title()
    'mesh'
    """
    mesh = build_mesh(grid.classes == CellClass.FREE) if mesh is None else mesh
    if mesh.polygon_at.shape != grid.shape:
        raise InvalidValueError(
            f"the mesh is of a map of {mesh.polygon_at.shape} cells, the grid has {grid.shape}: "
            "build it from the grid's free cells"
        )
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    line = canvas.sizes.line
    draw_classes(canvas, grid)
    corners = grid.frame.points_of_grid(mesh.corners)
    rings = np.split(corners[mesh.begins], mesh.first[1:-1]) if mesh.n_polygons else []
    fill = PolyCollection(
        rings, facecolors=_POLYGON, alpha=_FULL, linewidths=0, zorder=1, gid="polygons"
    )
    canvas.ax.add_collection(fill, autolim=False)
    _draw_sides(canvas, grid, mesh)
    convex = mesh.is_convex
    look = {"c": style.HOLE, "linewidths": 0, "zorder": 4, "gid": "corners"}
    canvas.add_dots(corners[convex], 1.5 * line, **look)
    dot = Line2D([], [], ls="", marker="o", ms=3.5 * line, mfc=style.HOLE, mec="none")
    entries: list[Entry] = [
        (Patch(fc=_POLYGON, alpha=_FULL), "convex polygon"),
        (Line2D([], [], color=_SIDE, lw=0.8 * line), "side between two"),
        (dot, "corner that paths bend round"),
    ]
    counts = [f"{mesh.n_polygons:,} polygons", f"{int(convex.sum()):,} convex corners"]
    words = [grid.name, *counts] if title is None else [title]
    return finish(canvas, entries + ground_entries(grid), words, framed=True)


def _draw_sides(canvas: Canvas, grid: OccupancyGrid, mesh: ConvexMesh) -> None:
    """Draw the sides that two polygons share, each once."""
    slots = np.flatnonzero(mesh.twins > np.arange(len(mesh.twins)))
    # The twin begins at the end of the side.
    endpoints = np.stack([mesh.begins[slots], mesh.begins[mesh.twins[slots]]], axis=1)
    lines = grid.frame.points_of_grid(mesh.corners[endpoints].reshape(-1, 2)).reshape(-1, 2, 2)
    width = 0.45 * canvas.sizes.line
    canvas.add_lines(lines, colors=_SIDE, linewidths=width, alpha=0.6, zorder=3, gid="sides")


# Pictures of a search by OMPL: states, corridor, and path.

_CORRIDOR = style.PLACES[1]
_STRENGTH = 0.55
_STATE, _EDGE = style.HOLE, style.PARALLEL


def plot_search(  # noqa: PLR0913 - all but the first two have defaults
    grid: OccupancyGrid,
    search: Search | None,
    *,
    corridor: BoolArray | None = None,
    path: Path | None = None,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the states and motions of a search by OMPL, its corridor, and its path.

    Parameters
    ----------
    grid
        The map. The picture is cropped to its known part.
    search
        Valid states that were drawn (dots), and motions of trees or roadmaps (lines); None for a
        search without any, as when a straight line suffices.
    corridor
        bool (rows, cols), the cells that the search could stand on; None for all.
    path
        The path found.
    ax
        Axes to draw on; by default new ones in a new figure. Leave room below for the legend.
    title
        Title instead of the counts of the search; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Raises
    ------
    InvalidValueError
        When the corridor has another shape than the grid.

    Examples
    --------
    >>> from hybridnav.viz import plot_search
    >>> plot_search(hn.example_map("figure1"), None, title="search").get_title()
    'search'
    """
    if corridor is not None:
        corridor = np.asarray(corridor, dtype=np.bool_)
        if corridor.shape != grid.shape:
            raise InvalidValueError(
                f"the corridor has {corridor.shape} cells, the grid has {grid.shape}"
            )
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    _draw_ground(canvas, grid, corridor)
    entries = _draw_states(canvas, search)
    sizes = (0, 0) if search is None else (len(search.states), len(search.edges))
    counts = [f"{sizes[0]:,} states", f"{sizes[1]:,} motions"]
    line = canvas.sizes.line
    if path is not None:
        canvas.add_line(path.points, color=style.PATH, lw=1.8 * line, zorder=5, gid="path")
        entries.append((Line2D([], [], color=style.PATH, lw=1.8 * line), "path"))
    if corridor is not None:
        (colour,) = style.rgb(_CORRIDOR, strength=_STRENGTH) / 255
        entries.append((Patch(fc=colour), "corridor"))
    words = [grid.name, *counts] if title is None else [title]
    return finish(canvas, entries + ground_entries(grid), words, framed=True)


def _draw_states(canvas: Canvas, search: Search | None) -> list[Entry]:
    """Draw the states and motions of a search by OMPL; return legend entries."""
    line = canvas.sizes.line
    entries: list[Entry] = []
    if search is not None and len(search.edges):
        lines = np.array(search.edges, dtype=np.float64).reshape(-1, 2, 2)
        canvas.add_lines(lines, colors=_EDGE, linewidths=0.5 * line, zorder=3, gid="motions")
        entries.append((Line2D([], [], color=_EDGE, lw=1.2 * line), "motions of the trees"))
    if search is not None and len(search.states):
        at = np.array(search.states, dtype=np.float64).reshape(-1, 2)
        canvas.add_dots(at, 1.3 * line, c=_STATE, linewidths=0, zorder=4, gid="states")
        dot = Line2D([], [], ls="", marker="o", ms=3 * line, mfc=_STATE, mec="none")
        entries.append((dot, "states drawn"))
    return entries


def _draw_ground(canvas: Canvas, grid: OccupancyGrid, corridor: BoolArray | None) -> None:
    """Draw the cells by class, with a tint for those of the corridor."""
    index = grid.classes.astype(np.int64)
    if corridor is not None:
        index[corridor] = 3
    tint = style.rgb(_CORRIDOR, strength=_STRENGTH)
    draw_cells(canvas, grid, index, np.concatenate([style.class_rgb(), tint]))
