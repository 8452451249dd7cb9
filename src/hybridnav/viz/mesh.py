"""Pictures of the convex mesh, and of the search of its intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.grid.runs import unique_rows
from hybridnav.mesh import build_mesh
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, known_view
from hybridnav.viz.layout import finish
from hybridnav.viz.maps import ground_entries

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hybridnav._typing import FloatArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.mesh import ConvexMesh, SearchTrace
    from hybridnav.viz.layout import Entry

_ORDER = LinearSegmentedColormap.from_list("order", ["#fff0b8", "#7cc3b5", "#2a5b9e"])
"""Colours of intervals from the first to the last: falling in lightness, for every kind of colour
vision and in grey."""
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

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

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
    check_mesh(grid, mesh)
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    line = canvas.sizes.line
    colours = style.rgb(style.BLOCKED, style.FREE, style.UNEXPLORED)
    draw_cells(canvas, grid, grid.classes, colours)
    corners = grid.frame.points_of_grid(mesh.corners)
    rings = np.split(corners[mesh.begins], mesh.first[1:-1]) if mesh.n_polygons else []
    fill = PolyCollection(
        rings, facecolors=_POLYGON, alpha=_FULL, linewidths=0, zorder=1, gid="polygons"
    )
    canvas.ax.add_collection(fill, autolim=False)
    draw_sides(canvas, grid, mesh)
    convex = mesh.is_convex
    x, y = corners[convex].T
    size = (1.5 * line) ** 2
    canvas.ax.scatter(x, y, s=size, c=style.HOLE, linewidths=0, zorder=4, gid="corners")
    dot = Line2D([], [], ls="", marker="o", ms=3.5 * line, mfc=style.HOLE, mec="none")
    entries: list[Entry] = [
        (Patch(fc=_POLYGON, alpha=_FULL), "convex polygon"),
        (Line2D([], [], color=_SIDE, lw=0.8 * line), "side between two"),
        (dot, "corner that paths bend round"),
    ]
    counts = [f"{mesh.n_polygons:,} polygons", f"{int(convex.sum()):,} convex corners"]
    words = [grid.name, *counts] if title is None else [title]
    return finish(canvas, entries + ground_entries(grid), words, framed=True)


def check_mesh(grid: OccupancyGrid, mesh: ConvexMesh) -> None:
    """Raise `InvalidValueError` if a mesh belongs to a map of another size."""
    if mesh.polygon_at.shape != grid.shape:
        raise InvalidValueError(
            f"the mesh is of a map of {mesh.polygon_at.shape} cells, the grid has {grid.shape}: "
            "build it from the grid's free cells"
        )


def draw_sides(canvas: Canvas, grid: OccupancyGrid, mesh: ConvexMesh) -> None:
    """Draw the sides that two polygons share, each once."""
    slots = np.flatnonzero(mesh.twins > np.arange(len(mesh.twins)))
    # The twin begins at the end of the side.
    endpoints = np.stack([mesh.begins[slots], mesh.begins[mesh.twins[slots]]], axis=1)
    lines = grid.frame.points_of_grid(mesh.corners[endpoints].reshape(-1, 2)).reshape(-1, 2, 2)
    width = 0.45 * canvas.sizes.line
    canvas.add_lines(lines, colors=_SIDE, linewidths=width, alpha=0.6, zorder=3, gid="sides")


def draw_intervals(canvas: Canvas, grid: OccupancyGrid, trace: SearchTrace) -> list[Entry]:
    """Draw the views of a search, the roots, and the path; return legend entries."""
    line, ax = canvas.sizes.line, canvas.ax
    draw_sides(canvas, grid, trace.mesh)
    n = len(trace.parents)
    views = _views(trace)
    rings = grid.frame.points_of_grid(views.reshape(-1, 2)).reshape(-1, 4, 2)
    shades = _ORDER(np.linspace(0, 1, max(n, 2))[:n])
    cones = PolyCollection(list(rings), facecolors=shades, linewidths=0, zorder=2, gid="views")
    ax.add_collection(cones, autolim=False)
    x, y = grid.frame.points_of_grid(unique_rows(trace.roots).rows).T
    ax.scatter(x, y, s=(2.4 * line) ** 2, c=style.HOLE, linewidths=0, zorder=5, gid="roots")
    swatches = tuple(Patch(fc=_ORDER(share)) for share in (0.0, 0.5, 1.0))
    dot = Line2D([], [], ls="", marker="o", ms=3.5 * line, mfc=style.HOLE, mec="none")
    entries: list[Entry] = [
        (swatches, "seen through intervals, first to last"),
        (dot, "root"),
        (Line2D([], [], color=_SIDE, lw=0.8 * line), "side of a polygon"),
    ]
    endpoints = grid.frame.points_of_grid(trace.endpoints)
    if trace.path.positions is not None:
        points = grid.frame.points_of_grid(trace.path.positions)
        ax.add_line(Line2D(*points.T, color=style.PATH, lw=1.8 * line, zorder=6, gid="path"))
        entries.append((Line2D([], [], color=style.PATH, lw=1.8 * line), "shortest path"))
    for point, marker in zip(endpoints, "os", strict=True):
        ax.plot(
            *point, marker, ms=5 * line, mfc=style.FREE, mec=style.PATH, mew=1.4 * line, zorder=7
        )
    return entries


def _views(trace: SearchTrace) -> FloatArray:
    """Return the view that each interval adds, float64 (n, 4, 2) in grid units.

    The view is the part of the polygon before it that lies between its rays.
    """
    far = trace.intervals
    near = np.repeat(trace.roots[:, None], 2, axis=1)
    later = np.flatnonzero(trace.parents >= 0)
    before = trace.parents[later]
    # With the parent's root the view begins at the parent's interval, else at the new root.
    kept = (trace.roots[later] == trace.roots[before]).all(axis=1)
    later, before = later[kept], before[kept]
    for end in (0, 1):
        near[later, end] = _met(trace.roots[later], far[later, end], trace.intervals[before])
    views: FloatArray = np.concatenate([far, near[:, ::-1]], axis=1)
    return views


def _met(roots: FloatArray, points: FloatArray, intervals: FloatArray) -> FloatArray:
    """Return the points where segments from roots to points cross intervals; a root that lies on
    one."""
    along, drawn = intervals[:, 1] - intervals[:, 0], points - roots
    off = intervals[:, 0] - roots
    cross = drawn[:, 0] * along[:, 1] - drawn[:, 1] * along[:, 0]
    reach = off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]
    share = np.divide(reach, cross, out=np.zeros(len(cross)), where=cross != 0)
    met: FloatArray = roots + share.clip(0, 1)[:, None] * drawn
    return met
