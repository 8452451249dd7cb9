"""Islands that are dropped: nothing becomes free, and what is kept stays the same."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.cli.app import run
from hybridnav.maps import CellClass
from tests.strategies import class_grids, drawn, occupancy_grid

OCCUPIED, FREE, UNEXPLORED = CellClass.OCCUPIED, CellClass.FREE, CellClass.UNEXPLORED


def _joined(cells, other):
    """Whether the same pairs of the other cells are joined by cells, as a set of frozen groups."""
    label_of, count = ndimage.label(cells)
    groups = [frozenset(np.flatnonzero((label_of == n) & other)) for n in range(1, count + 1)]
    return {group for group in groups if group}


@given(class_grids(20), st.floats(0, 30))
def test_dropping_makes_nothing_free_and_keeps_every_large_free_set(classes, least_m2):
    grid = occupancy_grid(classes)
    left = hn.drop_islands(grid, least_m2)
    assert (left.measured == grid.measured).all()
    before, after = grid.classes, left.classes
    assert (before[after == FREE] == FREE).all()
    assert (after[before == OCCUPIED] == OCCUPIED).all()
    assert (after[before == UNEXPLORED] != FREE).all()
    label_of, count = ndimage.label(before == FREE)
    for number in range(1, count + 1):
        island = label_of == number
        kept = np.count_nonzero(island) >= least_m2
        assert (after[island] == FREE).all() == kept
        assert kept or (after[island] != FREE).all()


@given(class_grids(20), st.floats(0, 30))
def test_what_is_joined_stays_joined_also_through_unexplored_cells(classes, least_m2):
    grid = occupancy_grid(classes)
    left = hn.drop_islands(grid, least_m2)
    free = left.classes == FREE
    assert _joined(grid.classes != OCCUPIED, free) == _joined(left.classes != OCCUPIED, free)


@given(class_grids(20), st.floats(0, 30))
def test_what_is_dropped_is_counted(classes, least_m2):
    grid = occupancy_grid(classes)
    left = hn.drop_islands(grid, least_m2)
    if least_m2 == 0:
        assert left.dropped is None
        return
    counted, before, after = left.dropped, grid.classes, left.classes
    areas = np.bincount(ndimage.label(before == FREE)[0].ravel())[1:]
    assert counted.free == np.count_nonzero(areas < least_m2)
    assert counted.free_cells == np.count_nonzero((before == FREE) & (after != FREE))
    closed = (before != OCCUPIED) & (after == OCCUPIED)
    assert counted.closed_cells == np.count_nonzero(closed)
    assert counted.unexplored_cells == np.count_nonzero(closed & (before == UNEXPLORED))
    assert counted.unexplored <= counted.unexplored_cells
    assert sum(left.class_counts().values()) == before.size


RAW = (
    "#########",
    "#..?....#",
    "#.......#",
    "#####?###",
    "#.......#",
    "#########",
    "#???.???#",
    "#########",
    "#.#..#?##",
)
"""Specks in a room, a bridge between two rooms, a ray in the unknown, slivers in a wall."""


def test_specks_go_and_a_bridge_stays():
    expected = drawn(
        "#########",
        "#..#....#",
        "#.......#",
        "#####?###",
        "#.......#",
        "#########",
        "#???????#",
        "#########",
        "#########",
    )
    left = hn.drop_islands(occupancy_grid(drawn(*RAW)), 4)
    np.testing.assert_array_equal(left.classes, expected)
    counted = hn.DroppedIslands(
        free=3, free_cells=4, unexplored=2, unexplored_cells=2, closed_cells=5
    )
    assert left.dropped == counted


def test_an_island_of_just_the_area_is_kept_whatever_the_resolution():
    lines = [line.replace("?", "#") for line in RAW]
    for resolution_m in (0.05, 0.1, 0.3, 1.0):
        grid = occupancy_grid(drawn(*lines), resolution_m=resolution_m)
        left = hn.drop_islands(grid, 7 * resolution_m**2)
        assert np.count_nonzero(left.classes == FREE) == 13 + 7
        more = hn.drop_islands(grid, 7.01 * resolution_m**2)
        assert np.count_nonzero(more.classes == FREE) == 13


def test_what_is_closed_does_not_inflate_and_a_copy_stays_without_islands():
    left = hn.drop_islands(occupancy_grid(drawn("......", "..?...", "......")), 2)
    for radius_m in (0.0, 1.0):
        again = replace(left, robot_radius_m=radius_m)
        assert again.classes.tolist() == left.classes.tolist()
        assert again.class_counts() == {
            "free": 17, "unexplored": 0, "occupied": 0, "blocked": 0, "closed": 1
        }  # fmt: skip


@pytest.mark.parametrize("area_m2", [-1.0, math.nan, math.inf])
def test_an_area_that_is_none_is_refused(area_m2):
    with pytest.raises(hn.errors.InvalidValueError, match="least area of an island"):
        hn.drop_islands(occupancy_grid(drawn("..")), area_m2)


@pytest.fixture
def raw_map(tmp_path):
    """The map above as a file, with cells of 1 m."""
    grey = {"#": 0, ".": 254, "?": 205}
    pixels = bytes(grey[letter] for line in RAW for letter in line)
    (tmp_path / "m.pgm").write_bytes(b"P5\n%d %d\n255\n" % (len(RAW[0]), len(RAW)) + pixels)
    path = tmp_path / "raw.yaml"
    path.write_text(
        "image: m.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


POINT = ("--robot-radius", "0")
TOLD = "islands    below 4 m² dropped: 3 free (4 cells), 2 unexplored (2 cells)"


def test_the_command_states_what_it_dropped(raw_map, capsys):
    assert run(["show", str(raw_map), *POINT, "--least-island", "4"]) == 0
    shown = capsys.readouterr().out
    assert TOLD in shown
    assert "0 blocked by a robot radius of 0 m, 5 closed with islands" in shown
    query = ["plan", str(raw_map), "--start", "1.5,6.5", "--goal", "7.5,7.5", *POINT]
    assert run([*query, "--least-island", "4"]) == 0
    assert TOLD in capsys.readouterr().out
    assert run([*query, "--least-island", "4", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["dropped_islands"] == {
        "least_area_m2": 4.0, "free": 3, "free_cells": 4,
        "unexplored": 2, "unexplored_cells": 2, "closed_cells": 5,
    }  # fmt: skip
    assert run([*query, "--json"]) == 0
    whole = json.loads(capsys.readouterr().out)
    assert whole["dropped_islands"] is None
    assert whole["length_m"] == figures["length_m"]
    assert run(["rooms", str(raw_map), *POINT, "--least-island", "4"]) == 0
    assert TOLD in capsys.readouterr().out


def test_an_area_that_leaves_no_free_cell_is_told_as_that(raw_map, capsys):
    assert run(["show", str(raw_map), *POINT, "--least-island", "99"]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert (
        told.err == "hybridnav: --least-island 99 leaves no free cell on raw: give a smaller area\n"
    )
    assert run(["show", str(raw_map), "--least-island", "nan"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.filterwarnings("default::hybridnav.errors.MapWarning")
def test_thresholds_of_the_command_win_over_the_maps(raw_map, capsys):
    thresholds = ["--free-threshold", "0.2", "--occupied-threshold", "0.9"]
    assert run(["show", str(raw_map), *POINT, *thresholds]) == 0
    told = capsys.readouterr()
    assert "cells      33 free, 0 unexplored, 48 occupied" in told.out
    assert "count as free at a free threshold of 0.2" in told.err
    assert run(["show", str(raw_map), *POINT, "--free-threshold", "0.7"]) == 2
    assert "free_thresh must be at most occupied_thresh" in capsys.readouterr().err


def test_smooth_wins_over_the_preset(raw_map, capsys):
    query = ["plan", str(raw_map), "--start", "1.5,6.5", "--goal", "7.5,7.5", *POINT, "--json"]
    assert run([*query, "--smooth", "line-of-sight"]) == 2
    assert "planner.smooth: no key of method shortest, but of " in capsys.readouterr().err
    query += ["--preset", "octile"]
    assert run([*query, "--smooth", "line-of-sight"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["metric"] == "any-angle"
    assert figures["length_m"] == pytest.approx(math.hypot(6, 1))
    assert run([*query, "--set", "planner.smooth=line-of-sight", "--smooth", "none"]) == 0
    assert json.loads(capsys.readouterr().out)["metric"] == "octile"
    assert run([*query, "--smooth", "splines"]) == 2
    assert (
        "--smooth must be one of none, line-of-sight, arcs, got 'splines'"
        in capsys.readouterr().err
    )


def test_an_area_may_leave_unexplored_cells_alone_where_they_may_be_entered(tmp_path, capsys):
    (tmp_path / "m.pgm").write_bytes(b"P5\n8 4\n255\n" + b"\xfe" + b"\xcd" * 31)
    path = tmp_path / "m.yaml"
    path.write_text(
        "image: m.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    query = ["plan", str(path), "--start", "1.5,0.5", "--goal", "6.5,2.5", *POINT]
    query += ["--preset", "grid-astar", "--least-island", "4"]
    assert run(query) == 2
    assert run([*query, "--set", "planner.allow_unexplored=true"]) == 0
    assert "leaves no free cell" in capsys.readouterr().err
