"""Profiles: who goes through a building, by which rooms, and how wide.

A profile is a problem of its own: its private rooms are closed, its costs count, its robot has its
width. What is planned under it is proved for that problem.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import Self

from hybridnav._base.typing import BoolArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import NO_ROOM, OccupancyGrid, RoomLabels, RoomUse
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.names import place_of_name
from hybridnav.planning import PlannerSettings, Preset
from hybridnav.planning.path import Path
from hybridnav.planning.preset import planner_settings
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.rooms import Door
from hybridnav.search.found import ClosedCells
from hybridnav.topology import TopologicalMap

_MOST_ELSEWHERE, _MOST_M = 10.0, 100.0
_ROUNDING_M = 1e-6
"""Metres by which widths are equal: a door as wide as a profile is passed."""
_MOST_NAMED = 5
"""Rooms, and doors, that a message names."""
_BY_COSTS = "grid-astar"
"""The method that plans by costs where that of the preset knows lengths only, as for `--costs`."""


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Who goes through a building, and by what.

    Raises
    ------
    InvalidValueError
        When the name is not one printable line, or a number is out of range.

    Examples
    --------
    >>> wide = hn.Profile(name="bed", stairs=False, width_m=1.0)
    >>> wide.described
    'no private rooms on the way, no stairs, 1.00 m wide'
    """

    name: str
    """Name, unlike those of other profiles of the building."""
    through_private: bool = False
    """Whether routes pass rooms of `use: private`, in which others only start or end."""
    elsewhere: float = 1.0
    """Cost of a metre outside of rooms of `prefer: corridor`, on a floor that has some."""
    costs: bool = True
    """Whether the `cost` of rooms counts."""
    stairs: bool = True
    """Whether stairs are taken."""
    width_m: float | None = None
    """Width in metres for which there must be room everywhere, also in doors; None for that of the
    robot that the map is for."""
    turn_m: float | None = None
    """Diameter in metres of the circle in which it turns. In the room of the goal there must be one
    that it reaches. None for a robot that turns on the spot."""

    def __post_init__(self) -> None:
        """Refuse what no route could keep to."""
        name = self.name
        if not isinstance(name, str) or not name.strip() or not name.isprintable():
            raise InvalidValueError(f"a profile needs a name of one line, got {name!r:.80}")
        ranges = ("elsewhere", 1.0, _MOST_ELSEWHERE), ("width_m", 0.0, _MOST_M)
        for field, least, most in (*ranges, ("turn_m", 0.0, _MOST_M)):
            value = getattr(self, field)
            if value is not None and not least <= value <= most:
                raise InvalidValueError(
                    f"profile {name:.80}: {field} is {value!r:.40}, expected a number from "
                    f"{least:g} to {most:g}"
                )

    @property
    def described(self) -> str:
        """Its demands, in one line."""
        parts = [] if self.through_private else ["no private rooms on the way"]
        if self.elsewhere > 1:
            parts.append(f"a metre outside of corridors counts {self.elsewhere:g}")
        parts += [] if self.stairs else ["no stairs"]
        parts += [] if self.width_m is None else [f"{self.width_m:.2f} m wide"]
        parts += [] if self.turn_m is None else [f"turns in {self.turn_m:.2f} m"]
        return ", ".join(parts) or "all rooms, links and doors"

    def by_costs(self, rooms: RoomLabels | None) -> bool:
        """Return whether a metre does not cost the same everywhere on a floor."""
        uses = () if rooms is None else rooms.uses.values()
        return any(
            (self.elsewhere > 1 and use.corridor) or (self.costs and use.cost > 1) for use in uses
        )


PROFILES = (
    Profile(name="visitor", elsewhere=1.5),
    Profile(name="staff", through_private=True),
    Profile(name="wheelchair", elsewhere=1.5, stairs=False, width_m=0.9, turn_m=1.5),
    Profile(name="cart", through_private=True, stairs=False, width_m=0.8),
)
"""The profiles that every building has, unless its file says otherwise."""


def profile_of(given: Profile | str, known: Sequence[Profile] = PROFILES) -> Profile:
    """Return a profile, or the one that a name means.

    Raises `InvalidValueError` when there is none of the name; the message suggests the nearest
    ones.
    """
    if isinstance(given, Profile):
        return given
    return known[place_of_name(given, tuple(one.name for one in known), "profile")]


def layer_of(profile: Profile, rooms: RoomLabels | None, grid: OccupancyGrid) -> CostLayer:
    """Return what a metre costs in each cell under a profile."""
    factors = np.ones(grid.shape, dtype=np.float32)
    if rooms is not None and rooms.names:
        uses = [rooms.uses.get(name, RoomUse()) for name in rooms.names]
        has_corridors = any(use.corridor for use in uses)
        away = profile.elsewhere if has_corridors else 1.0
        of_room = [
            (1.0 if use.corridor else away) * (use.cost if profile.costs else 1.0) for use in uses
        ]
        factors = np.array([*of_room, away], dtype=np.float32)[rooms.label_of]
    return CostLayer(factors, source={"kind": "profile", "name": profile.name})


def rebuilt(topology: TopologicalMap, grid: OccupancyGrid) -> TopologicalMap:
    """Return a topological map of another grid, built with the settings and rooms of this one."""
    built = topology.pyramid
    return TopologicalMap(
        DualGraphPyramid.build(
            grid,
            merge_distance_m=built.merge_distance_m,
            linkage=built.linkage,
            seed=built.seed,
            rooms=built.rooms,
        )
    )


def under_profile(
    topology: TopologicalMap,
    preset: Preset,
    given: CostLayer | None,
    profile: Profile,
    *,
    by_costs: bool,
) -> tuple[TopologicalMap, Preset, CostLayer | None]:
    """Return the map, the preset and the costs of a planner with the width and the costs of a
    profile: those given where nothing changes. Private rooms are not closed.

    `topology`, `preset`, `given`: of the planner without the profile; `by_costs`: whether it plans
    by costs, also where each metre counts one: floors of a building plan by one method. Where the
    preset knows lengths only, the cells of the whole map are searched.
    """
    grid, rooms = topology.grid, topology.room_labels
    if profile.width_m is not None:
        radius_m = max(profile.width_m / 2 - _ROUNDING_M, 0.0)
        grid = replace(grid, robot_radius_m=radius_m, radius_is_default=False)
        topology = rebuilt(topology, grid)
    if by_costs:
        layer = layer_of(profile, rooms, grid)
        given = layer if given is None else given * layer
        if preset.planner.refusal_of_costs():
            allowed = preset.planner.allow_unexplored
            section = planner_settings(_BY_COSTS, allow_unexplored=allowed)
            preset = preset.model_copy(update={"planner": section})
    return topology, preset, given


@dataclass(frozen=True, eq=False)
class ProfiledFloor:
    """What decides about private rooms on a map."""

    grid: OccupancyGrid
    rooms: RoomLabels | None
    allow_unexplored: bool
    narrow: tuple[int, ...] = ()
    """Numbers of doors that are closed because the profile is wider."""

    @classmethod
    def of(cls, topology: TopologicalMap, profile: Profile, settings: PlannerSettings) -> Self:
        """Return that of a map for the width of a profile. A disc passes some doors that are less
        than a cell narrower than it: these are closed."""
        rooms, narrow = topology.room_labels, list[int]()
        if rooms is not None and profile.width_m is not None:
            least_m = profile.width_m - _ROUNDING_M
            doors = [door for door in topology.rooms.listed_doors if door.passable]
            narrow = [door.number for door in doors if door.width_m < least_m]
        return cls(topology.grid, rooms, settings.allow_unexplored, tuple(narrow))

    def label_at(self, waypoint: ArrayLike | str) -> int:
        """Return the room that a point or a name lies in, -1 for none."""
        if self.rooms is None:
            return NO_ROOM
        if isinstance(waypoint, str) and waypoint in self.rooms.names:
            return self.rooms.names.index(waypoint)
        row, col = self.cell_at(waypoint)
        rows, cols = self.grid.shape
        is_inside = 0 <= row < rows and 0 <= col < cols
        return int(self.rooms.label_of[row, col]) if is_inside else NO_ROOM

    def cell_at(self, waypoint: ArrayLike | str) -> tuple[int, int]:
        """Return the cell of a point, or of a named one."""
        if isinstance(waypoint, str):
            assert self.rooms is not None  # noqa: S101 - names have been checked
            waypoint = self.rooms.points[waypoint]
        x, y = np.asarray(waypoint, dtype=np.float64)[:2].tolist()
        return self.grid.frame.cell_of(x, y)

    def open_but(self, shut: ClosedCells | None) -> BoolArray:
        """Return the cells that may be entered, bool (rows, cols)."""
        is_open = self.grid.enterable(allow_unexplored=self.allow_unexplored)
        if shut is not None:
            is_open.ravel()[shut.flat] = False
        return is_open


# Why there is no route.


def forbidden(profile: Profile, passed: Callable[[Profile], list[str] | None]) -> str:
    """Return what of a profile leaves no route, one line; empty where none is there without it.

    `profile`: the profile under which there is no route; `passed`: returns what a route under
    another profile passes that this one does not allow, as words; None if there is no route either.
    """
    width, turn = profile.width_m or 0.0, profile.turn_m or 0.0
    wider: dict[str, tuple[Any, str]] = {
        "through_private": (True, "private rooms"),
        "stairs": (True, "stairs"),
        "width_m": (None, f"places less than {width:.2f} m wide"),
        "turn_m": (None, f"a goal where no circle of {turn:.2f} m is free to turn in"),
    }
    wider = {key: one for key, one in wider.items() if getattr(profile, key) != one[0]}

    def wider_by(keys: Iterable[str]) -> str | None:
        """Return how a route goes that these keys forbid, None if there is none."""
        found = passed(replace(profile, **{key: wider[key][0] for key in keys}))
        if found is None:
            return None
        named = f" ({', '.join(found)})" if found else ""
        return " and ".join(wider[key][1] for key in keys) + named

    ways = [each for key in wider if (each := wider_by([key])) is not None]
    if not ways and len(wider) > 1 and (each := wider_by(list(wider))) is not None:
        ways = [each]
    if not ways:
        return ""
    return f"profile {profile.name} forbids every route: the way is by {', or by '.join(ways)}"


def in_the_way(
    profile: Profile,
    rooms: RoomLabels,
    doors: Sequence[Door],
    path: Path,
    *,
    whole: tuple[bool, bool] = (True, True),
) -> list[str]:
    """Return what a path passes that a profile does not allow: private rooms, narrow doors.

    `rooms`: the rooms of the map; `path`: a path under another profile, with the `doors` it passes;
    `whole`: whether the route begins where the path begins, and ends where it ends: it may do so in
    any room.
    """
    labels = rooms.label_of[tuple(path.cells.T)].tolist()
    own = {labels[place] for place, is_end in zip((0, -1), whole, strict=True) if is_end}
    inner = [label for label in labels if label != NO_ROOM and label not in own]
    names = [rooms.names[label] for label in dict.fromkeys(inner)]
    private = [name for name in names if rooms.uses.get(name, RoomUse()).private]
    narrow = [
        f"{door.kind} {door.number}, {door.width_m:.2f} m wide"
        for door in doors
        if door.width_m < (profile.width_m or 0.0)
    ]
    return [*([] if profile.through_private else private[:_MOST_NAMED]), *narrow[:_MOST_NAMED]]
