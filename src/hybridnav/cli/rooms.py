"""`hybridnav rooms`: find the rooms of a map and write them down."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

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
from hybridnav.cli.map_options import MapOptions
from hybridnav.cli.options import option
from hybridnav.cli.reading import check_room_to_be
from hybridnav.maps import CellClass

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray
    from hybridnav.maps import RoomLabels
    from hybridnav.maps.room_labels import Point
    from hybridnav.rooms import CarriedNames, Door, Rooms
    from hybridnav.rooms.files.measures import RoomMeasures

LeastAreaOption = Annotated[
    float | None,
    option(
        "--least-area A",
        "Least area of a room, in square metres of free cells as measured.",
        show_default="1.0",
    ),
]
AtOption = Annotated[str | None, option("--at X,Y", "Print only the room that this point lies in.")]
ToleranceOption = Annotated[
    float | None,
    option(
        "--tolerance D",
        "How coarse outlines are: a corner goes if it cuts off less than D x D m².",
        show_default="0.3",
    ),
]
AllOption = Annotated[
    bool,
    option("--all", "List and draw rooms that cannot be entered, gaps, and doors to them too."),
]
NamesFromOption = Annotated[
    Path | None,
    option(
        "--names-from FILE",
        "Carry names and numbers of doors from the rooms of an older map, in any frame.",
    ),
]
NamesMapOption = Annotated[
    Path | None,
    option(
        "--names-map OLD",
        "The map of --names-from.",
        show_default="the only map in the folder of that file",
    ),
]
FindOption = Annotated[
    bool, option("--find", "Find rooms anew, although the map has some, or its folder.")
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class RoomsOptions(MapOptions):
    """The options of `hybridnav rooms`."""

    out: options.OutOption[Path | None] = None
    least_area_m2: LeastAreaOption = None
    rooms_file: options.RoomsOption = None
    find: FindOption = False
    names_from: NamesFromOption = None
    names_map: NamesMapOption = None
    at: AtOption = None
    force: options.ForceOption = False
    tolerance_m: ToleranceOption = None
    everything: AllOption = False
    as_json: options.JsonOption = False
    plot: options.PlotOption = None

    @property
    def finds(self) -> bool:
        """Whether rooms are found anew, whatever is there."""
        return self.find or self.least_area_m2 is not None


def rooms(args: RoomsOptions) -> None:
    """Find the rooms of MAP, or read them, and list their doors.

    Without --rooms, rooms are those of the model, or of rooms.yaml beside the map, if there; --find
    finds them anew. --out writes them as YAML, to be edited.

    Example: hybridnav rooms maps/office/office.yaml --plot rooms.png
    """
    point = _point_of(args)
    _check_files(args)
    older = older_files(args.names_from, args.names_map)
    settings = args.settings()
    seconds: dict[str, float] = {}
    model = args.load(settings, seconds)
    check_room_to_be(model.grid)
    with stage("finding rooms", seconds, "rooms"):
        labels = _labels(args, model)
    old = None
    if older is not None:
        with stage("carrying names", seconds, "names"):
            old = Older.of(older, args, (labels, model.grid))
        labels = old.carried.labels
    if point is not None:
        room = _room_at(point, labels, model.grid)
        answer(json.dumps(room, allow_nan=False) + "\n" if args.as_json else _room_line(room))
        raise typer.Exit(EXIT_SOLVED if room["room"] is not None else EXIT_NOT_SOLVED)
    # Loads numba, which help and wrong usage can do without.
    from hybridnav.rooms.level import room_areas_m2  # noqa: PLC0415

    areas_m2 = room_areas_m2(labels, model.grid)
    if args.out is not None:
        # What is listed and drawn is what others read; areas stay those that were asked for.
        with stage("writing rooms", seconds, "write"):
            hn.save_rooms(args.out, labels, model.grid, tolerance_m=args.tolerance_m)
            labels = hn.load_rooms(args.out, model.grid)
    with stage("building the pyramid", seconds, "pyramid"):
        topology = model.grown(settings.pyramid, labels)
    _print_rooms(args, topology.rooms, areas_m2, old, seconds)
    if args.plot is not None:
        _draw(args.plot, topology, old, everything=args.everything)


def _labels(args: RoomsOptions, model: hn.Model) -> RoomLabels:
    """Read the rooms of a file, of the model, or of the file beside the map; else find them."""
    file, beside = args.rooms_file, args.map_file.parent / "rooms.yaml"
    labels = None if args.finds or file is not None else model.rooms
    # Names of an older map are carried to what is found on this one.
    if not args.finds and args.names_from is None and labels is None and beside.is_file():
        file = file or beside
    if file is not None:
        return hn.load_rooms(file, model.grid)
    if labels is not None:
        return labels
    area_m2 = 1.0 if args.least_area_m2 is None else args.least_area_m2
    return hn.find_rooms(model.grid, least_area_m2=area_m2)


def _check_files(args: RoomsOptions) -> None:
    """Refuse files that cannot be written, options that exclude each other, and a tolerance that is
    none or of no file."""
    check_picture(args.plot)
    out, tolerance_m = args.out, args.tolerance_m
    if out is not None and out.exists() and not args.force:
        raise UsageError(f"{printable(out)} exists: it may hold names given by hand; add --force")
    check_output(out, "--out", (".yaml", ".yml"))
    if tolerance_m is not None and (out is None or not 0 < tolerance_m < math.inf):
        needed = "needs --out" if out is None else "must be positive and finite"
        raise UsageError(f"--tolerance {needed}, got --tolerance {tolerance_m:g}")
    if args.rooms_file is not None and args.finds:
        option = "--find" if args.least_area_m2 is None else "--least-area"
        raise UsageError(f"{option} is for rooms that are found, --rooms reads them")


# The room of a point.


def _point_of(args: RoomsOptions) -> Point | None:
    """Return the point of `--at`, which stands alone."""
    if args.at is None:
        return None
    if args.out is not None or args.plot is not None:
        raise UsageError("--at prints one room: leave out --out and --plot")
    return options.parsed_point(args.at, "--at")


def _room_at(point: Point, labels: RoomLabels, grid: hn.OccupancyGrid) -> dict[str, Any]:
    row, col = grid.frame.cell_of(*point)
    is_inside = 0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]
    cell = CellClass(int(grid.measured[row, col])).name.lower() if is_inside else "outside"
    return {"at_m": list(point), "room": labels.at(point, grid), "cell": cell}


def _room_line(room: dict[str, Any]) -> str:
    """Return the name alone, for scripts, or a line that there is none."""
    if room["room"] is not None:
        return f"{room['room']}\n"
    x, y = room["at_m"]
    where = "outside the map" if room["cell"] == "outside" else f"in {room['cell']} space"
    return f"no room at ({x:.10g}, {y:.10g}), {where}\n"


# All rooms.


def _print_rooms(
    args: RoomsOptions,
    rooms: Rooms,
    areas_m2: FloatArray,
    old: Older | None,
    seconds: dict[str, float],
) -> None:
    if args.as_json:
        figures = _figures(rooms, areas_m2) | {"map": str(args.map_file), "seconds": seconds}
        figures |= {} if old is None else {"names": old.figures()}
        answer(json.dumps(figures, allow_nan=False) + "\n")
        return
    lines = _listing(rooms, areas_m2, everything=args.everything)
    lines += [*([] if old is None else old.lines()), *islands_line(rooms.grid)]
    answer("\n".join([*lines, f"seconds    {timings(seconds)}"]) + "\n")


def _draw(plot: Path, topology: hn.TopologicalMap, old: Older | None, *, everything: bool) -> None:
    """Write the picture of the rooms, beside those of the older map if there is one."""
    # matplotlib on demand
    from hybridnav.viz import plot_rooms, plot_rooms_beside, save_figure  # noqa: PLC0415

    if old is None:
        save_figure(plot_rooms(topology, everything=everything), plot)
    else:
        save_figure(plot_rooms_beside(old.topology, topology), plot)


class _Row(NamedTuple):
    """What is printed of a room; `doors` with the room behind each."""

    number: int
    name: str
    kind: Any
    area_m2: float
    fits: bool
    is_listed: bool
    measures: RoomMeasures
    doors: list[tuple[Door, str | None]]


def _rows(rooms: Rooms, areas_m2: FloatArray, doors: Iterable[Door]) -> list[_Row]:
    from hybridnav.rooms.files.measures import measures_of  # noqa: PLC0415 - loads numpy

    doors_of: dict[str | None, list[tuple[Door, str | None]]] = {name: [] for name in rooms.names}
    for door in doors:
        for name, other in (door.rooms, door.rooms[::-1]):
            if name is not None:
                doors_of[name].append((door, other))
    columns = zip(
        itertools.count(1),
        rooms.names,
        rooms.kinds,
        areas_m2.tolist(),
        rooms.fits.tolist(),
        rooms.is_listed.tolist(),
        measures_of(rooms.labels, rooms.grid),
        (doors_of[name] for name in rooms.names),
        strict=False,
    )
    return [_Row(*column) for column in columns]


def _figures(rooms: Rooms, areas_m2: FloatArray) -> dict[str, Any]:
    """Return rooms and doors as plain values, all of them: `is_listed` tells which the list has."""
    listed = {door.number for door in rooms.listed_doors}
    return {
        "is_building": rooms.is_building,
        "robot_radius_m": rooms.grid.robot_radius_m,
        "rooms": [
            {
                "number": row.number,
                "name": row.name,
                "area_m2": round(row.area_m2, 6),
                "kind": None if row.kind is None else row.kind.name,
                "kind_confidence": None if row.kind is None else round(row.kind.confidence, 3),
                "point_m": _rounded(rooms.point_of(row.name)),
                "centre_m": _rounded(row.measures.centre_m),
                "extent_m": [_rounded(row.measures.low_m), _rounded(row.measures.high_m)],
                "fits": row.fits,
                "is_listed": row.is_listed,
                "neighbours": [
                    {"room": other, "door": door.number, "width_m": round(door.width_m, 6)}
                    for door, other in row.doors
                ],
            }
            for row in _rows(rooms, areas_m2, rooms.listed_doors)
        ],
        "doors": [
            {
                "number": door.number,
                "rooms": list(door.rooms),
                "position_m": _rounded(door.position),
                "width_m": round(door.width_m, 6),
                "kind": door.kind,
                "passable": door.passable,
                "is_gap": door.is_gap,
                "is_listed": door.number in listed,
            }
            for door in rooms.doors
        ],
    }


def _rounded(point: Iterable[float]) -> list[float]:
    return [round(number, 6) for number in point]


def _listing(rooms: Rooms, areas_m2: FloatArray, *, everything: bool) -> list[str]:
    """Return one line a room: its number, free area, size, the point that stands for it, the doors
    to its neighbours."""
    doors = rooms.doors if everything else rooms.listed_doors
    rows = [row for row in _rows(rooms, areas_m2, doors) if everything or row.is_listed]
    width = max((len(row.name) for row in rows), default=0)
    digits = len(str(len(rooms.names)))
    of_rooms, of_doors, rest = rooms.counted(everything=everything)
    left_out = f"; not listed without --all: {rest}" if rest else ""
    lines = [
        f"rooms      {of_rooms.replace(' rooms', '', 1)}; {of_doors}{left_out}",
        "columns    room, number, area, extent in x and y, point, kind, doors to (number: width)",
    ]
    if not rooms.is_building:
        lines.insert(1, "building   no door between walls: these rooms are parts of open space")
    for row in rows:
        point = "({:.2f}, {:.2f})".format(*_rounded(rooms.point_of(row.name)))
        size = "{:.1f} x {:.1f} m".format(*row.measures.size_m)
        stated = [] if row.kind is None else [row.kind.name]
        stated += [] if row.fits else [f"no robot {2 * rooms.grid.robot_radius_m:g} m wide fits"]
        stated += [_door(door, other) for door, other in row.doors]
        lines.append(
            f"{row.name:<{width}} {row.number:>{digits}} {row.area_m2:>9.2f} m²  {size:<15} "
            f"{point:<16} {', '.join(stated)}".rstrip()
        )
    return lines


def _door(door: Door, other: str | None) -> str:
    narrow = "" if door.passable else ", too narrow"
    opening = "opening " if door.is_opening else ""
    return f"{other or '-'} ({opening}{door.number}: {door.width_m:.2f} m{narrow})"


# Names of an older map.

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
    maps = []
    for path in sorted(names_from.absolute().parent.glob("*.yaml")):
        with path.open("rb") as file:
            lines = file.read(_MOST_HEAD).splitlines()
        maps += [path] if any(line.startswith(b"image:") for line in lines) else []
    if len(maps) != 1:
        raise UsageError(
            f"--names-from needs the map of these rooms, and their folder has {len(maps)}: "
            "name it with --names-map OLD"
        )
    return names_from, maps[0]


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
        args: RoomsOptions,
        new: tuple[hn.RoomLabels, hn.OccupancyGrid],
    ) -> Older:
        """Read a file of rooms and its map, and carry the names; refuse a map that does not fit."""
        from hybridnav.rooms import carry_names  # noqa: PLC0415 - loads numba

        before = hn.load_map(
            files[1],
            robot_radius_m=new[1].robot_radius_m,
            free_threshold=args.free_threshold,
            occupied_threshold=args.occupied_threshold,
            max_cells=args.max_cells,
        )
        rooms = hn.load_rooms(files[0], before)
        carried = carry_names(rooms, before, *new, recut=args.rooms_file is None)
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
            n_carried = sum(fate.status == "carried" for fate in each.values())
            counts.append(f"{n_carried} of {len(each)} {what}")
        x, y = to.transform.translation_m
        turn = round(math.degrees(to.transform.rotation_rad), 2) + 0.0  # no "-0.00"
        moved = f"turned by {turn:.2f} degrees, moved by ({x:.2f}, {y:.2f}) m"
        whose = printable(self.grid.name)
        lines = [f"names      of {whose}: {' and '.join(counts)} carried; {moved}"]
        for status in ("carried", "undecided", "lost"):
            rooms = [(n, fate.reason) for n, fate in to.rooms.items() if fate.status == status]
            lines += [f"{status:<10} {name}: {reason}" for name, reason in rooms if reason]
            doors = [str(n) for n, fate in to.doors.items() if fate.status == status]
            lines += [f"{status:<10} doors {', '.join(doors)}"] * bool(
                doors and status != "carried"
            )
        lines += [f"new        {', '.join(to.new_rooms)}"] if to.new_rooms else []
        if to.lost_points:
            lines.append(f"lost       points {', '.join(to.lost_points)}")
        lines += [f"lost       one-way {rule}" for rule in to.lost_one_way]
        return lines

    def figures(self) -> dict[str, Any]:
        """Return what became of the names, as plain values."""
        to = self.carried
        assert to.transform is not None  # noqa: S101 - `of` refuses it
        return {
            **asdict(to.transform),
            "rooms": {name: asdict(fate) for name, fate in to.rooms.items()},
            "doors": {str(number): asdict(fate) for number, fate in to.doors.items()},
            "new_rooms": to.new_rooms,
            "new_doors": to.new_doors,
            "lost_points": to.lost_points,
            "lost_one_way": [str(rule) for rule in to.lost_one_way],
        }
