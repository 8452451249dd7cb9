"""What graphs of lanes leave out: rooms, doors and free points, on all ROS maps.

Robot radius 0.25 m, rooms found. `rooms` and `doors` are those of the list that the robot fits into
and passes, in parts of free space that get nodes; `bare` are those of them without a node. `hidden`
are nodes in rooms that the list leaves out, `alone` those without an edge. `unseen` is the share of
the free points of listed rooms that see no node, and `of all` that of all free points of 1 m² or
more inside the building. `lanes` is the CPU time of `build_lane_graph`.
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks.common import NEEDED_DATA, OFFICE, maps_of, option, read
from hybridnav.graphs.attach import Network
from hybridnav.graphs.judge import FreeSpace
from hybridnav.harness.tables import to_markdown

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path

    from hybridnav.harness.tables import Row

_POINTS = 4000

OPTIONS = [
    NEEDED_DATA,
    option("--maps", action="append", default=[], help="glob of maps, may be repeated"),
    option("--radius", type=float, default=0.25, help="robot radius in metres"),
]


def row_of(file: Path, name: str, radius_m: float) -> Row:
    """Return the figures of a map."""
    grid = read(file, radius_m)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid)))
    rooms = topology.rooms
    began = time.process_time()
    graph = hn.graphs.build_lane_graph(topology)
    seconds = time.process_time() - began
    space = FreeSpace.of(grid)
    is_kept = space.kept(rooms)[space.component_of] & space.free
    label_of = rooms.labels.label_of
    shown = np.append(rooms.is_listed, True)
    cells = np.floor(graph.positions).astype(np.int64)
    visited = set(label_of[tuple(cells.T)].tolist())
    inside = np.unique(label_of[is_kept])
    wanted = np.intersect1d(np.flatnonzero(rooms.is_listed & rooms.fits), inside).tolist()
    passed = {n for doors in graph.edge_doors for n in doors} & set(graph.doors.tolist())
    flat = is_kept.ravel()
    doors = [
        door.number
        for door in rooms.listed_doors
        if door.passable and flat[rooms.cells_beside(door.number)].any()
    ]
    network = Network.of(space.sight, graph.positions, graph.edges)
    shares = []
    for chosen in (is_kept & shown[label_of] & (label_of >= 0), is_kept):
        free = np.argwhere(chosen)
        free = free[np.random.default_rng(0).integers(len(free), size=_POINTS)]
        offsets, _, _ = network.in_sight(np.asarray(free + 0.5, dtype=np.float64))
        shares.append(100 * float((offsets[1:] == offsets[:-1]).mean()))
    bare = [rooms.names[room] for room in wanted if room not in visited]
    missed = [number for number in doors if number not in passed]
    nodeless = sorted(set(missed) - set(graph.doors.tolist()))
    sys.stderr.write(f"{name}: rooms {bare}, doors {missed}, without a node {nodeless}\n")
    return {
        "map": name,
        "nodes": graph.n_nodes,
        "edges": graph.n_edges,
        "rooms": len(wanted),
        "bare rooms": len(bare),
        "doors": len(doors),
        "bare doors": len(missed),
        "hidden": int((~shown[label_of[tuple(cells.T)]]).sum()),
        "alone": graph.n_nodes - len(np.unique(graph.edges)),
        "unseen %": shares[0],
        "of all %": shares[1],
        "lanes": seconds,
    }


def main(given: Namespace) -> None:
    """Print the table."""
    row_of(OFFICE, "office", given.radius)  # loads the kernels
    names = [name for name in maps_of(given.data, given.maps) if not name.endswith(".map")]
    rows = []
    for name in names:
        try:
            rows.append(row_of(given.data / name, name, given.radius))
        except hn.errors.HybridNavError as error:
            sys.stderr.write(f"{name}: {error}\n")
    sys.stdout.write(to_markdown(rows))
