"""Certainty of arcs: maps are made again with other thresholds, and the arcs looked for."""

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

import hybridnav as hn
from hybridnav.maps.clearance import greatest_within
from hybridnav.pyramid import Level
from tests.strategies import examples

_CHANCES = [0.0, 0.05, 0.1, 0.15, 0.19, 0.3, 0.5, 0.6, 0.7, 0.8, 1.0, np.nan]
_OFTEN_FREE = [0.3, 0.1, 0.1, 0.1, 0.1, 0.05, 0.05, 0.05, 0.03, 0.03, 0.04, 0.05]
_THRESHOLDS = [0.0, 0.02, 0.05, 0.07, 0.1, 0.15, 0.17, 0.19, 0.25, 0.3, 0.5, 0.55, 0.6, 0.64]
_THRESHOLDS += [0.66, 0.7, 0.75, 0.8, 0.9, 1.0]


def cores(level: Level, grid: hn.OccupancyGrid) -> NDArray[np.bool_]:
    """Cells of the components of more than half of their field that keep their class on a map."""
    kept = np.zeros(grid.shape, dtype=np.bool_)
    for vertex in range(level.n_vertices):
        of_field = level.field_of == vertex
        labels, _ = ndimage.label(of_field & (grid.classes == level.grid.classes))
        sizes = np.bincount(labels[labels > 0], minlength=1)
        if 2 * sizes.max(initial=0) > of_field.sum():
            kept |= labels == sizes.argmax()
    return kept


def goes_round(level: Level, arc: int, kept: NDArray[np.bool_]) -> bool:
    """Whether closed paths among the cells kept of a self-loop's field separate the ends of its
    line: no walk from corner to corner of cells joins them without crossing such a path."""
    inside = np.pad(kept & (level.field_of == level.arcs[arc, 0]), 1)
    rows, cols = inside.shape
    walks: nx.Graph[tuple[int, int]] = nx.Graph()
    for row in range(rows - 1):  # corner (row, col) is the upper right one of a padded cell
        for col in range(cols - 1):
            walks.add_node((row, col))
            if row + 1 < rows - 1 and not inside[row + 1, col : col + 2].all():
                walks.add_edge((row, col), (row + 1, col))
            if col + 1 < cols - 1 and not inside[row : row + 2, col + 1].all():
                walks.add_edge((row, col), (row, col + 1))
    odd: dict[tuple[int, int], int] = {}
    for pair in np.sort(level.boundary(arc), axis=1).tolist():
        (_, _), (row, col) = pair
        ends = [(row, col), (row + 1, col)] if pair[0][0] == row else [(row, col), (row, col + 1)]
        for corner in ends:
            odd[corner] = odd.get(corner, 0) ^ 1
    one, other = [corner for corner, count in odd.items() if count]
    return not nx.has_path(walks, one, other)


def exists(level: Level, grid: hn.OccupancyGrid) -> list[bool]:
    """Whether each arc of a level exists on its map with other thresholds."""
    kept = cores(level, grid)
    found = []
    for arc in range(level.n_arcs):
        if level.is_self_loop[arc]:
            found.append(goes_round(level, arc, kept))
        else:
            rows, cols = np.moveaxis(level.boundary(arc), -1, 0)
            found.append(bool(kept[rows, cols].all(axis=1).any()))
    return found


@settings(max_examples=examples(80))
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 1.0, 1.5]),
    st.sampled_from([1.5, 3.0, 10.0]),
)
def test_arcs_exist_at_the_thresholds_stated_and_at_no_others(
    seed: int, radius_m: float, merge_distance_m: float
) -> None:
    rng = np.random.default_rng(seed)
    shape = rng.integers(1, 11, 2)
    probability = rng.choice(_CHANCES, size=tuple(shape.tolist()), p=_OFTEN_FREE)
    grid = hn.OccupancyGrid(probability, robot_radius_m=radius_m)
    level = hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m)[-1]
    sure = level.certainty
    for value in rng.choice(_THRESHOLDS, 6):
        if value < grid.occupied_threshold:
            moved = np.float32(value)
            stated = (sure.free_from <= moved) & (moved < sure.free_below)
            assert stated.tolist() == exists(level, replace(grid, free_threshold=value))
        if value > grid.free_threshold:
            stated = np.float32(value) > sure.occupied_above
            assert stated.tolist() == exists(level, replace(grid, occupied_threshold=value))
    assert (sure.margin > 0).all()


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 12.0))
def test_the_greatest_within_a_radius_is_that_of_all_cells_so_near(
    seed: int, radius: float
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.random((int(rng.integers(1, 9)), int(rng.integers(1, 9))))
    indices = np.indices(values.shape)
    row, col = indices[0], indices[1]
    apart = np.hypot(row[:, :, None, None] - row, col[:, :, None, None] - col)
    expected = np.where(apart <= radius, values, -np.inf).max(axis=(2, 3))
    assert (greatest_within(values, radius_cells=radius) == expected).all()


def two_rooms(*doors: float) -> Level:
    """The level of two rooms with certain cells, and a door of one cell for each probability."""
    probability = np.full((2 * len(doors) + 1, 9), 0.02)
    probability[:, 4] = 0.98
    probability[1::2, 4] = doors
    probability[[0, -1]] = 0.98
    labels = np.tile([0] * 5 + [1] * 4, (len(probability), 1))
    pyramid = hn.DualGraphPyramid.build(
        hn.OccupancyGrid(probability, robot_radius_m=0),
        rooms=hn.RoomLabels(("west", "east"), labels.astype(np.int32)),
    )
    return pyramid[pyramid.room_level]


def test_a_door_seen_once_is_a_guess_and_one_seen_often_is_certain() -> None:
    level = two_rooms(0.02, 0.19)
    doors = np.argsort(level.boundary_middles[:, 1])
    assert level.arcs.tolist() == [[0, 1], [0, 1]]
    assert level.certainty.free_from[doors] == pytest.approx([0.02, 0.19])
    assert level.certainty.margin[doors] == pytest.approx([0.176, 0.006])


def test_a_narrow_door_depends_on_what_counts_as_an_obstacle() -> None:
    probability = np.full((5, 9), 0.02)
    probability[[0, -1]] = 0.98
    probability[3, 4] = 0.6  # no obstacle, but nearly: as one it would close the passage
    grid = hn.OccupancyGrid(probability, robot_radius_m=1.0)
    labels = np.tile([0] * 5 + [1] * 4, (5, 1)).astype(np.int32)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=hn.RoomLabels(("west", "east"), labels))
    level = pyramid[pyramid.room_level]
    between = np.flatnonzero((level.classes[level.arcs] == hn.CellClass.FREE).all(axis=1))
    assert level.certainty.occupied_above[between] == pytest.approx(0.6)
    assert level.certainty.margin[between] == pytest.approx(0.05)


def test_exports_state_the_ranges_where_asked_for() -> None:
    level = two_rooms(0.1, 0.05)
    for _, _, arc, attributes in level.to_networkx(certainty=True).edges(keys=True, data=True):
        assert attributes["margin"] == level.certainty.margin[arc]
        assert attributes["free_from"] == level.certainty.free_from[arc]
        assert attributes["free_below"] == level.grid.occupied_threshold
        assert attributes["occupied_above"] == level.certainty.occupied_above[arc]
    assert all("margin" not in edge for *_, edge in level.to_networkx().edges(data=True))
