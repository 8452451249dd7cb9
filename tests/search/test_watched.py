"""Records of searches: what A* and the jump-point search reached, and their trace for a viewer."""

import json
import re

import numpy as np
import pytest
from hypothesis import example

from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.octile import JumpSearch, build_jump_graph, contract_graph
from tests.oracle.grid import assert_legal, distances, move_graph
from tests.strategies import class_grids, seeds, tried


def octile(cells, end):
    """Distances on an empty grid, in steps."""
    long, short = np.sort(abs(cells - np.array(end)), axis=1).T[::-1]
    return long - short + short * np.sqrt(2)


def drawn_query(classes, seed):
    """Free cells of a map, its moves, and two of them."""
    free = np.asarray(classes) == CellClass.FREE
    rng = np.random.default_rng(seed)
    cells = np.argwhere(free)
    start, goal = (tuple(rng.choice(cells).tolist()) for _ in range(2))
    return free, move_graph(free), start, goal


def check_parents(record):
    """Each cell is reached from one of smaller g, and f never falls."""
    inner = record.parents >= 0
    assert (record.g[record.parents[inner]] < record.g[inner]).all()
    assert (np.diff(record.f) >= 0).all()


@tried(60, classes=class_grids(), seed=seeds)
def test_astar_expands_what_any_astar_must_and_knows_its_cost(classes, seed):
    if not (np.asarray(classes) == CellClass.FREE).any():
        return
    free, moves, start, goal = drawn_query(classes, seed)
    record = GridSearch(free).watch(start, goal)
    from_start = distances(moves, free.shape, start)
    at = tuple(record.cells.T)
    assert (record.g >= from_start[at] - 1e-6).all()
    check_parents(record)
    best = from_start[goal]
    if np.isfinite(best):
        assert_legal(record.path, free)
        assert record.g[(record.cells == goal).all(axis=1)] == pytest.approx(best)
    cells = np.argwhere(free & np.isfinite(from_start))
    f = from_start[tuple(cells.T)] + octile(cells, goal)
    must = {tuple(cell) for cell in cells[f < best - 1e-6].tolist()}
    if start != goal:
        assert {tuple(cell) for cell in record.cells[record.expanded].tolist()} == must


@pytest.mark.parametrize("contracted", [False, True])
@example(np.array([[1, 0, 1, 1, 1, 1], [1, 1, 0, 1, 1, 1]], np.uint8), 0)  # corners, no arcs
@tried(40, classes=class_grids(), seed=seeds)
def test_jumps_reach_corner_cells_by_ways_that_there_are(contracted, classes, seed):
    if not (np.asarray(classes) == CellClass.FREE).any():
        return
    free, moves, start, goal = drawn_query(classes, seed)
    graph = build_jump_graph(free)
    search = JumpSearch(contract_graph(graph) if contracted else graph)
    record = search.watch(start, goal)
    check_parents(record)
    least = np.minimum(
        *(distances(moves, free.shape, end)[tuple(record.cells.T)] for end in (start, goal))
    )
    assert (record.g >= least - 1e-6).all()
    path = search.path(start, goal).cells
    assert np.array_equal(record.path, np.empty((0, 2)) if path is None else path)
    assert search.watch(start, goal).g.tolist() == record.g.tolist()


def test_a_trace_has_what_the_viewer_reads():
    """Names, types and expressions are those of Posthoc, commit 67c2af53: `protocol/Trace-v140.ts`,
    `resources/traces/v1.4.0/astar.trace.yaml`; its `makePathIndex` takes a parent of 0 for none."""
    free = np.ones((4, 5), dtype=bool)
    free[1:3, 2] = False
    record = GridSearch(free).watch((1, 1), (2, 4))
    trace = json.loads(json.dumps(record.trace(free.shape)))
    assert list(trace) == ["version", "views", "pivot", "events"]
    assert trace["version"] == "1.4.0"
    (square,) = trace["views"]["main"]
    assert square["$"] == "rect"
    assert all(re.fullmatch(r"\$\{\{ .+ \}\}", square[key]) for key in ("x", "y", "fill"))
    events = trace["events"]
    assert {one["type"] for one in events} <= {
        "source", "destination", "generating", "expanding", "end",
    }  # fmt: skip
    assert [one["type"] for one in events[:2]] == ["source", "destination"]
    assert (events[0]["x"], events[0]["y"]) == (1, 2)  # row 1 of 4 from below
    ids = [one["id"] for one in events]
    assert len(set(ids)) == len(ids)
    assert 0 not in ids
    known = set()
    for one in events:
        assert one.get("pId") is None or one["pId"] in known
        known.add(one["id"])
    assert events[-1]["type"] == "end"


def test_a_search_by_costs_has_no_record():
    units = np.full((2, 2), 4, np.int32)
    with pytest.raises(InvalidValueError, match="by costs"):
        GridSearch(np.ones((2, 2), bool), units=units).watch((0, 0), (1, 1))
