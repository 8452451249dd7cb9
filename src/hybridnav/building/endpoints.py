"""Starts and goals in buildings: a floor, and a point or a name on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from hybridnav.building.search import Endpoint
from hybridnav.errors import InvalidValueError
from hybridnav.grid.names import did_you_mean, place_of_name
from hybridnav.planner.endpoints import cells_of_endpoints, read_point
from hybridnav.planner.named import check_names
from hybridnav.result import PlanStatus

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from hybridnav.building.floors import Floor
    from hybridnav.planner.closed import ClosedCells

FloorWaypoint: TypeAlias = "str | tuple[str, ArrayLike | str]"
"""A floor and a point or name on it, or a name that only one floor has."""


def endpoint_of(what: str, given: Any, floors: Sequence[Floor]) -> Endpoint:
    """Return the floor of a start or goal, and the point or name on it.

    Parameters
    ----------
    what
        "start" or "goal".
    given
        What the caller gave.
    floors
        The floors of the building.

    Raises
    ------
    InvalidValueError
        When it is neither, the floor or the name is not known, the name is on several floors, or
        the point is not two finite numbers.
    """
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
    found = [number for number, names in enumerate(names_of) if name in names]
    if len(found) == 1:
        return found[0]
    if not found:
        known = tuple(dict.fromkeys(each for names in names_of for each in names))
        hint = did_you_mean(name, known) if known else ": no floor has rooms"
        raise InvalidValueError(f"no room or point of the building is called {name!r:.80}{hint}")
    on = " and ".join(floors[number].name for number in found[:3])
    raise InvalidValueError(
        f"{name!r:.80} is a name on floors {on}: give the floor too, as in "
        f"{floors[found[0]].name}:{name:.80}, or in Python the pair of floor and name"
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
        grid, allowed = planner.topology.grid, planner.preset.planner.allow_unexplored
        point = read_point(kind, end.waypoint)
        cells = cells_of_endpoints(grid, (point, point), allow_unexplored=allowed)
        status = cells if isinstance(cells, PlanStatus) else None
        shut = planner.closed_for_all(closed.get(end.floor))
        if status is None and shut is not None and not isinstance(cells, PlanStatus):
            status = shut.refusal(cells, grid.shape)
        if status is not None:
            return PlanStatus[status.name.replace("START", kind)]
    return None
