"""Pictures of rooms: areas with names on them, and doors with numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, OccupancyGrid, RoomLabels
from hybridnav.rooms import Door, Rooms
from hybridnav.topology import TopologicalMap
from hybridnav.viz import style
from hybridnav.viz.canvas import MAX_HEIGHT, Canvas, draw_cells, known_view, new_figure
from hybridnav.viz.labels import RoomWriter
from hybridnav.viz.layout import Entry, finish_with_axes
from hybridnav.viz.maps import draw_one_way, ground_entries, swatch
from hybridnav.viz.room_colours import colour_rooms

_AROUND, _PANEL = 0.1, 0.46
"""Height of titles and legends of two maps, and width of each, as shares of the whole width."""
DOOR_POINTS = 1.2
"""Half the side of a door's dot."""


def plot_rooms(  # noqa: PLR0913 - all but the first have defaults
    rooms: RoomLabels | TopologicalMap,
    grid: OccupancyGrid | None = None,
    *,
    ax: Axes | None = None,
    names: bool = True,
    everything: bool = False,
    like: TopologicalMap | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw rooms in colours that differ between neighbours, with names, doors as dots, scale bar.

    Every room has its name. Where the name does not fit or would hide another, it has its number in
    the list of rooms, beside the room if necessary. The legend then has the names of the numbers,
    unless they end in them, as `room-7` does. Doors have their numbers if there is room for them.

    Openings are squares: they are wider than 2 m or not between jambs. Those of both kinds that are
    too narrow for the map's robot radius are hollow dots. The legend counts what the picture leaves
    out: gaps, which are doors narrower than 0.3 m, rooms that cannot be entered
    (`Rooms.is_listed`), and doors to them. Those rooms are drawn as free cells.

    Parameters
    ----------
    rooms
        Labels of a grid; or a topological map with rooms, whose doors are drawn too.
    grid
        The map; needed with labels only.
    ax
        Axes to draw on; by default new ones in a new figure.
    names
        Whether to write the names.
    everything
        Whether to draw all rooms and doors, not only listed ones.
    like
        Another map of the building with rooms, as before names were carried: rooms of one name have
        one colour, if it is drawn `like` this map.
    title
        Title instead of the map's name and the count of rooms; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Raises
    ------
    InvalidValueError
        When labels come without their map or with one of another shape, or a topological map has
        no rooms.

    Examples
    --------
    >>> from hybridnav.viz import plot_rooms
    >>> grid = hn.OccupancyGrid(np.zeros((4, 8)), robot_radius_m=0)
    >>> rooms = hn.RoomLabels(("kitchen",), np.zeros((4, 8), dtype=int))
    >>> plot_rooms(rooms, grid, title="rooms").get_title()
    'rooms'
    """
    view, labels, grid = _view_of(rooms, grid, everything=everything)
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    others = () if like is None else (_view_of(like, None, everything=everything)[1],)
    ground = draw_room_cells(canvas, labels, grid, *others)
    words = [grid.name, f"{len(labels.names)} rooms"]
    writer = RoomWriter(canvas, grid, labels)
    doors: list[Door] = []
    if view is not None:
        words = [grid.name, *view.counted(everything=everything)[:2]]
        doors = list(view.doors if everything else view.listed_doors)
        writer.labels.keep_free([door.position for door in doors], DOOR_POINTS * canvas.sizes.line)
    if names:
        writer.write_names()
        writer.number_rooms()
    n_rooms = 0 if view is None or everything else int((~view.is_listed).sum())
    left_out = f" ({n_rooms} narrow ones without a way in left out)" if n_rooms else ""
    entries: list[Entry] = [(swatch(style.PLACES), f"rooms{left_out}")]
    key = _key(writer.unnamed, labels.names)
    if view is not None:
        n_left_out = len(view.doors) - len(doors)
        entries += draw_doors(canvas, doors, f"{n_left_out} left out" if n_left_out else "")
        doors.sort(key=lambda door: (door.is_opening, -door.width_m))
        writer.number_doors(doors)
    entries += draw_one_way(canvas, rooms) if isinstance(rooms, TopologicalMap) else []
    entries += [*ground, *key]
    finish_with_axes(canvas, entries, words if title is None else [title])
    return canvas.ax


def plot_rooms_beside(
    old: TopologicalMap,
    new: TopologicalMap,
    *,
    axes: Sequence[Axes] | None = None,
    width_in: float = 2 * style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the rooms of two maps beside each other, such as before and after names were carried.

    Rooms of one name have one colour on both.

    Parameters
    ----------
    old, new
        Topological maps with rooms; see `plot_rooms`.
    axes
        Two axes to draw on; None for a figure of their own.
    width_in
        Width of that figure in inches.

    Returns
    -------
    Axes
        Those of the new map, on the right.

    Raises
    ------
    InvalidValueError
        When a map has no rooms.

    Examples
    --------
    >>> from hybridnav.viz import plot_rooms_beside
    >>> grid = hn.OccupancyGrid(np.zeros((4, 8)), robot_radius_m=0)
    >>> rooms = hn.RoomLabels(("kitchen",), np.zeros((4, 8), dtype=int))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    >>> len(plot_rooms_beside(topology, topology).figure.axes)
    2
    """
    if axes is None:
        sizes = [known_view(each.grid).size for each in (old, new)]
        height = max(float(high / wide) for wide, high in sizes)
        figure = new_figure(width_in, _AROUND + _PANEL * min(MAX_HEIGHT, height))
        axes = figure.subplots(1, 2)
        figure.subplots_adjust(left=0.04, right=0.99, bottom=0.17, top=0.94, wspace=0.1)
    for ax, each, other in zip(axes, (old, new), (new, old), strict=True):
        plot_rooms(each, ax=ax, like=other)
    return axes[1]


def _key(numbered: Sequence[int], names: Sequence[str]) -> list[Entry]:
    """Return the legend's entries for numbers that stand for names."""
    blank = Line2D([], [], linestyle="none")
    pairs = [(str(label + 1), names[label]) for label in sorted(numbered)]
    entries = [(blank, f"{n}  {name}") for n, name in pairs if name != f"room-{n}"]
    if len(entries) < len(pairs):
        entries.append((blank, "n  room-n"))
    return entries


def _view_of(
    rooms: RoomLabels | TopologicalMap, grid: OccupancyGrid | None, *, everything: bool
) -> tuple[Rooms | None, RoomLabels, OccupancyGrid]:
    """Return the rooms with doors (None for labels alone), the labels, and the map."""
    if isinstance(rooms, TopologicalMap):
        view = rooms.rooms
        return view, view.labels if everything else view.listed_labels, view.grid
    if grid is None:
        raise InvalidValueError("labels of rooms are drawn with their map: give the grid too")
    if rooms.label_of.shape != grid.shape:
        raise InvalidValueError(
            f"rooms are labels of {rooms.label_of.shape} cells, the grid has {grid.shape}"
        )
    return None, rooms, grid


def draw_room_cells(
    canvas: Canvas,
    labels: RoomLabels,
    grid: OccupancyGrid,
    *others: RoomLabels,
    strength: float = 1.0,
) -> list[Entry]:
    """Draw the map with each room in a colour of some strength; return the legend's entries of
    cells in no room.

    `others`: see `colour_rooms`.
    """
    index = colour_rooms(labels, grid, *others)
    rooms = style.rgb(*style.PLACES, strength=strength)[index]
    colours = np.concatenate([rooms, style.rgb(style.UNEXPLORED, style.FREE)])
    is_unexplored = grid.measured == CellClass.UNEXPLORED
    draw_cells(canvas, grid, np.where(is_unexplored, len(rooms), labels.label_of), colours)
    entry: Entry = (Patch(fc=style.UNEXPLORED), "unexplored")
    return [entry] * bool(is_unexplored.any()) + ground_entries(grid)


def room_entry(left_out: int, strength: float = 1.0) -> Entry:
    """Return the legend's entry for rooms, with the number of those without names."""
    text = f"rooms ({left_out} without their name)" if left_out else "rooms"
    return swatch(style.PLACES, strength), text


def draw_doors(canvas: Canvas, doors: Sequence[Door], left_out: str = "") -> list[Entry]:
    """Draw doors as dots and openings as squares, hollow dots where the robot does not pass; return
    the legend's entries.

    `left_out`: description of the omitted doors, for the legend.
    """
    entries: list[Entry] = []
    passed = [door for door in doors if door.passable]
    narrow = [door for door in doors if not door.passable]
    of_doors = f"doors ({left_out})" if left_out else "doors"
    width = canvas.sizes.line
    look: dict[str, Any] = {"color": style.PATH, "ls": "none", "zorder": 8}
    look |= {"ms": 2 * DOOR_POINTS * width, "mew": 0.8 * width}
    for gid, shown, marker, face, text in (
        ("doors", [door for door in passed if not door.is_opening], "o", style.PATH, of_doors),
        ("openings", [door for door in passed if door.is_opening], "s", style.PATH, "openings"),
        ("narrow-doors", narrow, "o", style.FREE, "doors too narrow for the robot"),
    ):
        if gid == "doors" or shown:
            at = np.array([door.position for door in shown]).reshape(-1, 2)
            canvas.add_line(at, **look, marker=marker, mfc=face, gid=gid)
            entries.append((Line2D([], [], **look, marker=marker, mfc=face), text))
    return entries
