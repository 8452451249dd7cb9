"""Checks of buildings: their floors fit together, and robots can stand at the ends of links."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from hybridnav._base.trig import hypots
from hybridnav._base.typing import LongArray
from hybridnav.closures import OutOfOrder
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.floors import Floor
from hybridnav.ext.fleet.links import ClosedLink, Endpoint, Link, LinkEnd
from hybridnav.ext.fleet.plan import BuildingPlan
from hybridnav.guide.words.itinerary import guide_of
from hybridnav.maps import CellClass
from hybridnav.maps.checks import checked_type
from hybridnav.maps.names import did_you_mean, place_of_name
from hybridnav.planning import HybridPlanner, PlanStatus, Profile
from hybridnav.planning.endpoints import places_of_endpoints, read_point, refusal
from hybridnav.planning.named import check_names
from hybridnav.planning.profile import ProfiledFloor, forbidden, in_the_way, under_profile
from hybridnav.search.found import ClosedCells

_LEAST_PART = 0.05
"""Share of the largest connected part of a floor that a part with the end of a link has."""


def check_floors(floors: Sequence[Floor]) -> None:
    """Refuse floors that do not make one building for one robot.

    Raises `InvalidValueError` when there is none, a name occurs twice, or their planners plan by
    different presets, for different robots, or with headings.
    """
    if not floors:
        raise InvalidValueError("a building needs at least one floor, got none")
    seen: set[str] = set()
    for floor in floors:
        checked_type("floors", floor, Floor)
        if floor.name in seen:
            raise InvalidValueError(f"floor {floor.name}: the name is given twice")
        seen.add(floor.name)
        if floor.planner.needs_headings:
            raise InvalidValueError(
                f"floor {floor.name}: preset {floor.planner.preset.name} plans with headings, "
                "which ends of links do not have: take a preset without"
            )
    first = floors[0]
    radius_m = first.planner.grid.robot_radius_m
    for floor in floors[1:]:
        other_m = floor.planner.grid.robot_radius_m
        if other_m != radius_m:
            raise InvalidValueError(
                f"floor {floor.name} is for a robot radius of {other_m:g} m and floor "
                f"{first.name} for {radius_m:g} m: load all maps with one robot_radius_m"
            )
        if floor.planner.preset.planner != first.planner.preset.planner:
            raise InvalidValueError(
                f"floor {floor.name} is planned by preset {floor.planner.preset.name} and floor "
                f"{first.name} by {first.planner.preset.name}: their bounds do not add up, take "
                "one preset"
            )


def check_links(links: Sequence[Link], floors: Sequence[Floor]) -> None:
    """Refuse links whose names occur twice, and ends where this robot cannot stand.

    Links that the robot does not fit in need no free ends.

    Raises `InvalidValueError` when a link is refused.
    """
    by_name = {floor.name: floor for floor in floors}
    seen: set[str] = set()
    for link in links:
        checked_type("links", link, Link)
        if not link.name.strip() or not link.name.isprintable():
            raise InvalidValueError(
                f"a link needs a name of one printable line, got {link.name!r:.80}"
            )
        if link.name in seen:
            raise InvalidValueError(f"link {link.name}: the name is given twice")
        seen.add(link.name)
        check_ends(link, by_name)


def check_ends(link: Link, floors: Mapping[str, Floor]) -> None:
    """Refuse a link that stops at no floor of a name, or where this robot cannot stand.

    Raises `InvalidValueError` when an end is refused.
    """
    for end in link.ends:
        if end.floor not in floors:
            raise InvalidValueError(
                f"link {link.name}: no floor is called {end.floor!r:.80}"
                f"{did_you_mean(end.floor, tuple(floors))}"
            )
        if link.admits(floors[end.floor].planner.grid.robot_radius_m):
            _check_free(link, end, floors[end.floor])


def _check_free(link: Link, end: LinkEnd, floor: Floor) -> None:
    planner = floor.planner
    grid, allowed = planner.grid, planner.preset.planner.allow_unexplored
    x, y = end.position_m
    at = f"link {link.name}: its end ({x:g}, {y:g}) on floor {floor.name}"
    row, col = grid.frame.cell_of(x, y)
    if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
        raise InvalidValueError(f"{at} lies outside the map: give a point on it")
    cell = CellClass(grid.classes[row, col])
    if cell == CellClass.FREE or (allowed and cell == CellClass.UNEXPLORED):
        return
    if grid.measured[row, col] == CellClass.FREE:
        why = f"is too near to an obstacle for a robot radius of {grid.robot_radius_m:g} m"
    else:
        why = f"lies in an {cell.name.lower()} cell"
    raise InvalidValueError(f"{at} {why}: give a point where the robot can stand")


def check_closing(item: OutOfOrder, floors: Sequence[Floor], links: Sequence[Link]) -> None:
    """Refuse to close what is not in a building.

    Raises `InvalidValueError` when there is no such link, floor, door or room, or a door or a room
    lacks its floor.
    """
    names = tuple(floor.name for floor in floors)
    if item.link is not None:
        ClosedLink.of(item.link, links)
    elif item.floor is None:
        raise InvalidValueError(f"{item.what} needs its floor, as {names[0]}:{item.what}")
    else:
        floor = floors[place_of_name(item.floor, names, "floor")]
        item.check_in(floor.planner.topology)


class FloorParts(NamedTuple):
    """The connected parts of a floor that the robot may be in."""

    of_cell: LongArray
    """int64 (rows, cols), the part that each cell lies in, -1 where the robot may not be."""
    sizes: LongArray
    """int64 (n,), cells of each part."""

    @classmethod
    def of(cls, floor: Floor) -> FloorParts:
        """Find the parts of a floor."""
        part_of = parts_of(floor, allow_unexplored=floor.planner.preset.planner.allow_unexplored)
        return cls(part_of, np.bincount(part_of[part_of >= 0]))


def check_reach(link: Link, floors: Mapping[str, Floor], parts: Mapping[str, FloorParts]) -> None:
    """Refuse a link if the robot does not reach the rest of a floor from its end there.

    A floor may consist of several parts, as two wings without a passage do, but an end lies in none
    that is smaller than a twentieth of the largest.

    `link`: the link, whose ends have been checked; `floors`: the floors of the building, by their
    names; `parts`: the parts of each floor. Raises `InvalidValueError` when an end lies in such a
    part.
    """
    for end in link.ends:
        grid = floors[end.floor].planner.grid
        if not link.admits(grid.robot_radius_m):
            continue
        of_cell, sizes = parts[end.floor]
        cells = sizes[of_cell[grid.frame.cell_of(*end.position_m)]]
        if cells < _LEAST_PART * sizes.max():
            x, y = end.position_m
            here, most = (n * grid.cell_area_m2 for n in (cells, sizes.max()))
            raise InvalidValueError(
                f"link {link.name}: its end ({x:g}, {y:g}) on floor {end.floor} lies in a "
                f"part of {here:.3g} m² that is cut off from the rest, {most:.3g} m²: give a "
                "point from which the robot can drive away"
            )


def parts_of(floor: Floor, *, allow_unexplored: bool = False) -> LongArray:
    """Return the connected part that each cell of a floor lies in, int64 (rows, cols), -1 where the
    robot may not be."""
    from scipy import ndimage  # noqa: PLC0415 - a plan on one map needs none

    grid = floor.planner.grid
    around = ndimage.generate_binary_structure(2, 2 if grid.corner_cutting else 1)
    labels, _ = ndimage.label(grid.enterable(allow_unexplored=allow_unexplored), structure=around)
    return np.asarray(labels, dtype=np.int64) - 1


def check_speed(speed_m_s: float) -> float:
    """Return a speed, refuse what is none.

    Raises `InvalidValueError` when it is not a finite number above 0.
    """
    if not (math.isfinite(speed_m_s) and speed_m_s > 0):
        raise InvalidValueError(
            f"speed_m_s is {speed_m_s!r:.40}, expected a finite number of metres per second above 0"
        )
    return float(speed_m_s)


# Starts and goals in buildings: a floor, and a point or a name on it.


def endpoints_of(start: Any, goal: Any, floors: Sequence[Floor]) -> tuple[Endpoint, Endpoint]:
    """Return the floors of a start and a goal, and the points or names on them.

    Raises `InvalidValueError` when one is neither, a floor or a name is not known, a name is on
    several floors, or a point is not two finite numbers.
    """
    return _endpoint("start", start, floors), _endpoint("goal", goal, floors)


def _endpoint(what: str, given: Any, floors: Sequence[Floor]) -> Endpoint:
    if isinstance(given, str):
        index, waypoint = _floor_of_name(given, floors), given
    elif isinstance(given, tuple | list) and len(given) == 2 and isinstance(given[0], str):  # noqa: PLR2004
        names = tuple(floor.name for floor in floors)
        index, waypoint = place_of_name(given[0], names, "floor"), given[1]
    else:
        raise InvalidValueError(
            f"{what} must be a floor and a point or name on it, such as ('3', (1.5, 2.0)), or a "
            f"name alone, got {given!r:.80}"
        )
    if isinstance(waypoint, str):
        check_names(floors[index].planner.topology, [waypoint])
        return Endpoint(index, waypoint)
    return Endpoint(index, read_point(what, waypoint))


def _floor_of_name(name: str, floors: Sequence[Floor]) -> int:
    """Return the index of the only floor that has a name."""
    names_of = [
        () if floor.rooms is None else (*floor.rooms.names, *floor.rooms.points) for floor in floors
    ]
    numbers = [number for number, names in enumerate(names_of) if name in names]
    if len(numbers) == 1:
        return numbers[0]
    if not numbers:
        all_names = tuple(dict.fromkeys(each for names in names_of for each in names))
        hint = did_you_mean(name, all_names) if all_names else ": no floor has rooms"
        raise InvalidValueError(f"no room or point of the building is called {name!r:.80}{hint}")
    on = " and ".join(floors[number].name for number in numbers[:3])
    raise InvalidValueError(
        f"{name!r:.80} is a name on floors {on}: give the floor too, as in "
        f"{floors[numbers[0]].name}:{name:.80}, or in Python the pair of floor and name"
    )


def refusal_of(
    endpoints: tuple[Endpoint, Endpoint], floors: Sequence[Floor], closed: dict[int, ClosedCells]
) -> PlanStatus | None:
    """Return the status of a query whose start or goal point cannot be entered; None if both can,
    and for names."""
    for end, kind in zip(endpoints, ("START", "GOAL"), strict=True):
        if isinstance(end.waypoint, str):
            continue
        planner = floors[end.floor].planner
        grid, allowed = planner.grid, planner.preset.planner.allow_unexplored
        point = tuple(read_point(kind, end.waypoint).tolist())
        cells, _, status = places_of_endpoints(grid, (point, point), allow_unexplored=allowed)
        shut = planner.closed_for_all(closed.get(end.floor))
        if shut is not None and status is None:
            status = refusal(shut, cells, grid.shape)
        if status is not None:
            return PlanStatus[status.name.replace("START", kind)]
    return None


# Buildings under a profile: planners of its width and costs, the links that it can use, and why
# there is no route.

_NEAR_M = 1.0
"""How far from its end a link is entered by who is too wide to stand there, at most."""


def floors_under(floors: Sequence[Floor], profile: Profile) -> list[Floor]:
    """Return floors with planners of the width and the costs of a profile.

    `floors`: the floors; if a profile has costs on one, it plans by costs on all.
    """
    by_costs = any(profile.by_costs(floor.rooms) for floor in floors)
    made: dict[HybridPlanner, HybridPlanner] = {}
    for floor in floors:
        if floor.planner not in made:
            before = floor.planner
            given = before.topology, before.preset, before.given_costs
            topology, preset, costs = under_profile(*given, profile, by_costs=by_costs)
            is_same = (topology, costs) == (given[0], given[2])
            made[before] = (
                before if is_same else HybridPlanner(topology, preset=preset, costs=costs)
            )
    return [replace(floor, planner=made[floor.planner]) for floor in floors]


def profiled(floors: Sequence[Floor], profile: Profile) -> list[ProfiledFloor]:
    """Return what decides about private rooms on floors with planners as wide as a profile."""
    planners = [floor.planner for floor in floors]
    return [ProfiledFloor.of(one.topology, profile, one.preset.planner) for one in planners]


def links_under(links: Sequence[Link], floors: Mapping[str, Floor], profile: Profile) -> list[Link]:
    """Return the links that a profile can use on floors with its planners.

    Where its width has no room at an end, the nearest cell of the same room within a metre is
    taken; a link without one is left out.

    `links`: the links of the building; `floors`: the floors, by name.
    """
    usable = []
    for link in links:
        radius_m = next(iter(floors.values())).planner.grid.robot_radius_m
        if link.admits(radius_m, stairs=profile.stairs):
            ends = [_end_under(end, floors[end.floor]) for end in link.ends]
            if None not in ends:
                usable.append(replace(link, ends=tuple(end for end in ends if end is not None)))
    return usable


def _end_under(end: LinkEnd, floor: Floor) -> LinkEnd | None:
    """Return the end of a link where the robot of a floor can stand, None for none."""
    planner, rooms = floor.planner, floor.rooms
    grid = planner.grid
    row, col = grid.frame.cell_of(*end.position_m)
    is_open = grid.enterable(allow_unexplored=planner.preset.planner.allow_unexplored)
    if is_open[row, col]:
        return end
    reach = int(_NEAR_M / grid.resolution_m)
    top, left = max(row - reach, 0), max(col - reach, 0)
    window = np.s_[top : row + reach + 1, left : col + reach + 1]
    near = is_open[window]
    if rooms is not None:
        near = near & (rooms.label_of[window] == rooms.label_of[row, col])
    cells = np.argwhere(near) + np.array([top, left])
    away = hypots(*(cells - [row, col]).T)
    if away.min(initial=np.inf) > reach:
        return None
    x, y = grid.frame.points_of(cells[away.argmin()][None])[0].tolist()
    return replace(end, position_m=(x, y))


def reason_under(
    profile: Profile, plan_under: Callable[[Profile], tuple[BuildingPlan, Sequence[Floor]]]
) -> str:
    """Return what of a profile leaves no route over floors, one line; empty where there is none
    without it.

    `plan_under`: returns the plan of the query under another profile, and the floors of its
    planners.
    """

    def passed(other: Profile) -> list[str] | None:
        plan, floors = plan_under(other)
        if not plan.solved:
            return None
        on = {floor.name: floor for floor in floors}
        last, words = len(plan.results) - 1, []
        for number, (name, result) in enumerate(zip(plan.floors, plan.results, strict=True)):
            guide, rooms = guide_of(on[name].planner), on[name].rooms
            if guide is None or rooms is None or result.path is None:
                continue
            whole = number == 0, number == last
            words += in_the_way(profile, rooms, guide.doors(result.path), result.path, whole=whole)
        half_m = (profile.width_m or 0.0) / 2
        taken = [
            ride.link for ride in plan.rides if not ride.link.admits(half_m, stairs=profile.stairs)
        ]
        return [*words, *(link.name for link in taken)]

    return forbidden(profile, passed)
