"""Pictures of tours and of alternative routes; one call for all that was planned: `plot`."""

from __future__ import annotations

import html
import itertools
from collections.abc import Sequence
from typing import Any

from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from hybridnav._base.typing import FloatArray
from hybridnav.closures.blocked import Closable
from hybridnav.errors import InvalidValueError
from hybridnav.guide import Alternatives, Tour
from hybridnav.guide.words.bends import Leg
from hybridnav.maps.costs import CostLayer
from hybridnav.planning import COST_METRICS, PlanResult
from hybridnav.rooms import Door, Rooms
from hybridnav.search.found import ClosedCells
from hybridnav.topology import TopologicalMap
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, known_view, picture_bytes, png_uri
from hybridnav.viz.charts import HasLosses, plot_losses
from hybridnav.viz.labels import LabelPlacer, Marker, RoomWriter, draw_markers
from hybridnav.viz.layout import Entry, finish
from hybridnav.viz.maps import draw_query, ground_entries, swatch
from hybridnav.viz.places import Places
from hybridnav.viz.plan import plot_paths, plot_plan
from hybridnav.viz.room_map import DOOR_POINTS, draw_doors, draw_room_cells, room_entry

_TOUR_WIDTH, _WAYPOINT_POINTS = 1.6, 5.0
_ROUTE_WIDTH, _WIDER, _CASING = 1.6, 1.9, 0.6
"""Line widths: longer routes are wider and below the shorter ones, so that all show where they
overlap."""
_MOST_DOORS = 8
"""Doors of a route that the legend names."""
_Dashes = tuple[float, tuple[float, ...]]
_DASHES: tuple[_Dashes | None, ...] = (
    None,
    (0.0, (2.2, 1.2)),
    (0.0, (0.8, 0.8)),
    (0.0, (4.0, 1.0, 1.0, 1.0)),
)
"""Dashes, each for as many routes as there are colours."""


def plot_tour(  # noqa: PLR0913 - all but two have defaults
    topology: TopologicalMap,
    tour: Tour,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    costs: CostLayer | None = None,
    blocked: Closable | ClosedCells | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw a tour: the rooms as in `plot_rooms`, and the paths from waypoint to waypoint.

    The doors on the path have their numbers, those of `Tour.words`.

    Parameters
    ----------
    topology
        The map with rooms.
    tour
        The tour; without a path only the rooms are drawn, and the title states the reason.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the map's name and the length; empty for none.
    costs, blocked
        Costs and closures of the query, drawn over the cells; None for none.
    width_in
        Width of a new figure in inches; its height follows.

    Examples
    --------
    >>> from hybridnav.viz import plot_tour
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> tour = hn.plan_tour(hn.HybridPlanner(topology), [(0.5, 0.5), (2.0, 2.5), (0.5, 0.5)])
    >>> plot_tour(topology, tour, title="tour").get_title()
    'tour'
    """
    text = f"{tour.length_m:.1f} m" if tour.solved else str(tour.status)
    if tour.solved and tour.metric in COST_METRICS:
        text += f", cost {tour.cost:.1f} m"
    paths = [result.path.points for result in tour.results if result.path is not None]
    canvas = Canvas.opened(ax, width_in, known_view(topology.grid))
    entries, _ = _draw_ground(canvas, topology, tour.legs, paths, 1.0)
    entries += draw_query(canvas, topology, costs, blocked)
    for points in paths:
        canvas.add_line(points, color=style.PATH, lw=_TOUR_WIDTH, zorder=7, gid="path")
        dots = {"marker": "o", "ms": _WAYPOINT_POINTS, "mfc": style.FREE, "ls": "none"}
        canvas.add_line(points[[0, -1]], color=style.PATH, **dots, zorder=8, gid="waypoints")
    if paths:
        entries.insert(0, (Line2D([], [], color=style.PATH, lw=_TOUR_WIDTH), "path"))
    return finish(canvas, entries, [topology.grid.name, text] if title is None else [title])


def plot_alternatives(  # noqa: PLR0913 - all but two have defaults
    topology: TopologicalMap,
    alternatives: Alternatives,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    costs: CostLayer | None = None,
    blocked: Closable | ClosedCells | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw alternative routes, each in its own colour, on rooms or places.

    The legend shows the number of each route, 1 for the plain plan, its length and its doors. Where
    routes overlap, the later one is the wider line below. With rooms, all doors that the routes
    pass have their numbers. More than five routes differ by dashes too.

    Parameters
    ----------
    topology
        The map that they were planned on.
    alternatives
        The routes; without any, the title states that there is no path.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the map's name and the count of routes; empty for none.
    costs, blocked
        Costs and closures of the query, drawn over the cells; None for none.
    width_in
        Width of a new figure in inches; its height follows.

    Examples
    --------
    >>> from hybridnav.viz import plot_alternatives
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> found = hn.plan_alternatives(hn.HybridPlanner(topology), (0.5, 0.5), (2.0, 2.5), 2)
    >>> plot_alternatives(topology, found, title="alternatives").get_title()
    'alternatives'
    """
    paths = [alternative.path for alternative in alternatives]
    canvas = Canvas.opened(ax, width_in, known_view(topology.grid))
    legs = [leg for alternative in alternatives for leg in alternative.tour.legs]
    endpoints = list(paths[0].points[[0, -1]]) if paths else []
    lines = [path.points for path in paths]
    ground, labels = _draw_ground(canvas, topology, legs, lines, style.PALE)
    ground += draw_query(canvas, topology, costs, blocked)
    entries: list[Entry] = []
    styles = itertools.product(_DASHES, style.ROUTES)
    for number, (one, (dashes, colour)) in enumerate(zip(alternatives, styles, strict=False)):
        _draw_line(canvas, one.path.points, number, colour, dashes)
        sample = Line2D([], [], color=colour, linestyle=dashes or "-", lw=2.2 * canvas.sizes.line)
        by_costs = one.result.metric in COST_METRICS
        cost = f", cost {one.result.cost:.2f} m" if by_costs else ""
        length = f"{one.path.length_m:.2f} m{cost}"
        entries.append((sample, f"route {number + 1}, {length}{_by(one.tour.legs)}"))
    markers = [Marker(name, end) for name, end in zip(("start", "goal"), endpoints, strict=False)]
    draw_markers(canvas, markers, lines, labels=labels)
    text = f"{len(paths)} route{'s' if len(paths) > 1 else ''}" if paths else "no path"
    words = [topology.grid.name, text] if title is None else [title]
    return finish(canvas, entries + ground, words)


def _by(legs: Sequence[Leg]) -> str:
    """Return the doors of a route for the legend, the first and the last of many."""
    doors = [leg.door for leg in legs if leg.door is not None]
    if not doors:
        return ""
    shown = [str(door.number) for door in doors]
    if len(doors) > _MOST_DOORS:
        shown = [*shown[: _MOST_DOORS - 2], "...", shown[-1]]
    ending = "s" if len(doors) > 1 else ""
    kinds = " and ".join(f"{kind}{ending}" for kind in sorted({door.kind for door in doors}))
    return f", by {kinds} {', '.join(shown)}"


def _draw_line(
    canvas: Canvas, points: FloatArray, number: int, colour: str, dashes: _Dashes | None
) -> None:
    """Draw the line of a route: each later one is wider and below those before it."""
    steps = min(number, len(style.ROUTES) - 1)
    width = (_ROUTE_WIDTH + _WIDER * steps) * canvas.sizes.line
    casing = patheffects.withStroke(
        linewidth=width + _CASING * canvas.sizes.line, foreground=style.FREE
    )
    canvas.add_line(
        points,
        color=colour,
        linestyle=dashes or "-",
        linewidth=width,
        solid_capstyle="round",
        solid_joinstyle="round",
        path_effects=[casing] if dashes is None else [],
        zorder=7 - number / 20,
        gid=f"route-{number + 1}",
    )


def _draw_ground(
    canvas: Canvas,
    topology: TopologicalMap,
    legs: Sequence[Leg],
    lines: Sequence[FloatArray],
    strength: float,
) -> tuple[list[Entry], LabelPlacer]:
    """Draw rooms with names and doors, or places if there are no rooms, below lines of points.

    Return the entries of the legend, and the labels that were placed.
    """
    grid = topology.grid
    if not topology.has_rooms:
        places = Places(topology.level)
        draw_cells(canvas, grid, topology.level.field_of, places.colours(~places.free))
        entry: Entry = (swatch(style.PLACES, style.PALE), "places")
        return [entry, *ground_entries(grid)], LabelPlacer(canvas)
    rooms = topology.rooms
    ground = draw_room_cells(canvas, rooms.listed_labels, grid, strength=strength)
    passed = list({leg.door.number: leg.door for leg in legs if leg.door is not None}.values())
    doors = _drawn_doors(rooms, passed)
    writer = RoomWriter(canvas, grid, rooms.listed_labels)
    writer.labels.keep_free(
        [end for line in lines for end in line[[0, -1]]], 0.6 * _WAYPOINT_POINTS
    )
    writer.labels.keep_free([door.position for door in doors], DOOR_POINTS * canvas.sizes.line)
    writer.number_doors(passed, always=True)
    named_first = {leg.room for leg in legs if leg.room is not None}
    left_out = writer.write_names(named_first, lines=lines)
    entries: list[Entry] = [room_entry(left_out, strength), *draw_doors(canvas, doors)]
    return entries + ground, writer.labels


def _drawn_doors(rooms: Rooms, passed: Sequence[Door]) -> list[Door]:
    numbers = {door.number for door in (*passed, *rooms.listed_doors)}
    return [door for door in rooms.doors if door.number in numbers]


# One call for a picture of what was planned or measured.

_DPI = 100
"""Pixels per inch of a picture in a notebook."""


def plot(
    shown: PlanResult | Tour | Alternatives | HasLosses,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw a plan, a tour, alternatives, or the losses of a study.

    A result knows the map that it was planned on; so do the others by their results. The functions
    `plot_plan`, `plot_tour`, `plot_alternatives` and `plot_losses` have more settings.

    Parameters
    ----------
    shown
        What to draw, as a planner, `hybridnav.plan` or `hybridnav.evaluate` returned it.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the usual one; empty for none.
    width_in
        Width of a new figure in inches.

    Raises
    ------
    InvalidValueError
        When it is something else, or a copy of a result, which holds no map.

    Examples
    --------
    >>> result = hn.plan(hn.example_map("figure1"), (0.5, 0.5), (2.0, 2.5))
    >>> hn.plot(result).get_title()
    'figure1  ·  path 2.5 m  ·  1 place on the route'
    """
    look: Any = {"ax": ax, "title": title, "width_in": width_in}
    if isinstance(shown, HasLosses):
        return plot_losses(shown, **look)
    first = shown
    if isinstance(first, Alternatives):
        if not first:
            raise InvalidValueError("there is no route to draw: plan between joined points")
        first = first[0].tour
    if isinstance(first, Tour):
        first = first.results[0]
    if not isinstance(first, PlanResult):
        raise InvalidValueError(
            f"a plan, a tour, alternatives or a study can be drawn, got {shown!r:.80}: for others "
            "see hybridnav.viz"
        )
    ground = first.ground
    if ground is None:
        raise InvalidValueError(
            "a copy of a result, or one read from a file, holds no map: draw the result that was "
            "planned, or take plot_plan with the map"
        )
    topology = ground.topology
    if topology is None:  # the map changed, and its places are not built yet
        return plot_paths(ground.grid, [] if first.path is None else first.path.points, **look)
    on: Any = {"costs": ground.costs.layer, "blocked": ground.closed}
    if isinstance(shown, PlanResult):
        for name, end in (("start", shown.start), ("goal", shown.goal)):
            on[name] = None if end is None else end[:2]
        return plot_plan(topology, shown, **on, **look)
    draw: Any = plot_tour if isinstance(shown, Tour) else plot_alternatives
    return draw(topology, shown, **on, **look)


def in_html(shown: Any) -> str:
    """Return HTML of a plan or a study for a notebook: its picture, and its lines."""
    text = f"<pre>{html.escape(str(shown))}</pre>"
    try:
        png = picture_bytes(plot(shown), ".png", dpi=_DPI)
    except InvalidValueError:  # a copy, or nothing to draw
        return text
    alt = html.escape(str(shown).partition("\n")[0], quote=True)
    return f'<img alt="{alt}" src="{png_uri(png)}">{text}'
