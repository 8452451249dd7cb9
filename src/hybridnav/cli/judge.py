"""`hybridnav judge`: recorded paths against the proved optimum between their own ends."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

import hybridnav as hn
from hybridnav.cli import options
from hybridnav.cli.common import (
    EXIT_NOT_SOLVED,
    UsageError,
    answer,
    check_output,
    check_picture,
    stage,
    write_out,
)
from hybridnav.cli.map_options import MapOptions
from hybridnav.cli.options import option

if TYPE_CHECKING:
    from hybridnav.harness import JudgedPath
    from hybridnav.harness.path_files import RecordedPath, Unit
    from hybridnav.harness.tables import Row

_MOST_CONTACTS, _MOST_DETOURS = 3, 3
"""Lines about contacts, and about parts that lose, of each path."""

FilesArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILE...",
        help="Recorded paths: bags, .csv, TUM or KITTI .txt, .geojson, .npy, lists of cells.",
    ),
]
UnitOption = Annotated[
    str | None,
    option(
        "--unit UNIT",
        "What the numbers of a point are, where it is asked: metres, millimetres, cells (column, "
        "row from below), image (column, row from the top) or matrix (row from the top, column).",
    ),
]
TopicOption = Annotated[
    str | None, option("--topic NAME", "Topic of a bag: paths, odometry or poses.")
]
ColumnsOption = Annotated[
    str | None,
    option("--columns X,Y[,T]", "Columns of a table, by name or number; axes of TUM and KITTI."),
]
FailOption = Annotated[
    str | None,
    option(
        "--fail-above P%", "Exit with 1 if a path is illegal, or loses more, or has no optimum."
    ),
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class JudgeOptions(MapOptions):
    """The options of `hybridnav judge`."""

    files: FilesArgument
    unit: UnitOption = None
    frame: options.FrameOption[str | None] = None
    topic: TopicOption = None
    columns: ColumnsOption = None
    fail_above: FailOption = None
    json: options.JsonOption = False
    out: options.OutOption[Path | None] = None
    plot: options.PlotOption = None


def judge(args: JudgeOptions) -> None:
    """Judge recorded paths on MAP by the optimum between their ends.

    A path that is illegal is judged too; its loss may be below 0. With --preset robot also by the
    costs of Nav2. -o writes the table, .csv; --plot draws the worst path, illegal ones first.

    Example: hybridnav judge maps/office/office.yaml driven.csv --fail-above 10%
    """
    check_picture(args.plot)
    check_output(args.out, "--out", (".csv",))
    most = _share(args.fail_above)
    settings, seconds = args.settings(), dict[str, float]()
    grid = args.load(settings, seconds).grid
    allowed = str(settings.planner.allow_unexplored).lower()
    by_length = hn.load_preset("shortest", overrides=[f"planner.allow_unexplored={allowed}"])
    by_length = by_length.model_copy(update={"pyramid": settings.pyramid})
    planner, costs = hn.HybridPlanner(grid, preset=by_length), None
    if settings.planner.method != "shortest":
        costs = hn.HybridPlanner(grid, preset=settings)
        if costs.costs is None:
            raise UsageError(
                f"--preset {settings.name} plans by lengths, which preset shortest proves: leave "
                "it out, or take one by costs, such as robot"
            )
    from hybridnav.harness.path_files import load_paths  # noqa: PLC0415 - after the options

    columns = None if args.columns is None else args.columns.split(",")
    recorded: list[RecordedPath] = []
    for file in args.files:
        recorded += load_paths(
            file,
            grid,
            unit=cast("Unit | None", args.unit),
            frame=args.frame,
            topic=args.topic,
            columns=columns,
        )
    with stage("judging", seconds, "judge"):
        judged = [
            hn.judge(planner, each.points, times_s=each.times_s, costs=costs) for each in recorded
        ]
    named = [(each.name, path) for each, path in zip(recorded, judged, strict=True)]
    _write(args, grid, named)
    if most is not None and any(
        path.legal is not True or not path.loss_at_most <= most for _, path in named
    ):
        raise typer.Exit(EXIT_NOT_SOLVED)


def _share(text: str | None) -> float | None:
    """Return the share that `--fail-above` states, None without it."""
    if text is None:
        return None
    try:
        value = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0):
        raise UsageError(f"--fail-above must be a share, such as 10% or 0.1, got {text!r:.80}")
    return value


def _write(args: JudgeOptions, grid: hn.OccupancyGrid, named: list[tuple[str, JudgedPath]]) -> None:
    """Print the verdicts, write the table, draw the worst path."""
    from hybridnav.harness.tables import to_csv, to_markdown  # noqa: PLC0415 - on demand

    rows = [_row(name, found) for name, found in named]
    if args.json:
        told = {"map": grid.name, "robot_radius_m": grid.robot_radius_m}
        paths = [{"path": name, **found.to_dict()} for name, found in named]
        answer(json.dumps(told | {"paths": paths}, allow_nan=False) + "\n")
    else:
        lines = [line for name, found in named for line in _lines(name, found)]
        answer(to_markdown(rows) + "".join(f"\n{line}" for line in lines) + "\n")
    if args.out is not None:
        write_out(args.out, to_csv(rows))
    if args.plot is not None:
        from hybridnav import viz  # noqa: PLC0415 - matplotlib on demand

        _, worst = max(
            named,
            key=lambda each: (
                not each[1].legal,
                -2.0 if math.isnan(each[1].loss) else each[1].loss,
            ),
        )
        path = worst.optimum.path
        axes = viz.plot_paths(
            grid,
            worst.points,
            None if path is None else path.points,
            losing=[worst.part(each.from_m, each.to_m) for each in worst.detours],
            contacts=[(each.x, each.y) for each in worst.contacts] or None,
        )
        viz.save_figure(axes, args.plot)


def _row(name: str, path: JudgedPath) -> Row:
    """Return the row of a table: metres, per cent, degrees and seconds."""
    row: dict[str, Any] = {
        "path": name,
        "legal": {True: "yes", False: "no", None: "?"}[path.legal],
        "contacts": len(path.contacts),
        "depth m": max((each.depth_m for each in path.contacts), default=0.0),
        "length m": path.length_m,
        "optimum m": path.optimum_m[0] if math.isfinite(path.optimum_m[0]) else math.nan,
        "loss %": 100 * path.loss,
        "clearance m": path.clearance.least_m,
        "turning deg": math.degrees(path.turning_rad),
    }
    if path.duration_s is not None:
        row |= {"seconds": path.duration_s, "m/s": path.mean_speed_m_s or math.nan}
    if path.least_cost is not None:
        cost = math.nan if path.cost is None else path.cost
        row |= {
            "cost": cost,
            "least cost": path.least_cost[0],
            "cost loss %": 100 * path.cost_loss,
        }
    return row


def _lines(name: str, path: JudgedPath) -> list[str]:
    """Return what a table has no room for."""
    lines = [
        f"{name}: contact, {each.what}, {each.depth_m:.3f} m deep at ({each.x:.2f}, {each.y:.2f}), "
        f"{each.from_m:.2f} to {each.to_m:.2f} m along"
        for each in path.contacts[:_MOST_CONTACTS]
    ]
    if (left := len(path.contacts) - _MOST_CONTACTS) > 0:
        lines.append(f"{name}: {left} more contacts, in --json")
    lines += [
        f"{name}: loses {part.loss_m:.2f} m from ({part.start[0]:.2f}, {part.start[1]:.2f}) to "
        f"({part.end[0]:.2f}, {part.end[1]:.2f}), {part.from_m:.2f} to {part.to_m:.2f} m along"
        for part in path.detours[:_MOST_DETOURS]
    ]
    if not path.optimum.solved:
        lines.append(f"{name}: no optimum between its ends: {path.optimum.status}")
    elif path.loss < 0:
        lines.append(f"{name}: shorter than every path of the disc, as it is none")
    return lines
