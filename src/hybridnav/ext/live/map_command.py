"""`hybridnav map`: from a robot's log to a map file; and logs as commands read them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._base.clock import clock
from hybridnav._base.files import printable
from hybridnav.cli import options
from hybridnav.cli.common import UsageError, answer, check_writable, extent_line, progress_bar
from hybridnav.cli.options import option
from hybridnav.errors import MapError
from hybridnav.maps import DEFAULT_MAX_CELLS

if TYPE_CHECKING:
    from hybridnav.ext.live.files.scan_log import ScanLog
    from hybridnav.ext.live.mapping import Mapper

# Logs of scans that commands read: CARMEN's, and bags.

_BAGS = (".bag", ".mcap", ".db3")


def is_bag(path: Path) -> bool:
    """Return whether a path names a bag of ROS, by its ending, or a folder."""
    return path.suffix.lower() in _BAGS or path.is_dir()


def open_log(path: Path, topic: str | None = None, frame: str | None = None) -> ScanLog:
    """Open a log of scans.

    `path`: the file or folder; `topic`, `frame`: as in `BagLog`, for bags.
    """
    if is_bag(path):
        return hn.ext.live.BagLog(path, topic=topic, frame=frame)
    if topic is not None or frame is not None:
        option = "--topic" if topic is not None else "--frame"
        raise UsageError(
            f"{option} is for bags of ROS, got the log {printable(path)}: leave it out"
        )
    return hn.ext.live.CarmenLog(path)


# The command.

_LESS_OFTEN = 16
"""Scans between two moves of the bar."""

LogArgument = Annotated[
    Path,
    typer.Argument(
        metavar="LOG",
        help="CARMEN log (.log, or packed by gzip), or bag of ROS (.bag, .mcap, .db3, folder).",
    ),
]
TopicOption = Annotated[
    str | None,
    option("--topic NAME", "Topic of a bag: of scans, or of a map, whose last message is written."),
]
YawOption = Annotated[
    float | None,
    option(
        "--yaw RAD",
        "Yaw of the map of --topic in a bag, where its quaternion is zero and states none.",
    ),
]
MaxRangeOption = Annotated[
    float, option("--max-range R", "Readings of R metres or more are no obstacles.")
]
MinRangeOption = Annotated[float, option("--min-range R", "Readings up to R metres are none.")]
ClearRangeOption = Annotated[
    float, option("--clear-range R", "Metres that a beam without a return makes free.")
]
ToleranceOption = Annotated[
    float, option("--tolerance R", "Metres before its end that a beam does not make free.")
]
HitOption = Annotated[float, option("--hit P", "Occupancy of a cell after one scan that hit it.")]
PassOption = Annotated[
    float, option("--pass P", "Occupancy of a cell after one scan that passed it.")
]
LeastOption = Annotated[
    float,
    option(
        "--least P",
        "Least occupancy of a cell: 0.02 lets later scans undo earlier ones, by 0 all count alike.",
    ),
]


def map(  # noqa: A001 - the command's name
    log_file: LogArgument,
    out: options.OutOption[Path],
    resolution_m: options.ResolutionOption[float] = 0.05,
    max_range_m: MaxRangeOption = 30.0,
    min_range_m: MinRangeOption = 0.0,
    clear_range_m: ClearRangeOption = 0.0,
    tolerance_m: ToleranceOption = 0.1,
    when_hit: HitOption = 0.988,
    when_passed: PassOption = 0.19,
    least: LeastOption = 0.0,
    max_cells: options.MaxCellsOption = DEFAULT_MAX_CELLS,
    topic: TopicOption = None,
    yaw_rad: YawOption = None,
    frame: options.FrameOption[str | None] = None,
    force: options.ForceOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Make a map of the laser scans in LOG, or of a map in it.

    Poses of the scans are taken as they are. The result is a ROS map (.yaml), beside it the image.
    Scans that need more cells than --max-cells are left out. The robot of a bag moves in --frame,
    else in map, odom or the root.

    Example: hybridnav map drive.mcap -o map.yaml
    """
    if out.suffix.lower() not in {".yaml", ".yml"}:
        raise UsageError(f"--out must end in .yaml or .yml, got '{printable(out)}'")
    for file in (out, out.with_suffix(".pgm")):
        check_writable(file, "--out")
        if file.resolve() == log_file.resolve():
            raise UsageError(
                f"--out {str(out)!r:.80} would replace the log, expected another name: choose one"
            )
        if file.exists() and not force:
            raise UsageError(f"{printable(file)} exists: add --force to write over it")
    if topic is not None and is_bag(log_file):
        grid = _last_map(log_file, topic, yaw_rad)
        if grid is not None:
            hn.write_ros_map(grid, out)
            whole = json.dumps(_map_figures(grid, out)) if as_json else None
            answer((whole or "\n".join(map_lines(grid, out))) + "\n")
            return
    if yaw_rad is not None:
        raise UsageError(
            "--yaw goes with --topic of a map in a bag: state that topic, or leave it out"
        )
    from hybridnav.ext.live.mapping import LaserModel, Mapper  # noqa: PLC0415 - loads numba

    model = LaserModel(when_hit, when_passed, max_range_m, min_range_m, clear_range_m, tolerance_m)
    mapper = Mapper(
        resolution_m=resolution_m, laser=model, least_probability=least, max_cells=max_cells
    )
    log = open_log(log_file, topic, frame)
    began = clock()
    _add_all(log, mapper)
    seconds = clock() - began
    where = f"log {printable(log_file)}"
    if not log.n_scans:
        raise MapError(f"{where}: no scan of a laser, expected {log.expected}; {log.summary()}")
    if not mapper.has_cells:
        raise MapError(
            f"{where}: no reading below the greatest range of {max_range_m:g} m; {log.summary()}"
        )
    grid = mapper.to_grid(robot_radius_m=0.0, name=out.stem)
    hn.write_ros_map(grid, out)
    describe = _figures if as_json else _summary
    answer(describe(grid, log, seconds, out))


def _last_map(bag: Path, topic: str, yaw_rad: float | None) -> hn.OccupancyGrid | None:
    from hybridnav.ext.live.files.bag_files import GRID, Bag  # noqa: PLC0415 - on demand

    if topic not in Bag(bag).topics_of({GRID}):
        return None
    return hn.ext.live.load_bag_map(bag, topic=topic, yaw_rad=yaw_rad, robot_radius_m=0.0)


def map_lines(grid: hn.OccupancyGrid, name: str | Path) -> list[str]:
    """Return the lines on a map of this name or file: its cells, its extent, their classes."""
    rows, cols = grid.shape
    counts = grid.class_counts()
    kinds = (f"{counts[kind]:,} {kind}" for kind in ("free", "occupied", "unexplored"))
    return [
        f"map        {printable(name)}, {cols} x {rows} cells of {grid.resolution_m:g} m",
        extent_line(grid),
        f"cells      {', '.join(kinds)}",
    ]


def _add_all(log: ScanLog, mapper: Mapper) -> None:
    """Add the scans of a log to a map, with a bar over the bytes of the file."""
    with progress_bar("reading scans") as advance:
        for count, scan in enumerate(log):
            n_before = mapper.n_scans
            mapper.add(scan)
            if mapper.n_scans == n_before:  # also where a wrong first scan has gone
                log.leave_out("beyond --max-cells")
            if count % _LESS_OFTEN == 0:
                advance(log.bytes_read, log.size_bytes)
        advance(log.size_bytes, log.size_bytes)


def _map_figures(grid: hn.OccupancyGrid, out: Path) -> dict[str, Any]:
    rows, cols = grid.shape
    size = {"rows": rows, "cols": cols, "resolution_m": grid.resolution_m}
    return {"map": str(out)} | size | {"cells": grid.class_counts()}


def _figures(grid: hn.OccupancyGrid, log: ScanLog, seconds: float, out: Path) -> str:
    figures = _map_figures(grid, out) | {
        "scans": log.n_scans,
        "left_out": dict(log.skipped),
        "no_readings": log.n_no_readings,
        "recorded_s": log.duration_s,
        "seconds": round(seconds, 6),
    }
    return json.dumps(figures) + "\n"


def _summary(grid: hn.OccupancyGrid, log: ScanLog, seconds: float, out: Path) -> str:
    recorded = f", recorded in {log.duration_s:.0f} s" if log.duration_s > 0 else ""
    lines = [
        *map_lines(grid, out),
        f"scans      {log.n_scans:,}{recorded}",
        f"log        {log.summary()}",
        f"seconds    {seconds:.3f}",
    ]
    return "\n".join(lines) + "\n"
