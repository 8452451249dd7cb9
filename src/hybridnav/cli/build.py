"""`hybridnav build`: from a map file to a model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import hybridnav as hn
from hybridnav._base.clock import clock
from hybridnav._base.extension import extension
from hybridnav._base.files import printable
from hybridnav.cli.common import UsageError, answer, progress_bar, stage, timings
from hybridnav.cli.options import MapOrBuildingArgument, OutOption, PresetOption, RoomsOption
from hybridnav.cli.reading import (
    MapOptions,
    check_model,
    check_room_to_be,
    grow_topology,
    load_model,
    overridden,
    with_map,
)
from hybridnav.cli.warm import rehearse

FindRoomsOption = Annotated[
    bool, typer.Option("--find-rooms", help="Find rooms, and keep them in the model.")
]
CompressOption = Annotated[
    bool, typer.Option("--compress", help="Write a small file, which loads more slowly.")
]


@with_map(
    before="compress",
    without=("preset",),
    over_floors=lambda: extension("formats", "building").build_over_floors,
)
def build(
    map_file: MapOrBuildingArgument,
    out: OutOption[Path],
    preset: PresetOption[list[str] | None] = None,
    rooms_file: RoomsOption = None,
    find_rooms: FindRoomsOption = False,
    compress: CompressOption = False,
    *,
    reading: MapOptions,
) -> None:
    """Prepare MAP for planning, and write it to a model (.hnm), which other commands take as MAP.

    --preset says what to prepare; it may be given several times, the first is the model's own.
    Rooms of --rooms are kept in the model. MAP may be a building; `hybridnav plan` takes its model.
    """
    if rooms_file is not None and find_rooms:
        raise UsageError("--find-rooms is for maps without a file of rooms, --rooms names one")
    check_model(out)
    settings = [reading.settings(map_file, preset=name) for name in preset or (None,)]
    seconds: dict[str, float] = {}
    model = load_model(map_file, settings[0], seconds, reading)
    if preset is None:  # all that a model was built for
        settings += [
            overridden(model.fitted(other), reading.overrides, reading.robot_radius_m, reading.seed)
            for other in model.presets[1:]
        ]
    for each in settings:
        check_room_to_be(model.grid, allow_unexplored=each.planner.allow_unexplored)
    topology = grow_topology(
        model, settings[0], seconds, rooms_file=rooms_file, find_rooms=find_rooms
    )
    began = clock()
    planners = [model.planner(each, topology=topology) for each in settings]
    for each, planner in zip(settings, planners, strict=True):
        with progress_bar(f"preparing {each.name}") as advance:
            planner.prepare(progress=advance)
        planner.close()
    seconds["prepare"] = round(clock() - began, 6)
    with stage(f"writing {out}", seconds, "write"):
        hn.save(planners, out, compress=compress)
    with stage("planning on the model once", seconds, "rehearse"):
        rehearse(out, settings)
    answer(_summary(out, topology, settings, seconds))


def _summary(
    out: Path, topology: hn.TopologicalMap, presets: list[hn.Preset], seconds: dict[str, float]
) -> str:
    grid, size, rooms = topology.grid, out.stat().st_size, topology.pyramid.rooms
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
