"""`hybridnav build`: from a map file to a model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import hybridnav as hn
from hybridnav._base.clock import clock
from hybridnav._base.extension import extension
from hybridnav._base.files import printable
from hybridnav.cli.common import UsageError, answer, progress_bar, stage, timings
from hybridnav.cli.map_options import FloorOptions
from hybridnav.cli.options import OneMap, OutOption, RoomsOption, option
from hybridnav.cli.reading import check_model, check_room_to_be, grow_topology, overridden
from hybridnav.cli.warm import rehearse

FindRoomsOption = Annotated[bool, option("--find-rooms", "Find rooms, and keep them in the model.")]
CompressOption = Annotated[
    bool, option("--compress", "Write a small file, which loads more slowly.")
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class BuildOptions(FloorOptions):
    """The options of `hybridnav build`."""

    out: OutOption[Path]
    rooms_file: OneMap[RoomsOption] = None
    find_rooms: OneMap[FindRoomsOption] = False
    compress: CompressOption = False


def build(args: BuildOptions) -> None:
    """Prepare MAP for planning, and write it to a model (.hnm).

    Other commands take it as MAP. --preset says what to prepare; it may be given several times, the
    first is the model's own. Rooms of --rooms are kept in the model. MAP may be a building;
    `hybridnav plan` takes its model.

    Example: hybridnav build maps/office/office.yaml --find-rooms -o office.hnm
    """
    if args.is_building:
        extension("formats", "building").build_over_floors(args)
        return
    out = args.out
    if args.rooms_file is not None and args.find_rooms:
        raise UsageError("--find-rooms is for maps without a file of rooms, --rooms names one")
    check_model(out)
    each_preset = [replace(args, presets=[name]) for name in args.presets or ()] or [args]
    settings = [each.settings() for each in each_preset]
    seconds: dict[str, float] = {}
    model = args.load(settings[0], seconds)
    if not args.presets:  # all that a model was built for
        settings += [
            overridden(model.fitted(other), args.overrides, args.robot_radius_m, args.seed)
            for other in model.presets[1:]
        ]
    for each in settings:
        check_room_to_be(model.grid, allow_unexplored=each.planner.allow_unexplored)
    topology = grow_topology(
        model, settings[0], seconds, rooms_file=args.rooms_file, find_rooms=args.find_rooms
    )
    began = clock()
    planners = [model.planner(each, topology=topology) for each in settings]
    for each, planner in zip(settings, planners, strict=True):
        with progress_bar(f"preparing {each.name}") as advance:
            planner.prepare(progress=advance)
        planner.close()
    seconds["prepare"] = round(clock() - began, 6)
    with stage(f"writing {out}", seconds, "write"):
        hn.save(planners, out, compress=args.compress)
    with stage("planning on the model once", seconds, "rehearse"):
        rehearse(out, settings)
    answer(_summary(out, topology, settings, seconds))


def _summary(
    out: Path, topology: hn.TopologicalMap, presets: list[hn.Preset], seconds: dict[str, float]
) -> str:
    grid, size, rooms = topology.grid, out.stat().st_size, topology.room_labels
    rows, cols = grid.shape
    per_cell = f"{size / (rows * cols):.1f} bytes a cell"
    cells = f"{cols} x {rows} cells of {grid.resolution_m:g} m"
    held = [f"{topology.n_places:,} places"]
    held += [] if rooms is None else [f"{len(rooms.names):,} rooms"]
    held.append(f"what {', '.join(each.name for each in presets)} plans on")
    lines = [
        f"model      {printable(out)}, {size / 1e6:.2f} MB, {per_cell}",
        f"map        {printable(grid.name)}, {cells}, robot radius {grid.robot_radius_m:g} m",
        f"holds      {', '.join(held)}",
        f"seconds    {timings(seconds)}",
    ]
    return "\n".join(lines) + "\n"
