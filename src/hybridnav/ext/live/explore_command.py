"""`hybridnav explore`: a simulated robot makes a map of a floor plan."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast, get_args

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli import common, options
from hybridnav.cli.options import option
from hybridnav.cli.reading import check_room_to_be
from hybridnav.ext.live.map_command import map_lines
from hybridnav.maps import DEFAULT_MAX_CELLS

if TYPE_CHECKING:
    from hybridnav.ext.live.explore import By, Exploration, Step

StartOption = Annotated[
    str | None,
    option(
        "--start X,Y",
        "Where the robot wakes up, in metres.",
        show_default="the point farthest from walls",
    ),
]
RangeOption = Annotated[float, option("--range R", "Range of the laser in metres.")]
NoiseOption = Annotated[float, option("--noise S", "Standard deviation of readings in metres.")]
ByOption = Annotated[
    str,
    option(
        "--by RULE",
        "Which goal comes next: path, the nearest; frontier, the nearest, even if it has become "
        "known on the way; room, those of its room first.",
    ),
]
GoalsOption = Annotated[
    int | None,
    option(
        "--most-goals N", "End after N choices: of goals, of drives back, of looks again.", min=1
    ),
]


def explore(
    map_file: options.MapArgument[Path],
    start: StartOption = None,
    out: options.OutOption[Path | None] = None,
    range_m: RangeOption = 8.0,
    noise_m: NoiseOption = 0.01,
    robot_radius_m: options.RadiusOption = None,
    seed: options.SeedOption[int] = 0,
    by: ByOption = "path",
    most_goals: GoalsOption = None,
    plot: options.AnimationOption = None,
    frames: options.FramesOption = 60,
    max_cells: options.MaxCellsOption = DEFAULT_MAX_CELLS,
    as_json: options.JsonOption = False,
) -> None:
    """Let a simulated robot explore MAP, and print what it knows.

    --out writes the robot's map, a ROS map (.yaml).

    Example: hybridnav explore maps/figure1/figure1.yaml --robot-radius 0.1 --most-goals 3
    """
    point = None if start is None else options.parsed_point(start, "--start")
    common.check_output(out, "--out", (".yaml", ".yml"))
    if out is not None:
        common.check_writable(out.with_suffix(".pgm"), "--out")
    common.check_output(plot, "--plot", (".gif",))
    world = hn.load(map_file, robot_radius_m=robot_radius_m, max_cells=max_cells).grid
    check_room_to_be(world)
    if out is not None:
        _check_replaces(map_file, out)
    from hybridnav.ext.live import explore as exploring  # noqa: PLC0415 - loads numba

    maps = _Maps(frames)
    with common.progress_bar("exploring") as advance:
        done = exploring.explore(
            world,
            point,
            sensor=exploring.laser_all_round(max_range_m=range_m, noise_m=noise_m),
            seed=seed,
            by=_rule(by),
            most_goals=exploring.MOST_GOALS if most_goals is None else most_goals,
            watch=None if plot is None else maps.add,
            progress=advance,
        )
    if out is not None:
        hn.write_ros_map(done.grid, out)
    if plot is not None:
        maps.draw(done.grid, plot)
    common.answer(_figures(done) if as_json else _summary(done, world, out))


class _Maps:
    """Maps of an exploration, at most so many: every one, every second one and so on."""

    def __init__(self, most: int) -> None:
        self._most, self._every, self._count = most, 1, 0
        self._grids: list[hn.OccupancyGrid] = []

    def add(self, step: Step) -> None:
        """Keep the map of a step, if it is its turn."""
        if self._count % self._every == 0:
            if len(self._grids) == self._most - 1:
                self._grids, self._every = self._grids[::2], 2 * self._every
            if self._count % self._every == 0:
                self._grids.append(step.topology.grid)
        self._count += 1

    def draw(self, last: hn.OccupancyGrid, file: Path) -> None:
        """Write an animation of the maps, and of the last one."""
        from hybridnav.ext.live import ReplayAnimation, replay  # noqa: PLC0415 - loads matplotlib

        animation = ReplayAnimation(most_frames=self._most)
        with common.progress_bar("drawing") as advance:
            for step in replay([*self._grids, last]):
                animation.add(step)
                advance(step.number + 1, len(self._grids) + 1)
        animation.save(file)


def _rule(text: str) -> By:
    from hybridnav.ext.live.explore import By  # noqa: PLC0415 - loads numba

    if text not in get_args(By):
        raise common.UsageError(
            f"--by must be one of {', '.join(get_args(By))}, got {printable(text)}"
        )
    return cast("By", text)


def _check_replaces(map_file: Path, out: Path) -> None:
    """Refuse a map that would replace the floor plan, its image, or the image beside it."""
    from hybridnav.maps.files.ros import files_of  # noqa: PLC0415 - on demand

    files = {map_file.with_suffix(ending).resolve() for ending in (".yaml", ".yml", ".pgm")}
    if map_file.suffix.lower() in {".yaml", ".yml"}:
        files |= {file.resolve() for file in files_of(map_file)}
    if not files.isdisjoint({out.resolve(), out.with_suffix(".pgm").resolve()}):
        raise common.UsageError(
            f"--out {str(out)!r:.80} would replace the floor plan, expected another name: "
            "choose one"
        )


def _figures(done: Exploration) -> str:
    figures = {
        "rows": done.grid.shape[0],
        "cols": done.grid.shape[1],
        "cells": done.grid.class_counts(),
        "driven_m": round(done.driven_m, 3),
        "scans": len(done.points),
        "goals": done.n_goals,
        "given_up": done.n_given_up,
        "looks_again": done.n_looks_again,
        "share_known": done.share_known,
        "complete": done.is_complete,
        "seconds": {name: round(value, 6) for name, value in done.seconds.items()},
    }
    return json.dumps(figures) + "\n"


def _summary(done: Exploration, world: hn.OccupancyGrid, out: Path | None) -> str:
    percent = math.floor(1000 * done.share_known) / 10  # 100 % means all
    ended = "no goal is left: a door may be closed in the map"
    if done.share_known == 1.0:
        ended = "nothing in reach is unknown"
    if not done.is_complete:
        ended = "ended by --most-goals"
    lines = [
        *map_lines(done.grid, world.name if out is None else out),
        f"driven     {done.driven_m:.1f} m, {len(done.points):,} scans, {done.n_goals:,} goals",
        f"known      {percent:g} % of what the robot can reach, {ended}",
        f"given up   {done.n_given_up:,} cells that stayed unexplored from beside them",
        f"doubts     {done.n_looks_again:,} spots where doubtful cells or gaps were seen again",
        f"seconds    {common.timings(done.seconds)}",
    ]
    return "\n".join(lines) + "\n"
