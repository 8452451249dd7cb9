"""The frames in which a map is seen, and the vote of the views."""

import math
import tracemalloc
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

import hybridnav as hn
from hybridnav.rooms.cutting import Ground, Kind
from hybridnav.rooms.kernels import views as _kernels
from hybridnav.rooms.kernels.views import ViewFrame
from hybridnav.rooms.merging import JudgedSegments
from hybridnav.rooms.views import Voted, frame_over
from research._rooms_agreement import compare_rooms
from research._rooms_drawn import bend, drawn
from tests.strategies import tried

SHAPES = st.tuples(st.integers(1, 9), st.integers(1, 9))
KINDS = SHAPES.flatmap(lambda shape: hnp.arrays(np.uint8, shape, elements=st.integers(0, 3)))
TURNS = st.floats(-math.pi, math.pi)


def over(shape, turn, side):
    reach = math.ceil(math.hypot(*shape) / side) + 2
    return ViewFrame(reach, reach + 1, math.cos(turn), math.sin(turn), side)


def on_map(frame, shape, y, x):
    """The cell of the map under a point of a frame, None if it is near another one or outside."""
    y, x = (y - frame.rows / 2) * frame.side, (x - frame.cols / 2) * frame.side
    row = frame.cosine * y + frame.sine * x + shape[0] / 2
    col = frame.cosine * x - frame.sine * y + shape[1] / 2
    if min(abs(row - round(row)), abs(col - round(col))) < 1e-6:
        return None
    return math.floor(row), math.floor(col)


@tried(60, kinds=KINDS, turn=TURNS, side=st.sampled_from([1.0, 1.7, 2.0, 3.1, 17.0]))
def test_a_cell_is_wall_if_one_of_its_points_is_and_else_what_half_of_them_are(kinds, turn, side):
    frame, n = over(kinds.shape, turn, side), math.ceil(side)
    seen = _kernels.seen(kinds, frame, n)
    for i, j in np.ndindex(frame.rows, frame.cols):
        points = [
            on_map(frame, kinds.shape, i + (k + 0.5) / n, j + (m + 0.5) / n)
            for k, m in product(range(n), repeat=2)
        ]
        if None in points:  # on a line between cells: either one
            continue
        inside = [at for at in points if 0 <= at[0] < len(kinds) and 0 <= at[1] < kinds.shape[1]]
        of = [kinds[at] for at in inside]
        half = [kind for kind in (Kind.INSIDE, Kind.OUTSIDE) if 2 * of.count(kind) >= n * n]
        expected = Kind.WALL if Kind.WALL in of else (half or [Kind.UNKNOWN])[0]
        assert seen[i, j] == expected


@tried(60, labels=KINDS, turns=st.tuples(TURNS, TURNS), side=st.sampled_from([1.0, 2.0, 3.1]))
def test_labels_go_from_one_frame_to_another_by_the_middles_of_cells(labels, turns, side):
    one, other = (over((9, 9), turn, side) for turn in turns)
    label_of = np.resize(labels, (one.rows, one.cols)).astype(np.int32)
    free = np.resize(labels != 1, (other.rows, other.cols))
    brought = _kernels.brought(label_of, one, other, free)
    turn = math.atan2(one.sine, one.cosine) - math.atan2(other.sine, other.cosine)
    # The first frame as a map, seen in the other one.
    seen = ViewFrame(other.rows, other.cols, math.cos(turn), -math.sin(turn), 1.0)
    for i, j in np.ndindex(other.rows, other.cols):
        at = on_map(seen, label_of.shape, i + 0.5, j + 0.5)
        if at is None:
            continue
        is_inside = 0 <= at[0] < one.rows and 0 <= at[1] < one.cols
        assert brought[i, j] == (label_of[at] if is_inside and free[i, j] else -1)


@tried(
    60, labels=hnp.arrays(np.int32, SHAPES, elements=st.integers(-1, 2)), reach=st.integers(1, 2)
)
def test_a_cell_at_a_border_takes_the_label_beside_it_that_most_cells_round_it_have(labels, reach):
    smooth = _kernels.smoothed(labels, reach)
    for row, col in np.ndindex(*labels.shape):
        own, round_it = labels[row, col], []
        for down, right in product(range(-reach, reach + 1), repeat=2):
            pair = [(row + down, col + right), (row - down, col - right)]
            if all(0 <= r < len(labels) and 0 <= c < labels.shape[1] for r, c in pair):
                one, other = (labels[at] for at in pair)
                round_it += [one] if one >= 0 and other >= 0 else []
        near = [(row, col + 1), (row + 1, col), (row, col - 1), (row - 1, col), (row, col)]
        beside = {
            int(labels[r, c])
            for r, c in near
            if 0 <= r < len(labels) and 0 <= c < labels.shape[1] and labels[r, c] >= 0
        }
        most = max((round_it.count(label) for label in beside), default=0)
        assert smooth[row, col] == own or round_it.count(own) < most
        if own >= 0:
            assert round_it.count(smooth[row, col]) == most
        else:
            assert smooth[row, col] == -1


def test_a_straight_border_stays_where_it_is_and_its_steps_go():
    labels = np.zeros((12, 9), np.int32)
    labels[6:] = 1
    assert (_kernels.smoothed(labels, 2) == labels).all()
    labels[:, :2] = labels[:, 7:] = -1  # between two jambs
    assert (_kernels.smoothed(labels, 2) == labels).all()
    for step in (np.s_[5, 4], np.s_[6, 4]):
        stepped = labels.copy()
        stepped[step] = 1 - labels[step]
        assert (_kernels.smoothed(stepped, 2) == labels).all()


@tried(30, data=st.data(), n_views=st.integers(1, 4))
def test_segments_join_by_the_mean_over_the_pairs_of_their_cells(data, n_views):
    shape = 3, 8
    cells = hnp.arrays(np.int32, shape, elements=st.integers(0, 2))
    labels: list[Any] = [data.draw(cells) for _ in range(n_views)]
    _, of_cell = np.unique(np.stack(labels).reshape(n_views, -1), axis=1, return_inverse=True)
    atoms: Any = of_cell.reshape(shape).astype(np.int32)
    ground = Ground(np.ones(shape, bool), np.zeros(shape, bool), np.ones(shape, np.int32), 1.0)
    segments = JudgedSegments(atoms, ground)
    rule = Voted(atoms, labels)

    while True:
        ratings, of = rule.ratings(segments, np.empty(0, np.int64)), segments.label_of
        live = (segments.state.endpoints[:, 0] >= 0) & (segments.state.open_sides > 0)
        assert not ratings[~live].any()
        for (u, v), rating in zip(segments.state.endpoints[live], ratings[live], strict=True):
            share = np.mean([own[of == u][:, None] == own[of == v] for own in labels])
            assert rating == pytest.approx(share if share >= 0.5 - 1e-9 else 0.0)
        if not ratings.any():
            break
        segments.merge(np.array([np.argmax(ratings)]))


def test_a_frame_holds_the_whole_map():
    assert frame_over((7, 9), 0.0, 1.0) == ViewFrame(7, 9, 1.0, 0.0, 1.0)
    assert frame_over((7, 9), 0.0, 2.0)[:2] == (4, 5)
    assert frame_over((30, 40), math.radians(30), 1.0)[:2] == (46, 50)


@pytest.mark.parametrize("share", [0.05, 0.1, 0.4])
def test_a_map_that_is_seen_once_may_fall_into_hundreds_of_segments(share):
    cells = (np.random.default_rng(2).random((3, 3000)) < share).astype(np.float32)
    grid = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    label_of = np.where(cells == 0, hn.find_rooms(grid, least_area_m2=0.3).label_of, -1)
    free_parts, _ = ndimage.label(cells == 0)
    areas = np.bincount(free_parts.ravel())
    assert (label_of[(cells == 0) & (areas[free_parts] >= 5)] >= 0).all()


def test_a_long_map_is_not_seen_across():
    """A corridor of 300 m with rooms along it, turned by 45 degrees, would be a square of 210 m."""
    cells = np.ones((160, 6000), np.float32)
    cells[2:40, 2:-2] = 0.0
    cells[42:-2, 2:-2] = np.where(np.arange(5996) % 150 < 146, 0.0, 1.0)
    for k in range(18):
        cells[40:42, 60 + k :: 150] = 0.0
    tracemalloc.start()
    names = hn.find_rooms(hn.OccupancyGrid(cells, hn.Frame(0.05), robot_radius_m=0)).names
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(names) == 41
    assert peak < 40 * cells.size


@pytest.mark.parametrize("degrees", [8, 23, 41])
def test_a_turned_floor_has_the_same_rooms(degrees):
    floor = drawn(bend(2.2), 0.05, math.radians(degrees))
    label_of = hn.find_rooms(floor.grid).label_of
    assert compare_rooms(floor.true[floor.compared], label_of[floor.compared]).mcc > 0.97
