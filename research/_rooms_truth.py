"""Labelled floors for the measurement of rooms: true rooms, true doors, what can be reached."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import yaml
from scipy import ndimage

import hybridnav as hn
from hybridnav._base.typing import BoolArray, FloatArray, IntArray

FLOORS = ("2", "3", "3ne")
RADIUS_M = 0.25


@dataclass(frozen=True, eq=False)
class TrueDoor:
    """A door as people drew it."""

    name: str
    rooms: tuple[str, str]
    middle: FloatArray
    approaches: FloatArray
    """(2, 2), a point on either side, in the order of rooms; metres."""


@dataclass(frozen=True, eq=False)
class Floor:
    """A map with true rooms and doors."""

    name: str
    grid: hn.OccupancyGrid
    rooms: hn.RoomLabels
    doors: list[TrueDoor]
    neighbours: set[frozenset[str]]
    """Pairs of rooms with a way between them, if the data lists any."""

    @classmethod
    def read(cls, folder: Path) -> Floor:
        """Read one floor of the data."""
        grid = hn.load_map(folder / f"{folder.name}.yaml", robot_radius_m=RADIUS_M)
        rooms = hn.load_rooms(folder / "locations.yaml", grid)
        doors = []
        for entry in yaml.safe_load((folder / "doors.yaml").read_text(encoding="utf-8")):
            sides = entry["approach"]
            corners = [entry["door_corner_pt_1"], entry["door_corner_pt_2"]]
            doors.append(
                TrueDoor(
                    entry["name"],
                    (sides[0]["from"], sides[1]["from"]),
                    np.mean(corners, axis=0),
                    np.array([side["point"][:2] for side in sides], dtype=np.float64),
                )
            )
        neighbours: set[frozenset[str]] = set()
        for place in (folder, folder.with_name(f"sim_{folder.name}")):  # one of them has it
            if (place / "connectivity.yaml").is_file():
                listed = yaml.safe_load((place / "connectivity.yaml").read_text(encoding="utf-8"))
                neighbours |= {frozenset((a, b)) for a, others in listed.items() for b in others}
        return cls(folder.name, grid, rooms, doors, neighbours)

    @cached_property
    def components(self) -> IntArray:
        """Connected parts of the free cells, 0 elsewhere: what legal moves join, for a diagonal
        needs both cells beside it."""
        labels, _ = ndimage.label(self.grid.classes == hn.CellClass.FREE)
        return labels.astype(np.int32)

    @cached_property
    def reachable(self) -> BoolArray:
        """The largest of them."""
        sizes = np.bincount(self.components.ravel())
        sizes[0] = 0
        inside: BoolArray = self.components == sizes.argmax()
        return inside

    @cached_property
    def compared(self) -> BoolArray:
        """Cells that are both labelled and reachable."""
        cells: BoolArray = self.reachable & (self.rooms.label_of >= 0)
        return cells

    @cached_property
    def reachable_doors(self) -> list[TrueDoor]:
        """Doors whose approaches can both be reached."""
        return [
            door
            for door in self.doors
            if self.reachable[tuple(self.grid.frame.cells_of(door.approaches).T)].all()
        ]

    def topology(self, rooms: hn.RoomLabels) -> hn.TopologicalMap:
        """The map with some rooms, at the default merge distance."""
        return hn.TopologicalMap(hn.DualGraphPyramid.build(self.grid, rooms=rooms))
