"""Contraction of a graph into a hierarchy."""

import numpy as np
import pytest

from hybridnav.search.contraction import HEAD_SHIFT, contract


@pytest.mark.parametrize("seed", range(3))
def test_corners_that_are_all_joined_keep_their_distances(seed: int) -> None:
    """Such corners are the core, which is contracted in another order than the rest."""
    rng = np.random.default_rng(seed)
    n = 400
    costs = np.triu(rng.integers(1, 10_000, (n, n)) + (rng.random((n, n)) < 0.2) * (1 << 40), 1)
    costs = costs + costs.T
    is_arc = (costs > 0) & (costs < 1 << 40)
    first = np.concatenate([[0], is_arc.sum(axis=1).cumsum()]).astype(np.int64)
    arcs = np.stack([costs[is_arc], np.nonzero(is_arc)[1] << HEAD_SHIFT], 1)
    follow = np.full((4, 64), -1, np.int64)
    kinds, kept = np.zeros(n, np.uint8), np.empty(0, np.bool_)
    upward, up, _, taken = contract(kinds, first, arcs, follow, (1, 1 << 60), kept)
    assert sorted(taken) == list(range(n))

    shortest = np.where(is_arc, costs, 1 << 40)
    np.fill_diagonal(shortest, 0)
    climbed = np.where(np.eye(n, dtype=bool), 0, 1 << 40)
    for middle in range(n):
        shortest = np.minimum(shortest, shortest[:, middle, None] + shortest[middle])
    for corner in taken[::-1]:
        for cost, packed in up[upward[corner] : upward[corner + 1]]:
            climbed[corner] = np.minimum(climbed[corner], cost + climbed[packed >> HEAD_SHIFT])
    found = np.array([(row + climbed).min(axis=1) for row in climbed])
    assert (found == shortest).all()
