"""Results state what their points are: cost, length, and a bound that is no more."""

import dataclasses
import importlib.util

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.subjects.claims import claims, claims_of_floors, faults_of
from hybridnav.errors import InvalidValueError
from tests.plans import TWO_ROOMS, map_of
from tests.strategies import examples, occupancy_grid


@pytest.mark.parametrize("samples", [False, True])
def test_random_plans_of_every_kind_state_what_they_drive(samples: bool) -> None:
    """`python -m benchmarks claims` plans 100,000."""
    if samples and importlib.util.find_spec("ompl") is None:
        pytest.skip("OMPL is not installed")
    count = examples(30 if samples else 500)
    found = list(claims(np.random.default_rng(5), count, samples=samples))
    assert len(found) >= count
    assert [(name, *faults) for name, faults in found if faults] == []


def test_plans_over_floors_state_what_they_drive() -> None:
    found = claims_of_floors(np.random.default_rng(5), examples(20))
    assert [(name, *faults) for name, faults in found if faults] == []


def test_a_path_of_another_length_is_refused_and_a_false_cost_found() -> None:
    planner = hn.HybridPlanner(map_of(occupancy_grid(TWO_ROOMS)))
    (row, col), (to_row, to_col) = np.argwhere(planner.grid.enterable())[[0, -1]].tolist()
    result = planner.plan(*planner.grid.frame.points_of([(row, col), (to_row, to_col)]))
    assert result.path is not None
    assert faults_of(planner, result) == []
    for wrong in (result.cost * 1.01, 0.0, float("nan")):
        with pytest.raises(InvalidValueError, match="a path states a length of"):
            dataclasses.replace(result.path, points_source=result.path.points, length_m=wrong)
    assert faults_of(planner, dataclasses.replace(result, weighted_cost=result.cost * 1.1))
    assert faults_of(planner, dataclasses.replace(result, lower_bound_source=result.cost * 1.1))
