"""Buildings with people's rooms: the floors of GDC, and the maps that ROSE2 was measured on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from PIL import Image

import hybridnav as hn
from hybridnav._base.typing import BoolArray, FloatArray, IntArray
from hybridnav.rooms.cutting import spread
from hybridnav.rooms.doors import MOST_DOOR_M, RoomBoundaries, measured_clearance_m
from research._rooms_truth import FLOORS, Floor

SITES = {
    **dict.fromkeys(FLOORS, "GDC"),
    "NOGT-intel_map": "Intel",
    "map23": "Intel",
    "freiburg_building79": "Freiburg 79",
    "map15": "Freiburg 79",
    "freiburg_building101": "Freiburg 101",
    "map_with_clutter": "clutter",
    "ubremen-cartesium-demo4": "Cartesium",
}
"""The site of each map: several maps show one building, or one floor of the same."""
_RESOLUTION_M = 0.05
_FREE_FROM, _OCCUPIED_BELOW = 250, 90
_LEAST_PIXELS = 40
_BETWEEN_M = 0.3
"""How far people's rooms are spread over free cells between them: their lines are thinner."""


@dataclass(frozen=True, eq=False)
class Building:
    """A map with people's rooms."""

    name: str
    grid: hn.OccupancyGrid
    true: IntArray
    """int32 (rows, cols), -1 for no room."""
    compared: BoolArray
    """bool (rows, cols), cells that count."""
    rose2: IntArray | None
    """int32 (rows, cols), the rooms of ROSE2, where its own images are given."""
    drawn: list[FloatArray] | None
    """Middles of the doors that people drew, where they did."""

    @property
    def site(self) -> str:
        """The building that the map shows; a generated one is its own."""
        return SITES.get(self.name, self.name)

    @classmethod
    def read(cls, data: Path, name: str) -> Building:
        """Read a building of the reference data."""
        if name in FLOORS:
            floor = Floor.read(data / "bwi_gdc" / name)
            middles = [door.middle for door in floor.reachable_doors]
            return cls(name, floor.grid, floor.rooms.label_of, floor.compared, None, middles)
        folder = data / "rose2_rooms" / name
        grey = np.array(Image.open(folder / "0_Map.png").convert("L"))[::-1]
        known = np.where(grey < _OCCUPIED_BELOW, 1.0, 0.5)
        probability = np.where(grey >= _FREE_FROM, 0.0, known).astype(np.float32)
        grid = hn.OccupancyGrid(probability, hn.Frame(_RESOLUTION_M), robot_radius_m=0)
        true = _colours(folder / "gt_used.png", grid.shape)
        free = grid.measured == hn.CellClass.FREE
        rose2 = _colours(folder / "seg_used.png", grid.shape)
        return cls(name, grid, true, (true >= 0) & free, rose2, None)

    @cached_property
    def free(self) -> BoolArray:
        """bool (rows, cols), free cells as measured."""
        free: BoolArray = self.grid.measured == hn.CellClass.FREE
        return free

    @cached_property
    def clearance_m(self) -> FloatArray:
        """As `measured_clearance_m` returns it."""
        return measured_clearance_m(self.grid)

    def boundaries(self, label_of: IntArray) -> RoomBoundaries:
        """Return the boundaries between rooms, which are spread over free cells between them."""
        label_of = self.spread(label_of)
        names = tuple(map(str, range(int(label_of.max()) + 1)))
        return RoomBoundaries.of(hn.RoomLabels(names, label_of), self.grid, self.clearance_m)

    def spread(self, label_of: IntArray) -> IntArray:
        """Return rooms that are spread over free cells between them."""
        grown = np.where(self.free, label_of, -1).astype(np.int32)
        region = np.where(self.free, np.int32(0), np.int32(-1))
        steps = round(_BETWEEN_M / self.grid.resolution_m)
        spread(grown, region, steps)
        return grown

    def doors(self, label_of: IntArray) -> FloatArray:
        """Return the middles of doors between rooms, float64 (n, 2), in metres: of at most 2 m,
        and passable for a robot of 0.15 m."""
        found = self.boundaries(label_of)
        is_door = (found.labels >= 0).all(axis=1) & found.between_jambs
        is_door &= (found.widths_m <= MOST_DOOR_M) & (found.passages_m >= 0.3)
        middles: FloatArray = found.middles[is_door]
        return middles

    @cached_property
    def true_doors(self) -> FloatArray:
        """The doors that people drew, else those between their rooms, float64 (n, 2)."""
        return self.doors(self.true) if self.drawn is None else np.array(self.drawn)


def _colours(path: Path, shape: tuple[int, int]) -> IntArray:
    """Labels of the colours of an image; black, white and rare colours are none."""
    pixels = np.array(Image.open(path).convert("RGB")).astype(np.int64)
    colour = pixels @ (1 << np.array([16, 8, 0]))
    found, dense, counts = np.unique(colour, return_inverse=True, return_counts=True)
    is_room = (counts >= _LEAST_PIXELS) & (found != 0) & (found != 0xFFFFFF)
    label = np.where(is_room, np.cumsum(is_room) - 1, -1)[dense.reshape(colour.shape)]
    labels = np.full(shape, -1, dtype=np.int32)
    rows, cols = np.minimum(shape, label.shape)
    labels[:rows, :cols] = label[:rows, :cols]
    return labels[::-1].copy()
