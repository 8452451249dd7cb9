"""Floors with known rooms and doors, questions about them, and a judge that knows the answers.

The judge asks nothing of the package: rooms are what was painted, reachability is flooding, lengths
are by scipy, doors by a search over rooms.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import csgraph

from tests.oracle.grid import move_graph

RESOLUTION_M = 0.25
NAMES = ("kitchen 1", "Kitchen 2", "ward 1", "ward 2", "ward 10", "Büro", "lab", "store", "hall A")
SLACK = 1.0824
"""Most by which a path of cells is longer than one at any angle."""


@dataclass
class Doorway:
    """A door that was painted: its two rooms, and the moves through it."""

    rooms: tuple[int, int]
    moves: list[tuple[tuple[int, int], tuple[int, int]]]
    number: int = 0
    """What the server calls it."""

    @property
    def centre(self) -> NDArray[np.float64]:
        """Its middle, `(x, y)` in metres."""
        row, col = np.array(self.moves, dtype=np.float64).reshape(-1, 2).mean(axis=0)
        return np.array([col + 0.5, row + 0.5]) * RESOLUTION_M


class PaintedFloor:
    """Rooms in rows with walls of a cell, doors of three or four cells."""

    def __init__(self, seed: int) -> None:
        self.rng = rng = np.random.default_rng(seed)
        heights, widths = rng.integers(6, 11, rng.integers(2, 4)), rng.integers(6, 11, 3)
        tops, lefts = (np.concatenate([[1], 1 + np.cumsum(one + 1)]) for one in (heights, widths))
        self.free = np.zeros((tops[-1], lefts[-1]), np.bool_)
        self.label_of: NDArray[np.int32] = np.full(self.free.shape, -1, np.int32)
        self.boxes: list[tuple[int, int, int, int]] = []
        for (top, low), (left, right) in itertools.product(
            itertools.pairwise(tops), itertools.pairwise(lefts)
        ):
            self.free[top : low - 1, left : right - 1] = True
            self.label_of[top : low - 1, left : right - 1] = len(self.boxes)
            self.boxes.append((int(top), int(low) - 1, int(left), int(right) - 1))
        order = rng.permutation(len(NAMES))[: len(self.boxes)]
        self.names = tuple(NAMES[k] for k in order)
        self.doors: list[Doorway] = []
        across = len(widths)
        for k in range(len(self.boxes)):
            for other, axis in ((k + 1, 1), (k + across, 0)):
                is_beside = other < len(self.boxes) and (axis == 0 or other % across)
                if is_beside and rng.random() < 0.75:
                    self._cut(k, other, axis)

    def _cut(self, one: int, other: int, axis: int) -> None:
        """Cut a door into the wall between two rooms; its cells belong to the first."""
        top, low, left, right = self.boxes[one]
        first, last, wall = (top, low, right) if axis else (left, right, low)
        width = int(self.rng.integers(3, 5))
        at = int(self.rng.integers(first + 1, last - width))
        cells = [(k, wall) if axis else (wall, k) for k in range(at, at + width)]
        for cell in cells:
            self.free[cell] = True
            self.label_of[cell] = one
        step = (0, 1) if axis else (1, 0)
        moves = [(cell, (cell[0] + step[0], cell[1] + step[1])) for cell in cells]
        self.doors.append(Doorway((one, other), moves))

    def inner_point(self) -> tuple[list[float], tuple[int, int], int]:
        """A point well inside a room: in metres, as a cell, and the room."""
        room = int(self.rng.integers(len(self.boxes)))
        top, low, left, right = self.boxes[room]
        cell = int(self.rng.integers(top + 2, low - 2)), int(self.rng.integers(left + 2, right - 2))
        off = self.rng.random(2) * 0.8 + 0.1
        x, y = ((np.array(cell[::-1]) + off) * RESOLUTION_M).round(4).tolist()
        return [x, y], cell, room

    def reachable(
        self, one: Any, other: Any, *, width: float | None, doors: Any, rooms: Any
    ) -> bool:
        """Flood from one cell to another, without closed doors and rooms."""
        apart = ndimage.distance_transform_edt(self.free) ** 2
        reach = 0.8 if width is None else width / 2 / RESOLUTION_M
        able = self.free & (
            np.rint(apart) > (math.floor(reach**2 * (1 + 1e-9)) if reach >= 1 else 0)
        )
        able &= ~np.isin(self.label_of, list(rooms))
        barred = {frozenset(move) for door in doors for move in door.moves}
        known, queue = {one}, [one]
        while queue:
            row, col = queue.pop()
            for near in ((row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)):
                if able[near] and near not in known and frozenset(((row, col), near)) not in barred:
                    known.add(near)
                    queue.append(near)
        return bool(able[one]) and other in known

    def octile_m(self, one: tuple[int, int]) -> NDArray[np.float64]:
        """Lengths of shortest paths of cells from one, metres."""
        at = one[0] * self.free.shape[1] + one[1]
        found = csgraph.dijkstra(move_graph(self.free), directed=False, indices=at)
        lengths: NDArray[np.float64] = found.reshape(self.free.shape) * RESOLUTION_M
        return lengths


class Judge:
    """Asks about a floor and holds the answers against what was painted."""

    def __init__(self, floor: PaintedFloor, ask: Callable[..., dict[str, Any]]) -> None:
        self.floor, self.ask, self.rng = floor, ask, floor.rng
        for door in floor.doors:
            found = ask("where_am_i", point=door.centre.round(6).tolist())["nearest_door"]
            assert found["straight_m"] < RESOLUTION_M
            door.number = found["number"]
        assert len({door.number for door in floor.doors}) == len(floor.doors)
        assert ask("describe_map")["doors"] == len(floor.doors)

    def questions(self, count: int) -> Iterator[str]:
        """Ask so many questions, each of a kind in turn, and yield their kinds."""
        kinds = [name for name in dir(self) if name.startswith("judge_")]
        for kind in itertools.islice(itertools.cycle(kinds), count):
            getattr(self, kind)()
            yield kind

    def _some_doors(self) -> list[Doorway]:
        return [door for door in self.floor.doors if self.rng.random() < 0.4]

    def judge_place(self) -> None:
        """The room of a point, and what lies behind its doors."""
        point, _, room = self.floor.inner_point()
        found = self.ask("where_am_i", point=point)
        assert found["room"] == self.floor.names[room]
        beside = {
            (door.number, self.floor.names[next(k for k in door.rooms if k != room)])
            for door in self.floor.doors
            if room in door.rooms
        }
        assert {(one["door"], one["to"]) for one in found["beside"]} == beside

    def judge_list(self) -> None:
        word = str(self.rng.choice(["WARD", "kitchen", "buro", "lab"]))
        found = self.ask("list_rooms", name=word, count=50)
        plain = [(name.lower().replace("ü", "u"), name) for name in self.floor.names]
        assert {one["name"] for one in found["rooms"]} == {
            name for low, name in plain if word.lower() in low
        }
        wards = [int(one["name"].split()[1]) for one in found["rooms"] if "ward" in one["name"]]
        assert wards == sorted(wards)

    def judge_reach(self) -> None:
        """Whether one can go, past closed doors and rooms, as wide as one is."""
        (p, one, room), (q, other, goal) = self.floor.inner_point(), self.floor.inner_point()
        width = float(self.rng.choice([0, 0.4, 0.6, 0.9, 1.2])) or None
        doors = self._some_doors()
        free = [k for k in range(len(self.floor.names)) if k not in {room, goal}]
        rooms = [k for k in free if self.rng.random() < 0.2]
        avoiding = [f"door {door.number}" for door in doors] + [self.floor.names[k] for k in rooms]
        found = self.ask("can_reach", start=p, goal=q, width=width, avoiding=avoiding)
        true = self.floor.reachable(one, other, width=width, doors=doors, rooms=rooms)
        assert found["can_reach"] == true, (p, q, width, avoiding, found)

    def judge_route(self) -> None:
        """The length of a route, against paths of cells, and its proof."""
        (p, one, _), (q, other, _) = self.floor.inner_point(), self.floor.inner_point()
        found = self.ask("route", start=p, goal=q, points=True)
        octile = self.floor.octile_m(one)[other]
        assert (found["status"] == "solved") == math.isfinite(octile)
        if math.isfinite(octile):
            off = 1.6 * RESOLUTION_M  # points lie off the centres of their cells
            assert octile / SLACK - off <= found["length_m"] <= octile + off
            assert found["lower_bound_m"] <= found["length_m"]
            steps = np.diff(np.array(found["points"]), axis=0)
            assert abs(np.hypot(*steps.T).sum() - found["length_m"]) < 0.01

    def judge_nearest(self) -> None:
        """The nearest room with a word in its name, by the way one goes."""
        p, one, _ = self.floor.inner_point()
        found = self.ask("nearest", of="ward", start=p)
        lengths = self.floor.octile_m(one)
        wards = [k for k, name in enumerate(self.floor.names) if "ward" in name]
        reached = [k for k in wards if np.isfinite(lengths[self.floor.label_of == k]).any()]
        if not reached:
            assert not found["ok"]
            return
        (best,) = found["nearest"]
        listed = {each["name"]: each for each in self.ask("list_rooms", name="ward")["rooms"]}
        off = 1.6 * RESOLUTION_M
        for k in reached:
            x, y = listed[self.floor.names[k]]["point"]
            octile = lengths[int(y / RESOLUTION_M), int(x / RESOLUTION_M)]
            assert best["length_m"] <= octile + off
            if best["name"] == self.floor.names[k]:
                assert octile / SLACK - off <= best["length_m"]

    def judge_why(self) -> None:
        """The fewest doors to open when all are closed."""
        (p, _, room), (q, _, goal) = self.floor.inner_point(), self.floor.inner_point()
        avoiding = [f"door {door.number}" for door in self.floor.doors]
        found = self.ask("explain", start=p, goal=q, avoiding=avoiding)
        graph = nx.Graph(door.rooms for door in self.floor.doors)
        graph.add_nodes_from(range(len(self.floor.names)))
        assert found["has_path"] == (room == goal)
        fewest = nx.shortest_path_length(graph, room, goal) if nx.has_path(graph, room, goal) else 0
        assert len(found["doors_to_open"]) == fewest
        opened = [door.rooms for door in self.floor.doors if door.number in found["doors_to_open"]]
        through = nx.Graph(opened)
        through.add_nodes_from([room, goal])
        assert nx.has_path(through, room, goal) == nx.has_path(graph, room, goal)

    def judge_names(self) -> None:
        """What may mean several rooms is asked back; what is misspelt is suggested."""
        point, _, _ = self.floor.inner_point()
        kitchens = {name for name in self.floor.names if "kitchen" in name.lower()}
        found = self.ask("route", start="the kitchen", goal=point)
        if len(kitchens) == 2:
            assert not found["ok"]
            assert {one["name"] for one in found["choices"]} == kitchens
        elif not kitchens:
            assert not found["ok"]
        if "ward 10" in self.floor.names:
            wrong = self.ask("route", start="wrad 10", goal=point)
            assert not wrong["ok"]
            assert "ward 10" in wrong["text"]

    def judge_session(self) -> None:
        """Doors that are closed stay closed until they are opened, or the change is taken back."""
        if not self.floor.doors:
            return
        (p, one, _), (q, other, _) = self.floor.inner_point(), self.floor.inner_point()
        doors = self._some_doors() or self.floor.doors[:1]
        numbers = [door.number for door in doors]
        closed = self.ask("close", doors=numbers)["closed"]
        assert closed == {"doors": numbers, "rooms": []}
        for now in (doors, doors[1:]):
            true = self.floor.reachable(one, other, width=None, doors=now, rooms=())
            assert self.ask("can_reach", start=p, goal=q)["can_reach"] == true
            if now is doors:
                self.ask("open", doors=numbers[:1])
        assert self.ask("undo")["closed"]["doors"] == numbers
        assert self.ask("undo")["closed"]["doors"] == []
