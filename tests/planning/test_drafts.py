"""Drafts: the cost and the bound of a plan, and its result if somebody wants it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

import hybridnav as hn
from tests.plans import PLAIN, PRESETS, answer, points_in, scene_map
from tests.strategies import Scene, scenes


@pytest.mark.parametrize("preset", ["shortest", *PRESETS])
@PLAIN
@given(scenes())
def test_a_draft_is_the_plan(preset: str, scene: Scene) -> None:
    topology = scene_map(scene)
    planner = hn.HybridPlanner(topology, preset=preset)
    rng = np.random.default_rng(scene.seed)
    pairs = [*points_in(topology.grid, rng, 3)]
    pairs += [(pair[0], pair[0]) for pair in pairs[:1]] + [([1e3, 0.0], [0.0, 0.0])]
    for start, goal in pairs:
        shut = {"cells": np.argwhere(rng.random(topology.grid.shape) < 0.1)}
        for blocked in (None, shut):
            plan = planner.plan(start, goal, blocked=blocked)
            draft = planner.draft(start, goal, blocked=blocked)
            assert (draft.status, draft.cost) == (plan.status, plan.cost)
            assert draft.lower_bound == plan.lower_bound
            assert answer(draft.result()) == answer(plan)
