"""`hybridnav rooms`: find the rooms of a map and write them down."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, get_args

import numpy as np
import typer

import hybridnav as hn
from hybridnav.cli.common import (
    Reading,
    answer,
    check_picture,
    check_radius,
    complain,
    islands_line,
    load_grid,
    read_settings,
    stage,
    timings,
)
from hybridnav.cli.errors import UsageError
from hybridnav.cli.options import (
    FreeOption,
    LeastIslandOption,
    MapArgument,
    MaxCellsOption,
    OccupiedOption,
    PlotOption,
    PresetOption,
    RadiusOption,
    RoomsOption,
)
from hybridnav.config.yaml_file import printable
from hybridnav.grid import DEFAULT_MAX_CELLS
from hybridnav.grid.rooms import NO_ROOM, Segmentation

OutOption = Annotated[
    Path | None,
    typer.Option("--out", "-o", metavar="FILE", help="Write the rooms as YAML, to be edited."),
]
MethodOption = Annotated[
    str | None,
    typer.Option(
        "--method",
        metavar="NAME",
        help=f"How rooms are found: {', '.join(get_args(Segmentation))}.",
        show_default="walls",
    ),
]
LeastAreaOption = Annotated[
    float | None,
    typer.Option(
        "--least-area",
        metavar="A",
        help="Square metres of free cells that a room has.",
        show_default="1.0",
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")]

_TOLD = 5
"""Names that a warning lists at most."""


def rooms(
    map_file: MapArgument,
    out: OutOption = None,
    method: MethodOption = None,
    least_area_m2: LeastAreaOption = None,
    rooms_file: RoomsOption = None,
    preset: PresetOption = "balanced",
    robot_radius_m: RadiusOption = None,
    free_threshold: FreeOption = None,
    occupied_threshold: OccupiedOption = None,
    least_island_m2: LeastIslandOption = 0.0,
    max_cells: MaxCellsOption = DEFAULT_MAX_CELLS,
    force: ForceOption = False,
    plot: PlotOption = None,
) -> None:
    """Find the rooms of MAP, or read them from a file, and list them with their doors."""
    check_picture(plot)
    if out is not None and out.exists() and not force:
        raise UsageError(f"{printable(out)} exists: it may hold names given by hand; add --force")
    if rooms_file is not None:
        for option, given in (("--method", method), ("--least-area", least_area_m2)):
            if given is not None:
                raise UsageError(f"{option} is for rooms that are found, --rooms reads them")
    method = "walls" if method is None else method
    checked = next((known for known in get_args(Segmentation) if known == method), None)
    if checked is None:
        known = ", ".join(get_args(Segmentation))
        raise UsageError(f"--method must be one of {known}, got {method!r:.80}")
    settings = read_settings(preset, None, robot_radius_m, None)
    seconds: dict[str, float] = {}
    reading = Reading(free_threshold, occupied_threshold, least_island_m2, max_cells)
    grid = load_grid(map_file, settings, seconds, reading)
    check_radius(grid)
    with stage("finding rooms", seconds, "rooms"):
        labels = (
            hn.find_rooms(
                grid,
                method=checked,
                least_area_m2=1.0 if least_area_m2 is None else least_area_m2,
            )
            if rooms_file is None
            else hn.load_rooms(rooms_file, grid)
        )
    with stage("building the pyramid", seconds, "pyramid"):
        built = settings.pyramid
        pyramid = hn.DualGraphPyramid.build(
            grid,
            merge_distance_m=built.merge_distance_m,
            linkage=built.linkage,
            seed=built.seed,
            rooms=labels,
        )
    topology = hn.TopologicalMap(pyramid)
    if out is not None:
        hn.save_rooms(out, _enterable(labels, topology), grid)
    answer(
        "\n".join([_listing(topology), *islands_line(grid)]) + f"\nseconds    {timings(seconds)}\n"
    )
    if plot is not None:
        from hybridnav.viz import plot_rooms, save_figure  # noqa: PLC0415 - matplotlib on demand

        save_figure(plot_rooms(topology), plot)


def _enterable(labels: hn.RoomLabels, topology: hn.TopologicalMap) -> hn.RoomLabels:
    """The rooms that the robot can be in: a file with others could not be read for it."""
    fits = topology.rooms.areas_m2 > 0
    if fits.all():
        return labels
    names = np.array(labels.names, dtype=object)
    left_out = names[~fits]
    told = ", ".join(left_out[:_TOLD]) + (", ..." if len(left_out) > _TOLD else "")
    complain(
        f"not written, as a robot radius of {topology.grid.robot_radius_m:g} m leaves no free "
        f"cell: {len(left_out)} rooms, {told}"
    )
    renumbered = np.append(np.where(fits, np.cumsum(fits) - 1, NO_ROOM), NO_ROOM)
    points = {name: at for name, at in labels.points.items() if name not in set(left_out)}
    return hn.RoomLabels(tuple(names[fits].tolist()), renumbered[labels.label_of], points)


def _listing(topology: hn.TopologicalMap) -> str:
    """One line a room: its free area and the doors to its neighbours."""
    view = topology.rooms
    doors: dict[str, list[str]] = {name: [] for name in view.names}
    for door in view.doors:
        for name, other in (door.rooms, door.rooms[::-1]):
            if name is not None:
                doors[name].append(f"{other or '-'} ({door.number}: {door.width_m:.2f} m)")
    width = max((len(name) for name in view.names), default=0)
    lines = [f"rooms      {len(view.names)}, {len(view.doors)} doors; free area, doors to"]
    for name, area_m2 in zip(view.names, view.areas_m2.tolist(), strict=True):
        lines.append(f"{name:<{width}} {area_m2:>9.2f} m²  {', '.join(doors[name])}".rstrip())
    return "\n".join(lines)
