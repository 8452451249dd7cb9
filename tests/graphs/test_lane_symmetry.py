"""Equal places have equal lanes: those of turned and mirrored maps are turned and mirrored."""

from itertools import product

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.graphs import build_lane_graph
from tests.strategies import tried

SIDE_M = 0.05
WAYS = [*product((0, 1), repeat=3)][1:]


def turned(cells, way):
    """The cells with rows and columns swapped, then one or both reversed."""
    swap, down, left = way
    found = cells.T if swap else cells
    return np.ascontiguousarray(found[:: 1 - 2 * down, :: 1 - 2 * left])


def moved(positions, shape, way):
    """Positions, (row, col) in grid units, where `turned` brings them."""
    swap, *flips = way
    at, sides = (positions[:, ::-1], shape[::-1]) if swap else (positions, shape)
    return np.where(flips, np.array(sides) - at, at)


@st.composite
def offices(draw):
    """A corridor with rooms of several sizes on both sides, and posts: cells, and rooms."""
    cells, label_of = np.ones((170, 200), dtype=np.float32), np.full((170, 200), -1)
    label_of[70:100, 6:194] = 0
    count = 1
    for wall, way in ((100, 1), (69, -1)):
        col = 8
        while col < 150:
            width, depth = draw(st.integers(24, 50)), draw(st.integers(24, 60))
            door = col + draw(st.integers(2, width - 20))
            low = wall + 3 * way
            label_of[low : low + depth * way : way, col : col + width] = count
            label_of[wall, door : door + 17] = 0
            label_of[wall + way : low + way : way, door : door + 17] = count
            col += width + draw(st.integers(3, 9))
            count += 1
    for _ in range(draw(st.integers(0, 4))):
        row, col = draw(st.integers(8, 160)), draw(st.integers(8, 190))
        label_of[row : row + 7, col : col + 5] = -1
    cells[label_of >= 0] = 0.0
    return cells, label_of


def lanes(cells, label_of, **given_):
    """Nodes, float64 (n, 2) in grid units, and edges as sets of two of them, of a map with rooms if
    there are labels."""
    grid = hn.OccupancyGrid(cells, hn.Frame(SIDE_M), robot_radius_m=0.2)
    rooms = None
    if label_of is not None:
        names = tuple(f"room-{k + 1}" for k in range(int(label_of.max()) + 1))
        rooms = hn.RoomLabels(names, label_of)
    graph = build_lane_graph(
        hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms)), **given_
    )
    return graph.positions, graph.edges


def assert_alike(one, other):
    """Two graphs have the same nodes, to a thousandth of a cell, and edges."""
    keys = [np.round(positions * 1000).astype(int) for positions, _ in (one, other)]
    nodes, others = ({tuple(at) for at in key.tolist()} for key in keys)
    assert nodes == others
    ends = [
        {tuple(map(tuple, pair)) for pair in key[edges].tolist()}
        for key, (_, edges) in zip(keys, (one, other), strict=True)
    ]
    assert ends[0] == ends[1]


@tried(12, offices(), st.sampled_from(WAYS), st.booleans())
def test_turned_and_mirrored_maps_have_turned_and_mirrored_lanes(office, way, has_rooms):
    cells, label_of = office
    labels = label_of if has_rooms else None
    positions, edges = lanes(cells, labels)
    there = lanes(turned(cells, way), turned(label_of, way) if has_rooms else None)
    assert_alike((moved(positions, cells.shape, way), edges), there)


@pytest.mark.parametrize("way", WAYS)
def test_named_points_are_turned_and_mirrored_with_the_map(way):
    cells = np.ones((90, 120), dtype=np.float32)
    cells[6:40, 6:114] = cells[40:84, 60:90] = 0.0
    at = np.array([[12.3, 20.7], [70.2, 66.9]])
    found = [
        lanes(image, None, points={str(k): spot[::-1] * SIDE_M for k, spot in enumerate(spots)})
        for image, spots in ((cells, at), (turned(cells, way), moved(at, cells.shape, way)))
    ]
    assert_alike((moved(found[0][0], cells.shape, way), found[0][1]), found[1])


def bays(width, depth, door, count=4):
    """Bays of one size, each a room, along a corridor that is longer; and the first column of
    each."""
    label_of = np.full((depth + 60, count * (width + 6) + 202), -1)
    label_of[8:48, 8:-8] = 0
    firsts = [104 + k * (width + 6) for k in range(count)]
    for k, col in enumerate(firsts, start=1):
        label_of[52 : 48 + depth, col : col + width] = k
        first = col + (width - door) // 2
        label_of[48:50, first : first + door] = 0
        label_of[50:52, first : first + door] = k
    return label_of, firsts


@pytest.mark.parametrize(
    ("width", "depth", "door"),
    [(40, 50, 40), (60, 60, 60), (60, 140, 60), (80, 60, 80), (80, 100, 24), (80, 140, 80)],
)
def test_equal_bays_have_equal_lanes(width, depth, door):
    label_of, firsts = bays(width, depth, door)
    at, _ = lanes(np.where(label_of < 0, 1, 0).astype(np.float32), label_of)
    room = label_of[tuple(at.astype(int).T)]
    found = [at[room == k] - (0, col) for k, col in enumerate(firsts, start=1)]
    found = [inside[np.argsort(inside[:, 0])] for inside in found]
    assert len(found[0]) > 0
    for one in found[1:]:
        assert one.shape == found[0].shape
        assert abs(one - found[0]).max() <= 1.1
