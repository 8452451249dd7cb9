"""Pictures of a descent: the fields kept at each level, narrowing to a path."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hybridnav._base.moves import path_length_in_cells
from hybridnav._base.typing import BoolArray, ByteArray, IntArray, PathLike
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.search.descent import KeptFields, WatchedDescent
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, checked_animation, draw_cells, known_view, save_frames
from hybridnav.viz.layout import add_title, frame_axes
from hybridnav.viz.levels import panels
from hybridnav.viz.places import colour_vertices

_MILLISECONDS = 1200
"""Time of a level; the whole path stays three times as long."""
_PARTS, _PART_MILLISECONDS = 8, 150
"""Frames in which the path grows, and the time of each."""


def plot_descent(
    grid: OccupancyGrid,
    descent: WatchedDescent,
    *,
    axes: Sequence[Axes] | None = None,
    columns: int = 3,
    width_in: float = style.FULL_WIDTH_IN,
) -> tuple[Axes, ...]:
    """Draw what a descent kept at each level, from the top down, and at last its path.

    Fields of the route are in full colours, outlined; the others that were kept are pale; the rest
    is white.

    Parameters
    ----------
    grid
        The map. The pictures are cropped to its known part.
    descent
        What `Descent.watch` returned.
    axes
        Axes to draw on, one for each level and one for the path; by default new ones in a new
        figure.
    columns
        Panels in a row of a new figure, >= 1.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    tuple of Axes
        The axes drawn on; `axes[0].figure` is the figure.

    Raises
    ------
    InvalidValueError
        When there are no columns, not as many axes as panels, or the descent is of another map.

    Examples
    --------
    >>> from hybridnav.search.descent import Descent, DescentSettings
    >>> from hybridnav.viz import plot_descent
    >>> grid = hn.example_map("figure1")
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=1.0)
    >>> descent = Descent(pyramid, grid.enterable(), DescentSettings(field_cells=8))
    >>> len(plot_descent(grid, descent.watch((5, 5), (25, 20))))
    3
    """
    titles = _titles(grid, descent)
    if columns < 1:
        raise InvalidValueError(f"expected at least one column, got {columns}: give 1 or more")
    if axes is None:
        axes = panels(known_view(grid), titles, columns, width_in)
    elif len(axes) != len(titles):
        raise InvalidValueError(
            f"{len(axes)} axes were given for {len(titles)} panels: give one for each level, and "
            "one for the path"
        )
    for number, (ax, words) in enumerate(zip(axes, titles, strict=True)):
        _draw(Canvas.opened(ax, width_in, known_view(grid)), grid, descent, number, words)
    return tuple(axes)


def save_descent(
    grid: OccupancyGrid,
    descent: WatchedDescent,
    path: PathLike,
    *,
    width_in: float = style.FULL_WIDTH_IN,
) -> None:
    """Write a descent as an animation: a frame for each level, then the path as it grows.

    Parameters
    ----------
    grid, descent
        As for `plot_descent`.
    path
        A file whose name ends in `.gif`, or in `.html` for a page with a slider; an existing one is
        replaced.
    width_in
        Width in inches; 100 pixels each.

    Raises
    ------
    InvalidValueError
        When the descent is of another map, the name has another ending or the file cannot be
        written.

    Examples
    --------
    >>> from hybridnav.search.descent import Descent, DescentSettings
    >>> from hybridnav.viz import save_descent
    >>> grid = hn.example_map("figure1")
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=1.0)
    >>> descent = Descent(pyramid, grid.enterable(), DescentSettings(field_cells=8))
    >>> save_descent(grid, descent.watch((5, 5), (25, 20)), "descent.gif")
    """
    file, titles = checked_animation(path), _titles(grid, descent)
    times = [_MILLISECONDS] * (len(titles) - 1)
    times += [_PART_MILLISECONDS] * (_PARTS - 1) + [3 * _MILLISECONDS]
    save_frames(_frames(grid, descent, titles, width_in), times, file)


def _frames(
    grid: OccupancyGrid, descent: WatchedDescent, titles: list[list[str]], width_in: float
) -> Iterator[Figure]:
    """Draw one figure after the other; that of the path is drawn on."""
    view = known_view(grid)
    for number, words in enumerate(titles):
        (ax,) = panels(view, [words], 1, width_in)
        line = _draw(Canvas.opened(ax, width_in, view), grid, descent, number, words)
        if line is not None:
            points = grid.frame.points_of(descent.cells)
            for part in range(1, _PARTS):
                line.set_data(*points[: len(points) * part // _PARTS].T)
                yield ax.figure.figure
            line.set_data(*points.T)
        yield ax.figure.figure


def _titles(grid: OccupancyGrid, descent: WatchedDescent) -> list[list[str]]:
    """Return the parts of the title of each panel."""
    if descent.levels[0].field_of.shape != grid.shape:
        raise InvalidValueError(
            f"the descent is of a map of {descent.levels[0].field_of.shape} cells, the grid has "
            f"{grid.shape}: give the map that it went through"
        )
    titles = []
    for kept in descent.levels:
        n, n_route = int(kept.kept.sum()), len(kept.route)
        beside = [] if n == n_route else [f"{n:,} kept"]
        titles.append([f"route of {n_route:,} of {len(kept.kept):,} fields", *beside])
    length_m = path_length_in_cells(descent.cells) * grid.resolution_m
    return [*titles, [f"path of {length_m:.1f} m"]]


def _draw(
    canvas: Canvas, grid: OccupancyGrid, descent: WatchedDescent, number: int, words: list[str]
) -> Line2D | None:
    """Draw a panel: a level, or after the last one the path, whose line is returned."""
    is_path = number == len(descent.levels)
    kept, line = descent.levels[number - is_path], None
    draw_cells(canvas, grid, *_coloured(grid, kept, is_path=is_path))
    width, points = canvas.sizes.line, grid.frame.points_of(descent.cells)
    if is_path:
        line = canvas.add_line(points, color=style.PATH, lw=1.8 * width, zorder=5, gid="path")
    else:
        _outline(canvas, grid, np.isin(kept.field_of, kept.route))
    for point, marker in zip(points[[0, -1]], "os", strict=True):
        canvas.ax.plot(
            *point, marker, ms=5 * width, mfc=style.FREE, mec=style.PATH, mew=1.8 * width, zorder=7
        )
    frame_axes(canvas)
    add_title(canvas, words)
    return line


def _outline(canvas: Canvas, grid: OccupancyGrid, mask: BoolArray) -> None:
    """Draw the outline of some cells: the last fields of a large map are specks without it."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    low = np.array([rows[0], cols[0]]) - 1
    box = np.pad(mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1], 1)
    at = np.indices(box.shape).reshape(2, -1).T + low
    x, y = grid.frame.points_of(at).T.reshape(2, *box.shape)
    width = 0.7 * canvas.sizes.line
    canvas.ax.contour(x, y, box, [0.5], colors=style.INK, linewidths=width, zorder=4)


def _coloured(
    grid: OccupancyGrid, kept: KeptFields, *, is_path: bool
) -> tuple[IntArray, ByteArray]:
    n = len(kept.kept)
    index = colour_vertices(kept.arcs, n)
    table = np.tile(style.rgb(style.FREE), (n + 3, 1))
    pale = style.rgb(*style.PLACES, strength=style.PALE)[index]
    table[:n][kept.kept] = pale[kept.kept]
    route = kept.route
    table[route] = pale[route] if is_path else style.rgb(*style.PLACES)[index[route]]
    table[n:] = style.class_rgb()
    is_kept = np.append(kept.kept, False)[kept.field_of]
    return np.where(is_kept, kept.field_of, n + grid.classes.astype(np.int32)), table
