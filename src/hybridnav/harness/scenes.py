"""What a run plans on: a map, and the costs of its cells where the run has some."""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.errors import MapWarning
from hybridnav.harness.records import map_digest
from hybridnav.maps import DEFAULT_MAX_CELLS, CellClass, OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.costs.files import read_costs
from hybridnav.maps.files import load_map

if TYPE_CHECKING:
    from collections.abc import Sequence

GivenCosts = tuple[str, ...] | CostLayer
"""Texts as in `hybridnav plan --costs`, or a layer; an empty tuple for lengths."""


_DIGITS = 12
"""Digits of the hash of a layer in texts."""


@dataclass(frozen=True)
class MapSpec:
    """A map file and its reading."""

    path: str
    robot_radius_m: float | None
    """None for that of a model."""
    corner_cutting: bool = False
    max_cells: int = DEFAULT_MAX_CELLS
    costs: GivenCosts = ()


@dataclass(frozen=True, eq=False)
class Scene:
    """A map on which cells that the costs close are occupied, so that no method enters them, and
    the factors of its cells."""

    grid: OccupancyGrid
    costs: CostLayer | None
    """Factors, without closed cells; None for lengths."""

    @property
    def digest(self) -> str:
        """The SHA-256 of all that planners see: `map_digest`, and with costs also the factors."""
        of_map = map_digest(self.grid)
        if self.costs is None:
            return of_map
        return hashlib.sha256(of_map.encode() + self.costs.units.tobytes()).hexdigest()


@lru_cache(maxsize=2)
def read_map(spec: MapSpec) -> OccupancyGrid:
    """Return the grid of a map file, without costs; the last two are kept."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MapWarning)
        grid = load_map(spec.path, robot_radius_m=spec.robot_radius_m, max_cells=spec.max_cells)
    return replace(grid, corner_cutting=True) if spec.corner_cutting else grid


@lru_cache(maxsize=2)
def read_scene(spec: MapSpec) -> Scene:
    """Return the map of a file with its costs; the last two are kept.

    Raises
    ------
    InvalidValueError
        When the costs have another form, or are those of another map.
    MapError
        When a file cannot be read.
    """
    grid = read_map(replace(spec, costs=()))
    given = spec.costs
    layer = given if isinstance(given, CostLayer) else read_costs(given, grid)
    if layer is None:
        return Scene(grid, None)
    layer.check_fits(grid)
    layer = layer.inflated(grid)
    if layer.keepout is None:
        return Scene(grid, layer)
    classes = np.where(layer.keepout, np.uint8(CellClass.OCCUPIED), grid.classes)
    open_grid = OccupancyGrid.restored(**vars(grid) | {"classes": classes})
    return Scene(open_grid, CostLayer(layer.factors, source=layer.source))


def clear_scenes() -> None:
    """Forget what was read, because files may have changed."""
    read_map.cache_clear()
    read_scene.cache_clear()


def text_of_costs(given: GivenCosts) -> str:
    """Return costs as one text, empty for lengths.

    That of a layer ends in a hash of its factors and closed cells: two arrays have one source.
    """
    if not isinstance(given, CostLayer):
        return " ".join(given)
    return f"{_text_of_source(given.source)} {given.digest[:_DIGITS]}"


def _text_of_source(source: dict[str, Any]) -> str:
    parts: Sequence[dict[str, Any]] = source.get("of", ())
    return "+".join(map(_text_of_source, parts)) if parts else str(source["kind"])
