"""Graphs of waypoints as methods of the study: our own for Nav2, and one in the manner of SWAGGER.

Each is made from the map of a run, so that its making counts as preparation, and a map that it
cannot take is a result. Routes on it are those of `hybridnav evaluate --graph`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.subjects._swagger_like import (
    BOUNDARY_M,
    SKELETON_M,
    SPACE_M,
    Distances,
    skeleton_of,
    swagger_like,
)
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import UnsuitableMapError
from hybridnav.graphs import WaypointGraph, build_lane_graph
from hybridnav.graphs.method import GraphMethod
from hybridnav.harness.baselines import MethodResult
from hybridnav.harness.baselines.regions import Cell
from hybridnav.maps import OccupancyGrid
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.topology import TopologicalMap

MOST_SKELETON = 100_000
"""Cells of the skeleton of free space up to which graphs are made: a maze whose corridors are a
cell wide is all skeleton, and a graph of it has tens of thousands of nodes."""

_GAME_CELL_M, _AS_IF_M = 1.0, 0.1
"""Cells from this side on, those of MovingAI maps, are taken for cells of 0.1 m: distances in
metres are meant for buildings. The merge distance of the study, 40 m there and 4 m elsewhere, has
the same ratio."""
_MERGE_M = 4.0


class RouteGraphMethod(GraphMethod):
    """Routes on our own graph of lanes, as `hybridnav export` writes it for Nav2."""

    def __init__(self, grid: OccupancyGrid) -> None:
        check_skeleton(grid)
        scaled = _in_buildings(grid)
        topology = TopologicalMap(DualGraphPyramid.build(scaled, merge_distance_m=_MERGE_M))
        built = build_lane_graph(topology)
        graph = _graph_of("our graph", grid, built.positions, built.edges)
        super().__init__(grid, graph)
        self.settings = "lanes, as by default"


class SwaggerLike(GraphMethod):
    """Routes on a graph in the manner of SWAGGER; where no edges lead on, it gives up.

    It claims no completeness, so it never says that there is no path.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        free, skeleton = check_skeleton(grid)
        scaled = _in_buildings(grid)
        sizes = Distances(scaled.resolution_m, scaled.robot_radius_m)
        cells, sides = swagger_like(free, skeleton, sizes)
        edges = np.concatenate([sides, sides[:, ::-1]])
        graph = _graph_of("swagger-like", grid, cells.astype(np.float64) + 0.5, edges)
        super().__init__(grid, graph)
        self.settings = (
            f"nodes every {SKELETON_M:g} m of skeleton, {BOUNDARY_M:g} m of contour, {SPACE_M:g} m "
            "of space"
        )

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        answer = super().solve(start, goal)
        if answer.is_path or answer.gave_up:
            return answer
        return replace(answer, gave_up="no edges from one node to the other")


def check_skeleton(grid: OccupancyGrid) -> tuple[BoolArray, BoolArray]:
    """Return the free cells and their skeleton, bool (rows, cols) both.

    Raises
    ------
    UnsuitableMapError
        When the skeleton has more than `MOST_SKELETON` cells.
    """
    free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
    skeleton = skeleton_of(free)
    count = int(np.count_nonzero(skeleton))
    if count > MOST_SKELETON:
        raise UnsuitableMapError(
            f"graphs are made where the skeleton of free space has up to {MOST_SKELETON:,} cells, "
            f"this map has {count:,}"
        )
    return free, skeleton


def _in_buildings(grid: OccupancyGrid) -> OccupancyGrid:
    """Return the grid with cells of a size that buildings are drawn with."""
    if grid.resolution_m < _GAME_CELL_M:
        return grid
    scale = _AS_IF_M / grid.resolution_m
    frame = replace(grid.frame, resolution_m=_AS_IF_M)
    return replace(grid, frame=frame, robot_radius_m=scale * grid.robot_radius_m)


def _graph_of(
    name: str, grid: OccupancyGrid, positions: FloatArray, edges: LongArray
) -> WaypointGraph:
    """Return a graph in metres of the map, of positions in grid units."""
    return WaypointGraph(
        name=name,
        format="hybridnav",
        frame="map",
        names=tuple(range(len(positions))),
        points=grid.frame.points_of_grid(positions),
        edge_names=(None,) * len(edges),
        edges=edges,
        costs=np.full(len(edges), np.nan),
    )
