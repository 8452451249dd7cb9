"""The model of a building, opened."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.files import printable
from hybridnav.errors import InvalidValueError, MapError, ModelError
from hybridnav.ext.fleet import Building, Floor
from hybridnav.ext.fleet.floors import BuildingValues, Known
from hybridnav.maps import DEFAULT_MAX_CELLS
from hybridnav.maps.files.movingai import check_max_cells
from hybridnav.planner import load_preset
from hybridnav.planner.saved.container import parts_within, read_parts
from hybridnav.planner.saved.model import model_of
from hybridnav.planner.saved.parts import values_of
from hybridnav.planner.saved.structures import BUILDING, FLOOR, refusal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._base.typing import PathLike
    from hybridnav.planner import HybridPlanner, Preset
    from hybridnav.planner.saved.container import FiledPart
    from hybridnav.planner.saved.model import Model

_NONE = {"cells": 0, "rows": 0, "cols": 0}


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
        building = Building(floors, values.links, speed_m_s=values.speed_m_s)
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
