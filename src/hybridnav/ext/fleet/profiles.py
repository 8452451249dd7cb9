"""Buildings under a profile: planners of its width and costs, the links that it can use, and why
there is no route."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.planner import HybridPlanner
from hybridnav.planner.profile import ProfiledFloor, forbidden, in_the_way, under_profile

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from hybridnav.ext.fleet.floors import Floor
    from hybridnav.ext.fleet.links import Link, LinkEnd
    from hybridnav.ext.fleet.plan import BuildingPlan
    from hybridnav.planner import Profile

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
    found = []
    for link in links:
        radius_m = next(iter(floors.values())).planner.grid.robot_radius_m
        if link.admits(radius_m, stairs=profile.stairs):
            ends = [_end_under(end, floors[end.floor]) for end in link.ends]
            if None not in ends:
                found.append(replace(link, ends=tuple(end for end in ends if end is not None)))
    return found


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
    away = np.hypot(*(cells - [row, col]).T)
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
            guide, rooms = on[name].planner.guide, on[name].rooms
            if guide is None or rooms is None or result.path is None:
                continue
            whole = number == 0, number == last
            words += in_the_way(profile, rooms, guide, result.path, whole=whole)
        half_m = (profile.width_m or 0.0) / 2
        taken = [
            ride.link for ride in plan.rides if not ride.link.admits(half_m, stairs=profile.stairs)
        ]
        return [*words, *(link.name for link in taken)]

    return forbidden(profile, passed)
