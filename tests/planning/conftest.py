"""The office, and planners of it."""

import pytest

import hybridnav as hn
from benchmarks.worlds import office_world
from tests.plans import PRESETS, map_of


@pytest.fixture(scope="module")
def office() -> hn.TopologicalMap:
    return map_of(office_world().grid(robot_radius_m=0.25))


@pytest.fixture(scope="module")
def office_planners(office: hn.TopologicalMap) -> dict[str, hn.HybridPlanner]:
    return {preset: hn.HybridPlanner(office, preset=preset) for preset in PRESETS}
