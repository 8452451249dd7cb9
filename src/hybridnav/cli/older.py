"""The older map from which `hybridnav rooms --names-from` carries names."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli.common import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from hybridnav.cli.reading import MapOptions
    from hybridnav.topology.rooms import CarriedNames

_MOST_HEAD = 4096
"""Bytes of a file in which the image of a map is named."""


def older_files(names_from: Path | None, names_map: Path | None) -> tuple[Path, Path] | None:
    """Return a file of rooms and its map: the given one, or the only one in the folder; None
    without a file."""
    if names_from is None:
        if names_map is not None:
            raise UsageError("--names-map is the map of --names-from: give both")
        return None
    if not names_from.is_file():
        raise hn.errors.RoomsNotFoundError(f"rooms {printable(names_from)}: no such file")
    if names_map is not None:
        return names_from, names_map
    found = []
    for path in sorted(names_from.absolute().parent.glob("*.yaml")):
        with path.open("rb") as file:
            lines = file.read(_MOST_HEAD).splitlines()
        found += [path] if any(line.startswith(b"image:") for line in lines) else []
    if len(found) != 1:
        raise UsageError(
            f"--names-from needs the map of these rooms, and their folder has {len(found)}: "
            "name it with --names-map OLD"
        )
    return names_from, found[0]


@dataclass(frozen=True, eq=False)
class Older:
    """The older map, and what its names became."""

    rooms: hn.RoomLabels
    grid: hn.OccupancyGrid
    carried: CarriedNames

    @classmethod
    def of(
        cls,
        files: tuple[Path, Path],
        reading: MapOptions,
        new: tuple[hn.RoomLabels, hn.OccupancyGrid],
    ) -> Older:
        """Read a file of rooms and its map, and carry the names; refuse a map that does not fit."""
        from hybridnav.topology.rooms import carry_names  # noqa: PLC0415 - loads numba

        before = hn.load_map(
            files[1],
            robot_radius_m=new[1].robot_radius_m,
            free_threshold=reading.free_threshold,
            occupied_threshold=reading.occupied_threshold,
            max_cells=reading.max_cells,
        )
        rooms = hn.load_rooms(files[0], before)
        carried = carry_names(rooms, before, *new)
        if carried.transform is None:
            raise hn.errors.RoomsError(
                f"rooms {printable(files[0])}: no name is carried from "
                f"{printable(before.name)} to {printable(new[1].name)}: {carried.reason}"
            )
        return cls(rooms, before, carried)

    @property
    def topology(self) -> hn.TopologicalMap:
        """The older map with its rooms, for a picture."""
        return hn.TopologicalMap(hn.DualGraphPyramid.build(self.grid, rooms=self.rooms))

    def lines(self) -> list[str]:
        """Return what became of the names, for people."""
        to = self.carried
        assert to.transform is not None  # noqa: S101 - `of` refuses it
        counts = []
        for what, each in (("rooms", to.rooms), ("doors", to.doors)):
            kept = sum(one.status == "carried" for one in each.values())
            counts.append(f"{kept} of {len(each)} {what}")
        x, y = to.transform.translation_m
        turn = math.degrees(to.transform.rotation_rad)
        moved = f"turned by {turn:.2f} degrees, moved by ({x:.2f}, {y:.2f}) m"
        whose = printable(self.grid.name)
        lines = [f"names      of {whose}: {' and '.join(counts)} carried; {moved}"]
        for status in ("undecided", "lost"):
            rooms = [(name, one.reason) for name, one in to.rooms.items() if one.status == status]
            lines += [f"{status:<10} {name}: {reason}" for name, reason in rooms]
            gone = [str(n) for n, one in to.doors.items() if one.status == status]
            lines += [f"{status:<10} doors {', '.join(gone)}"] if gone else []
        lines += [f"new        {', '.join(to.new_rooms)}"] if to.new_rooms else []
        if to.lost_points:
            lines.append(f"lost       points {', '.join(to.lost_points)}")
        return lines

    def figures(self) -> dict[str, Any]:
        """Return what became of the names, as plain values."""
        to = self.carried
        assert to.transform is not None  # noqa: S101 - `of` refuses it
        return {
            **asdict(to.transform),
            "rooms": {name: asdict(one) for name, one in to.rooms.items()},
            "doors": {str(number): asdict(one) for number, one in to.doors.items()},
            "new_rooms": to.new_rooms,
            "new_doors": to.new_doors,
            "lost_points": to.lost_points,
        }
