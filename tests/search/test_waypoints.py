"""The cheapest cells of sets, against all pairs by grid search."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hybridnav._base.moves import path_length_in_cells
from hybridnav.maps import CellClass
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.waypoints import cheapest_waypoints
from tests.strategies import class_grids


@given(classes=class_grids(9), seed=st.integers(0, 2**32 - 1), n_sets=st.integers(2, 4))
def test_stops_are_as_cheap_as_the_best_of_all_choices(classes, seed, n_sets):
    enterable = classes == CellClass.FREE
    cells = np.flatnonzero(enterable)
    if len(cells) == 0:
        return
    rng = np.random.default_rng(seed)
    sets = [rng.choice(cells, min(len(cells), 3), replace=False) for _ in range(n_sets)]
    search = GridSearch(enterable)
    cols = classes.shape[1]

    def length(waypoints):
        total = 0.0
        for tail, head in itertools.pairwise(waypoints):
            found = search.search(divmod(int(tail), cols), divmod(int(head), cols))
            total += np.inf if found.cells is None else path_length_in_cells(found.cells)
        return total

    best = min(map(length, itertools.product(*sets)))
    waypoints = cheapest_waypoints(enterable, sets)
    if waypoints is None:
        assert best == np.inf
    else:
        assert all(waypoint in members for waypoint, members in zip(waypoints, sets, strict=True))
        assert abs(length(waypoints) - best) < 1e-9
