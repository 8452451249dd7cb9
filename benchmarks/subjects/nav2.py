"""The tables of route graphs: how long their routes are beside shortest paths, on 13 buildings.

The office of `maps/office`; with FOLDER twelve buildings as well. Robot
radius 0.25 m, without rooms. `--nodes` are the numbers to aim at, 0 for as many as the routes need.
Pairs are random free points with a path between them, other ones than those that the graph is
built with; `from 5 m` leaves out those whose shortest path is shorter. Edges of each graph are
tested against the cells by the tests of the metrics, which the builder does not use, and by the
walk from cell to cell of Nav2's collision monitor. A wrong edge,
or a graph that is cut where free space is not, is listed on stderr, and the exit code is 1.
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

import hybridnav as hn
from benchmarks.common import DATA, OFFICE, matches, option, read
from hybridnav.ext.graphs.waypoint_graph import components_of
from hybridnav.harness.judges import segment_faults
from hybridnav.harness.tables import to_markdown
from hybridnav.maps.geometry import walks_clear

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path

    from hybridnav.ext.graphs import Excess
    from hybridnav.harness.tables import Row

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
_APART_M = 5.0
_AIMS = {"best mean %": 2.0, "best max %": 10.0}
_POLICIES = ("best", "nearest")


def measure(file: Path, nodes: int, spacing_m: float, pairs: int) -> tuple[Row, list[str]]:
    """Build the graph of a map and judge it; return its row and what is wrong with it."""
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(read(file)))
    began = time.perf_counter()
    graph = hn.ext.graphs.build_route_graph(topology, nodes=nodes or None, spacing_m=spacing_m)
    seconds = time.perf_counter() - began
    every = hn.ext.graphs.judge_route_graph(graph, pairs=pairs)
    apart = hn.ext.graphs.judge_route_graph(graph, pairs=pairs, least_m=_APART_M)
    row: Row = {"map": file.stem, "aim": nodes or "none", "nodes": graph.n_nodes}
    row |= {"edges": graph.n_edges, "build s": seconds}
    row["solved %"] = 100 * every.best.solved
    for name in _POLICIES:
        excess: Excess = getattr(every, name)
        row[f"{name} mean %"] = 100 * excess.mean
        row[f"{name} p95 %"] = 100 * excess.p95
        row[f"{name} max %"] = 100 * excess.greatest
        row[f"{name} max from 5 m %"] = 100 * getattr(apart, name).greatest
    return row, _faults(graph)


def _faults(graph: hn.ext.graphs.RouteGraph) -> list[str]:
    ends = graph.points[graph.edges]
    wrong = [
        f"edge {k} is not free" for k, end in enumerate(ends) if segment_faults(graph.grid, end)
    ]
    free = np.ascontiguousarray(graph.grid.enterable(allow_unexplored=False))
    cells_of = graph.grid.frame.cells_of(graph.points)
    walks = walks_clear(free, *(cells_of[graph.edges[:, end]] for end in (0, 1)))
    wrong += [f"Nav2's walk over edge {k} collides" for k in np.flatnonzero(~walks).tolist()]
    parts = components_of(graph.n_nodes, graph.edges, "weak")
    cells = ndimage.label(free)[0][tuple(cells_of.T)]
    pairs = {(part, cell) for part, cell in zip(parts.tolist(), cells.tolist(), strict=True)}
    if len({part for part, _ in pairs}) != len(pairs) or len({c for _, c in pairs}) != len(pairs):
        wrong.append("its parts are not those of free space")
    return wrong


def _summary(rows: list[Row]) -> list[Row]:
    """Return the mean and worst figures over all maps of each aim, beside the aims."""
    table: list[Row] = []
    for aim in dict.fromkeys(row["aim"] for row in rows):
        own = [row for row in rows if row["aim"] == aim]
        line: Row = {"nodes aimed at": aim, "maps": len(own)}
        for key in own[0]:
            if key.endswith("%"):
                values = np.array([float(row[key]) for row in own])
                worst = values.min() if key.startswith("solved") else values.max()
                line[key] = float(worst if "max" in key or "solved" in key else values.mean())
        for key, most in _AIMS.items():
            met = sum(float(row[key]) <= most for row in own)
            line[f"{key} <= {most:g}"] = f"{met} of {len(own)} maps"
        table.append(line)
    return table


OPTIONS = [
    DATA,
    option("--maps", action="append", default=[]),
    option("--nodes", default="200,800,0"),
    option("--spacing", type=float, default=1.0),
    option("--pairs", type=int, default=3000),
]


def main(given: Namespace) -> int:
    """Print the tables."""
    names = [name for name in BUILDINGS if not given.maps or matches(name, given.maps)]
    files = [OFFICE] if not given.maps or matches("office", given.maps) else []
    files += [given.data / name for name in names] if given.data else []
    rows: list[Row] = []
    n_wrong = 0
    for nodes in map(int, given.nodes.split(",")):
        for file in files:
            row, wrong = measure(file, nodes, given.spacing, given.pairs)
            rows.append(row)
            n_wrong += len(wrong)
            for line in wrong:
                sys.stderr.write(f"wrong: {file.stem}: {line}\n")
            sys.stderr.write(f"{row}\n")
    sys.stdout.write(f"## Route graphs\n\n{to_markdown(rows)}\n")
    sys.stdout.write(
        f"## Means, and worst figures for max and solved\n\n{to_markdown(_summary(rows))}"
    )
    return 1 if n_wrong else 0
