"""What the page draws over the cells: places, rooms and plans as plain values in grid units."""

from __future__ import annotations

import math
import threading
from typing import Any

import numpy as np
import shapely

from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.closures import Blocked, Journal, OneWay
from hybridnav.errors import InvalidValueError
from hybridnav.ext.page import requests as ask
from hybridnav.guide import Tour, plan_alternatives
from hybridnav.guide.tour import tour_of
from hybridnav.maps import CellClass, OccupancyGrid, OneWayRule
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.names import natural_key
from hybridnav.models import Model
from hybridnav.planning import HybridPlanner, PlanResult, Preset, load_preset, preset_names, under
from hybridnav.pyramid import Level
from hybridnav.rooms import Door, Rooms
from hybridnav.rooms.choices import leading_doors
from hybridnav.topology import TopologicalMap
from hybridnav.viz.places import Places

MOST_VERTICES = 20_000
"""Vertices of a level beyond which its graph is not sent: it would be one grey area."""
_MOST_BLOCKS = 40
"""Blocks of cells along a room in which a place for its name is searched."""
_WHOLE = 0.75
"""Share of free cells from which a block belongs to that place."""
_FLAT = 3
"""Width of a line of text by its height, about."""


def known_box(grid: OccupancyGrid) -> list[int]:
    """Return the box of the cells that are not unexplored: first and last column and row."""
    is_explored: BoolArray = grid.measured != CellClass.UNEXPLORED
    if not is_explored.any():
        return [0, grid.shape[1], 0, grid.shape[0]]
    rows, cols = np.flatnonzero(is_explored.any(axis=1)), np.flatnonzero(is_explored.any(axis=0))
    return [int(cols[0]), int(cols[-1]) + 1, int(rows[0]), int(rows[-1]) + 1]


def level_graph(level: Level) -> dict[str, Any]:
    """Return positions, arcs and self-loops of a level, drawn as in the pictures of places.

    Specks of a scan's noise have no dot and no arcs. An arc runs through the middle of its
    boundary.
    """
    facts = {
        "level": level.index,
        "vertices": level.n_vertices,
        "arcs": level.n_arcs,
        "self_loops": int(level.is_self_loop.sum()),
    }
    if level.n_vertices > MOST_VERTICES:
        return facts | {"drawn": False}
    places = Places(level)
    seen = places.large[level.arcs].all(axis=1) & ~level.is_self_loop
    n_free = places.free[level.arcs].sum(axis=1)
    lines = {
        name: _lines(places.lines(seen & (n_free == free)), level.grid)
        for name, free in (("unexplored_arcs", 0), ("rim_arcs", 1), ("free_arcs", 2))
    }
    looped = level.is_self_loop & places.large[level.arcs[:, 0]]
    lines["loops"] = _lines(places.loops(looped), level.grid)
    dots = {
        name: ask.in_grid(places.positions[mask & places.large], level.grid)
        for name, mask in (("unexplored_dots", ~places.free), ("free_dots", places.free))
    }
    areas = level.areas[places.free & places.large]
    spacing = float(np.sqrt(np.median(areas))) if len(areas) else 1.0
    return facts | {"drawn": True, "spacing": round(spacing, 2)} | lines | dots


def _lines(lines: list[FloatArray], grid: OccupancyGrid) -> list[Any]:
    return ask.in_grid(np.stack(lines), grid) if lines else []


def map_facts(grid: OccupancyGrid, n_zooms: int) -> dict[str, Any]:
    """Return what a page needs to know of a map before it draws its cells.

    `n_zooms`: number of sizes of its tiles.
    """
    up, along = grid.frame.axes_m.tolist()
    return {
        "name": grid.name,
        "rows": grid.shape[0],
        "cols": grid.shape[1],
        "resolution_m": grid.resolution_m,
        "robot_radius_m": grid.robot_radius_m,
        "frame": {"origin": list(grid.frame.origin_m), "up": up, "along": along},
        "known": known_box(grid),
        "zooms": n_zooms,
    }


def room_facts(rooms: Rooms) -> dict[str, Any]:
    """Return names, areas, positions and boxes of rooms, in the order of their names, and their
    doors without gaps.

    `listed` tells which of them the page shows unless it is asked for all, `leads` which doors it
    shows to people."""
    shown = {door.number for door in rooms.listed_doors}
    leading = {door.number for door in leading_doors(rooms)}
    listed = [
        {
            "name": name,
            "area_m2": round(area, 2),
            "fits": fits,
            "listed": is_listed,
            "at": [(box[0] + box[1]) / 2, (box[2] + box[3]) / 2],
            "box": box,
        }
        for name, area, fits, is_listed, box in zip(
            rooms.names,
            rooms.areas_m2.tolist(),
            rooms.fits.tolist(),
            rooms.is_listed.tolist(),
            _spots(rooms),
            strict=True,
        )
    ]
    return {
        "rooms": sorted(listed, key=lambda room: natural_key(room["name"])),
        "doors": [
            _door(door, rooms) | {"listed": door.number in shown, "leads": door.number in leading}
            for door in rooms.doors
            if not door.is_gap
        ],
        "one_way": [str(rule) for rule in rooms.labels.one_way],
    }


def _spots(rooms: Rooms) -> list[list[int]]:
    """Return where the name of each room is written, its first and last column and row.

    It is the rectangle of its free cells that has most room for a line of text.
    """
    free: BoolArray = rooms.grid.measured == CellClass.FREE
    inside = np.where(free, rooms.labels.label_of, -1)
    # Loads scipy's filters, which the rest of the page does not need.
    from scipy.ndimage import find_objects  # noqa: PLC0415

    spots = []
    for label, box in enumerate(find_objects(inside + 1, max_label=len(rooms.names))):
        if box is None:  # no free cell: nothing is written on the map
            spots.append([0, 0, 0, 0])
            continue
        row, col = (part.start for part in box)
        top, bottom, left, right = _widest(inside[box] == label)
        spots.append([col + left, col + right, row + top, row + bottom])
    return spots


def _widest(inside: BoolArray) -> tuple[int, int, int, int]:
    """Return the first and last row and column of the widest rectangle of true cells.

    It is at least a third as high as wide, in blocks of cells: specks of noise do not count.
    """
    step = -(-max(inside.shape) // _MOST_BLOCKS)
    rows, cols = (-(-n // step) for n in inside.shape)
    padded = np.zeros((rows * step, cols * step), dtype=np.bool_)
    padded[: inside.shape[0], : inside.shape[1]] = inside
    shares = padded.reshape(rows, step, cols, step).mean(axis=(1, 3))
    whole = shares >= min(_WHOLE, float(shares.max()))
    here, number = whole, np.arange(cols)
    best, area = (0, 0), (0, 1, 0, 1)
    for high in range(1, rows + 1):
        if high > 1:
            here = here[:-1] & whole[high - 1 :]
        gap = np.maximum.accumulate(np.where(here, -1, number), axis=1)
        row, last = np.unravel_index(int(np.argmax(number - gap)), here.shape)
        wide = int(number[last] - gap[row, last])
        score = (min(wide, _FLAT * high), wide * high)
        if wide and score > best:
            best, area = score, (int(row), int(row) + high, int(last) - wide + 1, int(last) + 1)
    top, bottom, left, right = (step * n for n in area)
    return top, min(bottom, inside.shape[0]), left, min(right, inside.shape[1])


def _door(door: Door, rooms: Rooms) -> dict[str, Any]:
    moves, label_of = rooms.moves_through(door.number), rooms.labels.label_of.ravel()
    into = -1 if door.rooms[1] is None else rooms.labels.index(door.rooms[1])
    steps = np.diff(np.stack(np.divmod(moves, rooms.grid.shape[1]), axis=2), axis=1)[:, 0]
    ahead = np.where(label_of[moves[:, 1:]] == into, steps, -steps).mean(axis=0)
    return {
        "ahead": np.round(ahead[::-1], 3).tolist(),
        "number": door.number,
        "rooms": list(door.rooms),
        "kind": door.kind,
        "passable": door.passable,
        "width_m": round(door.width_m, 2),
        "at": ask.in_grid(door.position, rooms.grid),
    }


# Planners by preset, and their answers.

GRID = "grid-astar"
"""The preset of the optimum on the grid."""


class PagePlanning:
    """The planners of one topological map, made when a preset is first asked for.

    `model`: the map or model; `topology`: its topological map with rooms; `settings`: the preset
    that the page begins with; its section `pyramid` holds for all; `costs`: costs given beside the
    presets, None for none.
    """

    def __init__(
        self,
        model: Model,
        topology: TopologicalMap,
        settings: Preset,
        costs: CostLayer | None = None,
    ) -> None:
        self.topology = topology
        self.grid = topology.grid
        self._model, self._settings, self._costs = model, settings, costs
        self._planners: dict[str, HybridPlanner] = {}
        self._making = threading.Lock()
        self.journal: Journal | None = None
        """What is closed for all queries until it is opened again."""

    @property
    def presets(self) -> list[str]:
        """The names to choose from, the one of the start first."""
        first = self._settings.name
        return [first, *(name for name in preset_names() if name != first)]

    def adopt(self, planner: HybridPlanner) -> None:
        """Take a planner over that is there already, with what it has prepared, unless the rooms
        have changed."""
        if planner.topology is self.topology:
            self._planners[planner.preset.name] = planner

    def planner(self, name: str) -> HybridPlanner:
        """Return the planner of a preset.

        Raises `HybridNavError` when there is no such preset, or it cannot plan on this map.
        """
        with self._making:
            if name not in self._planners:
                self._planners[name] = self._made(name)
            return self._planners[name]

    def _made(self, name: str) -> HybridPlanner:
        preset = self._settings
        if name != preset.name:
            if name not in self.presets:
                raise InvalidValueError(f"no preset is called {name!r:.80}")
            preset = load_preset(name).model_copy(update={"pyramid": self._settings.pyramid})
        return self._model.planner(preset, topology=self.topology, costs=self._costs)

    def plan(self, query: ask.PlanQuery) -> dict[str, Any]:
        """Return a plan with its certificate; unless it is brief, with rooms, doors and words."""
        planner, points = self._under(query), self._points(query)
        closed = self._closed(query)
        if query.brief:
            return self._facts(planner.plan(*points, blocked=closed))
        result = planner.plan(*points, blocked=closed)
        tour = tour_of(planner, [result], ask.named_ends(query, points))
        facts, explanation = self._facts(result), result.explanation
        if explanation is not None and not facts["why"]:
            facts["why"] = " ".join(explanation.words(query.language))
        return facts | self._itinerary(tour, query.language)

    def on_floor(self, query: ask.PartQuery) -> PlanResult:
        """Return the plan itself, to be written."""
        points, closed = self._points(query), self._closed(query)
        return self._under(query).plan(*points, blocked=closed)

    def _under(self, query: ask.PathQuery) -> HybridPlanner:
        planner = self.planner(query.preset)
        return planner if query.profile is None else under(planner, query.profile)

    def kept(self) -> HybridPlanner:
        """Return what a model of the map holds."""
        return self.planner(self.presets[0])

    @property
    def links(self) -> list[dict[str, Any]]:
        """The links that join a map with others: none."""
        return []

    def alternatives(self, query: ask.AlternativesQuery) -> dict[str, Any]:
        """Return some routes by other doors."""
        start, goal = self._points(query)
        planner, closed = self._under(query), self._closed(query)
        paths = plan_alternatives(planner, start, goal, query.count, blocked=closed)
        routes = [
            self._facts(each.result)
            | self._itinerary(
                tour_of(planner, [each.result], ask.named_ends(query, (start, goal))),
                query.language,
            )
            for each in paths
        ]
        return {"routes": routes, "complete": paths.complete, "note": paths.note}

    def _points(self, query: ask.PathQuery) -> tuple[tuple[float, ...], tuple[float, ...]]:
        start, goal = (ask.in_metres(end.point, self.grid) for end in (query.start, query.goal))
        if not self.planner(query.preset).needs_headings:
            return start, goal
        yaw = math.atan2(goal[1] - start[1], goal[0] - start[0])
        return (*start, yaw), (*goal, yaw)

    def _closed(self, query: ask.PathQuery) -> Blocked | None:
        if query.closed.links:
            raise InvalidValueError(f"one map has no links, got {query.closed.links[0]!r:.80}")
        asked = next(map(self.blocked, query.closed.floors), None)
        shut = None if self.journal is None or query.all_open else self.journal.closures()
        return asked | shut if asked and shut else asked or shut

    def blocked(self, closed: ask.FloorClosed) -> Blocked | None:
        """Return what is closed, in metres; None for nothing.

        Raises `InvalidValueError` when the corners of an area make no polygon.
        """
        if not closed:
            return None
        areas: list[list[tuple[float, float]]] = [
            [ask.in_metres(p, self.grid) for p in ring] for ring in closed.polygons
        ]
        for ring in areas:
            if not shapely.Polygon(ring).is_valid:
                raise InvalidValueError(
                    "the drawn area crosses itself: draw its corners in one turn round it"
                )
        one_way = OneWay.of(map(OneWayRule.of, closed.one_way)) if closed.one_way else None
        shut: Any = {"doors": closed.doors, "rooms": closed.rooms, "one_way": one_way}
        return Blocked(polygons=areas, **shut)

    def _facts(self, result: PlanResult) -> dict[str, Any]:
        path = result.path
        lines = [] if path is None else [ask.in_grid(path.points, self.grid)]
        parts = [{"floor": 0, "line": line} for line in lines]
        length_m = None if path is None else path.length_m
        return ask.facts_of(result, parts) | {"length_m": ask.finite(length_m)}

    def _itinerary(self, tour: Tour, language: str) -> dict[str, Any]:
        return {
            "legs": [
                {
                    "room": leg.room,
                    "shape": leg.shape,
                    "door": leg.door.number if leg.door else None,
                }
                for leg in tour.legs
            ],
            "words": ask.lines_of(tour.instructions, language, [(0, self.grid)]),
        }
