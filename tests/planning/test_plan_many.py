"""Many queries in one call, with every preset."""

import copy
import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.planning.finishes import CostFinish
from tests.plans import PRESETS, TWO_ROOMS, grid_of, map_of, points_in, presets


@presets
@pytest.mark.parametrize("smooth", [None, "line-of-sight"])
def test_many_answers_are_the_answers_one_by_one(office_planners, preset, smooth):
    planner = office_planners[preset]
    grid = planner.grid
    rng = np.random.default_rng(6)
    pairs = points_in(grid, rng, 25)
    low, high = grid.frame.points_of_grid([(-5, -5), (grid.shape[0] + 5, grid.shape[1] + 5)])
    anywhere = rng.uniform(low, high, size=(15, 2, 2))
    same = np.repeat(pairs[:1, :1], 2, axis=1)
    starts, goals = np.concatenate([pairs, anywhere, same]).transpose(1, 0, 2)
    batch = planner.plan_many(starts, goals, smooth=smooth)
    singles = [
        planner.plan(*endpoints, smooth=smooth) for endpoints in zip(starts, goals, strict=True)
    ]
    assert batch.status.tolist() == [str(single.status) for single in singles]
    assert len(set(batch.status.tolist())) >= 3
    assert batch.cost.tolist() == [single.cost for single in singles]
    assert batch.lower_bound.tolist() == [single.lower_bound for single in singles]
    np.testing.assert_array_equal(batch.gap, [single.gap for single in singles])
    assert batch.path_start[0] == 0
    assert batch.path_start[-1] == len(batch.points)
    assert len(batch.path_start) == len(singles) + 1
    arrays = (
        batch.status,
        batch.cost,
        batch.lower_bound,
        batch.path_start,
        batch.points,
        batch.path(0),
    )
    assert not any(array.flags.writeable for array in arrays)
    for i, single in enumerate(singles):
        points = np.empty((0, 2)) if single.path is None else single.path.points
        np.testing.assert_array_equal(batch.path(i), points)


@pytest.mark.parametrize("preset", [*PRESETS, "shortest", "robot"])
def test_a_path_from_a_point_to_itself_is_that_point_alone(preset: str) -> None:
    planner = hn.HybridPlanner(map_of(grid_of(TWO_ROOMS)), preset=preset)
    start, goal = planner.grid.frame.points_of([(2, 3), (3, 12)])
    batch = planner.plan_many([start, start, goal], [start, goal, goal])
    for query, end in ((0, start), (2, goal)):
        assert batch.path(query).tolist() == [end.tolist()]
        alone = planner.plan(end, end).path
        assert alone.points.tolist() == [end.tolist()]
    assert len(batch.path(1)) > 1


@presets
def test_many_takes_lists_and_nothing_at_all(office_planners, preset):
    planner = office_planners[preset]
    (start, goal), *_ = points_in(planner.grid, np.random.default_rng(7), 1)
    one = planner.plan_many([start.tolist()], [tuple(goal)])
    assert one.cost.tolist() == [planner.plan(start, goal).cost]
    nothing: Any
    for nothing in ([], np.empty((0, 2)), ()):
        batch = planner.plan_many(nothing, nothing)
        assert batch.status.shape == batch.cost.shape == batch.lower_bound.shape == (0,)
        assert batch.gap.shape == (0,)
        assert batch.points.shape == (0, 2)
        assert batch.path_start.tolist() == [0]


@pytest.mark.parametrize(
    ("starts", "goals", "message"),
    [
        ([(0, 0)], [], "there are 1 starts and 0 goals"),
        ([(0, 0), (1, 1)], [(0, 0)], "there are 2 starts and 1 goals"),
        ((0, 0), (1, 1), "starts must be finite coordinates"),
        ([(0, 0, 0, 0)], [(0, 0, 0, 0)], "starts must be finite coordinates"),
        ([(0, 0, math.nan)], [(0, 0, 0)], "starts must be finite coordinates"),
        ([(0, 0)], [(0, math.nan)], "goals must be finite coordinates"),
        ([(math.inf, 0)], [(0, 0)], "starts must be finite coordinates"),
        ([[(0, 0)]], [[(0, 0)]], "starts must be finite coordinates"),
        ([(0, 0), (1,)], [(0, 0), (1, 1)], "starts must be finite coordinates"),
        ("here", "there", "starts must be finite coordinates"),
        (None, None, "starts must be finite coordinates"),
    ],
)
def test_many_refuses_what_are_no_points(office_planners, starts, goals, message):
    with pytest.raises(hn.errors.InvalidValueError, match=message) as caught:
        office_planners["octile"].plan_many(starts, goals)
    assert str(caught.value).isprintable()


def test_bounds_that_take_a_search_are_found_when_they_are_read(office_planners, monkeypatch):
    planner = hn.HybridPlanner(office_planners["octile"].topology, preset="robot")
    pairs = points_in(planner.grid, np.random.default_rng(2), 6)
    bound, read = CostFinish.bound, []

    def counted(*of: Any) -> float:
        read.append(of)
        return bound(*of)

    monkeypatch.setattr(CostFinish, "bound", counted)
    batch = planner.plan_many(pairs[:, 0], pairs[:, 1])
    assert not read
    assert np.isfinite(batch.cost).any()
    copied = pickle.loads(pickle.dumps(batch)), copy.deepcopy(batch)  # noqa: S301 - our own
    assert len(read) == np.isfinite(batch.cost).sum()
    for other in (batch, *copied):
        assert not other.lower_bound.flags.writeable
        assert not other.points.flags.writeable
        np.testing.assert_array_equal(other.lower_bound, batch.lower_bound)
        np.testing.assert_array_equal(other.points, batch.points)
        np.testing.assert_array_equal(other.gap, batch.gap)
    assert len(read) == np.isfinite(batch.cost).sum()


@pytest.mark.parametrize("preset", ["octile", "shortest", "grid-astar"])
def test_costs_that_are_not_the_length_of_their_points_are_refused(monkeypatch, preset):
    grid = grid_of(np.ones((6, 9)))
    planner = hn.HybridPlanner(map_of(grid), preset=preset)
    points, method = grid.frame.points_of(np.array([[0, 0], [2, 6]])), planner.method
    ends = points[:1], points[1:]
    assert np.isfinite(planner.plan_many(*ends).cost).all()
    many, one = method.find_many, method.find

    def dearer_many(queries: Any) -> Any:
        found = many(queries)
        return None if found is None else replace(found, cost_m=found.cost_m + 0.1)

    def dearer(query: Any) -> Any:
        found = one(query)
        return replace(found, cost_source=found.cost_m + 0.1)

    monkeypatch.setattr(method, "find_many", dearer_many)
    monkeypatch.setattr(method, "find", dearer)
    with pytest.raises(hn.errors.InvalidValueError, match=r"states a length of .* of its points"):
        planner.plan_many(*ends)
    with pytest.raises(hn.errors.InvalidValueError, match=r"states a length of .* of its points"):
        _ = planner.plan(ends[0][0], ends[1][0]).path.points
