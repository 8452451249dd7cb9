"""The picture of a building: a panel for each floor, with its links and the routes on it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet import Building, BuildingPlan, Floor, Link, LinkEnd
from hybridnav.maps import CellClass
from hybridnav.viz import style
from hybridnav.viz.canvas import PAD_IN, Canvas, View, draw_cells, known_view
from hybridnav.viz.labels import LabelPlacer, Marker, RoomWriter, draw_markers
from hybridnav.viz.layout import Entry, add_legend, add_scale_bar, add_title, frame_axes, text_width
from hybridnav.viz.maps import draw_one_way, ground_entries
from hybridnav.viz.room_map import draw_room_cells, room_entry

_MARKS = {"lift": "s", "stairs": "^", "ramp": "D"}
_POINTS = 6.0
"""Side of the mark of a link, in points."""
_LINE = 1.8
_GAP_IN = 0.12
_STRIP = 0.045
"""Height of a floor that no route visits, in widths of its map."""
_LEGEND_LINES = 4.5
"""Height of what stands below the lowest panel, in font sizes."""


def plot_building(
    building: Building,
    plans: BuildingPlan | Sequence[BuildingPlan] = (),
    *,
    axes: Sequence[Axes] | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> tuple[Axes, ...]:
    """Draw the floors of a building one above the other, the highest on top, all in one scale.

    Every end of a link has a mark by its kind, and its name. Each route is a line on the floors
    that it visits. Where the first route takes a link, the mark is filled, and the name says which
    floor it leads to. A floor that no route visits is a narrow strip with its links.

    Parameters
    ----------
    building
        The building.
    plans
        A plan, or alternatives, which have a colour each; none for the building alone.
    axes
        Axes to draw on, one for each floor in their order; by default new ones in a new figure.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    tuple of Axes
        The axes drawn on, one for each floor in their order; `axes[0].figure` is the figure.

    Raises
    ------
    InvalidValueError
        When there are not as many axes as floors.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, plot_building
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")]
    >>> len(plot_building(Building(floors)))
    2
    """
    shown = (plans,) if isinstance(plans, BuildingPlan) else tuple(plans)
    shown = tuple(plan for plan in shown if plan.solved)
    views = [_view(floor, shown) for floor in building.floors]
    heights = [floor.elevation_m for floor in building.floors]
    order = sorted(range(len(views)), key=lambda number: (-heights[number], -number))
    if axes is None:
        axes = _panels(views, order, width_in)
    elif len(axes) != len(views):
        raise InvalidValueError(f"{len(views)} floors need as many axes, got {len(axes)}")
    entries: dict[str, Any] = {}
    for number in order:
        floor = building.floors[number]
        canvas = Canvas.opened(axes[number], width_in, views[number])
        # One scale for all: sizes are those of the whole picture.
        for handle, text in _draw_floor(canvas, building, floor, shown):
            # Floors leave out different numbers of names: one entry is enough.
            entries.setdefault(text.partition(" (")[0], handle)
        frame_axes(canvas)
        add_title(canvas, _words(floor, shown))
    lowest = Canvas.opened(axes[order[-1]], width_in, views[order[-1]])
    bar = add_scale_bar(lowest)
    lines: list[Entry] = [
        (Line2D([], [], color=colour, lw=_LINE * lowest.sizes.line), _route_words(plan, number))
        for number, (plan, colour) in enumerate(zip(shown, _colours(shown), strict=True), start=1)
    ]
    ground: list[Entry] = [(handle, text) for text, handle in entries.items()]
    add_legend(lowest, lines + ground, bar=bar, below=0.35 * lowest.sizes.font)
    return tuple(axes)


def _is_strip(floor: Floor, plans: Sequence[BuildingPlan]) -> bool:
    """Return whether there are routes, and none visits a floor."""
    return bool(plans) and not any(floor.name in plan.floors for plan in plans)


def _view(floor: Floor, plans: Sequence[BuildingPlan]) -> View:
    """Return what is shown of a floor: a strip as wide as its map where no route visits it."""
    view = known_view(floor.planner.grid)
    if not _is_strip(floor, plans):
        return view
    middle, half = view.low[1] + view.size[1] / 2, min(_STRIP * view.size[0], view.size[1]) / 2
    return View(np.array([view.low[0], middle - half]), np.array([view.high[0], middle + half]))


def _panels(views: Sequence[View], order: Sequence[int], width_in: float) -> list[Axes]:
    """Return axes one below the other, in one scale, with room for titles and a legend."""
    font_in = style.Sizes.fitting(width_in, 1.0).font / 72
    title_in, below_in = 2.0 * font_in, _LEGEND_LINES * font_in
    widest = max(float(view.size[0]) for view in views)
    scale = (width_in - 2 * PAD_IN) / widest
    tall = [float(view.size[1]) * scale for view in views]
    height_in = sum(tall) + len(tall) * title_in + (len(tall) - 1) * _GAP_IN + below_in + 2 * PAD_IN
    figure = Figure(figsize=(width_in, height_in))
    axes: dict[int, Axes] = {}
    top_in = height_in - PAD_IN
    for number in order:
        wide_in = float(views[number].size[0]) * scale
        left_in, bottom_in = (width_in - wide_in) / 2, top_in - title_in - tall[number]
        box = np.array([left_in, bottom_in, wide_in, tall[number]])
        axes[number] = figure.add_axes(
            tuple((box / [width_in, height_in, width_in, height_in]).tolist())
        )
        top_in = bottom_in - _GAP_IN
    return [axes[number] for number in range(len(views))]


def _words(floor: Floor, plans: Sequence[BuildingPlan]) -> list[str]:
    """Return the parts of a panel's title."""
    words = [f"floor {floor.name}", floor.planner.grid.name]
    if plans:
        on_floor = [
            result.path.length_m
            for name, result in zip(plans[0].floors, plans[0].results, strict=True)
            if name == floor.name and result.path is not None
        ]
        words.append(f"{sum(on_floor):.1f} m" if on_floor else "not visited")
    return words


def _route_words(plan: BuildingPlan, number: int) -> str:
    by = ", ".join(dict.fromkeys(ride.link.name for ride in plan.rides))
    cost = f"cost {plan.cost:.1f} m, {plan.travel_s:.0f} s"
    return f"route {number}, {cost}" + (f", by {by}" if by else "")


def _colours(plans: Sequence[BuildingPlan]) -> list[str]:
    return [style.ROUTES[number % len(style.ROUTES)] for number in range(len(plans))]


def _draw_floor(
    canvas: Canvas, building: Building, floor: Floor, plans: Sequence[BuildingPlan]
) -> list[Entry]:
    """Draw the ground, the routes and the links of a floor, and return the legend's entries.

    A strip has the links alone, above where they are.
    """
    ends = [(link, end) for link in building.links if (end := link.end_on(floor.name))]
    if _is_strip(floor, plans):
        middle = float(canvas.view.low[1] + canvas.view.size[1] / 2)
        labels = LabelPlacer(canvas)
        held = [(end.position_m[0], middle) for _, end in ends]
        labels.keep_free(held, 0.8 * _POINTS * canvas.sizes.line)
        for link, end in ends:
            at = replace(end, position_m=(end.position_m[0], middle))
            _draw_end(canvas, labels, link, at, plans[:1])
        return [(_mark(link, canvas, is_taken=False), link.kind) for link, _ in ends]
    lines = [
        (number, result.path.points)
        for number, plan in enumerate(plans)
        for name, result in zip(plan.floors, plan.results, strict=True)
        if name == floor.name and result.path is not None
    ]
    for number, points in reversed(lines):
        width = (_LINE + 1.6 * min(number, 4)) * canvas.sizes.line
        look = {"color": _colours(plans)[number], "linewidth": width, "zorder": 7}
        canvas.add_line(points, **look, gid=f"route-{number + 1}")
    drawn = [points for _, points in lines]
    markers = _markers(floor, plans)
    entries, labels = _draw_ground(canvas, floor, drawn, [end.position_m for _, end in ends])
    labels.keep_free([marker.point for marker in markers], 5.0 * canvas.sizes.line)
    draw_markers(canvas, markers, drawn, labels=labels)
    entries = [(_mark(link, canvas, is_taken=False), link.kind) for link, _ in ends] + entries
    for link, end in ends:
        _draw_end(canvas, labels, link, end, plans[:1])
    return entries


def _markers(floor: Floor, plans: Sequence[BuildingPlan]) -> list[Marker]:
    """Return the start and the goal of the first route, where they are on a floor."""
    markers = []
    for plan in plans[:1]:
        first, last = plan.results[0].path, plan.results[-1].path
        if plan.floors[0] == floor.name and first is not None:
            markers.append(Marker("start", first.points[0]))
        if plan.floors[-1] == floor.name and last is not None:
            markers.append(Marker("goal", last.points[-1]))
    return markers


def _draw_ground(
    canvas: Canvas, floor: Floor, lines: Sequence[FloatArray], ends: Sequence[tuple[float, float]]
) -> tuple[list[Entry], LabelPlacer]:
    """Draw rooms with their names, or the map alone; return entries of the legend, and labels."""
    grid = floor.planner.grid
    rooms = floor.rooms
    if rooms is None:
        field_of = (grid.measured == CellClass.UNEXPLORED).astype(np.int64)
        draw_cells(canvas, grid, field_of, style.rgb(style.FREE, style.UNEXPLORED))
        labels = LabelPlacer(canvas)
        labels.keep_free(ends, 0.8 * _POINTS * canvas.sizes.line)
        return ground_entries(grid), labels
    draw_room_cells(canvas, rooms, grid, strength=style.PALE)
    writer = RoomWriter(canvas, grid, rooms)
    writer.labels.keep_free(ends, 0.8 * _POINTS * canvas.sizes.line)
    left_out = writer.write_names(set(), lines=list(lines))
    one_way = draw_one_way(canvas, floor.planner.topology)
    return [room_entry(left_out, style.PALE), *one_way, *ground_entries(grid)], writer.labels


def _mark(link: Link, canvas: Canvas, *, is_taken: bool) -> Line2D:
    """Return the mark of a link, filled where the route takes it."""
    line = canvas.sizes.line
    face, edge = (style.PATH, style.PATH) if is_taken else (style.FREE, style.INK)
    look: dict[str, Any] = {"markerfacecolor": face, "markeredgecolor": edge, "zorder": 8.5}
    look |= {"markersize": _POINTS * line, "markeredgewidth": 1.2 * line}
    return Line2D([], [], linestyle="none", marker=_MARKS[link.kind], **look)


def _draw_end(
    canvas: Canvas, labels: LabelPlacer, link: Link, end: LinkEnd, plans: Sequence[BuildingPlan]
) -> None:
    """Draw the end of a link with its name, and where a route rides to."""
    rides = [ride for plan in plans for ride in plan.rides if ride.link.name == link.name]
    to = next((ride.to_floor for ride in rides if ride.from_floor == end.floor), None)
    is_taken = to is not None or any(ride.to_floor == end.floor for ride in rides)
    mark = _mark(link, canvas, is_taken=is_taken)
    x, y = end.position_m
    mark.set_data([x], [y])
    mark.set_gid(f"link-{link.name}")
    canvas.ax.add_line(mark)
    words = link.label if to is None else f"{link.label}, to floor {to}"
    size = 0.85 * canvas.sizes.font
    half = np.array([text_width(words, size, "bold") / 2, 0.6 * size])
    reaches = 0.75 * _POINTS * canvas.sizes.line, 1.6 * _POINTS * canvas.sizes.line
    boxes = labels.boxes_beside(np.array([x, y]), half, reaches)
    hidden = [labels.n_hidden(box) + 100 * (not labels.is_in_view(box)) for box in boxes]
    colour = style.PATH if is_taken else style.INK
    font = {"fontsize": size, "fontweight": "bold", "color": colour}
    labels.write(words, boxes[int(np.argmin(hidden))], f"link-{link.name}-label", halo=2.0, **font)
