"""Answers of maps, pyramid, rooms, paths and exploring, as hashes: equal on every processor.

    python -m tests.answers [--whole]

`tests/product/test_processors.py` runs it as different processors do, and compares.
"""

import hashlib
import json
import sys
from typing import Any

import numpy as np
from numpy._core._multiarray_umath import (  # type: ignore[import-not-found]
    __cpu_dispatch__,
    __cpu_features__,
)

import hybridnav as hn
from benchmarks.subjects.explore import narrow_world, widest_point
from hybridnav.ext.live.explore import explore
from hybridnav.ext.live.mapping import Mapper, SimulatedLaser
from hybridnav.graphs import build_lane_graph

PRESETS = [name for name in hn.preset_names() if name != "ompl"]
"""OMPL is a library of others, which takes its sines where it finds them."""


def digest(*values: Any) -> str:
    """Return a hash of arrays and of what has an exact text."""
    made = hashlib.sha256()
    for value in values:
        if isinstance(value, np.ndarray):
            made.update(f"{value.dtype} {value.shape}".encode())
            made.update(np.ascontiguousarray(value).tobytes())
        else:
            made.update(repr(value).encode())
    return made.hexdigest()[:16]


def features() -> list[str]:
    """Return the features of this processor for which numpy has functions of their own."""
    return [name for name in __cpu_dispatch__ if __cpu_features__[name]]


def scanned(world: hn.OccupancyGrid) -> str:
    """Return the map that a laser makes on a circle."""
    mapper, noise = Mapper(resolution_m=0.05), np.random.default_rng(0)
    x, y = widest_point(world)
    for turn in np.linspace(0.0, 6.0, 40).tolist():
        mapper.add(SimulatedLaser(noise_m=0.02).scan(world, (x, y, turn), seed=noise))
    return digest(mapper.to_grid(robot_radius_m=0.0).probability)


def explored(seed: int, resolution_m: float) -> str:
    """Return what a robot makes of a random world, and where it drove."""
    world = narrow_world(seed, resolution_m=resolution_m)
    done = explore(world, widest_point(world), seed=seed)
    return digest(done.grid.probability, done.points, done.driven_m, done.n_looks_again)


def planned(topology: hn.TopologicalMap, preset: str, count: int) -> str:
    grid, rng = topology.grid, np.random.default_rng(1)
    cells = np.argwhere(grid.enterable())[:, None].repeat(2, axis=1)
    inside = rng.uniform(0.02, 0.98, size=(count, 2, 2))
    chosen = cells[rng.integers(len(cells), size=(count, 2)), [0, 1]]
    found: list[Any] = []
    planner = hn.HybridPlanner(topology, preset=preset)
    for start, goal in grid.frame.points_of_grid(chosen + inside):
        result = planner.plan(tuple(start), tuple(goal))
        found += [result.status.value, result.cost, result.lower_bound]
        if result.path is not None:
            found += [result.path.points, result.path.poses(spacing_m=0.1)]
            found.append([str(each) for each in result.instructions])
    return digest(*found)


def answers_on(grid: hn.OccupancyGrid, count: int) -> dict[str, str]:
    labels = hn.find_rooms(grid)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=labels)
    topology = hn.TopologicalMap(pyramid)
    graph = build_lane_graph(topology)
    found = {
        "rooms": digest(labels.label_of, labels.names),
        "pyramid": digest(*(level.field_of for level in pyramid)),
        "graph": digest(graph.positions, graph.edges, graph.widths_m),
    }
    return found | {preset: planned(topology, preset, count) for preset in PRESETS}


def main(*, whole: bool) -> dict[str, str]:
    """Return all answers, or those that take some seconds."""
    world = narrow_world(5, resolution_m=0.05)
    maps = {"narrow": world}
    if whole:
        maps |= {name: hn.example_map(name, robot_radius_m=0.2) for name in ("office", "figure1")}
    found = {"scans": scanned(world), "explored 5": explored(5, 0.05)}
    if whole:
        found |= {
            f"explored {n}, {side} m": explored(n, side) for n in range(20) for side in (0.05, 0.1)
        }
    for name, grid in maps.items():
        each = answers_on(grid, 30 if whole else 4)
        found |= {f"{name}: {what}": answer for what, answer in each.items()}
    return found


if __name__ == "__main__":
    made = {"features": features(), "answers": main(whole="--whole" in sys.argv)}
    sys.stdout.write(json.dumps(made))
