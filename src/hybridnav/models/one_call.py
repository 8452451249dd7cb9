"""From a map to a path in one call. Public: `plan`."""

import os
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from hybridnav._base.typing import PathLike
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.models.model import Model, load
from hybridnav.planning import PlanResult, Preset, load_preset
from hybridnav.topology import TopologicalMap

ROOMS_FILE = "rooms.yaml"
"""Name of the file of rooms beside a map."""


def plan(
    source: PathLike | OccupancyGrid | Model | TopologicalMap,
    start: ArrayLike | str,
    goal: ArrayLike | str,
    *,
    preset: PathLike | Preset | None = None,
    robot_radius_m: float | None = None,
    **query: Any,
) -> PlanResult:
    """Plan one path on a map: read it, grow its places, prepare a planner, ask it.

    For more than one path keep a `HybridPlanner`: it is prepared once.

    Parameters
    ----------
    source
        A map file or a model, as in `load`; or a grid, a model, or a topological map.
    start, goal
        `(x, y)` in metres, map frame, or `(x, y, yaw)`; or names of rooms. If one is a name, rooms
        are those of the model, of the file `rooms.yaml` beside the map, or found.
    preset
        Name of a preset, path to a preset file, or a `Preset`; None for that of the model, or
        `shortest`.
    robot_radius_m
        Radius of the robot in metres; None for that of the preset, unless you chose one for
        the grid.
    **query
        What else `HybridPlanner.plan` takes: `blocked`, `at`, `smooth`, `within_m`.

    Returns
    -------
    PlanResult
        It prints as three lines, `hybridnav.plot` draws it, and a notebook shows both.

    Raises
    ------
    MapError, PresetError
        When a file cannot be read.
    InvalidValueError
        When the source is none of these, or a value is out of range.

    Examples
    --------
    >>> hn.plan(hn.example_map("figure1"), (0.5, 0.5), (2.0, 2.5))
    solved by preset shortest: 2.55 m (any-angle)
    none below 2.55 m: optimal
    from (0.5, 0.5) to (2, 2.5), 1 place, 0 arcs
    """
    named = None if preset is None else load_preset(preset)
    if isinstance(source, TopologicalMap):
        chosen = load_preset("shortest") if named is None else named
        model, topology = Model(source.grid), source
    else:
        model = _model_of(source, named, robot_radius_m)
        chosen = model.fitted(named)
        rooms = model.rooms
        if rooms is None and (isinstance(start, str) or isinstance(goal, str)):
            rooms = _rooms_beside(source, model.grid)
        topology = model.grown(chosen.pyramid, rooms)
    return model.planner(chosen, topology=topology).plan(start, goal, **query)


def _model_of(source: object, preset: Preset | None, radius_m: float | None) -> Model:
    """Return a model with the radius given, else that of the preset, unless the caller chose one
    for a grid."""
    wanted_m = None if preset is None else preset.pyramid.robot_radius_m
    if isinstance(source, str | os.PathLike):
        return load(source, robot_radius_m=wanted_m if radius_m is None else radius_m)
    model = Model(source) if isinstance(source, OccupancyGrid) else source
    if not isinstance(model, Model):
        raise InvalidValueError(
            f"a plan needs a map, got {source!r:.80}: give a file, a grid, a model or its places"
        )
    if radius_m is None and model.grid.radius_is_default:
        radius_m = wanted_m
    return model.remade(robot_radius_m=radius_m)


def _rooms_beside(source: object, grid: OccupancyGrid) -> RoomLabels:
    """Return the rooms of the file beside a map, else those found on it."""
    from hybridnav.rooms import find_rooms  # noqa: PLC0415 - plans between points need none
    from hybridnav.rooms.files import load_rooms  # noqa: PLC0415

    if isinstance(source, str | os.PathLike):
        beside = Path(source).parent / ROOMS_FILE
        if beside.is_file():
            return load_rooms(beside, grid)
    return find_rooms(grid)
