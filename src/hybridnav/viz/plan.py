"""The picture of a plan. Public: `plot_paths`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from hybridnav._base.trig import lengths_along
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.closures.blocked import Closable
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.planning import COST_METRICS, PlanResult
from hybridnav.planning.endpoints import read_point
from hybridnav.route import Route
from hybridnav.search.found import ClosedCells
from hybridnav.topology import TopologicalMap
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, View, draw_cells, draw_classes, known_view
from hybridnav.viz.labels import Marker, draw_markers
from hybridnav.viz.layout import Entry, finish
from hybridnav.viz.maps import arc_handle, draw_query, ground_entries, swatch, unexplored_entry
from hybridnav.viz.places import Places, draw_arcs, draw_dots
from hybridnav.viz.style import Sizes

_LOOKS = 4
"""Points of a path that are looked up in the map, to a cell."""
_ROUTE_WIDTH, PATH_WIDTH, _CASING = 1.5, 2.0, 1.5
_CUT: Any = {"colors": style.PATH, "capstyle": "round", "gid": "cut"}
"""The line of cells that part start and goal."""
_LOSING_WIDTH = 7.0
_LOSING: Any = {"colors": "#e6c200", "capstyle": "round", "gid": "losing"}
"""Parts of a path that lose most, below it."""


def plot_plan(  # noqa: PLR0913 - independent parts of a picture
    topology: TopologicalMap,
    result: PlanResult,
    *,
    ax: Axes | None = None,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    title: str | None = None,
    optimum_m: float | None = None,
    costs: CostLayer | None = None,
    blocked: Closable | ClosedCells | None = None,
    unexplored: bool = False,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw a plan: map, places, arcs, route, path, start and goal, scale bar.

    Arcs run through the middle of their boundaries, so that two doors are two lines. Places of the
    route, or of the corridor if the preset searched in one, keep their full colours; the others are
    pale. The route lies along the path, with a dot in each place that it passes; a route without a
    path runs from place to place. Without a path the title states the status, and a line runs along
    the cells that part start and goal.

    Parameters
    ----------
    topology
        The topological map that was planned on. The picture is cropped to its map's known part.
    result
        The plan.
    ax
        Axes to draw on; by default new ones in a new figure. Leave room below for the legend.
    start, goal
        `(x, y)` in metres, map frame; by default the endpoints of the path.
    title
        Title instead of the map's name, length, loss and places; empty for none.
    optimum_m
        Cost of an optimal path of the same metric in metres, for the loss in the title.
    costs, blocked
        What the query was planned with, drawn over the cells; None for nothing.
    unexplored
        Whether to draw unexplored places and their arcs. Most maps have many of them; they are
        drawn in any case if the plan may enter them.
    width_in
        Width of a new figure in inches, 3.3 for one column of a paper; its height follows.

    Raises
    ------
    InvalidValueError
        When start, goal or optimum is not finite or the optimum is negative.

    Examples
    --------
    >>> from hybridnav.viz import plot_plan
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> result = hn.HybridPlanner(topology).plan((0.5, 0.5), (2.0, 2.5))
    >>> plot_plan(topology, result, title="plan").get_title()
    'plan'
    """
    if optimum_m is not None and not (math.isfinite(optimum_m) and optimum_m >= 0):
        raise InvalidValueError(f"optimum must be a length in metres >= 0, got {optimum_m}")
    grid, places = topology.grid, Places(topology.level)
    view, markers = known_view(grid), _markers(result, start, goal)
    if markers:
        margin = 0.015 * float(view.size.max())
        view = view.holding(np.stack([marker.point for marker in markers]), margin)
    canvas = Canvas.opened(ax, width_in, view)
    strong = _corridor(topology, result)
    unexplored |= result.settings.get("planner", {}).get("allow_unexplored", False)
    colours = places.colours(strong, unexplored=unexplored)
    draw_cells(canvas, grid, topology.level.field_of, colours)
    query = draw_query(canvas, topology, costs, blocked)
    draw_arcs(canvas, places, unexplored=unexplored)
    draw_dots(canvas, places, unexplored=unexplored)
    path = np.empty((0, 2)) if result.path is None else result.path.points
    if result.route is not None:
        _draw_route(canvas, topology, result.route, places, path)
    if result.path is not None:
        draw_path(canvas, path)
    cut = None if result.explanation is None else result.explanation.cut
    if cut is not None:
        canvas.add_lines([cut], **_CUT, linewidths=_ROUTE_WIDTH * canvas.sizes.line, zorder=6)
    draw_markers(canvas, markers, [path])
    words = _words(topology, result, optimum_m) if title is None else [title]
    entries = _entries(result, places, strong, canvas.sizes, unexplored=unexplored)
    if cut is not None:
        entries.append((Line2D([], [], color=style.PATH, lw=_ROUTE_WIDTH), "cut"))
    entries += query + ground_entries(grid)
    return finish(canvas, entries, words)


def _markers(result: PlanResult, start: ArrayLike | None, goal: ArrayLike | None) -> list[Marker]:
    endpoints = result.path.points[[0, -1]] if result.path is not None else (None, None)
    markers = []
    for name, given, end in zip(("start", "goal"), (start, goal), endpoints, strict=True):
        point = end if given is None else read_point(name, given)
        if point is not None:
            markers.append(Marker(name, point))
    return markers


def _corridor(topology: TopologicalMap, result: PlanResult) -> BoolArray:
    """Return the mask of the places to draw in full colours."""
    inside = np.zeros(topology.n_places, dtype=np.bool_)
    passed = () if result.route is None else result.route.places
    index = {place: at for at, place in enumerate(topology.place_ids.tolist())}
    on_route = np.array([index[place] for place in passed], dtype=np.int64)
    inside[on_route] = True
    settings = result.settings.get("planner", {})
    is_at_once = settings.get("levels", "places") == "places"  # a descent keeps smaller fields
    beside: Any = settings.get("corridor", "route") if is_at_once else "route"
    if beside != "route" and len(on_route):
        from hybridnav.route import corridor_of  # noqa: PLC0415 - most presets search no corridor

        inside = corridor_of(topology, on_route, beside=beside).places
    return inside


def _draw_route(
    canvas: Canvas, topology: TopologicalMap, route: Route, places: Places, path: FloatArray
) -> None:
    """Draw a route along its path, with a dot in the middle of each stretch in one place; from
    place to place if there is no path."""
    width = _ROUTE_WIDTH * canvas.sizes.line
    lines = [path]
    dots = _middles(topology, path) if len(path) else places.positions[:0]
    if not len(path):
        lines = places.lines(np.isin(topology.arc_ids, route.arcs))
        dots = places.positions[np.isin(topology.place_ids, route.places)]
    look = {"colors": style.INK, "capstyle": "round", "zorder": 5}
    rim = (PATH_WIDTH + _CASING) * canvas.sizes.line if len(path) else 0.0
    canvas.add_lines(lines, linewidths=width + rim, **look, gid="route")
    canvas.add_dots(
        dots,
        max(places.dot(canvas.sizes), 2.4 * width),
        c=style.FREE,
        edgecolors=style.INK,
        linewidths=0.7 * width,
        zorder=7.5 if len(path) else 6,
        gid="route-places",
    )


def _middles(topology: TopologicalMap, path: FloatArray) -> FloatArray:
    """Return the middle of each stretch of a path in one place, `(x, y)` in metres, shape (n, 2);
    the path is looked up a few times in each cell."""
    ends_m = lengths_along(path)
    count = max(1, math.ceil(_LOOKS * ends_m[-1] / topology.grid.resolution_m))
    at_m = (np.arange(count) + 0.5) * (ends_m[-1] / count)
    points = np.column_stack([np.interp(at_m, ends_m, along) for along in path.T])
    cells = topology.grid.frame.cells_of(points).clip(0, np.array(topology.grid.shape) - 1)
    places = topology.level.field_of[tuple(cells.T)]
    points, places = points[places >= 0], places[places >= 0]  # a side of a wall lies in a wall
    begins = np.flatnonzero(np.diff(places, prepend=-1))
    return points[(begins + np.append(begins[1:], len(places))) // 2]


def draw_path(canvas: Canvas, points: FloatArray) -> None:
    """Draw a path as a line with a pale rim; points `(x, y)` in metres."""
    factor = canvas.sizes.line
    casing = patheffects.withStroke(
        linewidth=(PATH_WIDTH + _CASING) * factor, foreground=style.FREE, capstyle="round"
    )
    canvas.add_line(
        points,
        color=style.PATH,
        linewidth=PATH_WIDTH * factor,
        solid_capstyle="round",
        solid_joinstyle="round",
        path_effects=[casing],
        zorder=7,
        gid="path",
    )


def _words(topology: TopologicalMap, result: PlanResult, optimum_m: float | None) -> list[str]:
    """Return the parts of the title."""
    words = [topology.grid.name]
    if result.path is None:
        return [*words, str(result.status)]
    words.append(f"path {result.path.length_m:.1f} m")
    if result.metric in COST_METRICS:
        words.append(f"cost {result.cost:.1f} m")
    if optimum_m is not None:
        loss = result.cost / optimum_m - 1 if optimum_m > 0 else 0.0
        words.append(f"loss {round(loss, 3) + 0.0:.1%}")  # no "-0.0%" from rounding
    if result.route is None:
        return words
    n_places = len(result.route.places)
    return [*words, f"{n_places} place{'s' if n_places > 1 else ''} on the route"]


def _entries(
    result: PlanResult, places: Places, strong: BoolArray, sizes: Sizes, *, unexplored: bool
) -> list[Entry]:
    """Return the legend entries for the items drawn over the cells, and for places."""
    entries: list[Entry] = []
    width = sizes.line
    if result.path is not None:
        entries.append((Line2D([], [], color=style.PATH, lw=PATH_WIDTH * width), "path"))
    if result.route is not None:
        line = Line2D([], [], color=style.INK, lw=_ROUTE_WIDTH * width, marker="o")
        line.set(markerfacecolor=style.FREE, markersize=3.6 * width, markeredgewidth=width)
        chosen = result.settings.get("planner", {}).get("levels") == "places"
        words = ("coarse route", "corridor") if chosen else ("route", "its places")
        entries += [(line, words[0]), (swatch(style.PLACES), words[1])]
    entries.append((arc_handle(sizes), "place, arc"))
    if (places.free & ~strong).any():
        label = "other places" if result.route is not None else "places"
        entries.append((swatch(style.PLACES, style.PALE), label))
    if not places.free.all():
        greys = style.UNEXPLORED_PLACES if unexplored else [style.UNEXPLORED]
        entries.append((swatch(greys), "unexplored"))
    return entries


# The picture of a path beside a shortest one, on the part of the map round them.

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
    losing: Sequence[ArrayLike] = (),
    contacts: ArrayLike | None = None,
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
    losing
        Points of each part on which the path loses most, drawn wide.
    contacts
        Points at which it meets what it must not, shape (k, 2), drawn as crosses.
    ax
        Where to draw; by default new axes in a new figure. Leave room below for the legend.
    title
        Title of the picture; by default the map's name.
    width_in
        Width of a new figure in inches; its height follows.

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
    draw_classes(canvas, grid)
    entries: list[Entry] = []
    width = canvas.sizes.line
    if len(lines[0]):
        draw_path(canvas, lines[0])
        entries.append((Line2D([], [], color=style.PATH, lw=PATH_WIDTH * width), "path"))
    if len(lines[1]):
        line = canvas.add_line(
            lines[1],
            color=style.PARALLEL,
            linewidth=_SHORTEST_WIDTH * width,
            linestyle=_SHORTEST_DASHES,
            zorder=7.5,
            gid="shortest",
        )
        entries.append((line, "shortest path"))
    parts, met = list(map(_checked, losing)), _checked([] if contacts is None else contacts)
    if parts:
        canvas.add_lines(parts, **_LOSING, linewidths=_LOSING_WIDTH * width, zorder=5.5)
        wide = Line2D([], [], color=_LOSING["colors"], lw=_LOSING_WIDTH * width)
        entries.append((wide, "loses most"))
    if len(met):
        look: Any = {"marker": "x", "color": style.INK, "linestyle": "", "ms": 5 * width}
        (crosses,) = canvas.ax.plot(*met.T, **look, zorder=8, gid="contacts")
        entries.append((crosses, "contact"))
    endpoints = next((line[[0, -1]] for line in lines if len(line)), np.empty((0, 2)))
    markers = [Marker(name, end) for name, end in zip(("start", "goal"), endpoints, strict=False)]
    draw_markers(canvas, markers, lines)
    entries += unexplored_entry(grid) + ground_entries(grid)
    words = [grid.name if title is None else title]
    return finish(canvas, entries, words, framed=True)


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
