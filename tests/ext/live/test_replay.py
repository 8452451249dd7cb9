"""Replays: flips by their definition, the last version, scans of a log."""

import itertools
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import OnlineRooms, ReplayFigures, grids_of_scans, replay
from hybridnav.ext.live.mapping import Mapper, SimulatedLaser
from hybridnav.ext.live.replay import faults_of
from hybridnav.maps import Frame, OccupancyGrid
from tests.ext.live.test_rooms import check_update as check_rooms_update
from tests.ext.live.test_rooms import check_version as check_rooms
from tests.ext.live.test_updates import check_version as check_places
from tests.strategies import class_grids, examples, seeds

NOTHING: Any = None
EVENTS = ("born", "died", "merged", "split")
NAN: Any = math.nan
WRONG: Any = "x"
OTHER_ROOMS = hn.RoomLabels(("hall",), np.zeros((2, 2), np.int32))


def grid_of(classes, corner=(0, 0)):
    probability = np.array([1.0, 0.0, 0.5], np.float32)[classes]
    return OccupancyGrid(probability, Frame(0.25, corner), robot_radius_m=0)


def changing_grids():
    """Two rooms, seen one after the other; then a door that closes, and a pallet."""
    classes = np.pad(np.ones((11, 23), np.uint8), 1)
    classes[:, 12], classes[4:7, 12] = 0, 1
    seen = np.full((13, 13), 2, np.uint8)
    seen[:, :13] = classes[:, :13]
    yield grid_of(seen)
    yield grid_of(classes)
    shut = classes.copy()
    shut[4:7, 12] = 0
    yield grid_of(shut)
    shut[8:10, 15:17] = 0
    yield grid_of(shut)
    yield grid_of(shut)


def numbered(version, classes):
    return np.where(classes == 1, version.number_of, -1)


def beside(cells):
    """Cells beside others at a side, and at a side or a corner."""
    cross = ndimage.binary_dilation(cells)
    return cross & ~cells, ndimage.binary_dilation(cells, np.ones((3, 3), bool)) & ~cells


def check_flips(flips, before, after, classes):
    """Count flips cell by cell; `classes` are those of both maps."""
    rows, cols = before.grid.shape
    number_of = np.full(after.grid.shape, -1)
    number_of[:rows, :cols] = before.number_of
    was = np.zeros(after.grid.shape, np.uint8)
    was[:rows, :cols] = classes[0]
    changed = was != classes[1]
    old, now = np.where(was == 1, number_of, -1), after.number_of
    stays = (was == 1) & ~changed
    found: dict[str, set[int]] = {name: set() for name in ("untouched", "flipped", "apart", "far")}
    cells = {"cells": 0, "merged": 0, "cut_off": 0}
    for place in set(old[old >= 0].tolist()):
        inside = old == place
        flips_of = now[inside & stays & (now != place)]
        if 2 * (inside & stays).sum() > inside.sum():
            cells["cells"] += flips_of.size
            for number in flips_of.tolist():
                most = 2 * (flips_of == number).sum() > inside.sum()
                cells["cut_off"] += place in now
                cells["merged"] += place not in now and most
        if not stays[inside].all():
            continue
        found["untouched"].add(place)
        if 2 * (now[inside] == place).sum() <= inside.sum():
            found["flipped"].add(place)
        if not changed[beside(inside)[1]].any():
            found["apart"].add(place)
            others = set(number_of[beside(number_of == place)[0]].tolist()) - {-1}
            if not any(changed[number_of == other].any() for other in others):
                found["far"].add(place)
    assert flips._asdict() == {"free": stays.sum(), **cells, **found}


def test_flips_are_those_of_the_definition():
    steps = list(replay(changing_grids(), merge_distance_m=1.5))
    first = steps[0]
    assert [first.place_flips, first.update, first.rooms_update] == [None] * 3
    for before, after in itertools.pairwise(steps):
        grids = before.places.grid, after.places.grid
        classes = [grid.classes for grid in grids]
        check_flips(after.place_flips, before.places, after.places, classes)
        check_flips(after.room_flips, before.rooms, after.rooms, classes)
    assert [flips.cells for flips in (steps[-1].place_flips, steps[-1].room_flips) if flips] == [
        0,
        0,
    ]


@given(
    first=class_grids(12),
    seed=seeds,
    share=st.sampled_from([0.01, 0.03, 0.1, 0.5]),
    merge_distance_m=st.sampled_from([0.5, 1.0, 1.5]),
)
@settings(max_examples=examples(40), deadline=None, derandomize=True)
def test_flips_of_any_change_are_those_of_the_definition(first, seed, share, merge_distance_m):
    rng = np.random.default_rng(seed)
    differs = rng.random(first.shape) < share
    second = np.where(differs, rng.integers(0, 3, first.shape), first).astype(np.uint8)
    grids = grid_of(first), grid_of(second)
    before, after = replay(grids, merge_distance_m=merge_distance_m)
    classes = [grid.classes for grid in grids]
    check_flips(after.place_flips, before.places, after.places, classes)
    check_flips(after.room_flips, before.rooms, after.rooms, classes)


def test_rooms_are_brought_up_to_date_at_times_and_at_the_end():
    steps = list(replay(changing_grids(), rooms_every=3))
    assert [step.rooms_update is not None for step in steps] == [False] * 3 + [True] * 2
    assert steps[2].rooms is steps[0].rooms
    assert steps[-1].rooms.grid is steps[-1].places.grid


def test_a_replay_counts_what_happens():
    figures = ReplayFigures()
    assert figures.figures() == {}
    for step in replay(changing_grids()):
        figures.add(step)
    found = figures.figures()
    assert (found["maps"], found["n_rooms"], found["faults"]) == (5, 2, [])
    assert (found["rooms"]["updates"], found["rooms"]["born"], found["rooms"]["died"]) == (4, 1, 0)
    assert found["doors"] == dict.fromkeys([*EVENTS, "changed"], 0) | {"born": 1, "died": 1}
    assert found["rooms"]["untouched"]["flipped"] == 0


def test_named_rooms_are_followed_and_lost_names_are_counted():
    _, both, *others = changing_grids()
    labels = np.zeros(both.shape, np.int32)
    labels[:, 12:] = 1
    rooms = hn.RoomLabels(("kitchen", "hall"), labels)
    gone = grid_of(np.where(np.arange(25) > 11, 0, both.classes).astype(np.uint8))
    steps = list(replay([both, *others, gone], rooms=rooms))
    assert [step.rooms.labels.names for step in steps] == 4 * [("kitchen", "hall")] + [("kitchen",)]
    figures = ReplayFigures()
    for step in steps:
        figures.add(step)
    assert figures.figures()["lost_names"] == ["hall"]


def simulated_scans():
    """Scans of a robot that drives through a door."""
    classes = np.pad(np.ones((20, 40), np.uint8), 1)
    classes[:, 20], classes[8:13, 20] = 0, 1
    world = OccupancyGrid(np.array([1.0, 0.0], np.float32)[classes], Frame(0.25), robot_radius_m=0)
    laser = SimulatedLaser()
    return [laser.scan(world, (x, 2.6, math.pi * x)) for x in np.linspace(1.0, 9.0, 12)]


def test_a_replay_of_scans_ends_in_what_the_oracle_reads():
    scans = simulated_scans()
    grids = grids_of_scans(scans, Mapper(resolution_m=0.25), every=2, robot_radius_m=0)
    steps = list(replay(grids, merge_distance_m=1.5, rooms_every=2))
    whole = Mapper(resolution_m=0.25)
    for scan in scans:
        whole.add(scan)
    grid, last = whole.to_grid(robot_radius_m=0), steps[-1]
    assert np.array_equal(last.places.grid.classes, grid.classes)
    assert last.number == 5
    check_places(last.places)
    check_rooms(last.rooms)
    assert faults_of(last.places.pyramid) == []
    with_rooms = [steps[0], *(step for step in steps if step.rooms_update is not None)]
    for before, after in itertools.pairwise(with_rooms):
        check_rooms_update(before.rooms, after.rooms_update, shift(before.rooms, after.rooms))


def shift(before, after):
    """Rows and columns by which cell (0, 0) of the newer version lies lower."""
    return before.low[0] - after.low[0], before.low[1] - after.low[1]


def test_a_replay_sees_a_change_wherever_it_lies():
    cells = np.zeros((40, 50), np.float32)
    frame = Frame(0.05, (-3.0, 7.0))
    empty = OccupancyGrid(cells, frame, robot_radius_m=0)
    for row, col in [(0, 0), (39, 49), (12, 30)]:
        cells = np.zeros((40, 50), np.float32)
        cells[row, col] = 1.0
        _, last = replay([empty, OccupancyGrid(cells, frame, robot_radius_m=0)])
        assert last.update.cells.tolist() == [[row, col]]
        assert last.places.pyramid.grid is last.places.grid


def test_a_level_without_one_of_its_arcs_is_a_fault():
    pyramid = hn.DualGraphPyramid.build(next(changing_grids()), merge_distance_m=1.0)
    level = pyramid[-1]
    kept = np.arange(level.n_arcs) != np.flatnonzero(~level.is_self_loop)[0]
    cut: Any = SimpleNamespace(
        index=level.index,
        grid=level.grid,
        field_of=level.field_of,
        arcs=level.arcs[kept],
        is_self_loop=level.is_self_loop[kept],
    )
    n_arcs = int((~level.is_self_loop).sum())
    (fault,) = faults_of([*pyramid, cut])
    assert fault == (
        f"level {level.index} has {n_arcs - 1} arcs, its fields have {n_arcs} boundaries"
    )


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: list(replay([])), "no map to replay"),
        (lambda: list(replay([NOTHING])), "a map of the replay is None"),
        (lambda: list(replay(changing_grids(), rooms_every=NAN)), "rooms_every is nan"),
        (lambda: OnlineRooms.of(NOTHING), "grid is None"),
        (lambda: OnlineRooms.of(next(changing_grids())).update(NOTHING), "grid is None"),
        (lambda: list(replay(changing_grids(), rooms_every=0)), "rooms_every is 0"),
        (lambda: list(replay(changing_grids(), rooms_every=WRONG)), "rooms_every is 'x'"),
        (lambda: list(grids_of_scans([], Mapper(), every=WRONG)), "every is 'x'"),
        (lambda: list(replay(changing_grids(), rooms=WRONG)), "labels is 'x'"),
        (lambda: list(replay(changing_grids(), rooms=OTHER_ROOMS)), "rooms are labels of"),
        (lambda: list(grids_of_scans([], Mapper(), every=0)), "every is 0"),
        (lambda: list(replay(list(changing_grids())[::-1])), "does not cover"),
    ],
)
def test_wrong_arguments_end_in_one_line(ask, message):
    with pytest.raises(InvalidValueError, match=message) as error:
        ask()
    assert "\n" not in str(error.value)
