"""The first search, among cells: what it may state when it ends early."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.search.overlay import build_overlay
from hybridnav.search.overlay.kernels.fields import search_near
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH
from tests.search.overlay.judge import WeightedJudge
from tests.search.overlay.test_overlay import nested, world
from tests.strategies import examples


@given(
    seed=st.integers(0, 10**6), share=st.sampled_from([0.0, 0.15, 0.3]), most=st.integers(0, 300)
)
@settings(max_examples=examples(80), deadline=None)
def test_a_search_that_ends_early_states_no_path(seed, share, most):
    """A path that is not proved may pass cells whose distance has fallen since."""
    free, factor = world(seed, (25, 30), share)
    overlay = build_overlay(free, nested(free, [5]), factor)
    judge, distance = WeightedJudge(free, factor), np.full(free.size, FAR, dtype=np.int32)
    cells = np.argwhere(free)
    rng = np.random.default_rng(seed)
    for start, goal in cells[rng.integers(len(cells), size=(20, 2))].tolist():
        ends = (start[0] * 30 + start[1], goal[0] * 30 + goal[1])
        cost, flat, is_proved, expanded = search_near(overlay.ground, *ends, most, distance)
        assert (distance == FAR).all()
        assert expanded <= most
        if not is_proved:
            assert cost == NO_PATH
            assert not flat.size
            continue
        least = judge.least(start)[1][tuple(goal)]
        if np.isinf(least):
            assert cost == NO_PATH
            continue
        assert (flat[0], flat[-1]) == ends
        assert cost * overlay.cost_unit == least
