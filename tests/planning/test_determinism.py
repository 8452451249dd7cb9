"""Equal queries have equal answers, bit for bit, whatever was asked before, of every preset.

But for `ompl`: its paths depend on the time that a query has, and its process is asked one query at
a time (`test_ompl_plans.py` holds its seeds).
"""

import hashlib
import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.maps.clearance import within_radius
from tests.strategies import IS_FULL

COUNTS = {"shortest": 200, "octile": 200, "robot": 40, "cheapest": 80} | dict.fromkeys(
    ("grid-astar", "paper", "cheapest-by-noise"), 20
)
if IS_FULL:
    COUNTS |= {"robot": 100, "cheapest": 200}
"""Number of queries by each preset, fewer of the slow ones. `cheapest` is the method of `robot`
without costs, `cheapest-by-noise` with a given layer."""


@cache
def office(*, is_changed: bool = False) -> hn.TopologicalMap:
    """The office, or with boxes in its halls and some walls open."""
    grid = hn.example_map("office", robot_radius_m=0.25)
    if is_changed:
        probability, rng = grid.probability.copy(), np.random.default_rng(4)
        for row, col in rng.integers(grid.shape, size=(30, 2)):
            probability[row : row + 8, col : col + 8] = rng.choice([0.0, 1.0])
        grid = replace(grid, probability=probability)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid))


def noise(seed: int) -> hn.CostLayer:
    """Costs that differ from cell to cell."""
    shape = office().grid.shape
    return hn.CostLayer(np.random.default_rng(seed).uniform(1, 4, shape).astype(np.float32))


def planner_of(name: str, *, is_changed: bool = False) -> hn.HybridPlanner:
    """A planner that was asked nothing."""
    costs, preset = None, hn.load_preset(name if not name.startswith("cheapest") else "octile")
    if name.startswith("cheapest"):
        preset = hn.load_preset("octile", overrides=["planner.method=cheapest"])
        costs = noise(1) if name != "cheapest" else None
    return hn.HybridPlanner(office(is_changed=is_changed), preset=preset, costs=costs)


def queries(name: str) -> Any:
    """Pairs of points, in free cells of both maps, anywhere in their cells."""
    free = office().grid.enterable() & office(is_changed=True).grid.enterable()
    cells, rng = np.argwhere(free), np.random.default_rng(6)
    chosen = cells[rng.integers(len(cells), size=(COUNTS[name], 2))]
    inside = rng.choice([0.5, 0.25, 0.77], size=chosen.shape)
    return office().grid.frame.points_of_grid(chosen + inside)


def told(planner: hn.HybridPlanner, pair: Any) -> str:
    """A hash of all bits of an answer.

    The bound, which takes a search of its own, is read of a fifth of the queries.
    """
    result = planner.plan(*pair)
    parts = [str(result.status), result.cost.hex()]
    if round(1000 * pair.sum()) % 5 == 0:
        parts.append(float(result.lower_bound).hex())
    if result.path is not None:
        parts += [result.path.points.tobytes().hex(), str(result.path.cells.tolist())]
    return hashlib.sha256(" ".join(parts).encode()).hexdigest()


def asked(name: str) -> list[str]:
    """The answers of a planner that is made in this process."""
    planner = planner_of(name)
    return [told(planner, pair) for pair in queries(name)[:20]]


@pytest.mark.parametrize("name", COUNTS)
def test_answers_depend_on_nothing_that_was_asked_before(name: str) -> None:
    pairs, planner = queries(name), planner_of(name)
    cold = [told(planner, pair) for pair in pairs]
    assert len(set(cold)) > len(pairs) / 2
    assert [told(planner, pair) for pair in pairs] == cold
    assert [told(planner, pair) for pair in pairs[::-1]][::-1] == cold
    prepared = planner_of(name)
    prepared.prepare()
    assert [told(prepared, pair) for pair in pairs] == cold
    assert [told(planner_of(name), pair) for pair in pairs[:3]] == cold[:3]
    shared = planner_of(name)
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda pair: told(shared, pair), pairs)) == cold


@pytest.mark.parametrize("is_prepared", [False, True])
@pytest.mark.parametrize("name", COUNTS)
def test_an_update_and_its_reverse_change_nothing(name: str, is_prepared: bool) -> None:
    pairs, planner = queries(name)[:20], planner_of(name)
    cold = [told(planner, pair) for pair in pairs]
    if is_prepared:
        planner.prepare()
    planner.update(topology=office(is_changed=True))
    fresh = planner_of(name, is_changed=True)
    there = [told(planner, pair) for pair in pairs]
    assert there == [told(fresh, pair) for pair in pairs]
    assert there != cold
    if name == "cheapest-by-noise":
        planner.update(costs=noise(2), changed=(5.0, 5.0, 20.0, 15.0))
        planner.update(costs=noise(1), changed=(5.0, 5.0, 20.0, 15.0))
        assert [told(planner, pair) for pair in pairs] == there
    planner.update(topology=office())
    assert [told(planner, pair) for pair in pairs] == cold


def test_a_change_far_away_leaves_a_path_as_it_is() -> None:
    """Boxes are put where they are 5 m and more from the path."""
    planner, grid = planner_of("robot"), office().grid
    planner.prepare()
    pairs = queries("robot")[:12]
    paths = [planner.plan(*pair).path for pair in pairs]
    for pair, path in zip(pairs, paths, strict=True):
        if path is None:
            continue
        near = np.zeros(grid.shape, np.bool_)
        near[tuple(path.cells.T)] = True
        far = np.argwhere(~within_radius(near, radius_cells=5 / grid.resolution_m + 8))
        probability = grid.probability.copy()
        for row, col in np.random.default_rng(3).choice(far, 12):
            probability[row : row + 8, col : col + 8] = 1.0
        planner.update(grid=replace(grid, probability=probability))
        again = planner.plan(*pair).path
        planner.update(grid=grid)
        assert again.points.tobytes() == path.points.tobytes()


def test_another_process_answers_alike() -> None:
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        found = dict(zip(COUNTS, pool.map(asked, COUNTS), strict=True))
    for name, answers in found.items():
        assert asked(name) == answers, name
