"""Pictures of the subject `ompl`: what a search looks at, in the corridor and on the whole map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

import hybridnav as hn
from benchmarks.worlds import office_world
from hybridnav.planning import load_preset
from hybridnav.planning.methods.ompl import OmplPlanner
from hybridnav.viz import plot_search

if TYPE_CHECKING:
    from pathlib import Path

ENDS = (1.0, 13.2), (40.6, 19.4)
PLANNERS = ("RRTConnect", "BITstar")
SCOPES = (
    ("whole map", "mask"),
    ("corridor, as one problem", "mask"),
    ("corridor, leg by leg", "chain"),
)


def draw(out: Path) -> list[Path]:
    """A picture for each planner: the whole map's run, and the corridor's in both ways."""
    grid = office_world().grid(robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    coarse = hn.HybridPlanner(topology, preset="shortest")
    field_of = topology.level.field_of
    path = coarse.plan(*ENDS).raise_for_status().path
    assert path is not None  # noqa: S101 - solved
    passed = np.unique(field_of[path.cells[:, 0], path.cells[:, 1]])
    corridor = np.isin(field_of, passed)
    poses = np.column_stack([ENDS, np.zeros(2)])
    files = []
    for planner in PLANNERS:
        figure = Figure(figsize=(9, 17), layout="constrained")
        for ax, (scope, confine) in zip(figure.subplots(3, 1), SCOPES, strict=True):
            settings = f"planner.ompl={{planner: {planner}, confine: {confine}}}"
            preset = load_preset("ompl", overrides=[settings])
            is_whole = scope == "whole map"
            section: Any = preset.planner
            plan = OmplPlanner(grid, section, None if is_whole else field_of).plan(
                path.cells, (poses[0], poses[1]), None, tells_search=True
            )
            assert plan.path is not None  # noqa: S101 - the office is easy
            plot_search(
                grid,
                plan.search,
                corridor=None if is_whole else corridor,
                path=plan.path,
                ax=ax,
                title=f"{planner}, {scope}: {plan.path.length_m:.2f} m, first path after "
                f"{1e3 * plan.refinement.trace[0][0]:.0f} ms",
            )
        file = out / f"ompl-{planner.lower()}.png"
        figure.savefig(file, dpi=100)
        files.append(file)
    return files
