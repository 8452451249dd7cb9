"""The table of graphs that people have drawn: what is wrong with them, and how long routes are.

Seven graphs of Nav2 and STRANDS on their maps and three of AMRL on their walls, and beside each the
lanes that hybridnav builds from the map. Pairs are random free cells with a path between them.
`edges in walls` are those that the robot cannot follow, `out of reach` is the share of free points
that see no node. `at a wall` are routes over an edge that the robot cannot follow, in the graph as
it is; `solved` and the losses, over the shortest any-angle path, are those without such edges, and
the losses are those of the pairs that both graphs solve (`common`). Every route is judged anew; a
wrong one ends the command.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import networkx as nx
import numpy as np
from PIL import Image, ImageDraw
from scipy import ndimage

import hybridnav as hn
from benchmarks.common import NEEDED_DATA, option, read
from hybridnav.graphs.method import GraphMethod
from hybridnav.harness import AnyAngleOptimum
from hybridnav.harness.judges import judge_line
from hybridnav.harness.scenes import sample_pairs
from hybridnav.harness.tables import to_markdown

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path

    from hybridnav._base.typing import FloatArray
    from hybridnav.harness.scenes import Pair
    from hybridnav.harness.tables import Row

GRAPHS = {
    "nav2/graphs/nav2_bringup/depot_graph.geojson": "nav2/maps/depot.yaml",
    "nav2/graphs/nav2_bringup/turtlebot3_graph.geojson": "nav2/maps/tb3_sandbox.yaml",
    "nav2/graphs/nav2_route/aws_graph.geojson": "aws_small_warehouse/005/map.yaml",
    "strands/g4s/g4s_sim.tplg": "strands/g4s/g4s_sim_cropped.yaml",
    "strands/g4s/g4s_y2.tmap": "strands/g4s/g4s_y2.yaml",
    "strands/tsc_y3/tsc_y3_final.tplg": "strands/tsc_y3/tsc20160523.yaml",
    "strands/tsc_y4/tsc_y4_final.tplg.tpl": "strands/tsc_y4/tsc_1701.yaml",
}
WALLS = "GDC3", "AHG2", "AHG_Apartment"
"""Graphs of AMRL, which come with segments of walls; those of GDC2 leave its outside open."""
_CELL_M, _RIM_M, _GAP_M = 0.05, 4.0, 3.0
"""Cells of walls, the free rim round them, and the widest gap that lets no outside in."""


def drawn_on_walls(
    data: Path, name: str, radius_m: float
) -> tuple[hn.graphs.WaypointGraph, hn.OccupancyGrid]:
    """Return a graph of AMRL, and a grid of its walls, unexplored outside."""
    stated, walls = (
        json.loads((data / f"amrl_maps/{name}.{kind}.json").read_text(encoding="utf-8"))
        for kind in ("navigation", "vectormap")
    )
    ends = np.array([[(wall[end]["x"], wall[end]["y"]) for end in ("p0", "p1")] for wall in walls])
    origin = ends.min(axis=(0, 1)) - _RIM_M
    cells = (ends - origin) / _CELL_M
    cols, rows = np.ceil(cells.max(axis=(0, 1)) + _RIM_M / _CELL_M).astype(int).tolist()
    image = Image.new("1", (cols, rows))
    pen = ImageDraw.Draw(image)
    for line in cells.reshape(-1, 4).tolist():
        pen.line(line, fill=1)
    is_wall = np.array(image)
    half = _GAP_M / 2 / _CELL_M
    wide, _ = ndimage.label(ndimage.distance_transform_edt(~is_wall) > half)
    is_outside = ndimage.distance_transform_edt(wide != wide[0, 0]) <= half
    values = np.select([is_wall, is_outside], [1.0, 0.5], 0.0)
    frame = hn.Frame(_CELL_M, origin_m=(float(origin[0]), float(origin[1])))
    grid = hn.OccupancyGrid(values, frame, robot_radius_m=radius_m, name=name)
    drawn: nx.Graph[str] = nx.Graph()
    drawn.add_nodes_from((node["id"], node["loc"]) for node in stated["nodes"])
    drawn.add_edges_from((edge["s0_id"], edge["s1_id"]) for edge in stated["edges"])
    return hn.graphs.WaypointGraph.from_networkx(drawn, name="amrl"), grid


def rows_of(
    graph: hn.graphs.WaypointGraph, topology: hn.TopologicalMap, pairs: list[Pair]
) -> list[Row]:
    """Return the rows of a drawn graph, and of those that are built."""
    graphs = {graph.name if graph.format == "networkx" else graph.format: graph}
    built = hn.graphs.build_lane_graph(topology)
    graphs["lanes"] = hn.graphs.WaypointGraph.from_networkx(built.to_networkx(), name="lanes")
    grid = topology.grid
    losses = [
        _losses(GraphMethod(grid, one, clear_edges_only=True), grid, pairs)
        for one in graphs.values()
    ]
    common = np.isfinite(losses).all(axis=0)
    rows = []
    for (name, one), own in zip(graphs.items(), losses, strict=True):
        row: Row = {"map": grid.name, "graph": name}
        row |= _checked(one, topology, pairs)
        row["solved %"] = 100 * float(np.isfinite(own).mean())
        row["common %"] = 100 * float(common.mean())
        row["loss mean %"] = 100 * float(own[common].mean())
        row["loss p95 %"] = 100 * float(np.percentile(own[common], 95))
        row["loss max %"] = 100 * float(own[common].max())
        rows.append(row)
    return rows


def _checked(graph: hn.graphs.WaypointGraph, topology: hn.TopologicalMap, pairs: list[Pair]) -> Row:
    """Return figures on a graph as it is."""
    grid = topology.grid
    check = hn.graphs.check_graph(topology, graph)
    at_wall, method = 0, GraphMethod(grid, graph)
    for pair in pairs:
        line = method.solve(pair.start, pair.goal).any_angle
        if line is not None:
            verdict = judge_line(grid, line.points, start=pair.start, goal=pair.goal)
            at_wall += bool(verdict.faults)
    return {
        "nodes": graph.n_nodes,
        "edges": graph.n_edges,
        "edges in walls": int((~check.is_clear).sum()),
        "out of reach %": 100 * (1 - check.in_sight),
        "doors": "{} of {}".format(*check.doors),
        "at a wall %": 100 * at_wall / len(pairs),
    }


def _losses(method: GraphMethod, grid: hn.OccupancyGrid, pairs: list[Pair]) -> FloatArray:
    """Return the loss of each pair, NaN where the method has no route."""
    optimum = AnyAngleOptimum(grid)
    losses = np.full(len(pairs), np.nan)
    for k, pair in enumerate(pairs):
        line = method.solve(pair.start, pair.goal).any_angle
        if line is None:
            continue
        verdict = judge_line(grid, line.points, start=pair.start, goal=pair.goal)
        if verdict.faults:
            sys.exit(f"wrong: {method.name} on {grid.name}: {verdict.faults[0]}")
        losses[k] = verdict.length_m / optimum.length_m(pair.start, pair.goal) - 1
    return losses


OPTIONS = [
    NEEDED_DATA,
    option("--pairs", type=int, default=500),
    option("--radius", type=float, default=0.25),
]


def main(given: Namespace) -> None:
    """Print the table."""
    rows: list[Row] = []
    data = given.data
    drawn = [
        (hn.ext.fleet.load_graph(data / file), read(data / map_file, given.radius))
        for file, map_file in GRAPHS.items()
    ]
    drawn += [drawn_on_walls(data, name, given.radius) for name in WALLS]
    for graph, grid in drawn:
        rooms = hn.find_rooms(grid)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
        optimum = AnyAngleOptimum(grid)
        pairs = [
            pair
            for pair in sample_pairs(grid, given.pairs, seed=0)
            if np.isfinite(optimum.length_m(pair.start, pair.goal)) and pair.start != pair.goal
        ]
        rows += rows_of(graph, topology, pairs)
        sys.stderr.write(f"{rows[-1]}\n")
    sys.stdout.write(to_markdown(rows))
