"""Alternatives by doors of a random floor: what holds of them by lengths as by costs."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely

import hybridnav as hn
from hybridnav.harness.judges import judge_path
from tests.floors import Floor, random_floor


@dataclass(frozen=True)
class Planned:
    """A planner of paths of cells on a floor, and how its paths are measured."""

    planner: hn.HybridPlanner
    moves: Callable[..., Any]
    """Takes the doors that may be passed as `doors`, returns the graph of all moves."""
    measure: Callable[[Any], float]
    """Takes a part of a path as a shapely line or several."""


def two_points(floor: Floor, rng: np.random.Generator) -> Any:
    free = np.argwhere(floor.classes == 1)
    first, last = (tuple(cell) for cell in rng.choice(free, 2, replace=False).tolist())
    return first, last


def line_of(path: hn.Path) -> shapely.LineString:
    return shapely.LineString(path.points if len(path.points) > 1 else path.points.repeat(2, 0))


def doors_by_cells(floor: Floor, path: hn.Path) -> list[int]:
    """The doors that a path of cells steps through, in order."""
    number_of = {}
    for number, (one, other) in enumerate(floor.doors):
        number_of[one, other] = number_of[other, one] = number
    cells: list[Any] = list(map(tuple, path.cells.tolist()))
    return [number_of[step] for step in itertools.pairwise(cells) if step in number_of]


def check_alternatives(
    seed: int, planned: Callable[[Floor, np.random.Generator], Planned]
) -> hn.Alternatives:
    """Plan between two cells of a floor; each is the best by its doors, and within the limits."""
    rng = np.random.default_rng(seed)
    floor = random_floor(rng)
    judge = planned(floor, rng)
    planner, grid = judge.planner, floor.topology.grid
    first, last = two_points(floor, rng)
    ends = grid.frame.points_of([first, last])
    most, stretch = float(rng.choice([0.3, 0.5, 0.8])), float(rng.choice([1.2, 2.0, 4.0]))
    plain = planner.plan(*ends)
    found = hn.plan_alternatives(
        planner, ends[0], ends[1], 4, max_overlap=most, max_stretch=stretch
    )
    assert bool(found) == plain.solved
    if plain.path is None:
        return found
    assert np.array_equal(found[0].path.points, plain.path.points)
    sequences = [tuple(doors_by_cells(floor, other.path)) for other in found]
    assert len(set(sequences)) == len(found)
    costs = [other.result.cost for other in found]
    assert costs == pytest.approx(sorted(costs))
    for number, (other, doors) in enumerate(zip(found, sequences, strict=True)):
        assert judge_path(grid, other.path.cells, start=first, goal=last).faults == ()
        assert len(other.doors) == len(doors)
        inside = judge.moves(doors=set(doors))
        least = nx.dijkstra_path_length(inside, first, last)
        assert other.result.cost >= least * (1 - 1e-9)
        # Cells beside the other doors of these rooms may be closed.
        kept = {first, last, *itertools.chain(*(floor.doors[door] for door in doors))}
        inside.remove_nodes_from(set(itertools.chain(*floor.doors)) - kept)
        if nx.has_path(inside, first, last):
            least = nx.dijkstra_path_length(inside, first, last)
            assert other.result.cost <= least * (1 + 1e-9)
        assert other.result.cost <= stretch * costs[0] * (1 + 1e-9)
        assert other.result.lower_bound == plain.lower_bound
        line = line_of(other.path)
        for before in found[:number]:
            shared = line.intersection(line_of(before.path).buffer(grid.resolution_m))
            share = judge.measure(shared) / max(other.result.cost, 1e-9)
            assert share <= other.overlap + 1e-6
        assert other.overlap <= most
    return found
