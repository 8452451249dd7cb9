"""The picture of a path beside a shortest one, on the part of the map round them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, View, draw_cells, known_view
from hybridnav.viz.labels import Marker, draw_markers
from hybridnav.viz.layout import finish
from hybridnav.viz.maps import ground_entries
from hybridnav.viz.plan import PATH_WIDTH, draw_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from hybridnav._typing import FloatArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.viz.layout import Entry

_MARGIN = 0.08
"""Map shown round the paths, as a share of their longer side."""
_LEAST_MARGIN_CELLS = 4
_LEAST_ASPECT = 0.45
"""Shorter side of a picture at least, in longer ones."""
_SHORTEST_WIDTH, _SHORTEST_DASHES = 1.3, (0.0, (2.5, 1.5))


def plot_paths(  # noqa: PLR0913 - all but two have defaults
    grid: OccupancyGrid,
    path: ArrayLike,
    shortest: ArrayLike | None = None,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw a path and a shortest one between the same endpoints, on the part of the map round them.

    Parameters
    ----------
    grid
        The map.
    path
        Points from start to goal, shape (n, 2), `(x, y)` in metres, map frame; without any the
        known part of the map is drawn.
    shortest
        Points of a shortest path, drawn dashed; by default there is none.
    ax
        Where to draw; by default new axes in a new figure. Leave room below for the legend.
    title
        Title of the picture; by default the map's name.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

    Raises
    ------
    InvalidValueError
        When points are not finite pairs.

    Examples
    --------
    >>> from hybridnav.viz import plot_paths
    >>> plot_paths(hn.example_map("figure1"), [(0.5, 0.5), (2.0, 2.5)], title="path").get_title()
    'path'
    """
    lines = [_checked(path), _checked([] if shortest is None else shortest)]
    points = np.concatenate(lines)
    canvas = Canvas.opened(ax, width_in, _view_round(grid, points))
    # Occupied and blocked cells have colours of their own: only two classes are looked up.
    colours = style.rgb(style.BLOCKED, style.FREE, style.UNEXPLORED)
    draw_cells(canvas, grid, grid.classes, colours)
    entries: list[Entry] = []
    width = canvas.sizes.line
    if len(lines[0]):
        draw_path(canvas, lines[0])
        entries.append((Line2D([], [], color=style.PATH, lw=PATH_WIDTH * width), "path"))
    if len(lines[1]):
        line = Line2D(
            *lines[1].T,
            color=style.PARALLEL,
            linewidth=_SHORTEST_WIDTH * width,
            linestyle=_SHORTEST_DASHES,
            zorder=7.5,
            gid="shortest",
        )
        canvas.ax.add_line(line)
        entries.append((line, "shortest path"))
    endpoints = next((line[[0, -1]] for line in lines if len(line)), np.empty((0, 2)))
    markers = [Marker(name, end) for name, end in zip(("start", "goal"), endpoints, strict=False)]
    draw_markers(canvas, markers, lines)
    if (grid.classes == CellClass.UNEXPLORED).any():
        entries.append((Patch(fc=style.UNEXPLORED), "unexplored"))
    words = [grid.name if title is None else title]
    return finish(canvas, entries + ground_entries(grid), words, framed=True)


def _checked(given: ArrayLike) -> FloatArray:
    points = np.asarray(given, dtype=np.float64)
    if points.size == 0:
        return np.empty((0, 2))
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():  # noqa: PLR2004
        raise InvalidValueError(
            f"a path must be finite points of shape (n, 2), got shape {points.shape}"
        )
    return points


def _view_round(grid: OccupancyGrid, points: FloatArray) -> View:
    """Return the rectangle round points, with a margin, not too narrow, no larger than the map."""
    if not len(points):
        return known_view(grid)
    corners = grid.frame.points_of_grid(np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) * grid.shape)
    lowest, highest = corners.min(axis=0), corners.max(axis=0)
    inside = points.clip(lowest, highest)
    low, high = inside.min(axis=0), inside.max(axis=0)
    longer = float((high - low).max())
    margin = max(_LEAST_MARGIN_CELLS * grid.resolution_m, _MARGIN * longer)
    lacking = _LEAST_ASPECT * (longer + 2 * margin) - (high - low + 2 * margin)
    grown = margin + np.maximum(lacking, 0) / 2
    return View(np.maximum(low - grown, lowest), np.minimum(high + grown, highest))
