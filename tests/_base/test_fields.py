"""Shortest distances inside fields against scipy's."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume

from hybridnav._base.kernels.moves import field_distances
from hybridnav._base.moves import length_in_cells
from hybridnav.maps import CellClass
from tests.oracle.grid import distances, move_graph
from tests.strategies import block_labels, class_grids, seeds, tried


@tried(60, class_grids(), seeds)
def test_distances_inside_fields_are_those_that_dijkstra_finds(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = classes != CellClass.OCCUPIED
    assume(vertices.any())
    # Fields of one class each; they need not be connected: what is not reached has -1.
    label = np.where(vertices, 2 * block_labels(classes.shape, rng) + classes - 1, -1)
    names, dense = np.unique(label[vertices], return_inverse=True)
    field_of = np.full(classes.shape, -1, dtype=np.int32)
    field_of[vertices] = dense
    sources = [rng.choice(np.argwhere(field_of == v)).tolist() for v in range(len(names))]
    flat = np.array([row * classes.shape[1] + col for row, col in sources], dtype=np.int64)
    found = field_distances(classes, field_of.ravel(), flat).reshape(classes.shape)
    expected = np.full(classes.shape, np.inf)
    for v, source in enumerate(sources):
        free = classes[tuple(source)] == CellClass.FREE
        enterable = classes == CellClass.FREE if free else vertices
        graph = move_graph(enterable, field_of == v)
        expected = np.minimum(expected, distances(graph, classes.shape, tuple(source)))
    assert ((found == -1) == np.isinf(expected)).all()
    reached = found >= 0
    assert length_in_cells(found[reached]) == pytest.approx(expected[reached], rel=0, abs=1e-9)
