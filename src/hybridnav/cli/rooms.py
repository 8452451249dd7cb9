"""`hybridnav rooms`: find the rooms of a map and write them down."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli import options
from hybridnav.cli.common import (
    EXIT_NOT_SOLVED,
    EXIT_SOLVED,
    UsageError,
    answer,
    check_output,
    check_picture,
    islands_line,
    stage,
    timings,
)
from hybridnav.cli.reading import MapOptions, check_room_to_be, load_model, with_map
from hybridnav.maps import CellClass
from hybridnav.maps.names import read_point

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._base.typing import FloatArray
    from hybridnav.maps import OccupancyGrid, RoomLabels
    from hybridnav.maps.room_labels import Point
    from hybridnav.rooms import CarriedNames, Door, Rooms
    from hybridnav.rooms.files.measures import RoomMeasures

LeastAreaOption = Annotated[
    float | None,
    typer.Option(
        "--least-area",
        metavar="A",
        help="Least area of a room, in square metres of free cells as measured.",
        show_default="1.0",
    ),
]
AtOption = Annotated[
    str | None,
    typer.Option("--at", metavar="X,Y", help="Print only the room that this point lies in."),
]
ToleranceOption = Annotated[
    float | None,
    typer.Option(
        "--tolerance",
        metavar="D",
        help="How far outlines may lie from the cells, in metres, before they are straightened.",
        show_default="the least with which the file has at most 20 kB",
    ),
]
AllOption = Annotated[
    bool,
    typer.Option(
        "--all", help="List and draw rooms that cannot be entered, gaps, and doors to them too."
    ),
]
NamesFromOption = Annotated[
    Path | None,
    typer.Option(
        "--names-from",
        metavar="FILE",
        help="Carry names and numbers of doors from the rooms of an older map, in any frame.",
    ),
]
NamesMapOption = Annotated[
    Path | None,
    typer.Option(
        "--names-map",
        metavar="OLD",
        help="The map of --names-from.",
        show_default="the only map in the folder of that file",
    ),
]
FindOption = Annotated[
    bool, typer.Option("--find", help="Find rooms anew, although the map has some, or its folder.")
]


@with_map(before="at")
def rooms(
    map_file: options.MapArgument[Path],
    out: options.OutOption[Path | None] = None,
    least_area_m2: LeastAreaOption = None,
    rooms_file: options.RoomsOption = None,
    find: FindOption = False,
    names_from: NamesFromOption = None,
    names_map: NamesMapOption = None,
    at: AtOption = None,
    force: options.ForceOption = False,
    tolerance_m: ToleranceOption = None,
    everything: AllOption = False,
    as_json: options.JsonOption = False,
    plot: options.PlotOption = None,
    *,
    reading: MapOptions,
) -> None:
    """Find the rooms of MAP, or read them from a file, and list them with their doors.

    Without --rooms, rooms are those of the model, or of rooms.yaml beside the map, if there; --find
    finds them anew. --out writes them as YAML, to be edited.
    """
    asked = _asked_point(at, out, plot)
    _check_files(out, plot, tolerance_m, force=force)
    finds = find or least_area_m2 is not None
    if rooms_file is not None and finds:
        option = "--find" if least_area_m2 is None else "--least-area"
        raise UsageError(f"{option} is for rooms that are found, --rooms reads them")
    area_m2 = 1.0 if least_area_m2 is None else least_area_m2
    older = older_files(names_from, names_map)
    settings = reading.settings(map_file)
    seconds: dict[str, float] = {}
    model = load_model(map_file, settings, seconds, reading)
    grid = model.grid
    check_room_to_be(grid)
    with stage("finding rooms", seconds, "rooms"):
        labels = None if finds else model.rooms
        beside = map_file.parent / "rooms.yaml"
        # Names of an older map are carried to what is found on this one.
        reads = not finds and older is None and labels is None
        if rooms_file is None and reads and beside.is_file():
            rooms_file = beside
        if rooms_file is not None:
            labels = hn.load_rooms(rooms_file, grid)
        elif labels is None:
            labels = hn.find_rooms(grid, least_area_m2=area_m2)
    old = None
    if older is not None:
        with stage("carrying names", seconds, "names"):
            old = Older.of(older, reading, (labels, grid))
        labels = old.carried.labels
    if asked is not None:
        found = _found_at(asked, labels, grid)
        answer(json.dumps(found, allow_nan=False) + "\n" if as_json else _room_line(found))
        raise typer.Exit(EXIT_SOLVED if found["room"] is not None else EXIT_NOT_SOLVED)
    # Loads numba, which help and wrong usage can do without.
    from hybridnav.rooms.level import room_areas_m2  # noqa: PLC0415

    areas_m2 = room_areas_m2(labels, grid)
    if out is not None:
        # What is listed and drawn is what others read; areas stay those that were asked for.
        with stage("writing rooms", seconds, "write"):
            hn.save_rooms(out, labels, grid, tolerance_m=tolerance_m)
            labels = hn.load_rooms(out, grid)
    with stage("building the pyramid", seconds, "pyramid"):
        topology = model.grown(settings.pyramid, labels)
    figures = _figures(topology.rooms, areas_m2) | {"map": str(map_file), "seconds": seconds}
    if old is not None:
        figures |= {"names": old.figures()}
    answer(
        json.dumps(figures, allow_nan=False) + "\n"
        if as_json
        else "\n".join(
            [
                _listing(topology.rooms, areas_m2, everything=everything),
                *([] if old is None else old.lines()),
                *islands_line(grid),
            ]
        )
        + f"\nseconds    {timings(seconds)}\n"
    )
    if plot is not None:
        _draw(plot, topology, old, everything=everything)


def _draw(plot: Path, topology: hn.TopologicalMap, old: Older | None, *, everything: bool) -> None:
    """Write the picture of the rooms, beside those of the older map if there is one."""
    # matplotlib on demand
    from hybridnav.viz import plot_rooms, plot_rooms_beside, save_figure  # noqa: PLC0415

    if old is None:
        save_figure(plot_rooms(topology, everything=everything), plot)
    else:
        save_figure(plot_rooms_beside(old.topology, topology), plot)


def _measures_of(labels: RoomLabels, grid: OccupancyGrid) -> list[RoomMeasures]:
    from hybridnav.rooms.files.measures import measures_of  # noqa: PLC0415 - loads numpy

    return measures_of(labels, grid)


def _check_files(
    out: Path | None, plot: Path | None, tolerance_m: float | None, *, force: bool
) -> None:
    """Refuse files that cannot be written, and a tolerance that is none or of no file."""
    check_picture(plot)
    if out is not None and out.exists() and not force:
        raise UsageError(f"{printable(out)} exists: it may hold names given by hand; add --force")
    check_output(out, "--out", (".yaml", ".yml"))
    if tolerance_m is not None and (out is None or not 0 < tolerance_m < math.inf):
        needed = "needs --out" if out is None else "must be positive and finite"
        raise UsageError(f"--tolerance {needed}, got --tolerance {tolerance_m:g}")


def _asked_point(text: str | None, out: Path | None, plot: Path | None) -> Point | None:
    """Return the point of `--at`, which stands alone."""
    if text is None:
        return None
    if out is not None or plot is not None:
        raise UsageError("--at prints one room: leave out --out and --plot")
    point = read_point(text)
    if point is None or len(point) != 2 or not all(map(math.isfinite, point)):  # noqa: PLR2004
        raise UsageError(f"--at must be two finite numbers X,Y in metres, got {text!r:.80}")
    return point[0], point[1]


def _found_at(point: Point, labels: hn.RoomLabels, grid: hn.OccupancyGrid) -> dict[str, Any]:
    """Return the room of a point, and what its cell is."""
    row, col = grid.frame.cell_of(*point)
    is_inside = 0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]
    cell = CellClass(int(grid.measured[row, col])).name.lower() if is_inside else "outside"
    return {"at_m": list(point), "room": labels.at(point, grid), "cell": cell}


def _room_line(found: dict[str, Any]) -> str:
    """Return the name alone, for scripts, or a line that there is none."""
    if found["room"] is not None:
        return f"{found['room']}\n"
    x, y = found["at_m"]
    where = "outside the map" if found["cell"] == "outside" else f"in {found['cell']} space"
    return f"no room at ({x:.10g}, {y:.10g}), {where}\n"


def _figures(rooms: Rooms, areas_m2: FloatArray) -> dict[str, Any]:
    """Return rooms and doors as plain values, all of them: `is_listed` tells which the list has."""
    shown = {door.number for door in rooms.listed_doors}
    return {
        "is_building": rooms.is_building,
        "robot_radius_m": rooms.grid.robot_radius_m,
        "rooms": [
            {
                "number": number,
                "name": name,
                "area_m2": round(area_m2, 6),
                "kind": None if kind is None else kind.name,
                "kind_confidence": None if kind is None else round(kind.confidence, 3),
                "point_m": _rounded(rooms.point_of(name)),
                "centre_m": _rounded(facts.centre_m),
                "extent_m": [_rounded(facts.low_m), _rounded(facts.high_m)],
                "fits": fits,
                "is_listed": is_listed,
                "neighbours": [
                    {"room": other, "door": door.number, "width_m": round(door.width_m, 6)}
                    for door, other in beside
                ],
            }
            for number, (name, kind, area_m2, fits, is_listed, facts, beside) in enumerate(
                zip(
                    rooms.names,
                    rooms.kinds,
                    areas_m2.tolist(),
                    rooms.fits.tolist(),
                    rooms.is_listed.tolist(),
                    _measures_of(rooms.labels, rooms.grid),
                    _neighbours(rooms, rooms.listed_doors),
                    strict=True,
                ),
                start=1,
            )
        ],
        "doors": [
            {
                "number": door.number,
                "rooms": list(door.rooms),
                "position_m": [round(number, 6) for number in door.position],
                "width_m": round(door.width_m, 6),
                "kind": door.kind,
                "passable": door.passable,
                "is_gap": door.is_gap,
                "is_listed": door.number in shown,
            }
            for door in rooms.doors
        ],
    }


def _rounded(point: tuple[float, float]) -> list[float]:
    return [round(number, 6) for number in point]


def _neighbours(rooms: Rooms, doors: Iterable[Door]) -> list[list[tuple[Door, str | None]]]:
    """Return for each room its doors among some, and the room behind each."""
    found: dict[str | None, list[tuple[Door, str | None]]] = {name: [] for name in rooms.names}
    for door in doors:
        for name, other in (door.rooms, door.rooms[::-1]):
            if name is not None:
                found[name].append((door, other))
    return [found[name] for name in rooms.names]


def _listing(rooms: Rooms, areas_m2: FloatArray, *, everything: bool) -> str:
    """Return one line a room: its number, free area, size, the point that stands for it, the doors
    to its neighbours."""
    is_shown = [everything or is_listed for is_listed in rooms.is_listed.tolist()]
    shown = [name for name, is_one in zip(rooms.names, is_shown, strict=True) if is_one]
    width = max(map(len, shown), default=0)
    digits = len(str(len(rooms.names)))
    of_rooms, of_doors, rest = rooms.counted(everything=everything)
    left_out = f"; not listed without --all: {rest}" if rest else ""
    lines = [
        f"rooms      {of_rooms.replace(' rooms', '', 1)}; {of_doors}{left_out}",
        "columns    room, number, area, extent in x and y, point, kind, doors to (number: width)",
    ]
    if not rooms.is_building:
        lines.insert(1, "building   no door between walls: these rooms are parts of open space")
    measures = _measures_of(rooms.labels, rooms.grid)
    each = zip(
        rooms.names,
        rooms.kinds,
        areas_m2.tolist(),
        rooms.fits.tolist(),
        measures,
        _neighbours(rooms, rooms.doors if everything else rooms.listed_doors),
        strict=True,
    )
    for number, (name, kind, area_m2, fits, facts, beside) in enumerate(each, start=1):
        if not is_shown[number - 1]:
            continue
        point = "({:.2f}, {:.2f})".format(*_rounded(rooms.point_of(name)))
        size = "{:.1f} x {:.1f} m".format(*facts.size_m)
        stated = [] if kind is None else [kind.name]
        stated += [] if fits else [f"no robot {2 * rooms.grid.robot_radius_m:g} m wide fits"]
        stated += [_door(door, other) for door, other in beside]
        lines.append(
            f"{name:<{width}} {number:>{digits}} {area_m2:>9.2f} m²  {size:<15} {point:<16} "
            f"{', '.join(stated)}".rstrip()
        )
    return "\n".join(lines)


def _door(door: Door, other: str | None) -> str:
    narrow = "" if door.passable else ", too narrow"
    opening = "opening " if door.is_opening else ""
    return f"{other or '-'} ({opening}{door.number}: {door.width_m:.2f} m{narrow})"


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
        from hybridnav.rooms import carry_names  # noqa: PLC0415 - loads numba

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
        turn = round(math.degrees(to.transform.rotation_rad), 2) + 0.0  # no "-0.00"
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
