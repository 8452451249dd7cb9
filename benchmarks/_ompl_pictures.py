"""Pictures of `benchmarks.ompl`: what a search looks at, in the corridor and on the whole map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

import hybridnav as hn
from hybridnav.config import load_preset
from hybridnav.grid.worlds import office_world
from hybridnav.planner.ompl_plans import OmplPlanner

if TYPE_CHECKING:
    from pathlib import Path

ENDS = (1.0, 13.2), (40.6, 19.4)
PLANNERS = ("RRTConnect", "BITstar")


def draw(out: Path) -> list[Path]:
    """A picture for each planner: the corridor's run on the left, the whole map's on the right."""
    grid = office_world().grid(robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    coarse = hn.HybridPlanner(topology, preset="fast")
    cells: Any = coarse._cells  # noqa: SLF001 - the planner's own fields, built once
    path = coarse.plan(*ENDS).raise_for_status().path
    assert path is not None  # noqa: S101 - solved
    poses = np.column_stack([ENDS, np.zeros(2)])
    files = []
    for planner in PLANNERS:
        figure = Figure(figsize=(15, 6), layout="constrained")
        for ax, (scope, confine) in zip(
            figure.subplots(1, 2), (("corridor", "mask"), ("whole map", "mask")), strict=True
        ):
            settings = f"planner.ompl={{planner: {planner}, confine: {confine}}}"
            preset = load_preset("ompl-rrtconnect", overrides=[settings])
            field_of = cells.search.field_of if scope == "corridor" else None
            plan = OmplPlanner(grid, preset.planner, field_of).plan(
                path.cells, (poses[0], poses[1]), None, tells_search=True
            )
            _draw(ax, grid, plan)
            steps = "; ".join(plan.refinement.steps)
            ax.set_title(f"{planner}, {scope}: {steps}", fontsize=9)
        file = out / f"ompl-{planner.lower()}.png"
        figure.savefig(file, dpi=110)
        files.append(file)
    return files


def _draw(ax: Any, grid: hn.OccupancyGrid, plan: Any) -> None:
    rows, cols = grid.shape
    extent = (0.0, cols * grid.resolution_m, 0.0, rows * grid.resolution_m)
    blocked = grid.classes == hn.CellClass.OCCUPIED
    ax.imshow(~blocked, origin="lower", extent=extent, cmap="gray", vmin=-1.0, vmax=1.0)
    search = plan.search
    if search is not None:
        lines = np.array(search.edges, dtype=np.float64).reshape(-1, 2, 2)
        ax.add_collection(LineCollection(list(lines), colors="tab:blue", linewidths=0.4))
        states = np.array(search.states, dtype=np.float64).reshape(-1, 2)
        ax.plot(*states.T, ".", color="tab:orange", markersize=1.2)
    if plan.path is not None:
        ax.plot(*plan.path.points.T, color="tab:red", linewidth=1.5)
    ax.set_aspect("equal")
    ax.set_xlabel("x in metres")
    ax.set_ylabel("y in metres")
