"""`hybridnav show`: what a map and its pyramid are made of."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from hybridnav.cli.common import grow_topology, read_settings
from hybridnav.cli.errors import UsageError
from hybridnav.cli.options import (
    MapArgument,
    PlotOption,
    PresetOption,
    RadiusOption,
    SeedOption,
    SetOption,
)

if TYPE_CHECKING:
    import hybridnav as hn

LevelOption = Annotated[
    int, typer.Option("--level", metavar="N", help="Level to draw: 0 the base, -1 the apex.")
]


def show(
    map_file: MapArgument,
    level: LevelOption = -1,
    preset: PresetOption = "paper",
    overrides: SetOption = None,
    robot_radius_m: RadiusOption = None,
    seed: SeedOption = None,
    plot: PlotOption = None,
) -> None:
    """Show the classes of MAP's cells and the levels of its pyramid."""
    settings = read_settings(preset, overrides, robot_radius_m, seed)
    seconds: dict[str, float] = {}
    topology = grow_topology(map_file, settings, seconds)
    pyramid = topology.pyramid
    if not -len(pyramid) <= level < len(pyramid):
        raise UsageError(f"--level must be from {-len(pyramid)} to {len(pyramid) - 1}, got {level}")
    sys.stdout.write(_describe(topology, pyramid[level].index, seconds))
    if plot is not None:
        from hybridnav.viz import plot_level, save_figure  # noqa: PLC0415 - matplotlib on demand

        save_figure(plot_level(pyramid[level]), plot)


def _describe(topology: hn.TopologicalMap, level: int, seconds: dict[str, float]) -> str:
    grid, pyramid = topology.grid, topology.pyramid
    rows, cols = grid.shape
    size_m = f"{cols * grid.resolution_m:.2f} x {rows * grid.resolution_m:.2f} m"
    lines = [
        f"map        {grid.name}: {rows} x {cols} cells of {grid.resolution_m:g} m, {size_m}",
        "cells      " + ", ".join(f"{n} {name}" for name, n in grid.class_counts().items()),
        f"pyramid    U_d {pyramid.merge_distance_m:g} m, {pyramid.linkage}, seed {pyramid.seed}",
        "",
        f"{'level':>5} {'vertices':>10} {'arcs':>10} {'self-loops':>10} {'factor':>7}",
    ]
    sizes = pyramid.stats.sizes
    for index, size in enumerate(sizes):
        factor = f"{sizes[index - 1].vertices / size.vertices:.2f}" if index else ""
        mark = " <" if index == level else ""
        counts = f"{size.vertices:>10} {size.arcs:>10} {size.self_loops:>10}"
        lines.append(f"{index:>5} {counts} {factor:>7}{mark}")
    lines += ["", f"parallel   {topology.parallel_arcs()} arcs that a simple graph would lose"]
    timings = {"load": seconds["load"], **pyramid.stats.seconds}
    lines.append("seconds    " + ", ".join(f"{key} {s:.3f}" for key, s in timings.items()))
    return "\n".join(lines) + "\n"
