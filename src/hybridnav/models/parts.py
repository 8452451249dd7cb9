"""Grids, rooms, pyramids and presets as parts of a model, and back."""

import math
from dataclasses import asdict
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from hybridnav._base.typing import AnyArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import Frame, OccupancyGrid, OneWayRule, RoomLabels, RoomUse
from hybridnav.maps.files.limits import check_size
from hybridnav.maps.islands import DroppedIslands
from hybridnav.models.container import FiledPart, Part
from hybridnav.models.structures import GRID, PRESET, PYRAMID, ROOMS, refusal
from hybridnav.planning import Preset
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.record import MAX_LEVELS, SURVIVES, BuildStats, LevelSize, Linkage, Record

_PALETTE = 256
_COUNT = Annotated[int, Field(ge=0)]
_T = TypeVar("_T", bound=BaseModel)


class _Values(BaseModel):
    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)


class _GridValues(_Values):
    resolution_m: float
    origin_m: tuple[float, float]
    yaw_rad: float
    free_threshold: Annotated[float, Field(ge=0, le=1)]
    occupied_threshold: Annotated[float, Field(ge=0, le=1)]
    robot_radius_m: Annotated[float, Field(ge=0)]
    corner_cutting: bool
    name: str
    radius_is_default: bool
    least_island_m2: float
    dropped: dict[str, _COUNT] | None


class _RoomsValues(_Values):
    names: list[str]
    points: dict[str, tuple[float, float]]
    doors: list[tuple[int, float, float]]
    uses: dict[str, RoomUse] = {}
    one_way: list[str] = []


class _PyramidValues(_Values):
    merge_distance_m: Annotated[float, Field(gt=0)]
    linkage: Linkage
    seed: int
    sizes: Annotated[
        list[tuple[_COUNT, _COUNT, _COUNT]], Field(min_length=1, max_length=MAX_LEVELS)
    ]
    seconds: dict[str, float]
    tops: Annotated[list[_COUNT], Field(min_length=1, max_length=4)]
    region_cells: Annotated[int, Field(ge=1)] | None = None


def values_of(kind: type[_T], filed: FiledPart) -> _T:
    """Check the numbers and texts of a part.

    Raises `ModelError` when one is missing, not known, or of another kind.
    """
    try:
        return kind.model_validate(filed.values)
    except ValidationError as error:
        problem = error.errors(include_url=False, include_input=False)[0]
        key = ".".join(map(str, problem["loc"]))
        raise refusal(filed, f"{key}: {problem['msg']}") from None


def plain(tree: Any) -> Any:
    """Replace infinities by texts, because JSON has no number for them; pydantic reads them
    back."""
    if isinstance(tree, dict):
        return {key: plain(value) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [plain(value) for value in tree]
    return str(tree) if isinstance(tree, float) and math.isinf(tree) else tree


def grid_part(grid: OccupancyGrid) -> Part:
    """Describe a grid."""
    rows, cols = grid.shape
    levels, index = np.unique(grid.probability.view(np.uint32), return_inverse=True)
    probability: AnyArray = grid.probability
    palette = np.empty(0, np.float32)
    if len(levels) <= _PALETTE:
        probability = index.astype(np.uint8).reshape(grid.shape)
        palette = levels.view(np.float32)
    arrays = {
        "palette": palette,
        "probability": probability,
        "measured": grid.measured,
        "classes": grid.classes,
    }
    values = {
        "resolution_m": grid.frame.resolution_m,
        "origin_m": list(grid.frame.origin_m),
        "yaw_rad": grid.frame.yaw_rad,
        "free_threshold": grid.free_threshold,
        "occupied_threshold": grid.occupied_threshold,
        "robot_radius_m": grid.robot_radius_m,
        "corner_cutting": grid.corner_cutting,
        "name": grid.name,
        "radius_is_default": grid.radius_is_default,
        "least_island_m2": grid.least_island_m2,
        "dropped": None if grid.dropped is None else asdict(grid.dropped),
    }
    return GRID.part(arrays, {"rows": rows, "cols": cols, "levels": len(palette)}, values)


def sizes_of(filed: FiledPart, *, max_cells: int) -> dict[str, int]:
    """Return the sizes of the map that a part describes, to which other sizes refer.

    Raises `ModelError` when the sizes are missing, `MapError` when the map has more than
    `max_cells` cells.
    """
    GRID.check_version(filed)
    rows, cols = (filed.part.sizes.get(name, 0) for name in ("rows", "cols"))
    if min(rows, cols) < 1:
        raise refusal(filed, "rows or cols is missing, or 0")
    check_size(cols, rows, max_cells=max_cells, where=filed.where)
    return {"rows": rows, "cols": cols, "cells": rows * cols}


def grid_of(filed: FiledPart, known: dict[str, int]) -> OccupancyGrid:
    """Read a grid.

    Raises `ModelError` when the part is not as `grid_part` has written it.
    """
    values = values_of(_GridValues, filed)
    arrays = GRID.read(filed, {"cells": known["cells"]})
    try:
        frame = Frame(values.resolution_m, values.origin_m, values.yaw_rad)
        dropped = {}
        if values.dropped is not None:
            dropped = {"dropped": DroppedIslands(**values.dropped)}
    except (InvalidValueError, TypeError) as error:
        raise refusal(filed, str(error)) from None
    return OccupancyGrid.restored(
        probability=_probability(filed, arrays["palette"], arrays["probability"]),
        frame=frame,
        measured=arrays["measured"],
        classes=arrays["classes"],
        **dropped,
        **values.model_dump(exclude={"resolution_m", "origin_m", "yaw_rad", "dropped"}),
    )


def _probability(filed: FiledPart, palette: AnyArray, stored: AnyArray) -> AnyArray:
    if stored.dtype != np.uint8:
        return stored
    if stored.max() >= len(palette):
        raise refusal(filed, f"probability has {stored.max()}, expected less than {len(palette)}")
    return palette[stored]


def grid_settings(filed: FiledPart) -> dict[str, Any]:
    """Return the name and the settings of a grid, without reading its cells."""
    return values_of(_GridValues, filed).model_dump()


def pyramid_settings(filed: FiledPart) -> dict[str, Any]:
    """Return the settings of a pyramid, without reading it."""
    return values_of(_PyramidValues, filed).model_dump(
        include={"merge_distance_m", "linkage", "seed"}
    )


def rooms_part(rooms: RoomLabels) -> Part:
    """Describe rooms."""
    values: dict[str, Any] = {
        "names": list(rooms.names),
        "points": {name: list(at) for name, at in rooms.points.items()},
        "doors": [[number, *at] for number, at in rooms.doors.items()],
    }
    if rooms.uses:  # models without are read by earlier versions too
        values["uses"] = {name: asdict(use) for name, use in rooms.uses.items()}
    if rooms.one_way:
        values["one_way"] = [str(rule) for rule in rooms.one_way]
    return ROOMS.part(rooms, {}, values)


def rooms_of(filed: FiledPart, known: dict[str, int]) -> RoomLabels:
    """Read rooms.

    Raises `ModelError` when the part is not as `rooms_part` has written it.
    """
    values = values_of(_RoomsValues, filed)
    label_of = ROOMS.read(filed, known)["label_of"]
    try:
        doors = {number: (x, y) for number, x, y in values.doors}
        names, rules = tuple(values.names), tuple(map(OneWayRule.of, values.one_way))
        return RoomLabels(names, label_of, values.points, doors, values.uses, rules)
    except InvalidValueError as error:
        raise refusal(filed, str(error)) from None


def pyramid_part(pyramid: DualGraphPyramid) -> Part:
    """Describe a pyramid; its grid and its rooms are parts of their own."""
    values = {
        "merge_distance_m": plain(pyramid.merge_distance_m),
        "linkage": pyramid.linkage,
        "seed": pyramid.seed,
        "sizes": [[size.vertices, size.arcs, size.self_loops] for size in pyramid.stats.sizes],
        "seconds": dict(pyramid.stats.seconds),
        "tops": list(pyramid.stats.tops),
        "region_cells": pyramid.region_cells,
    }
    return PYRAMID.part(pyramid.record, {}, values)


def pyramid_of(
    filed: FiledPart, known: dict[str, int], grid: OccupancyGrid, rooms: RoomLabels | None
) -> DualGraphPyramid:
    """Read a pyramid.

    Raises `ModelError` when the part is not as `pyramid_part` has written it.
    """
    values = values_of(_PyramidValues, filed)
    wanted = 1 + (rooms is not None) + (values.region_cells is not None)
    if len(values.tops) < wanted or max(values.tops) >= len(values.sizes):
        raise refusal(filed, f"tops are {values.tops}, of {len(values.sizes)} levels")
    record = Record(**PYRAMID.read(filed, known))
    gone = np.flatnonzero((record.vertex_end > 0) & (record.vertex_end < SURVIVES))
    into = record.vertex_parent[gone]
    if (into < 0).any() or (record.vertex_end[into] <= record.vertex_end[gone]).any():
        raise refusal(filed, "vertices go into others that do not outlive them")
    edge_end = record.edge_end.reshape(known["rows"], known["cols"], 2)
    if edge_end[-1, :, 1].any() or edge_end[:, -1, 0].any():
        raise refusal(filed, "edges lead out of the map")
    sizes = [LevelSize(*size) for size in values.sizes]
    stats = BuildStats(sizes, dict(values.seconds), list(values.tops))
    return DualGraphPyramid(
        grid,
        values.merge_distance_m,
        values.linkage,
        values.seed,
        stats,
        rooms,
        record,
        values.region_cells,
    )


def preset_part(preset: Preset) -> Part:
    """Describe the preset of a planner."""
    return PRESET.part({}, {}, plain(preset.model_dump(mode="json")))


def preset_of(filed: FiledPart) -> Preset:
    """Read a preset.

    Raises `ModelError` when it is not valid.
    """
    PRESET.check_version(filed)
    return values_of(Preset, filed)
