"""Buildings from files: their YAML with maps and links, and models."""

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hybridnav._base.files import printable
from hybridnav._base.trig import hypots
from hybridnav._base.typing import PathLike
from hybridnav.closures import Journal
from hybridnav.errors import (
    HybridNavError,
    InvalidValueError,
    MapError,
    MapNotFoundError,
    ModelError,
    PresetError,
)
from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd
from hybridnav.ext.fleet.checks import FloorParts, check_ends, check_reach
from hybridnav.ext.fleet.files.entries import (
    EndEntry,
    Entries,
    FloorEntry,
    LinkEntry,
    read_building_entries,
)
from hybridnav.ext.fleet.floors import BuildingValues, Known
from hybridnav.guide.words.landmarks import Landmarks
from hybridnav.maps import DEFAULT_MAX_CELLS
from hybridnav.maps.checks import checked_radius
from hybridnav.maps.files.limits import check_max_cells
from hybridnav.maps.names import place_of_name
from hybridnav.models import Model, load
from hybridnav.models.container import FiledPart, parts_within, read_parts
from hybridnav.models.model import is_model, model_of
from hybridnav.models.parts import values_of
from hybridnav.models.structures import BUILDING, FLOOR, refusal
from hybridnav.planning import HybridPlanner, Preset, load_preset
from hybridnav.rooms import Rooms, find_rooms
from hybridnav.rooms.files.read import load_rooms


def load_building(
    path: PathLike,
    *,
    robot_radius_m: float | None = None,
    preset: PathLike | Preset | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> Building:
    r"""Load a building from its description, or from its model.

    Parameters
    ----------
    path
        A YAML file, or a model (.hnm) that `save` has written of a building. The file has a list
        `floors`, from the lowest to the highest. Each has its `name`, its `map` (a map or a model,
        relative to the file), and optionally `elevation_m`, a file of `rooms`, or `find_rooms:
        true`. A list `links` has for each its `name`, its `kind` (lift, stairs or ramp), two or
        more `ends`, and optionally `wait_s`, `ride_s`, `cost_m`, `max_radius_m` and `one_way` (up
        or down). Optional are `speed_m_s`, and `profiles`, each with its `name` and its differences
        from a plain `Profile`. An end has a `floor`, a place, and optionally `yaw_rad`. The place
        is `at: [x, y]`, a `room`, or the number of a `door`, with the `room` where the robot
        stands.
    robot_radius_m
        Radius of the robot in metres on all floors; None for that of the models, or of the preset.
    preset
        Preset of all planners; None for that of the models, or `shortest`.
    max_cells
        Most cells of the map of a floor.

    Returns
    -------
    Building
        The building, whose links have been checked: the robot can stand at each end, and drive from
        it to the rest of the floor. Its journal is `NAME.closed.yaml` beside the file.

    Raises
    ------
    MapNotFoundError
        When a file does not exist.
    MapError
        When a file cannot be read. When a floor, a room, a door or the place of an end is not as it
        is written, or does not suit the robot. The text names the file and the line.
    PresetError
        When the preset does not exist or is not valid.
    InvalidValueError
        When the radius or the limit is out of range.

    Examples
    --------
    >>> from hybridnav.ext.fleet import load_building
    >>> from pathlib import Path
    >>> hn.save(hn.example_map("figure1"), "figure1.hnm")
    >>> ends = "[{floor: 1, at: [0.5, 0.5]}, {floor: 2, at: [0.5, 2.5]}]"
    >>> _ = Path("building.yaml").write_text(
    ...     "floors: [{name: 1, map: figure1.hnm}, {name: 2, map: figure1.hnm}]\n"
    ...     f"links: [{{name: lift, kind: lift, wait_s: 20, ends: {ends}}}]\n"
    ... )
    >>> building = load_building("building.yaml")
    >>> round(building.plan(("1", (1.5, 0.5)), ("2", (0.5, 0.5))).length_m, 3)
    3.0
    """
    check_max_cells(max_cells)
    if robot_radius_m is not None:
        checked_radius(robot_radius_m)
    if is_model(path):
        return open_building(
            path, robot_radius_m=robot_radius_m, preset=preset, max_cells=max_cells
        )
    entries = read_building_entries(path)
    folder = Path(path).parent
    planners: dict[object, HybridPlanner] = {}
    floors = []
    for entry in entries.floors:
        # One map on several floors is read once.
        key = entry.map_file, entry.rooms_file, entry.find_rooms, entry.one_way
        if key not in planners:
            planners[key] = _planner(entry, folder, robot_radius_m, preset, max_cells)
        with _at(entry.at):
            floors.append(Floor(entry.name, planners[key], entry.elevation_m))
    return _joined(entries, floors, Journal(path))


def load_floor(
    entry: FloorEntry,
    folder: Path,
    *,
    robot_radius_m: float | None = None,
    preset: PathLike | Preset | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> Model:
    """Load the map or model of one floor, as `load_building` does.

    `folder`: the folder of the file that describes the building; `robot_radius_m`, `preset`,
    `max_cells`: as `load_building` takes them. Raises `HybridNavError` when it cannot be read; the
    message names the floor and the line.
    """
    map_file = folder / entry.map_file
    if robot_radius_m is None and not is_model(map_file):
        chosen = load_preset("shortest" if preset is None else preset)
        robot_radius_m = chosen.pyramid.robot_radius_m
    with _at(f"{entry.at}: floor {entry.name}"):
        return load(map_file, robot_radius_m=robot_radius_m, max_cells=max_cells)


def _planner(
    entry: FloorEntry,
    folder: Path,
    robot_radius_m: float | None,
    preset: PathLike | Preset | None,
    max_cells: int,
) -> HybridPlanner:
    model = load_floor(
        entry, folder, robot_radius_m=robot_radius_m, preset=preset, max_cells=max_cells
    )
    with _at(f"{entry.at}: floor {entry.name}"):
        rooms = model.rooms
        if entry.rooms_file is not None:
            rooms = load_rooms(folder / entry.rooms_file, model.grid)
        elif entry.find_rooms and rooms is None:
            rooms = find_rooms(model.grid)
        if entry.one_way:
            if rooms is None:
                raise InvalidValueError("one_way needs rooms: add rooms, or find_rooms: true")
            rooms = replace(rooms, one_way=(*rooms.one_way, *entry.one_way))
        fitted = model.fitted(None if preset is None else load_preset(preset))
        planner = model.planner(preset, topology=model.grown(fitted.pyramid, rooms))
        planner.closed(None)  # refuses rules of doors that are not there
        return planner


@contextmanager
def _at(where: str) -> Iterator[None]:
    """Put a place in the file before the errors of what is built of it."""
    try:
        yield
    except PresetError:
        raise
    except MapNotFoundError as error:
        raise MapNotFoundError(f"{where}: {error}") from None
    except HybridNavError as error:
        raise MapError(f"{where}: {error}") from None


def _joined(entries: Entries, floors: list[Floor], journal: Journal) -> Building:
    by_name = {floor.name: floor for floor in floors}
    links = [_link(entry, by_name) for entry in entries.links]
    stops = {end.floor for link in links for end in link.ends}
    parts = {name: FloorParts.of(floor) for name, floor in by_name.items() if name in stops}
    for entry, link in zip(entries.links, links, strict=True):
        with _at(entry.at):
            check_ends(link, by_name)
            check_reach(link, by_name, parts)
    speed: dict[str, Any] = {} if entries.speed_m_s is None else {"speed_m_s": entries.speed_m_s}
    with _at(entries.where):
        return Building(floors, links, profiles=entries.profiles, journal=journal, **speed)


def _link(entry: LinkEntry, floors: dict[str, Floor]) -> Link:
    most_m = entry.numbers.get("max_radius_m", math.inf)
    ends = tuple(_end(end, floors, most_m) for end in entry.ends)
    with _at(entry.at):
        numbers: dict[str, Any] = entry.numbers
        return Link(name=entry.name, kind=entry.kind, ends=ends, one_way=entry.one_way, **numbers)


def _end(entry: EndEntry, floors: dict[str, Floor], max_radius_m: float) -> LinkEnd:
    yaw_rad = entry.yaw_rad
    with _at(entry.at):
        place_of_name(entry.floor, tuple(floors), "floor")
        floor = floors[entry.floor]
        if entry.point is not None:
            if entry.room is not None:
                _check_in_room(entry.point, entry.room, floor)
            return LinkEnd(entry.floor, entry.point, yaw_rad)
        rooms = floor.planner.topology.rooms
        if entry.door is None:
            assert entry.room is not None  # noqa: S101 - an end has a place
            if entry.room not in rooms.labels.points:
                rooms.labels.index(entry.room)
            return LinkEnd(entry.floor, rooms.point_of(entry.room), yaw_rad)
        point, out_rad = _at_door(rooms, entry.door, entry.room, max_radius_m)
        return LinkEnd(entry.floor, point, out_rad if yaw_rad is None else yaw_rad)


def _check_in_room(point: tuple[float, float], room: str, floor: Floor) -> None:
    rooms = floor.planner.topology.rooms
    rooms.labels.index(room)
    own = rooms.at(point)
    if own != room:
        where = "in no room" if own is None else f"in room {own}"
        raise MapError(f"the point {list(point)} lies {where}, expected {room}")


def _at_door(
    rooms: Rooms, number: int, room: str | None, max_radius_m: float
) -> tuple[tuple[float, float], float | None]:
    """Return the free point nearest to the middle of a door, and the direction in which one enters.

    The point is on the side of a room if one is named. It is the middle where the robot does not
    fit in the link, and finds no free point.
    """
    door, grid = rooms.door(number), rooms.grid
    rows, cols = np.divmod(rooms.cells_beside(number), grid.shape[1])
    kept = grid.enterable()[rows, cols]
    yaw_rad = None
    if room is not None:
        kept &= rooms.labels.label_of[rows, cols] == rooms.labels.index(room)
        if room not in door.rooms:
            joined = " and ".join(name or "a space without a name" for name in door.rooms)
            raise MapError(f"door {number} joins {joined}, not {room}")
        way_rad = Landmarks(rooms).way_out_rad(door, is_forward=door.rooms[1] == room)
        yaw_rad = math.remainder(way_rad, math.tau) if math.isfinite(way_rad) else None
    if not kept.any() and grid.robot_radius_m > max_radius_m:
        return door.position, yaw_rad
    if not kept.any():
        raise MapError(
            f"door {number} has no free cell for a robot radius of {grid.robot_radius_m:g} m: give "
            "the end a point"
        )
    points = grid.frame.points_of(np.stack([rows[kept], cols[kept]], axis=1))
    away = points - np.array(door.position)
    x, y = points[int(np.argmin(hypots(away[:, 0], away[:, 1])))].tolist()
    return (x, y), yaw_rad


# The model of a building, opened.

_NONE = {"cells": 0, "rows": 0, "cols": 0}


def open_building(
    path: PathLike,
    *,
    robot_radius_m: float | None = None,
    preset: PathLike | Preset | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> Building:
    """Open the model of a building; see `hybridnav.ext.fleet.files.load_building`."""
    check_max_cells(max_cells)
    filed = read_parts(path)
    where = f"model {printable(path)}"
    if not filed or filed[0].kind != BUILDING.kind:
        raise ModelError(f"{where}: it is that of a map, expected one of a building")
    values = values_of(BuildingValues, filed[0])
    models = [_map_of(part, number, max_cells) for number, part in enumerate(filed[1:])]
    for floor in values.floors:
        if floor.map >= len(models):
            raise refusal(filed[0], f"floor {floor.name} has map {floor.map} of {len(models)}")
    wanted = None if preset is None else load_preset(preset)
    # Most of the time goes to checksums, which are computed without Python's lock.
    with ThreadPoolExecutor() as pool:
        made = list(pool.map(lambda model: _planner_of(model, robot_radius_m, wanted), models))
    planners, are_same = [planner for planner, _ in made], all(is_same for _, is_same in made)
    try:
        floors = [Floor(one.name, planners[one.map], one.elevation_m) for one in values.floors]
        building = Building(
            floors,
            values.links,
            speed_m_s=values.speed_m_s,
            profiles=values.profiles,
            journal=Journal(path),
        )
    except InvalidValueError as error:
        raise MapError(f"{where}: {error}") from None
    if are_same:
        building.adopt(_known(filed[0], building))
    return building


def _planner_of(
    model: Model, robot_radius_m: float | None, wanted: Preset | None
) -> tuple[HybridPlanner, bool]:
    """Return the planner of a map, and whether it is the one that was saved."""
    remade = model.remade(robot_radius_m=robot_radius_m)
    chosen, saved = remade.fitted(wanted), model.presets[:1]
    is_same = remade is model and bool(saved) and chosen.planner == saved[0].planner
    topology = remade.topology if wanted is None else remade.grown(chosen.pyramid, model.rooms)
    return remade.planner(wanted, topology=topology), is_same


def _map_of(part: FiledPart, number: int, max_cells: int) -> Model:
    FLOOR.check_version(part)
    where = f"{part.where}, map {number}"
    return model_of(parts_within(part.stored("model"), where), where, max_cells)


def _known(filed: FiledPart, building: Building) -> Sequence[Known]:
    """Return what is known between the ends of links on each floor."""
    arrays = BUILDING.read(filed, _NONE)
    counts = [
        sum(link.end_on(floor.name) is not None for link in building.links)
        for floor in building.floors
    ]
    if len(arrays["lower"]) != sum(n * n for n in counts):
        raise refusal(filed, f"lower has {len(arrays['lower'])} numbers")
    ends = np.cumsum([n * n for n in counts])[:-1]
    lower, cost = (np.split(arrays[name], ends) for name in ("lower", "cost"))
    return [
        Known(one.reshape(n, n), other.reshape(n, n))
        for n, one, other in zip(counts, lower, cost, strict=True)
    ]
