"""Models of buildings: the models of their maps in one file, with links and what is known."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from hybridnav._files import printable
from hybridnav.building import Building, Floor, Link, LinkEnd, LinkKind
from hybridnav.building.floors import Known
from hybridnav.config import load_preset
from hybridnav.errors import InvalidValueError, MapError, ModelError
from hybridnav.grid import DEFAULT_MAX_CELLS
from hybridnav.io.models.container import buffers_of, parts_within, read_parts
from hybridnav.io.models.model import model_of
from hybridnav.io.models.parts import plain, values_of
from hybridnav.io.models.structures import BUILDING, FLOOR, refusal
from hybridnav.io.size import check_max_cells

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from hybridnav._typing import PathLike
    from hybridnav.config import Preset
    from hybridnav.io.models.container import FiledPart, Part
    from hybridnav.io.models.model import Model
    from hybridnav.planner import HybridPlanner

_MOST_MAPS = 99
"""Most different maps of a building in a file."""
_NONE = {"cells": 0, "rows": 0, "cols": 0}


class _Values(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _FloorValues(_Values):
    name: str
    elevation_m: float
    map: Annotated[int, Field(ge=0, lt=_MOST_MAPS)]


class _EndValues(_Values):
    floor: str
    position_m: tuple[float, float]
    yaw_rad: float | None


class _LinkValues(_Values):
    name: str
    kind: LinkKind
    ends: Annotated[list[_EndValues], Field(max_length=10_000)]
    wait_s: float
    ride_s: float
    cost_m: float
    max_radius_m: float


class _BuildingValues(_Values):
    speed_m_s: float
    floors: Annotated[list[_FloorValues], Field(min_length=1, max_length=10_000)]
    links: Annotated[list[_LinkValues], Field(max_length=10_000)]


def building_parts(
    building: Building,
    parts_of: Callable[[HybridPlanner], Iterable[Part]],
    *,
    compress: bool,
) -> list[Part]:
    """Describe a building; planners that several floors share are described once.

    Parameters
    ----------
    building
        The building.
    parts_of
        Returns the parts of the model of a planner.
    compress
        Whether the arrays of its maps are deflated.

    Raises
    ------
    InvalidValueError
        When it has too many maps.
    """
    planners = list({id(floor.planner): floor.planner for floor in building.floors}.values())
    if len(planners) > _MOST_MAPS:
        raise InvalidValueError(
            f"a model holds a building of at most {_MOST_MAPS} maps, this one has {len(planners)}"
        )
    values = {
        "speed_m_s": building.speed_m_s,
        "floors": [
            {
                "name": floor.name,
                "elevation_m": floor.elevation_m,
                "map": next(i for i, one in enumerate(planners) if one is floor.planner),
            }
            for floor in building.floors
        ],
        "links": [plain(asdict(link)) for link in building.links],
    }
    known = [
        # A model has no costs of cells, and what is known by them does not hold without.
        one if floor.planner.costs is None else Known(np.zeros_like(one.lower), one.cost * np.nan)
        for floor, one in zip(building.floors, building.known, strict=True)
    ]
    arrays = {
        name: np.concatenate([getattr(one, name).ravel() for one in known])
        for name in ("lower", "cost")
    }
    parts = [BUILDING.part(arrays, {"pairs": len(arrays["lower"])}, values)]
    for planner in planners:
        content = np.frombuffer(
            b"".join(buffers_of(parts_of(planner), compress=compress)), dtype=np.uint8
        )
        parts.append(FLOOR.part({"model": content}, {"bytes": len(content)}))
    return parts


def is_building_model(path: PathLike) -> bool:
    """Return whether a file is the model of a building; False for one that cannot be read."""
    with suppress(MapError):
        filed = read_parts(path)
        return bool(filed) and filed[0].kind == BUILDING.kind
    return False


def open_building(
    path: PathLike,
    *,
    robot_radius_m: float | None = None,
    preset: PathLike | Preset | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> Building:
    """Open the model of a building; see `hybridnav.io.load_building`."""
    check_max_cells(max_cells)
    filed = read_parts(path)
    where = f"model {printable(path)}"
    if not filed or filed[0].kind != BUILDING.kind:
        raise ModelError(f"{where}: it is that of a map, expected one of a building")
    values = values_of(_BuildingValues, filed[0])
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
        links = [_link(one) for one in values.links]
        building = Building(floors, links, speed_m_s=values.speed_m_s)
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
    """Return the model of one map of a building."""
    FLOOR.check_version(part)
    where = f"{part.where}, map {number}"
    return model_of(parts_within(part.stored("model"), where), where, max_cells)


def _link(values: _LinkValues) -> Link:
    ends = tuple(LinkEnd(end.floor, end.position_m, end.yaw_rad) for end in values.ends)
    numbers: dict[str, Any] = values.model_dump(exclude={"name", "kind", "ends"})
    return Link(name=values.name, kind=values.kind, ends=ends, **numbers)


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
