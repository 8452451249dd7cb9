"""Pictures of maps, of the levels of their pyramids, and of the costs of their cells. Public:
`plot_places`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import ArrayLike

from hybridnav._base.typing import BoolArray
from hybridnav.closures import OneWay
from hybridnav.closures.blocked import Closable, as_blocked
from hybridnav.closures.one_way import directions_on
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.checks import checked_points
from hybridnav.maps.costs import CostLayer
from hybridnav.pyramid import Level
from hybridnav.search.found import ClosedCells
from hybridnav.topology import TopologicalMap
from hybridnav.viz import layout, style
from hybridnav.viz.canvas import Canvas, draw_cells, draw_classes, draw_shades, known_view
from hybridnav.viz.layout import Entry
from hybridnav.viz.places import Places, draw_arcs, draw_dots
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

    Examples
    --------
    >>> from hybridnav.viz import plot_map
    >>> ax = plot_map(hn.example_map("figure1"), title="Figure 1")
    >>> ax.get_title()
    'Figure 1'
    """
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    draw_classes(canvas, grid)
    entries: list[Entry] = [(Patch(fc=style.FREE, ec=style.ARC, lw=0.5), "free")]
    entries += unexplored_entry(grid) + ground_entries(grid)
    rows, cols = grid.shape
    words = [grid.name, f"{cols} x {rows} cells of {grid.resolution_m:g} m"]
    layout.finish_with_axes(canvas, entries, words if title is None else [title])
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
    layout.finish_with_axes(canvas, entries, words if title is None else [title])
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
    layout.finish_with_axes(canvas, entries, [f"{level.grid.name}, level {level.index}: {sizes}"])
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


def unexplored_entry(grid: OccupancyGrid) -> list[Entry]:
    """Return the legend entry for unexplored cells, none on a map without any."""
    is_unexplored = (grid.classes == CellClass.UNEXPLORED).any()
    return [(Patch(fc=style.UNEXPLORED), "unexplored")] if is_unexplored else []


def swatch(colours: Sequence[str], strength: float = 1.0) -> tuple[Patch, ...]:
    """Return the legend handle for places: three of their colours side by side."""
    return tuple(Patch(fc=rgb / 255) for rgb in style.rgb(*colours[:3], strength=strength))


def arc_handle(sizes: Sizes) -> Line2D:
    """Return the legend handle for an arc between two positions."""
    line = 0.9 * sizes.line
    return Line2D([], [], color=style.ARC, lw=line, marker="o", ms=3 * sizes.line, mfc=style.INK)


# Pictures of costs: the factor of each cell.


_LEVELS = 254
"""Colours of factors; two more are those of closed and unexplored cells."""
_DECADE = 10.0
"""Factor beyond which colours follow the logarithm."""
_CLOSED = "#7b3294"
_SHADES = (0.1, 0.33, 0.6, 0.85)
"""Parts of the colour map that follow white: its darkest end would look like a wall."""
_PALE = 0.55
"""Part of white in these colours where paths are drawn over them."""
_LEAST_SHADE, _CLOSED_ALPHA = 0.1, 190
"""Opacity of the least cost above 1, as a share, and of closed cells, of 255."""
_LEAST_CLOSED_POINTS = 3.0
"""Least breadth of what is closed, in points."""
_BAR, _BAR_HEIGHT = 3.0, 0.8
"""Heights of the colour bar with its labels and of the bar itself, in font sizes."""
_TICKS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
_BAR_LEFT, _BAR_WIDTH = 0.3, 0.4
"""Place of the bar below the map, in widths of the map."""
_PATHS = ("#0b3c8c", "#007f5f", *style.ROUTES[2:])
"""Colours of paths: the red of other pictures would vanish on costs."""


def draw_query(
    canvas: Canvas,
    topology: TopologicalMap,
    costs: CostLayer | None,
    blocked: Closable | ClosedCells | None,
) -> list[Entry]:
    """Draw what a query was planned with over the cells: costs as shades, closed cells.

    `canvas`: canvas on which the cells are drawn; `costs`: costs of its cells; the more a metre
    costs, the less of the cell shows through; `blocked`: closures of the query. Result: entries of
    the legend.
    """
    grid = topology.grid
    entries: list[Entry] = []
    is_open = grid.classes != CellClass.OCCUPIED
    is_closed = np.zeros(grid.shape, dtype=np.bool_)
    if costs is not None:
        costs.check_fits(grid)
        scale = _scale_of(grid, costs)
        at = np.where(
            grid.classes == CellClass.FREE, np.asarray(scale(costs.factors)).clip(0, 1), 0.0
        )
        table = np.round(colormaps["BuPu"](np.linspace(0.2, _SHADES[-1], _LEVELS)) * 255)
        shades = table.astype(np.uint8)[np.round(at * (_LEVELS - 1)).astype(np.intp)]
        shades[..., 3] = np.where(at > 0, 255 * (_LEAST_SHADE + (1 - _LEAST_SHADE) * at), 0)
        draw_shades(canvas, grid, shades, gid="costs")
        text = f"a metre costs up to {scale.vmax:.3g}"
        entries.append((Patch(fc=colormaps["BuPu"](_SHADES[-1])), text))
        is_closed.flat[costs.inflated(grid).closed_flat] = True
    given: OneWay | None = None
    if isinstance(blocked, ClosedCells):
        is_closed.ravel()[blocked.flat] = True
    elif blocked is not None:
        closure = as_blocked(blocked)
        is_closed.ravel()[closure.cells_of(topology)], given = True, closure.directions
    is_closed &= is_open
    if is_closed.any():
        # A closed door may be a single cell: everything closed is seen on the page.
        cell_points = grid.resolution_m * canvas.sizes.points_per_metre
        is_closed = _wider(is_closed, int(_LEAST_CLOSED_POINTS / cell_points / 2)) & is_open
        shades = np.zeros((*grid.shape, 4), dtype=np.uint8)
        shades[is_closed] = (*style.rgb(_CLOSED)[0].tolist(), _CLOSED_ALPHA)
        draw_shades(canvas, grid, shades, gid="closed")
        entries.append((Patch(fc=_CLOSED), "closed"))
    return entries + draw_one_way(canvas, topology, given)


def draw_one_way(
    canvas: Canvas, topology: TopologicalMap, given: OneWay | None = None
) -> list[Entry]:
    """Draw what is crossed in one direction only: its sides, and an arrow on each thing.

    `given`: that of a query, beside the rules of the rooms. Result: entries of the legend.
    """
    directions = directions_on(topology, given)
    if directions is None or not len(directions.sides):
        return []
    one, other = directions.sides[:, :2], directions.sides[:, 2:]
    corners, across = np.maximum(one, other), np.abs(other - one)[:, ::-1]
    frame, width = topology.grid.frame, 1.2 * canvas.sizes.line
    lines = np.stack([frame.points_of_grid(each) for each in (corners, corners + across)], axis=1)
    canvas.add_lines(lines, colors=_CLOSED, linewidths=width, zorder=5, gid="one-way")
    middles, steps = lines.mean(axis=1), frame.points_of(other) - frame.points_of(one)
    at = [  # the side in the middle of each thing
        places[((middles[places] - middles[places].mean(axis=0)) ** 2).sum(axis=1).argmin()]
        for places in directions.parts.values()
    ]
    along = np.array([steps[places].mean(axis=0) for places in directions.parts.values()])
    canvas.add_arrows(middles[at], along, color=_CLOSED, zorder=8.5, gid="one-way-arrows")
    mark = Line2D([], [], color=_CLOSED, lw=width, marker=">", markersize=5 * canvas.sizes.line)
    return [(mark, "one way")]


def _wider(cells: BoolArray, steps: int) -> BoolArray:
    """Return cells with those at most some steps away from them."""
    from scipy import ndimage  # noqa: PLC0415 - most pictures show nothing that is closed

    if not steps:
        return cells
    return ndimage.binary_dilation(cells, iterations=steps)


def _scale_of(grid: OccupancyGrid, layer: CostLayer) -> Normalize:
    """Return the scale of factors: logarithmic beyond 10."""
    most = float(layer.factors[grid.classes == CellClass.FREE].max(initial=1.0))
    most = max(most, 1.0 + 1e-3)
    return LogNorm(1.0, most) if most > _DECADE else Normalize(1.0, most)


def plot_costs(  # noqa: PLR0913 - all but the first two have defaults
    grid: OccupancyGrid,
    layer: CostLayer,
    *,
    paths: Mapping[str, ArrayLike] | None = None,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the factors of the free cells as colours with a bar, over the walls of a map.

    Parameters
    ----------
    grid
        The map. The picture is cropped to its known part; its axes are metres of the map frame.
    layer
        Costs of its cells. White is the factor 1; closed cells have a colour of their own. If a
        factor is above 10, colours follow the logarithm. They are paler below paths.
    paths
        Paths to draw by their labels, `(x, y)` in metres, shape (n, 2) each, at most 5; None for
        none.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the map's name and the range of factors; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Raises
    ------
    InvalidValueError
        When the layer is one of another map, or a path is no finite array of shape (n, 2).

    Examples
    --------
    >>> from hybridnav.viz import plot_costs
    >>> grid = hn.example_map("figure1")
    >>> ax = plot_costs(grid, hn.CostLayer.clearance(grid), title="clearance")
    >>> ax.get_title()
    'clearance'
    """
    layer.check_fits(grid)
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    scale = _scale_of(grid, layer)
    strong = colormaps["YlOrRd"](_SHADES)[:, :3]
    colours_of_costs = [style.FREE, *(_PALE + (1 - _PALE) * strong if paths else strong)]
    shades = LinearSegmentedColormap.from_list("factors", colours_of_costs)
    drawn = np.round(scale(layer.factors).clip(0, 1) * (_LEVELS - 1)).astype(np.uint8)
    drawn[grid.classes == CellClass.UNEXPLORED] = _LEVELS
    drawn.flat[layer.closed_flat] = _LEVELS + 1
    levels = np.round(shades(np.linspace(0, 1, _LEVELS))[:, :3] * 255).astype(np.uint8)
    colours = np.concatenate([levels, style.rgb(style.UNEXPLORED, _CLOSED)])
    draw_cells(canvas, grid, drawn, colours)
    entries = ground_entries(grid) + unexplored_entry(grid)
    if len(layer.closed_flat):
        entries.append((Patch(fc=_CLOSED), "closed"))
    entries += _draw_paths(canvas, paths or {})
    words = [grid.name, f"metres cost 1 to {scale.vmax:.3g} times as much"]
    _finish(canvas, entries, words if title is None else [title], ScalarMappable(scale, shades))
    return canvas.ax


def _draw_paths(canvas: Canvas, paths: Mapping[str, ArrayLike]) -> list[Entry]:
    """Draw paths as lines with a pale rim; return their legend entries."""
    if len(paths) > len(_PATHS):
        raise InvalidValueError(
            f"at most {len(_PATHS)} paths can be drawn, got {len(paths)}: draw fewer"
        )
    entries: list[Entry] = []
    for (label, points), colour in zip(paths.items(), _PATHS, strict=False):
        line = checked_points(points)
        width = 1.6 * canvas.sizes.line
        canvas.add_lines([line], colors=style.FREE, linewidths=2.2 * width, zorder=6)
        canvas.add_lines([line], colors=colour, linewidths=width, zorder=7, gid="path")
        entries.append((Line2D([], [], color=colour, lw=width), label))
    return entries


def _finish(canvas: Canvas, entries: list[Entry], words: list[str], shown: ScalarMappable) -> None:
    """Add the title, axes in metres, legend and colour bar."""
    ax, font = canvas.ax, canvas.sizes.font
    layout.label_axes(canvas)
    layout.add_title(canvas, words)
    layout.fit_height(
        canvas, layout.add_legend(canvas, entries, bar=0, below=(layout.LABELS + _BAR) * font)
    )
    points = float(ax.get_window_extent().height) * 72 / ax.figure.dpi
    place = (
        _BAR_LEFT,
        -(layout.LABELS + _BAR_HEIGHT) * font / points,
        _BAR_WIDTH,
        _BAR_HEIGHT * font / points,
    )
    bar = ax.figure.colorbar(
        shown, cax=ax.inset_axes(place), orientation="horizontal", format="{x:g}"
    )
    if isinstance(shown.norm, LogNorm):
        bar.set_ticks([tick for tick in _TICKS if tick <= (shown.norm.vmax or 1)])
        bar.minorticks_off()
    bar.ax.tick_params(labelsize=font, width=0.6, length=0.35 * font, color=style.ARC)
    bar.ax.text(
        -0.03, 0.5, "factor", transform=bar.ax.transAxes, fontsize=font, ha="right", va="center"
    )
    bar.outline.set_linewidth(0.6)
