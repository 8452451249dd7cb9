"""`hybridnav map`: from a robot's log to a map file."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import hybridnav as hn
from hybridnav._files import printable
from hybridnav.cli.common import (
    answer,
    check_writable,
    extent_line,
    load_numba,
    progress_bar,
)
from hybridnav.cli.errors import UsageError
from hybridnav.cli.options import JsonOption
from hybridnav.errors import MapError
from hybridnav.grid import DEFAULT_MAX_CELLS

if TYPE_CHECKING:
    from hybridnav.mapping import Mapper

_LESS_OFTEN = 16
"""Scans between two moves of the bar."""

LogArgument = Annotated[
    Path, typer.Argument(metavar="LOG", help="CARMEN log: .log, or the same packed by gzip.")
]
OutOption = Annotated[
    Path, typer.Option("-o", "--out", metavar="MAP", help="ROS map (.yaml); beside it the image.")
]
ResolutionOption = Annotated[
    float, typer.Option("--resolution", metavar="R", help="Side of a cell in metres.")
]
MaxRangeOption = Annotated[
    float,
    typer.Option("--max-range", metavar="R", help="Readings of R metres or more are no obstacles."),
]
MinRangeOption = Annotated[
    float, typer.Option("--min-range", metavar="R", help="Readings up to R metres are none.")
]
ClearRangeOption = Annotated[
    float,
    typer.Option(
        "--clear-range", metavar="R", help="Metres that a beam without a return makes free."
    ),
]
ToleranceOption = Annotated[
    float,
    typer.Option(
        "--tolerance", metavar="R", help="Metres before its end that a beam does not make free."
    ),
]
HitOption = Annotated[
    float,
    typer.Option("--hit", metavar="P", help="Occupancy of a cell after one scan that hit it."),
]
PassOption = Annotated[
    float,
    typer.Option("--pass", metavar="P", help="Occupancy of a cell after one scan that passed it."),
]
CellsOption = Annotated[
    int,
    typer.Option(
        "--max-cells", metavar="N", min=1, help="Scans that need more cells are left out."
    ),
]


def map(  # noqa: A001 - the command's name
    log_file: LogArgument,
    out: OutOption,
    resolution_m: ResolutionOption = 0.05,
    max_range_m: MaxRangeOption = 30.0,
    min_range_m: MinRangeOption = 0.0,
    clear_range_m: ClearRangeOption = 0.0,
    tolerance_m: ToleranceOption = 0.1,
    when_hit: HitOption = 0.95,
    when_passed: PassOption = 0.19,
    max_cells: CellsOption = DEFAULT_MAX_CELLS,
    as_json: JsonOption = False,
) -> None:
    """Make a map of the laser scans in LOG, whose poses are taken as given."""
    if out.suffix.lower() not in {".yaml", ".yml"}:
        raise UsageError(f"--out must end in .yaml or .yml, got {str(out)!r}")
    for file in (out, out.with_suffix(".pgm")):
        check_writable(file, "--out")
    load_numba()
    from hybridnav.mapping import LaserModel, Mapper  # noqa: PLC0415 - loads numba

    model = LaserModel(when_hit, when_passed, max_range_m, min_range_m, clear_range_m, tolerance_m)
    mapper = Mapper(resolution_m=resolution_m, laser=model, max_cells=max_cells)
    log = hn.CarmenLog(log_file)
    began = time.perf_counter()
    _add_all(log, mapper)
    seconds = time.perf_counter() - began
    where = f"log {printable(log_file)}"
    if not log.n_scans:
        raise MapError(
            f"{where}: no scan of a laser, expected lines FLASER or ROBOTLASER1; {log.summary()}"
        )
    if not mapper.has_cells:
        raise MapError(
            f"{where}: no reading below the greatest range of {max_range_m:g} m; {log.summary()}"
        )
    grid = mapper.to_grid(robot_radius_m=0.0, name=out.stem)
    hn.write_ros_map(grid, out)
    describe = _figures if as_json else _summary
    answer(describe(grid, log, seconds, out))


def _add_all(log: hn.CarmenLog, mapper: Mapper) -> None:
    """Add the scans of a log to a map, with a bar over the bytes of the file."""
    with progress_bar("reading scans") as advance:
        for count, scan in enumerate(log):
            if not mapper.add(scan):
                log.leave_out("beyond --max-cells")
            if count % _LESS_OFTEN == 0:
                advance(log.bytes_read, log.size_bytes)
        advance(log.size_bytes, log.size_bytes)


def _figures(grid: hn.OccupancyGrid, log: hn.CarmenLog, seconds: float, out: Path) -> str:
    rows, cols = grid.shape
    figures = {
        "map": str(out),
        "rows": rows,
        "cols": cols,
        "resolution_m": grid.resolution_m,
        "cells": grid.class_counts(),
        "scans": log.n_scans,
        "left_out": dict(log.skipped),
        "no_readings": log.n_no_readings,
        "recorded_s": log.duration_s,
        "seconds": round(seconds, 6),
    }
    return json.dumps(figures) + "\n"


def _summary(grid: hn.OccupancyGrid, log: hn.CarmenLog, seconds: float, out: Path) -> str:
    rows, cols = grid.shape
    counts = grid.class_counts()
    kinds = (f"{counts[kind]:,} {kind}" for kind in ("free", "occupied", "unexplored"))
    recorded = f", recorded in {log.duration_s:.0f} s" if log.duration_s > 0 else ""
    lines = [
        f"map        {printable(out)}, {cols} x {rows} cells of {grid.resolution_m:g} m",
        extent_line(grid),
        f"cells      {', '.join(kinds)}",
        f"scans      {log.n_scans:,}{recorded}",
        f"log        {log.summary()}",
        f"seconds    {seconds:.3f}",
    ]
    return "\n".join(lines) + "\n"
