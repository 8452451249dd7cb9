"""Pictures of a search: states or intervals, corridor, and path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hybridnav.errors import InvalidValueError
from hybridnav.mesh import SearchTrace
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, known_view
from hybridnav.viz.layout import finish
from hybridnav.viz.maps import ground_entries
from hybridnav.viz.mesh import check_mesh, draw_intervals

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hybridnav._typing import BoolArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.refine.ompl import Search
    from hybridnav.result import Path
    from hybridnav.viz.layout import Entry

_CORRIDOR = style.PLACES[1]
_STRENGTH = 0.55
_STATE, _EDGE = style.HOLE, style.PARALLEL


def plot_search(  # noqa: PLR0913 - all but the first two have defaults
    grid: OccupancyGrid,
    search: Search | SearchTrace | None,
    *,
    corridor: BoolArray | None = None,
    path: Path | None = None,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the states or intervals of a search, its corridor, and its path.

    For a search by OMPL, the picture shows states and motions; for a search of the mesh, the view
    through each interval, coloured in the order of discovery, and the roots of the views.

    Parameters
    ----------
    grid
        The map. The picture is cropped to its known part.
    search
        By OMPL: valid states that were drawn (dots), and motions of trees or roadmaps (lines); None
        for a search without any, as when a straight line suffices. On the mesh: the result of
        `trace_search`.
    corridor
        bool (rows, cols), the cells that the search could stand on; None for all.
    path
        The path found; a search of the mesh has its own.
    ax
        Axes to draw on; by default new ones in a new figure. Leave room below for the legend.
    title
        Title instead of the counts of the search; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

    Raises
    ------
    InvalidValueError
        When the corridor or the mesh has another shape than the grid.

    Examples
    --------
    >>> from hybridnav.mesh import build_mesh, trace_search
    >>> from hybridnav.viz import plot_search
    >>> grid = hn.example_map("figure1")
    >>> endpoints = (5, 5), (25, 20)
    >>> centres = tuple((row + 0.5, col + 0.5) for row, col in endpoints)
    >>> trace = trace_search(build_mesh(grid.enterable()), endpoints, centres)
    >>> plot_search(grid, trace, title="search").get_title()
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
    if isinstance(search, SearchTrace):
        check_mesh(grid, search.mesh)
        entries = draw_intervals(canvas, grid, search)
        counts = [f"{len(search.parents):,} intervals", f"{search.path.expanded:,} expanded"]
    else:
        entries = _draw_states(canvas, search)
        sizes = (0, 0) if search is None else (len(search.states), len(search.edges))
        counts = [f"{sizes[0]:,} states", f"{sizes[1]:,} motions"]
    line = canvas.sizes.line
    if path is not None:
        drawn = Line2D(*path.points.T, color=style.PATH, lw=1.8 * line, zorder=5, gid="path")
        canvas.ax.add_line(drawn)
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
        x, y = np.array(search.states, dtype=np.float64).reshape(-1, 2).T
        size = (1.3 * line) ** 2
        canvas.ax.scatter(x, y, s=size, c=_STATE, linewidths=0, zorder=4, gid="states")
        dot = Line2D([], [], ls="", marker="o", ms=3 * line, mfc=_STATE, mec="none")
        entries.append((dot, "states drawn"))
    return entries


def _draw_ground(canvas: Canvas, grid: OccupancyGrid, corridor: BoolArray | None) -> None:
    """Draw the cells by class, with a tint for those of the corridor."""
    index = grid.classes.astype(np.int64)
    if corridor is not None:
        index[corridor] = 3
    colours = np.concatenate(
        [
            style.rgb(style.BLOCKED, style.FREE, style.UNEXPLORED),
            style.rgb(_CORRIDOR, strength=_STRENGTH),
        ]
    )
    draw_cells(canvas, grid, index, colours)
