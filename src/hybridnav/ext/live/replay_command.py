"""`hybridnav replay`: follow a map that changes, and print how stable its identities are."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav._base.progress import Progress
from hybridnav.cli import common, options
from hybridnav.cli.options import option
from hybridnav.errors import MapError
from hybridnav.ext.live.map_command import open_log
from hybridnav.maps import DEFAULT_MAX_CELLS

if TYPE_CHECKING:
    from hybridnav.ext.live.mapping import Mapper

_MAP_ENDINGS = {".yaml", ".yml"}

FilesArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="LOG|GRIDS...",
        help="A CARMEN log (.log, or packed by gzip), a bag of ROS, or map files (.yaml) in order.",
    ),
]
EveryOption = Annotated[int, option("--every N", "Scans of a log from one map to the next.", min=1)]
ScansOption = Annotated[
    int | None, option("--scans N", "Scans of a log to read.", min=1, show_default="all")
]
RoomsEveryOption = Annotated[
    int, option("--rooms-every N", "Maps from one update of the rooms to the next.", min=1)
]


def replay(
    files: FilesArgument,
    every: EveryOption = 1,
    scans: ScansOption = None,
    resolution_m: options.ResolutionOption[float | None] = None,
    robot_radius_m: options.RadiusOption = None,
    merge_distance_m: options.MergeDistanceOption[float] = 4.0,
    rooms_every: RoomsEveryOption = 10,
    rooms_file: options.RoomsOption = None,
    max_cells: options.MaxCellsOption = DEFAULT_MAX_CELLS,
    plot: options.AnimationOption = None,
    frames: options.FramesOption = 60,
    as_json: options.JsonOption = False,
) -> None:
    """Follow a map that changes, and print how stable places are.

    It is that of a log, scan by scan, or of GRIDS, one after the other. Rooms of --rooms are those
    of the first map, and their names are followed.

    Example: hybridnav replay monday.yaml friday.yaml --plot changes.gif
    """
    common.check_output(plot, "--plot", (".gif",))
    is_log = _is_log(files)
    if not is_log and (scans is not None or every != 1 or resolution_m is not None):
        raise common.UsageError("--every, --scans and --resolution are for a log, got map files")
    if is_log and rooms_file is not None:
        raise common.UsageError("--rooms is for map files, got a log: its rooms are found")
    from hybridnav.ext.live import ReplayFigures  # noqa: PLC0415 - loads numba
    from hybridnav.ext.live import replay as follow  # noqa: PLC0415

    figures, animation = ReplayFigures(), None
    if plot is not None:
        from hybridnav.ext.live import ReplayAnimation  # noqa: PLC0415 - matplotlib on demand

        animation = ReplayAnimation(most_frames=frames)
    log = _Log(files[0], scans, max_cells) if is_log else None
    with common.progress_bar("replaying") as advance:
        if log is None:
            grids = _read(files, robot_radius_m, max_cells, advance)
        else:
            side_m = 0.05 if resolution_m is None else resolution_m
            grids = log.grids(side_m, every, robot_radius_m, advance)
        rooms, grids = _with_rooms(grids, rooms_file)
        for step in follow(
            grids, merge_distance_m=merge_distance_m, rooms_every=rooms_every, rooms=rooms
        ):
            figures.add(step)
            if animation is not None:
                animation.add(step)
    values = figures.figures() | ({} if log is None else {"log": log.summary()})
    if animation is not None and plot is not None:
        animation.save(plot)
    common.answer(json.dumps(values, allow_nan=False) + "\n" if as_json else _summary(values))
    raise typer.Exit(common.EXIT_NOT_SOLVED if values["faults"] else common.EXIT_SOLVED)


def _is_log(files: Sequence[Path]) -> bool:
    maps = [file.suffix.lower() in _MAP_ENDINGS for file in files]
    if any(maps) and not all(maps):
        raise common.UsageError(
            f"{printable(files[maps.index(False)])} is no map file, expected .yaml or .yml as the "
            "others: replay a log alone"
        )
    if not any(maps) and len(files) > 1:
        raise common.UsageError(f"got {len(files)} logs, expected one: replay them one by one")
    return not any(maps)


def _read(
    files: Sequence[Path], robot_radius_m: float | None, max_cells: int, advance: Progress
) -> Iterator[hn.OccupancyGrid]:
    for at, file in enumerate(files):
        yield hn.load_map(file, robot_radius_m=robot_radius_m, max_cells=max_cells)
        advance(at + 1, len(files))


def _with_rooms(
    grids: Iterator[hn.OccupancyGrid], rooms_file: Path | None
) -> tuple[hn.RoomLabels | None, Iterator[hn.OccupancyGrid]]:
    """Return the rooms that a file states for the first map, None without one, and all maps."""
    if rooms_file is None:
        return None, grids
    first = next(grids)
    return hn.load_rooms(rooms_file, first), itertools.chain([first], grids)


class _Log:
    """A log that is replayed.

    `most_scans`: scans to read, None for all; `max_cells`: scans that need more cells are left out.
    """

    def __init__(self, file: Path, most_scans: int | None, max_cells: int) -> None:
        self._file, self._most, self._max_cells = file, most_scans, max_cells
        self._log = open_log(file)

    def grids(
        self, resolution_m: float, every: int, robot_radius_m: float | None, advance: Progress
    ) -> Iterator[hn.OccupancyGrid]:
        from hybridnav.ext.live import grids_of_scans  # noqa: PLC0415
        from hybridnav.ext.live.mapping import Mapper  # noqa: PLC0415 - loads numba

        mapper = Mapper(resolution_m=resolution_m, max_cells=self._max_cells)
        scans = self._scans(mapper, advance)
        yield from grids_of_scans(scans, mapper, every=every, robot_radius_m=robot_radius_m)
        if not mapper.has_cells:
            raise MapError(
                f"log {printable(self._file)}: no scan with a reading, expected "
                f"{self._log.expected}; {self._log.summary()}"
            )

    def summary(self) -> str:
        """Return a line on what was left out."""
        return self._log.summary()

    def _scans(self, mapper: Mapper, advance: Progress) -> Iterator[Any]:
        for count, scan in enumerate(self._log, 1):
            n_before = mapper.n_scans
            yield scan
            if mapper.n_scans == n_before:  # also where a wrong first scan has gone
                self._log.leave_out("beyond --max-cells")
            advance(self._log.bytes_read, self._log.size_bytes)
            if count == self._most:
                return


def _summary(figures: dict[str, Any]) -> str:
    rows, cols = figures["cells"]
    doors = figures["doors"]
    counted = ["places", "rooms", "doors"]
    lines = [
        f"maps       {figures['maps']:,}, the last of {cols} x {rows} cells",
        "now        " + ", ".join(f"{figures[f'n_{kind}']:,} {kind}" for kind in counted),
        *(line for kind in counted[:-1] for line in _identities(kind, figures[kind])),
        "doors      " + ", ".join(f"{count:,} {event}" for event, count in doors.items()),
    ]
    if figures["lost_names"]:
        lines.append(f"names      lost with their rooms: {', '.join(figures['lost_names'])}")
    if figures["lost_one_way"]:
        lines.append(f"one-way    holds no more: {', '.join(figures['lost_one_way'])}")
    if "log" in figures:
        lines.append(f"log        {figures['log']}")
    n_levels, faults = figures["levels"], figures["faults"]
    lines += [f"check      {fault}" for fault in faults]
    if not faults:
        lines.append(f"check      {n_levels} levels, each boundary of their fields is one arc")
    return "\n".join(lines) + "\n"


def _identities(kind: str, counts: dict[str, Any]) -> list[str]:
    """Return lines on the updates of places or rooms."""
    if not counts["updates"]:
        return [f"{kind:<10} no update"]
    events = ", ".join(
        f"{counts[event]:,} {event}" for event in ("born", "died", "merged", "split")
    )
    times = f"median {counts['median_ms']:.1f} ms, 95 % below {counts['p95_ms']:.1f} ms"
    cells = (
        f"{counts['flipped_cells']:,.1f} cells an update, {counts['flipped_share']:.3%} of those"
    )
    return [
        f"{kind:<10} {counts['updates']:,} updates, {times}; {events}",
        (
            f"{'flips':<10} {cells} that stay free: {counts['flipped_by_merging']:.0%} by merging, "
            f"{counts['flipped_by_cutting_off']:.0%} by cutting off"
        ),
        (
            f"{'':<10} {_ever(counts['untouched'])} untouched {kind} ever; with no change beside "
            f"them {_ever(counts['apart'])}, nor in {kind} beside them {_ever(counts['far'])}"
        ),
    ]


def _ever(counts: dict[str, Any]) -> str:
    """Return how many places of a kind flip, and the share."""
    share = counts["flipped"] / max(counts["places"], 1)
    return f"{counts['flipped']:,} of {counts['places']:,} ({share:.2%})"
