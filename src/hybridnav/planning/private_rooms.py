"""Private rooms under a profile: which of them are open for a query, and which are closed."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.threads import keep_last
from hybridnav._base.typing import BoolArray, IntArray, LongArray
from hybridnav.closures.blocked import Blocked, Closable
from hybridnav.maps import NO_ROOM, CellClass
from hybridnav.maps.clearance import within_radius
from hybridnav.planning.planning import Planning
from hybridnav.planning.profile import Profile, ProfiledFloor, forbidden, in_the_way
from hybridnav.planning.result import PlanResult
from hybridnav.route import RouteFinder
from hybridnav.route.visits import visits_of
from hybridnav.search.found import ClosedCells


class PartGround(NamedTuple):
    """The connected parts of a floor under a profile: of each private room, and of all else."""

    part_of: IntArray
    """int32 (rows, cols), the part that each cell lies in, -1 where the robot may not be."""
    room_of: tuple[int, ...]
    """Label of the private room that each part lies in, -1 for a part of the others."""
    beside: tuple[frozenset[int], ...]
    """The parts that each part touches."""

    @classmethod
    def of(
        cls, is_open: BoolArray, label_of: IntArray, private: Collection[int], *, corners: bool
    ) -> PartGround:
        """Find the parts.

        `is_open`: bool (rows, cols), cells that the robot may enter; `label_of`: int32 (rows,
        cols), the room of each cell; `private`: labels of private rooms; `corners`: whether corners
        may be cut.
        """
        from scipy import ndimage  # noqa: PLC0415 - most queries need none

        around = ndimage.generate_binary_structure(2, 2 if corners else 1)
        is_private = np.isin(label_of, list(private))
        part_of = ndimage.label(is_open & ~is_private, structure=around)[0].astype(np.int32) - 1
        room_of = [NO_ROOM] * (int(part_of.max()) + 1)
        boxes = ndimage.find_objects(label_of + 1)
        for label in sorted(private):
            box = boxes[label] if label < len(boxes) else None
            if box is None:
                continue
            own = is_open[box] & (label_of[box] == label)
            parts, count = ndimage.label(own, structure=around)
            part_of[box][own] = parts[own] - 1 + len(room_of)
            room_of += [label] * count
        beside: list[set[int]] = [set() for _ in room_of]
        steps = [(0, 1), (1, 0)] + [(1, 1), (1, -1)] * corners
        for down, right in steps:
            one = part_of[: part_of.shape[0] - down, max(-right, 0) :]
            one = one[:, : part_of.shape[1] - abs(right)]
            other = part_of[down:, max(right, 0) :][:, : part_of.shape[1] - abs(right)]
            met = (one != other) & (one >= 0) & (other >= 0)
            for a, b in set(zip(one[met].tolist(), other[met].tolist(), strict=True)):
                beside[a].add(b)
                beside[b].add(a)
        return cls(part_of, tuple(room_of), tuple(map(frozenset, beside)))


def opened(
    room_of: Sequence[Any],
    beside: Sequence[Iterable[int]],
    ends: tuple[set[int], set[int]],
    own: Collection[Any],
) -> set[Any]:
    """Return the private rooms that must be crossed to leave those of start and goal.

    They are few: a way leads out of an own room through private rooms to a public part, on through
    public parts and own rooms, and by private rooms into an own room and to the goal. Those ways
    count that enter the fewest private parts besides, and their rooms are open. A way that enters
    a private room from a public part, and leaves it to one, does not count.

    `room_of`: the private room of each part, None for a public part; `beside`: the parts that each
    part touches, or a link joins with it; `ends`: the parts of the start and of the goal; none for
    an end that cannot be entered; `own`: the rooms of `room_of` that are open anyway, those of the
    ends among them. Result: rooms of `room_of`, own ones not among them.
    """
    ways = _PartSearch(room_of, beside, own)
    first, last = (ways.away(end) for end in ends)
    sums = {part: first[part] + last[part] for part in first if part in last and ways.free(part)}
    fewest = min(sums.values(), default=0)
    if not fewest:
        return set()
    best = [part for part, count in sums.items() if count == fewest]
    return ways.passed(first, best) | ways.passed(last, best)


class _PartSearch:
    """Ways away from an end, counted by the private parts, not of own rooms, that they enter."""

    def __init__(
        self, room_of: Sequence[Any], beside: Sequence[Iterable[int]], own: Collection[Any]
    ) -> None:
        self._room_of, self._beside, self._own = room_of, beside, own

    def free(self, part: int) -> bool:
        return self._room_of[part] is None or self._room_of[part] in self._own

    def _leads(self, part: int, other: int) -> bool:
        """Return whether a way goes on to a part: none enters a private room from a public part."""
        return self._room_of[part] is not None or self.free(other)

    def away(self, sources: set[int]) -> dict[int, int]:
        """Return how many parts are entered on the way to each part."""
        found = dict.fromkeys(sources, 0)
        queue = deque(sources)
        while queue:
            part = queue.popleft()
            for other in self._beside[part]:
                count = found[part] + (not self.free(other))
                if self._leads(part, other) and count < found.get(other, math.inf):
                    found[other] = count
                    (queue.appendleft if self.free(other) else queue.append)(other)
        return found

    def passed(self, known: dict[int, int], targets: Iterable[int]) -> set[Any]:
        """Return the rooms, not own ones, of all ways to some parts that enter the fewest."""
        found, seen, todo = set(), set(), list(targets)
        while todo:
            part = todo.pop()
            if part in seen:
                continue
            seen.add(part)
            if not self.free(part):
                found.add(self._room_of[part])
            before = known[part] - (not self.free(part))
            todo += [
                other
                for other in self._beside[part]
                if self._leads(other, part) and known.get(other) == before
            ]
        return found


_KEPT = 32
"""Number of closures, and of grounds, that are kept."""


End = tuple[int, "ArrayLike | str"]
"""The index of a floor, and a point or a name on it."""


class Privacy:
    """The private rooms of some floors under a profile, and which of them a query leaves open.

    `floors`: the floors, in the order of their indices; `whole`: the planner of one map without the
    profile; None for a building.
    """

    def __init__(
        self, profile: Profile, floors: Sequence[ProfiledFloor], *, whole: Any = None
    ) -> None:
        self.profile, self._floors, self._whole = profile, tuple(floors), whole
        self._private = [
            {
                floor.rooms.names.index(name)
                for name, use in floor.rooms.uses.items()
                if use.private and not profile.through_private
            }
            if floor.rooms is not None
            else set()
            for floor in floors
        ]
        self._grounds: dict[tuple[int, ClosedCells | None], PartGround] = {}
        self._joined: dict[tuple[Any, ...], ClosedCells] = {}

    def rooms_closed(self, floor: int, opened: Collection[tuple[int, int]] = ()) -> Blocked | None:
        """Return the private rooms of a floor but those that are opened, and the doors that are
        too narrow; None for none."""
        rooms = self._floors[floor].rooms
        labels = [one for one in sorted(self._private[floor]) if (floor, one) not in opened]
        narrow = self._floors[floor].narrow
        if rooms is None or not (labels or narrow):
            return None
        return Blocked(rooms=[rooms.names[label] for label in labels], doors=narrow)

    def blocked(
        self,
        ends: Sequence[End],
        shut: Mapping[int, ClosedCells],
        links: Sequence[Sequence[tuple[int, ArrayLike]]] = (),
    ) -> dict[int, Blocked]:
        """Return what a profile closes on each floor for a query.

        It closes private rooms but those of its ends and the ones that must be crossed from there,
        and where it cannot turn at the goal.

        `ends`: start and goal, and what lies between: floors with points or names; `shut`: cells
        that are closed besides, by floor; `links`: the ends of each link that may be used.
        """
        own = {(floor, self._floors[floor].label_at(waypoint)) for floor, waypoint in ends}
        own = {(floor, label) for floor, label in own if label in self._private[floor]}
        opens = set(own)
        if own:
            opens |= self._crossed(ends, own, shut, links)
        found = {floor: self.rooms_closed(floor, opens) for floor in range(len(self._floors))}
        closed = {floor: one for floor, one in found.items() if one is not None}
        cells = self._too_tight(ends[-1], shut.get(ends[-1][0]))
        if len(cells):
            floor = ends[-1][0]
            closed[floor] = closed.get(floor, Blocked()) | Blocked(cells=cells)
        return closed

    def closed(
        self, now: Planning, waypoints: Sequence[ArrayLike | str], blocked: Any
    ) -> ClosedCells | None:
        """Return the closed cells of a query on one map, with those of `blocked`."""
        shut = now.closed(blocked)
        taken = {} if shut is None else {0: shut}
        more = self.blocked([(0, waypoint) for waypoint in waypoints], taken).get(0)
        return self.joined(now.closed, more, shut)

    def stated(
        self,
        result: PlanResult,
        ends: tuple[ArrayLike | str, ArrayLike | str],
        blocked: Closable | ClosedCells | None,
    ) -> PlanResult:
        """Return the result of a plan on one map, whose settings name the profile, and what it
        forbids if there is no path.

        `ends`, `blocked`: as they were given; closed cells, as a search for alternatives gives
        them, ask for no reason.
        """

        def passed(other: Profile) -> list[str] | None:
            """Return what a path under another profile passes."""
            planner = self._whole.profiled(other)
            path = planner.path_between(*ends, blocked)
            if path is None or planner.pyramid_rooms is None:
                return None
            rooms = planner.topology.rooms
            visits = visits_of(rooms, RouteFinder(rooms), path.cells, path.length_m)
            doors = [each.door for each in visits if each.door is not None]
            return in_the_way(self.profile, rooms.labels, doors, path)

        facts = {"name": self.profile.name, "asks": self.profile.described}
        if not result.solved and not isinstance(blocked, ClosedCells):
            facts["forbids"] = forbidden(self.profile, passed)
        return replace(result, settings_source=result.settings | {"profile": facts})

    def joined(
        self,
        cells_of: Callable[[Blocked], ClosedCells | None],
        more: Blocked | None,
        shut: ClosedCells | None,
    ) -> ClosedCells | None:
        """Return closed cells with those of a profile: the same object for equal ones, by which
        searches keep what they have built."""
        own = None if more is None else cells_of(more)
        if own is None or shut is None:
            return own or shut
        if shut.holds(own.flat).all():
            return shut
        key = own, shut
        found = self._joined.pop(key, None) or own | shut
        return keep_last(self._joined, key, found, _KEPT)

    def _crossed(
        self,
        ends: Sequence[End],
        own: set[tuple[int, int]],
        shut: Mapping[int, ClosedCells],
        links: Sequence[Sequence[tuple[int, ArrayLike]]],
    ) -> set[tuple[int, int]]:
        """Return the private rooms that must be crossed to leave those of the ends."""
        grounds = [self._ground(floor, shut.get(floor)) for floor in range(len(self._floors))]
        begins = np.cumsum([0, *(len(ground.room_of) for ground in grounds)]).tolist()
        room_of: list[tuple[int, int] | None] = []
        beside: list[set[int]] = []
        for floor, ground in enumerate(grounds):
            room_of += [None if label < 0 else (floor, label) for label in ground.room_of]
            beside += [{part + begins[floor] for part in each} for each in ground.beside]

        def parts_at(floor: int, waypoint: ArrayLike | str) -> set[int]:
            here, of = self._floors[floor], grounds[floor].part_of
            if isinstance(waypoint, str) and here.rooms and waypoint in here.rooms.names:
                found = np.unique(of[here.rooms.label_of == here.label_at(waypoint)]).tolist()
            else:
                row, col = here.cell_at(waypoint)
                rows, cols = of.shape
                found = [of[row, col]] if 0 <= row < rows and 0 <= col < cols else []
            return {int(part) + begins[floor] for part in found if part >= 0}

        for link in links:
            joined = [part for at in link for part in parts_at(*at)]
            for part in joined:
                beside[part] |= set(joined) - {part}
        found: set[tuple[int, int]] = set()
        for one, other in pairwise(ends):
            if any((at[0], self._floors[at[0]].label_at(at[1])) in own for at in (one, other)):
                found |= opened(room_of, beside, (parts_at(*one), parts_at(*other)), own)
        return found

    def _ground(self, floor: int, shut: ClosedCells | None) -> PartGround:
        """Return the parts of a floor; the last ones are kept."""
        key = floor, shut
        found = self._grounds.pop(key, None)
        if found is None:
            here = self._floors[floor]
            none = np.full(here.grid.shape, NO_ROOM, dtype=np.int32)
            label_of = none if here.rooms is None else here.rooms.label_of
            is_open, corners = here.open_but(shut), here.grid.corner_cutting
            found = PartGround.of(is_open, label_of, self._private[floor], corners=corners)
        return keep_last(self._grounds, key, found, _KEPT)

    def _too_tight(self, goal: End, shut: ClosedCells | None) -> LongArray:
        """Return the cells of the goal's room from which no place to turn in is reached without
        leaving it, int64 (n, 2); none for a goal in no room."""
        none = np.empty((0, 2), dtype=np.int64)
        here, label = self._floors[goal[0]], self._floors[goal[0]].label_at(goal[1])
        if self.profile.turn_m is None or label == NO_ROOM or here.rooms is None:
            return none
        from scipy import ndimage  # noqa: PLC0415 - on demand

        grid = here.grid
        box = ndimage.find_objects((here.rooms.label_of == label).astype(np.int8))[0]
        own = here.open_but(shut)[box] & (here.rooms.label_of[box] == label)
        radius = self.profile.turn_m / 2 / grid.resolution_m
        near = within_radius(grid.measured == CellClass.OCCUPIED, radius_cells=radius)[box]
        parts, count = ndimage.label(own)
        has_turn = np.bincount(parts[own & ~near], minlength=count + 1) > 0
        rows, cols = np.nonzero(own & ~has_turn[parts])
        return np.stack([rows + box[0].start, cols + box[1].start], axis=1)
