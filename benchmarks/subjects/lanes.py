"""The tables of graphs of lanes, beside graphs that people have drawn on the same floors.

The office of `maps/office`, 12 buildings, three maps that nothing was chosen on, and seven drawn
graphs, robot radius 0.25 m, with rooms. Pairs are random free points with a path between them, the
same for all graphs of a map. `parts` of the loss: `own` is that of the best route from any
point of an edge (one in 0.5 m) to any other, which the graph itself costs; `best` is that from the
best nodes, `nearest` that from the nearest. `nearest` are routes by the nearest node in sight, as
`judge_route_graph` has them; `Nav2` are routes as its route server joins them: by the nearest node
if it is in sight, else by that of the five nearest to which the path is shortest, first and last
edges left out where the robot has passed their node, and shortest paths to the first node and from
the last one, also for pairs in sight. Losses are over the shortest path. `kept` are the nodes that
keep their ids when boxes of 0.3 to 0.8 m cover one free cell in a hundred. A graph with an edge
that the robot cannot follow, or a crossing, is listed on stderr if it is ours.
"""

import sys
import time
from argparse import Namespace
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy.spatial import KDTree

import hybridnav as hn
from benchmarks.common import OFFICE, matches, read
from benchmarks.options import DATA, option
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.graphs.attach import (
    MANY_CANDIDATES,
    Network,
    adjacency,
    placed_points,
    shortest_routes,
)
from hybridnav.graphs.free_space import FreeSpace
from hybridnav.graphs.judge import excess_of
from hybridnav.graphs.kernels import least_along
from hybridnav.graphs.sketch import settled
from hybridnav.harness.tables import Row, to_markdown
from hybridnav.rooms.doors import measured_clearance_m

GRAPHS = {
    "nav2/graphs/nav2_bringup/depot_graph.geojson": "nav2/maps/depot.yaml",
    "nav2/graphs/nav2_bringup/turtlebot3_graph.geojson": "nav2/maps/tb3_sandbox.yaml",
    "nav2/graphs/nav2_route/aws_graph.geojson": "aws_small_warehouse/005/map.yaml",
    "strands/g4s/g4s_sim.tplg": "strands/g4s/g4s_sim_cropped.yaml",
    "strands/g4s/g4s_y2.tmap": "strands/g4s/g4s_y2.yaml",
    "strands/tsc_y3/tsc_y3_final.tplg": "strands/tsc_y3/tsc20160523.yaml",
    "strands/tsc_y4/tsc_y4_final.tplg.tpl": "strands/tsc_y4/tsc_1701.yaml",
}
BUILDINGS = (
    "bwi_gdc/2/2.yaml",
    "bwi_gdc/3/3.yaml",
    "bwi_gdc/3ne/3ne.yaml",
    "bwi_mapper/intel.yaml",
    "f1tenth_simulator/stata_basement.yaml",
    "fetch_maps/3_1_16_localization.yaml",
    "fetch_maps/4_26_15.yaml",
    "fetch_maps/9_16_15.yaml",
    "strands/g4s/g4s_y2.yaml",
    "strands/tsc_y3/tsc20160523.yaml",
    "strands/tsc_y4/tsc_1701.yaml",
    "willow/willow-2010-02-18-0.10.yaml",
)
_UNSEEN = (
    "aws_small_house/map.yaml",
    "turtlebot4/depot.yaml",
    "cob_environments/ipa-apartment/map.yaml",
)
_CANDIDATES = 5
"""Nearest nodes that Nav2's route server looks at (`num_nearest_nodes`)."""
_PART_M = 0.5
_PASSED_M = 0.1, 0.15
"""Distances from the first and the last node above which it leaves out their edge."""


class Floor:
    """A map with random pairs and their shortest paths."""

    def __init__(self, file: Path, pairs: int) -> None:
        grid = read(file)
        self.name = file.stem
        self.rooms = hn.find_rooms(grid)
        self.topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=self.rooms))
        self.grid, self.space = grid, FreeSpace.of(grid)
        kept = self.space.kept(self.topology.rooms)
        rng = np.random.default_rng(1)
        self.starts, self.goals = self.space.random_pairs(pairs, rng, kept)
        self.optimum = self.space.paths(self.starts, self.goals).length_cells
        self.clearance_m = np.ascontiguousarray(measured_clearance_m(grid))
        self.free_m2 = (grid.measured == hn.CellClass.FREE).sum() * grid.cell_area_m2

    def row(self, name: str, graph: Any, seconds: float) -> Row:
        """Return the figures of a graph."""
        space, grid, edges = self.space, self.grid, graph.edges
        at, _, is_free = placed_points(graph.points, grid, space.free)
        clear = np.asarray(is_free[edges].all(axis=1))
        clear[clear] = space.joins(at[edges[clear, 0]], at[edges[clear, 1]])
        usable = edges[clear]
        network = Network.of(space.sight, at, usable, np.flatnonzero(is_free))
        joined = replace(network, candidates=MANY_CANDIDATES).join(self.starts, self.goals)
        nearest = excess_of(joined.nearest(), self.optimum)
        best = excess_of(joined.best(), self.optimum)
        own = excess_of(self.own_lengths(at, usable), self.optimum)
        nav2 = excess_of(self.nav2_lengths(at, is_free, usable), self.optimum)
        least, _ = least_along(space.free, self.clearance_m, at, usable)
        return {
            "map": self.name,
            "graph": name,
            "nodes": len(at),
            "edges": len(edges),
            "per 100 m²": 100 * len(at) / self.free_m2,
            "edges a node": len(edges) / len(at),
            "median m": float(np.median(graph.lengths_m)),
            "crossings": crossings(graph.points, edges),
            "not free": int((~clear).sum()),
            "clearance m": float(least.min()) if len(least) else None,
            "clearance p5 m": float(np.percentile(least, 5)) if len(least) else None,
            "own mean %": 100 * own.mean,
            "best mean %": 100 * best.mean,
            "nearest mean %": 100 * nearest.mean,
            "nearest p95 %": 100 * nearest.p95,
            "in sight %": 100 * nearest.solved,
            "Nav2 mean %": 100 * nav2.mean,
            "Nav2 p95 %": 100 * nav2.p95,
            "Nav2 solved %": 100 * nav2.solved,
            "seconds": seconds,
        }

    def own_lengths(self, at: FloatArray, edges: LongArray) -> FloatArray:
        """Return the lengths of the best routes of all pairs that join edges at points of 0.5 m,
        in cells, infinite for none."""
        tails, heads = at[edges[:, 0]], at[edges[:, 1]]
        parts = np.hypot(*(heads - tails).T) * self.grid.resolution_m // _PART_M
        parts = np.maximum(parts, 1).astype(np.int64)
        which = np.repeat(np.arange(len(edges)), parts - 1)
        first = len(at) + np.concatenate([[0], np.cumsum(parts - 1)])
        along = (np.arange(len(which)) - (first[which] - len(at)) + 1) / parts[which]
        inner = settled(tails[which] + (heads - tails)[which] * along[:, None])
        chains = [
            [tail, *range(first[k], first[k + 1]), head]
            for k, (tail, head) in enumerate(edges.tolist())
        ]
        steps = np.array([step for chain in chains for step in pairwise(chain)], dtype=np.int64)
        network = Network.of(self.space.sight, np.concatenate([at, inner]), steps.reshape(-1, 2))
        return replace(network, candidates=MANY_CANDIDATES).join(self.starts, self.goals).best()

    def nav2_lengths(self, at: FloatArray, is_free: Any, edges: LongArray) -> FloatArray:
        """Return the lengths of the routes of all pairs as Nav2 joins them, in cells, infinite for
        none."""
        first = self._joined(self.starts, at, is_free)
        last = self._joined(self.goals, at, is_free)
        lengths = np.full(len(first), np.inf)
        pairs = np.flatnonzero((first >= 0) & (last >= 0))
        steps = at[edges[:, 1]] - at[edges[:, 0]]
        network = adjacency(len(at), edges, np.hypot(steps[:, 0], steps[:, 1]))
        offsets, nothing = np.arange(len(pairs) + 1), np.zeros(len(pairs))
        ends = (offsets, first[pairs], nothing), (offsets, last[pairs], nothing)
        costs, routes, _ = shortest_routes(network, *ends)
        found = np.flatnonzero(np.isfinite(costs)).tolist()
        passed = []
        for k in found:
            nodes = self._pruned(routes[k], self.starts[pairs[k]], at, _PASSED_M[0])
            passed.append(self._pruned(nodes[::-1], self.goals[pairs[k]], at, _PASSED_M[1])[::-1])
        solved = pairs[found]
        lengths[solved] = [np.hypot(*np.diff(at[nodes], axis=0).T).sum() for nodes in passed]
        for ends_of, node in ((self.starts, 0), (self.goals, -1)):
            joints = at[np.array([nodes[node] for nodes in passed], dtype=np.int64)]
            lengths[solved] += self.space.paths(ends_of[solved], joints).length_cells
        return lengths

    def _joined(self, points: FloatArray, at: FloatArray, is_free: Any) -> LongArray:
        """Return the node that Nav2 joins each point to, int64 (p,), -1 for none."""
        few = min(_CANDIDATES, len(at))
        near = np.asarray(KDTree(at).query(points, k=list(range(1, few + 1)))[1], dtype=np.int64)
        chosen = np.where(is_free[near[:, 0]], near[:, 0], -1)
        fits = np.flatnonzero(chosen >= 0)
        chosen[fits[~self.space.sight.clear(points[fits], at[chosen[fits]])]] = -1
        rest = np.repeat(np.flatnonzero(chosen < 0), few)
        nodes = near[chosen < 0].ravel()
        part = self.space.components_at(points)[rest]
        reached = is_free[nodes]
        reached[reached] = self.space.components_at(at[nodes[reached]]) == part[reached]
        rest, nodes = rest[reached], nodes[reached]
        if len(rest):
            away = self.space.paths(points[rest], at[nodes]).length_cells
            order = np.lexsort((away, rest))
            _, first = np.unique(rest[order], return_index=True)
            chosen[rest[order][first]] = nodes[order][first]
        return chosen

    def _pruned(
        self, nodes: LongArray, point: FloatArray, at: FloatArray, least_m: float
    ) -> LongArray:
        """Return a route without its first node, if the robot has passed it."""
        if len(nodes) < 2:
            return nodes
        first, second = at[nodes[:2]]
        is_passed = ((second - first) * (point - first)).sum() > 0
        far = np.hypot(*(point - first)) * self.grid.resolution_m > least_m
        return nodes[1:] if is_passed and far else nodes

    def kept(self, graph: hn.graphs.RouteGraph, spacing_m: float | None) -> float:
        """Return the share of nodes that keep their ids on a map with boxes, in percent."""
        grid, rng = self.grid, np.random.default_rng(0)
        classes = np.array(grid.measured)
        free = np.argwhere(classes == hn.CellClass.FREE)
        left = len(free) // 100
        while left > 0:
            row, col = free[rng.integers(len(free))]
            height, width = rng.integers(
                round(0.3 / grid.resolution_m), round(0.8 / grid.resolution_m) + 1, 2
            )
            box = classes[row : row + height, col : col + width]
            left -= int((box == hn.CellClass.FREE).sum())
            box[box == hn.CellClass.FREE] = hn.CellClass.OCCUPIED
        values = np.select(
            [classes == hn.CellClass.FREE, classes == hn.CellClass.OCCUPIED], [0.0, 1.0], 0.3
        )
        new = hn.OccupancyGrid(values, grid.frame, robot_radius_m=grid.robot_radius_m)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(new, rooms=self.rooms))
        after = hn.graphs.build_lane_graph(topology, spacing_m=spacing_m, keep=graph)
        return 100 * float(np.isin(graph.ids[0], after.ids[0]).mean())


def crossings(points: FloatArray, edges: LongArray) -> int:
    """Return how many pairs of edges have a point in common that is no common node."""
    edges = np.unique(np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1), axis=0)
    lines = np.asarray(shapely.linestrings(points[edges]))
    one, other = shapely.STRtree(list(lines)).query(lines, predicate="intersects")
    one, other = one[one < other], other[one < other]
    apart = (edges[one][:, :, None] != edges[other][:, None]).all(axis=(1, 2))
    along = shapely.length(shapely.intersection(lines[one[~apart]], lines[other[~apart]])) > 1e-6
    return int(apart.sum() + along.sum())


def rows_of(
    floor: Floor, drawn: Path | None, spacings: list[float | None], *, steady: bool
) -> list[Row]:
    """Return the rows of the graphs of a floor."""
    graphs = hn.graphs
    rows = []
    if drawn is not None:
        rows.append(floor.row("drawn", hn.ext.fleet.load_graph(drawn), float("nan")))
    for spacing_m in spacings:
        began = time.process_time()
        built = graphs.build_lane_graph(floor.topology, spacing_m=spacing_m)
        name = "lanes" if spacing_m is None else f"lanes, {spacing_m:g} m"
        row = floor.row(name, built, time.process_time() - began)
        if steady:
            row["kept %"] = floor.kept(built, spacing_m)
        if row["crossings"] or row["not free"]:
            sys.stderr.write(f"wrong: {row}\n")
        rows.append(row)
    return rows


OPTIONS = [
    DATA,
    option("--maps", action="append", default=[]),
    option("--spacing", default="", help="distances between lanes in metres, with commas"),
    option("--pairs", type=int, default=1000),
    option("--steady", action="store_true", help="state how many nodes keep their ids"),
]


def main(given: Namespace) -> None:
    """Print the tables."""
    spacings = [float(word) if word else None for word in given.spacing.split(",")]
    names = [*BUILDINGS, *_UNSEEN] if given.data else []
    files: dict[Path, Path | None] = {OFFICE: None}
    files |= {given.data / name: None for name in names}
    if given.data:
        files |= {given.data / file: given.data / drawn for drawn, file in GRAPHS.items()}
    hn.graphs.build_lane_graph(Floor(OFFICE, 1).topology)  # loads the kernels
    rows: list[Row] = []
    for file, drawn in files.items():
        if given.maps and not matches(file.stem, given.maps):
            continue
        floor = Floor(file, given.pairs)
        found = rows_of(floor, drawn, spacings, steady=given.steady)
        rows += found
        sys.stderr.write("".join(f"{row}\n" for row in found))
    sys.stdout.write(to_markdown(rows))
