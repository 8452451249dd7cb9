"""Parts of a map against their definition, and places that end where passages are narrow."""

import os
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.pyramid.decimation import squared_limit
from hybridnav.pyramid.start import parts_of
from tests.oracle import throats as oracle
from tests.strategies import MAX_SIDE, class_grids, examples, occupancy_grid

ORDINARY = settings(max_examples=examples(60, full=300), deadline=None)
DISTANCES = st.sampled_from([1.0, 4.0, 8.0, 13.0, 20.0, 40.0, float("inf")])


@given(classes=class_grids(min(24, MAX_SIDE)), distance=DISTANCES)
@ORDINARY
def test_parts_are_those_of_the_definition(classes, distance):
    found = parts_of(classes, squared_limit(distance, 1.0))
    fine_of, part_of = oracle.parts_of(classes, distance)
    assert np.array_equal(found.part_of, part_of)
    free = classes == hn.CellClass.FREE
    assert np.array_equal(found.kinds[free], 2 * (fine_of[free] + 1) + 1)
    assert np.array_equal(found.kinds[~free], classes[~free])


@given(classes=class_grids(), distance=DISTANCES)
@ORDINARY
def test_no_place_has_cells_of_two_parts(classes, distance):
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=distance)
    free = np.argwhere(classes == hn.CellClass.FREE)
    parts = parts_of(classes, squared_limit(distance, 1.0)).at(free)
    pairs = np.unique([pyramid[-1].field_of[tuple(free.T)], parts], axis=1)
    assert len(np.unique(pairs[0])) == pairs.shape[1]


def two_rooms(rng, resolution_m):
    cells = lambda low, high: round(rng.uniform(low, high) / resolution_m)  # noqa: E731
    height, widths, wall = cells(5, 7), (cells(3, 6), cells(3, 6)), cells(0.1, 0.4)
    classes = np.zeros((height + 2, sum(widths) + wall + 2), np.uint8)
    classes[1:-1, 1:-1] = 1
    left = 1 + widths[0]
    classes[:, left : left + wall] = 0
    doors = []
    for low in (0.5, 3.0):
        row, high = cells(low, low + 0.5), cells(0.7, 1.2)
        doors.append((slice(row, row + high), slice(left, left + wall)))
        classes[doors[-1]] = 1
    return classes, doors


def rows_parted(seed, linkage):
    classes, doors = two_rooms(np.random.default_rng(seed), 0.05)
    grid = occupancy_grid(classes, resolution_m=0.05)
    field_of = hn.DualGraphPyramid.build(grid, linkage=linkage)[-1].field_of
    sills = (field_of[rows, cols.start - 1 : cols.stop + 1] for rows, cols in doors)
    return np.concatenate([(np.diff(sill, axis=1) != 0).any(axis=1) for sill in sills])


@pytest.mark.parametrize("seed", range(20))
def test_two_doors_between_two_rooms_are_two_borders(seed):
    assert rows_parted(seed, "throats").all()


def test_fields_round_surviving_cells_have_few_borders_in_doors():
    assert np.mean([rows_parted(seed, "radius").mean() for seed in range(20)]) < 0.5


def test_a_map_in_other_units_has_the_same_places():
    classes, _ = two_rooms(np.random.default_rng(1), 0.05)
    small, large = (
        hn.DualGraphPyramid.build(
            occupancy_grid(classes, resolution_m=side), merge_distance_m=80 * side
        )[-1].field_of
        for side in (0.05, 1.0)
    )
    assert np.array_equal(small, large)


def test_rooms_alone_decide_where_places_part():
    classes, _ = two_rooms(np.random.default_rng(2), 0.05)
    grid = occupancy_grid(classes, resolution_m=0.05)
    rooms = hn.RoomLabels(("a",), np.zeros(classes.shape, np.int32))
    one = hn.DualGraphPyramid.build(grid, rooms=rooms)
    other = hn.DualGraphPyramid.build(grid, rooms=rooms, linkage="radius")
    assert np.array_equal(one[one.place_level].field_of, other[other.place_level].field_of)


DATA = os.environ.get("HYBRIDNAV_DATA")


@pytest.mark.skipif(DATA is None, reason="needs HYBRIDNAV_DATA")
def test_places_end_in_the_doors_that_people_drew():
    parted = []
    for floor in ("2", "3", "3ne"):
        folder = Path(str(DATA), "bwi_gdc", floor)
        grid = hn.load_map(folder / f"{floor}.yaml", robot_radius_m=0.25)
        level = hn.DualGraphPyramid.build(grid)[-1]
        for door in yaml.safe_load((folder / "doors.yaml").read_text(encoding="utf-8")):
            ends = np.array([door["door_corner_pt_1"], door["door_corner_pt_2"]])
            along = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
            # Straight through the middle, half a metre to either side.
            across = np.linspace(-0.5, 0.5, 41)[:, None] * [-along[1], along[0]]
            row, col = grid.frame.cells_of(ends.mean(axis=0) + across).T
            if (grid.classes[row, col] == hn.CellClass.FREE).all():
                parted.append(len(np.unique(level.field_of[row, col])) > 1)
    assert len(parted) >= 50
    assert np.mean(parted) >= 0.95
