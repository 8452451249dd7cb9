"""What an overlay stores, against Dijkstra's algorithm of scipy."""

import numpy as np
import pytest

from hybridnav.errors import HybridNavError
from hybridnav.search.overlay import OverlaySearch, build_overlay
from hybridnav.search.overlay.kernels.costs import clique_place
from hybridnav.search.overlay.kernels.exits import reach_over_exits
from hybridnav.search.overlay.layout import slots_of
from tests.search.overlay.judge import UNITS, WeightedJudge
from tests.search.overlay.test_overlay import nested, world


def stored(seed):
    """An overlay of three levels with all that it can store, and its map."""
    free, factor = world(seed, (23, 31), [0.1, 0.3][seed % 2])
    return build_overlay(free, nested(free, (3, 9, 18)), factor, top_bytes=1e9), free, factor


@pytest.mark.parametrize("seed", range(4))
def test_distances_between_gates_are_least_costs(seed):
    """Each move over the last level leads from or to a gate."""
    overlay, free, factor = stored(seed)
    levels, top, judge = overlay.levels, overlay.top, WeightedJudge(free, factor)
    first = int(levels.node_at[levels.level_at[-2]])
    nodes = np.arange(first, len(levels.cell_of))
    starts = np.repeat(nodes, np.diff(levels.move_at[first:]))
    ends = levels.move_to[levels.move_at[first] :]
    assert (np.isin(starts, top.gates) | np.isin(ends, top.gates)).all()
    assert 0 < len(top.gates) < 0.6 * len(nodes)
    cells = np.array(np.unravel_index(levels.cell_of[top.gates], free.shape)).T
    for k in range(0, len(cells), 5):
        least = judge.least(cells[k])[1][tuple(cells.T)]
        kept = [top.distance[clique_place(k, j)] for j in range(len(cells))]
        is_reached = np.isfinite(least)
        np.testing.assert_array_equal(np.array(kept)[is_reached] / (2 * UNITS), least[is_reached])
        assert (np.array(kept)[~is_reached] > 2 * UNITS * least[is_reached].max()).all()


@pytest.mark.parametrize("seed", range(4))
def test_distances_over_exits_are_least_costs_inside_the_field(seed):
    overlay, free, factor = stored(seed)
    levels = overlay.levels
    slots = slots_of(overlay.ground, (slice(0, 23), slice(0, 31)))
    around = levels.parent[levels.parent[np.maximum(overlay.ground.field_of[slots], 0)]]
    for child in range(levels.level_at[1], levels.level_at[2]):
        field = levels.parent[child]
        inside = free & (around == field)
        judge = WeightedJudge(inside, factor)
        below, nodes = (np.arange(*levels.node_at[each : each + 2]) for each in (child, field))
        ends = np.unravel_index(levels.cell_of[nodes], free.shape)
        for i in range(0, len(below), 4):
            row = levels.clique[levels.clique_at[child] :]
            to_own = np.array([row[clique_place(i, j)] for j in range(len(below))], dtype=np.int64)
            to_own[to_own >= (1 << 30) - 1] = 1 << 60
            reach = np.zeros(len(nodes), dtype=np.int64)
            reach_over_exits(levels, child, to_own, reach)
            start = np.unravel_index(levels.cell_of[below[i]], free.shape)
            least = judge.least(start)[1][ends]
            expected = np.where(np.isfinite(least), least * 2 * UNITS, 1 << 60)
            np.testing.assert_array_equal(reach, expected)


@pytest.mark.parametrize("name", ["steps", "clique", "marks", "move_cost", "distance"])
def test_costs_that_contradict_each_other_end_in_an_error_or_a_path(name):
    refused = 0
    for seed in range(6):
        overlay, free, _ = stored(seed)
        part = overlay.top if name == "distance" else overlay.levels
        array, rng = getattr(part, name), np.random.default_rng(seed)
        wrong = rng.random(array.size) < 0.3
        array[wrong] = rng.permutation(array)[wrong]
        search, cells = OverlaySearch(overlay, near_cells=0), np.argwhere(free)
        for start, goal in cells[rng.integers(len(cells), size=(60, 2))].tolist():
            try:
                found = search.path(start, goal).cells
            except HybridNavError:
                refused += 1
                continue
            if found is not None:
                assert found[[0, -1]].tolist() == [start, goal]
                assert (np.abs(np.diff(found, axis=0)) <= 1).all()
    assert refused
