"""Pictures of maps and of the levels of their pyramids."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hybridnav.maps import CellClass
from hybridnav.topology import TopologicalMap
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, known_view
from hybridnav.viz.layout import finish_with_axes
from hybridnav.viz.places import Places, draw_arcs, draw_dots

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from hybridnav.maps import OccupancyGrid
    from hybridnav.pyramid import Level
    from hybridnav.viz.layout import Entry
    from hybridnav.viz.style import Sizes

MAX_VERTICES_WITH_ARCS = 2000
"""Vertices beyond which a level is drawn as fields alone: dots and arcs would cover them."""


def plot_map(
    grid: OccupancyGrid,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the cells of a map: occupied dark, blocked grey, unexplored light grey, free white.

    Parameters
    ----------
    grid
        The map. The picture is cropped to its known part; its axes are metres of the map frame.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the map's name; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

    Examples
    --------
    >>> from hybridnav.viz import plot_map
    >>> ax = plot_map(hn.example_map("figure1"), title="Figure 1")
    >>> ax.get_title()
    'Figure 1'
    """
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    # Occupied and blocked cells have their own colours: only two classes are looked up.
    colours = style.rgb(style.BLOCKED, style.FREE, style.UNEXPLORED)
    draw_cells(canvas, grid, grid.classes, colours)
    entries: list[Entry] = [(Patch(fc=style.FREE, ec=style.ARC, lw=0.5), "free")]
    if (grid.classes == CellClass.UNEXPLORED).any():
        entries.append((Patch(fc=style.UNEXPLORED), "unexplored"))
    entries += ground_entries(grid)
    rows, cols = grid.shape
    words = [grid.name, f"{cols} x {rows} cells of {grid.resolution_m:g} m"]
    finish_with_axes(canvas, entries, words if title is None else [title])
    return canvas.ax


def plot_places(  # noqa: PLR0913 - all but the first have defaults
    places: Level | TopologicalMap,
    *,
    ax: Axes | None = None,
    arcs: bool = True,
    self_loops: bool = False,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw places as coloured fields, their positions as dots, and the arcs between them.

    Neighbours never have the same colour; unexplored places are grey. An arc is a line from one
    position through the middle of its boundary to the other, so that two doors between two rooms
    are two lines. Places under half a square metre have no dot and no arcs, and a level of more
    than 2000 vertices is drawn as fields alone.

    Parameters
    ----------
    places
        The topological map, or any level of a pyramid.
    ax
        Axes to draw on; by default new ones in a new figure.
    arcs
        Whether to draw the arcs.
    self_loops
        Whether to draw the self-loops too, as closed curves through the middle of their boundary.
    title
        Title instead of the map's name and the count of places; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

    Examples
    --------
    >>> from hybridnav.viz import plot_places
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> plot_places(hn.TopologicalMap(pyramid), title="places").get_title()
    'places'
    """
    level = places.level if isinstance(places, TopologicalMap) else places
    canvas, drawn = Canvas.opened(ax, width_in, known_view(level.grid)), Places(level)
    entries = _draw_fields(canvas, drawn, "places")
    if arcs and level.n_vertices <= MAX_VERTICES_WITH_ARCS:
        entries.insert(0, _draw_arcs(canvas, drawn, self_loops=self_loops))
    n_free = int(drawn.free.sum())
    words = [level.grid.name, f"{n_free} free and {level.n_vertices - n_free} unexplored places"]
    finish_with_axes(canvas, entries, words if title is None else [title])
    return canvas.ax


def plot_level(
    level: Level, *, ax: Axes | None = None, width_in: float = style.FULL_WIDTH_IN
) -> Axes:
    """Draw the fields of one level of a pyramid as `plot_places` draws places.

    Parameters
    ----------
    level
        Any level, the base included.
    ax
        Axes to draw on; by default new ones in a new figure.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

    Examples
    --------
    >>> from hybridnav.viz import plot_level
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> plot_level(pyramid[3]).get_aspect()
    1.0
    """
    canvas, drawn = Canvas.opened(ax, width_in, known_view(level.grid)), Places(level)
    entries = _draw_fields(canvas, drawn, "fields")
    if level.n_vertices <= MAX_VERTICES_WITH_ARCS:
        entries.insert(0, _draw_arcs(canvas, drawn))
    sizes = f"{level.n_vertices:,} vertices, {level.n_arcs:,} arcs"
    finish_with_axes(canvas, entries, [f"{level.grid.name}, level {level.index}: {sizes}"])
    return canvas.ax


def _draw_fields(canvas: Canvas, drawn: Places, noun: str) -> list[Entry]:
    """Draw fields and their positions; return the legend entries, which call them by the noun."""
    draw_cells(canvas, drawn.level.grid, drawn.level.field_of, drawn.colours())
    if drawn.level.n_vertices <= MAX_VERTICES_WITH_ARCS:
        draw_dots(canvas, drawn)
    swatches = [(drawn.free, style.PLACES, f"free {noun}")]
    swatches.append((~drawn.free, style.UNEXPLORED_PLACES, f"unexplored {noun}"))
    entries = [(swatch(colours), label) for mask, colours, label in swatches if mask.any()]
    return entries + ground_entries(drawn.level.grid)


def _draw_arcs(canvas: Canvas, drawn: Places, *, self_loops: bool = False) -> Entry:
    """Draw the arcs; return their legend entry."""
    draw_arcs(canvas, drawn, self_loops=self_loops)
    return arc_handle(canvas.sizes), "position, arc"


def ground_entries(grid: OccupancyGrid) -> list[Entry]:
    """Return the legend entries for the cells that are in no place."""
    occupied = (grid.measured == CellClass.OCCUPIED).any()
    entries: list[Entry] = [(Patch(fc=style.OCCUPIED), "occupied")] if occupied else []
    blocked = []
    if occupied and grid.robot_radius_m > 0:
        blocked.append(f"within {grid.robot_radius_m:g} m of occupied")
    if grid.dropped is not None and grid.dropped.closed_cells:
        blocked.append(f"island below {grid.least_island_m2:g} m²")
    if blocked:
        entries.append((Patch(fc=style.BLOCKED), ", or ".join(blocked)))
    return entries


def swatch(colours: Sequence[str], strength: float = 1.0) -> tuple[Patch, ...]:
    """Return the legend handle for places: three of their colours side by side."""
    return tuple(Patch(fc=rgb / 255) for rgb in style.rgb(*colours[:3], strength=strength))


def arc_handle(sizes: Sizes) -> Line2D:
    """Return the legend handle for an arc between two positions."""
    line = 0.9 * sizes.line
    return Line2D([], [], color=style.ARC, lw=line, marker="o", ms=3 * sizes.line, mfc=style.INK)
