"""Pictures of rooms: areas with names on them, and doors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import patheffects
from matplotlib.lines import Line2D
from matplotlib.text import Text
from scipy import ndimage

from hybridnav.errors import InvalidValueError
from hybridnav.grid import NO_ROOM
from hybridnav.topology import Rooms, TopologicalMap
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, known_view
from hybridnav.viz.colouring import colour_vertices
from hybridnav.viz.layout import add_legend, add_scale_bar, add_title, fit_height
from hybridnav.viz.maps import ground_entries, swatch

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hybridnav._typing import ByteArray, FloatArray, IntArray
    from hybridnav.grid import OccupancyGrid, RoomLabels
    from hybridnav.planner import Tour
    from hybridnav.viz.layout import Entry

_LEAST_DOOR_M = 0.3
"""Narrower doors are not drawn: a scan's noise makes many."""


def plot_rooms(  # noqa: PLR0913 - all but the first have defaults
    rooms: RoomLabels | TopologicalMap,
    grid: OccupancyGrid | None = None,
    *,
    ax: Axes | None = None,
    names: bool = True,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw rooms in colours that differ between neighbours, with names, doors as dots, scale bar.

    Parameters
    ----------
    rooms
        Labels of a grid; or a topological map with rooms, whose doors are then drawn too.
    grid
        The map; needed with labels, which come without one.
    ax
        Where to draw; by default new axes in a new figure.
    names
        Write the names.
    title
        Replaces the title that names the map and counts rooms; an empty one leaves it out.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

    Raises
    ------
    InvalidValueError
        When labels come without their map or with one of another shape, or a topological map has
        no rooms.
    """
    view, labels, grid = _view_of(rooms, grid)
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    draw_cells(canvas, grid, labels.label_of, _colours(labels.label_of, len(labels.names)))
    entries: list[Entry] = [(swatch(style.PLACES), "rooms"), *ground_entries(grid)]
    words = [grid.name, f"{len(labels.names)} rooms"]
    if view is not None:
        entries.append((_draw_doors(canvas, view), "doors"))
        words.append(f"{len(view.doors)} doors")
    if names:
        _write_names(canvas, labels, grid)
    add_title(canvas, words if title is None else [title])
    canvas.ax.set_axis_off()
    bar = add_scale_bar(canvas)
    legend = add_legend(canvas, entries, bar=bar, below=0.35 * canvas.sizes.font)
    fit_height(canvas, legend)
    return canvas.ax


def _view_of(
    rooms: RoomLabels | TopologicalMap, grid: OccupancyGrid | None
) -> tuple[Rooms | None, RoomLabels, OccupancyGrid]:
    """The rooms with their doors, where they come from a topological map; labels; the map."""
    if isinstance(rooms, TopologicalMap):
        return rooms.rooms, rooms.rooms.labels, rooms.grid
    if grid is None:
        raise InvalidValueError("labels of rooms are drawn with their map: give the grid too")
    if rooms.label_of.shape != grid.shape:
        raise InvalidValueError(
            f"rooms are labels of {rooms.label_of.shape} cells, the grid has {grid.shape}"
        )
    return None, rooms, grid


def plot_tour(
    topology: TopologicalMap,
    tour: Tour,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw a way through rooms: the rooms as `plot_rooms` does, and the paths from stop to stop.

    Parameters
    ----------
    topology
        The map with rooms.
    tour
        The way; without a path only the rooms are drawn, and the title says why.
    ax
        Where to draw; by default new axes in a new figure.
    title
        Replaces the title that names the map and tells the length; an empty one leaves it out.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.
    """
    told = f"{tour.length_m:.1f} m" if tour.solved else str(tour.status)
    words = f"{topology.grid.name}  ·  {told}" if title is None else title
    ax = plot_rooms(topology, ax=ax, title=words, width_in=width_in)
    for result in tour.results:
        if result.path is None:
            continue
        line = Line2D(*result.path.points.T, color=style.PATH, linewidth=1.6, zorder=7)
        line.set_gid("path")
        ax.add_line(line)
        ends = Line2D(
            *result.path.points[[0, -1]].T,
            color=style.PATH,
            marker="o",
            markerfacecolor=style.FREE,
            linestyle="none",
            markersize=5.0,
            zorder=8,
        )
        ends.set_gid("stops")
        ax.add_line(ends)
    return ax


def _colours(label_of: IntArray, n_rooms: int) -> ByteArray:
    """RGB per room and one row more, white for no room."""
    pairs = [np.empty((0, 2), dtype=np.int64)]
    for tail, head in ((label_of[:, :-1], label_of[:, 1:]), (label_of[:-1], label_of[1:])):
        between = (tail != head) & (tail != NO_ROOM) & (head != NO_ROOM)
        pairs.append(np.stack([tail[between], head[between]], axis=1))
    arcs = np.unique(np.concatenate(pairs), axis=0).astype(np.int32)
    index = colour_vertices(arcs, n_rooms)
    return np.concatenate([style.rgb(*style.PLACES)[index], style.rgb(style.FREE)])


def _draw_doors(canvas: Canvas, rooms: Rooms) -> Line2D:
    """Draw doors as dots; gives one for the legend."""
    at = [door.position for door in rooms.doors if door.width_m >= _LEAST_DOOR_M]
    dots, sample = (
        Line2D(
            [x for x, _ in points],
            [y for _, y in points],
            color=style.PATH,
            marker="o",
            markersize=2.4 * canvas.sizes.line,
            linestyle="none",
            zorder=6,
        )
        for points in (at, [])
    )
    dots.set_gid("doors")
    canvas.ax.add_line(dots)
    return sample


def _write_names(canvas: Canvas, labels: RoomLabels, grid: OccupancyGrid) -> None:
    """Write each name in the middle of its room: where the room's own rim is farthest."""
    boxes = ndimage.find_objects(labels.label_of + 1, len(labels.names))
    for label, (name, window) in enumerate(zip(labels.names, boxes, strict=True)):
        if window is None:
            continue
        point = _middle(labels.label_of[window] == label, window, grid)
        text = Text(
            float(point[0]),
            float(point[1]),
            name,
            fontsize=0.75 * canvas.sizes.font,
            color=style.INK,
            horizontalalignment="center",
            verticalalignment="center",
            parse_math=False,
            path_effects=[patheffects.withStroke(linewidth=1.5, foreground=style.FREE)],
            zorder=9,
        )
        text.set_gid(f"room-{label}")
        canvas.ax.add_artist(text)


def _middle(
    inside: np.ndarray[tuple[int, ...], np.dtype[np.bool_]],
    window: tuple[slice, ...],
    grid: OccupancyGrid,
) -> FloatArray:
    depth = ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1]
    row, col = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return grid.frame.points_of((int(row) + window[0].start, int(col) + window[1].start))
