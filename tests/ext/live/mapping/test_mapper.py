"""Grids from scans: every cell against the definition, growth, order, hostile values."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.live.mapping import LaserModel, LaserScan, Mapper, ScanSequence
from tests.oracle.beams import kinds_of_cells
from tests.strategies import tried

HIT, PASSED = math.log(0.95 / 0.05), math.log(0.19 / 0.81)
LIMIT = math.log(0.98 / 0.02)

_READINGS = st.one_of(
    st.floats(0.0, 6.0),
    st.sampled_from([0.0, 0.05, 1.0, 2.5, 4.0, math.inf, math.nan, -math.inf, -1.0, 1e300, 5e-324]),
)


@st.composite
def scans(draw: Any, reach: float = 3.0) -> LaserScan:
    """A scan with any readings, at a pose near the origin, often on lines of the lattice."""
    place = st.one_of(st.floats(-reach, reach), st.sampled_from([0.0, 0.5, 1.0, -0.25, 0.3]))
    turn = st.one_of(st.floats(-4, 4), st.sampled_from([0.0, math.pi / 2, math.pi / 4, 1e9]))
    return LaserScan(
        np.array(draw(st.lists(_READINGS, min_size=1, max_size=12))),
        pose=(draw(place), draw(place), draw(turn)),
        start_rad=draw(st.sampled_from([0.0, -math.pi / 2, 0.1])),
        step_rad=draw(st.sampled_from([0.0, math.pi / 4, 0.01, 0.5])),
        max_range_m=draw(st.sampled_from([math.inf, 4.0])),
    )


def odd(scan: LaserScan) -> LaserScan:
    """The scan from an odd place, with odd readings."""
    x, y, heading_rad = scan.pose
    pose = x + 0.0123456, y + 0.0234567, math.fmod(heading_rad, 7) + 0.0345678
    return replace(scan, pose=pose, ranges_m=scan.ranges_m + 0.00456789)


MODELS = st.builds(
    LaserModel,
    max_range_m=st.just(5.0),
    min_range_m=st.sampled_from([0.0, 0.5]),
    clear_range_m=st.sampled_from([0.0, 2.0, 5.0]),
    tolerance_m=st.sampled_from([0.0, 0.1, 1.0]),
    depth_m=st.sampled_from([0.0, 0.05, 0.4]),
    hits_win=st.booleans(),
)


def expected_evidence(given_scans: list[LaserScan], model: LaserModel, side_m: float) -> Any:
    evidence: dict[tuple[int, int], np.float32] = {}
    for scan in given_scans:
        hits, passed = kinds_of_cells(scan, model, side_m)
        for cells, change in ((hits, HIT), (passed, PASSED)):
            for cell in cells:
                total = evidence.get(cell, np.float32(0)) + np.float32(change)
                evidence[cell] = np.clip(total, np.float32(-LIMIT), np.float32(LIMIT))
    return evidence


@tried(120, st.lists(scans(), min_size=1, max_size=4), MODELS, st.sampled_from([0.25, 0.3, 1.0]))
def test_every_cell_has_the_evidence_of_the_definition(given_scans, model, side_m):
    mapper = Mapper(resolution_m=side_m, laser=model)
    for scan in given_scans:
        assert mapper.add(scan)
    expected = expected_evidence(given_scans, model, side_m)
    assert mapper.has_cells == bool(expected)
    if not expected:
        with pytest.raises(hn.errors.InvalidValueError, match="at least one scan"):
            mapper.to_grid()
        return
    grid = mapper.to_grid(robot_radius_m=0)
    first_row = round(grid.frame.origin_m[1] / side_m)
    first_col = round(grid.frame.origin_m[0] / side_m)
    found = {
        (first_row + row, first_col + col): grid.probability[row, col]
        for row, col in np.argwhere(~np.isnan(grid.probability)).tolist()
    }
    assert found.keys() == expected.keys()
    for cell, evidence in expected.items():
        assert found[cell] == pytest.approx(1 / (1 + math.exp(-evidence)), abs=1e-6)


@tried(60, st.lists(scans(reach=60.0), min_size=1, max_size=5))
def test_a_grid_that_grew_is_one_that_was_large_from_the_start(given_scans):
    grown = Mapper(resolution_m=0.25)
    large = Mapper(resolution_m=0.25)
    no_return = np.array([math.inf])
    for x, y in ((-99.0, -99.0), (99.0, 99.0)):
        assert large.add(LaserScan(no_return, (x, y, 0.0), start_rad=0.0, step_rad=0.0))
    for scan in given_scans:
        assert grown.add(scan)
        assert large.add(scan)
    assert grown.has_cells == large.has_cells
    if grown.has_cells:
        first, second = grown.to_grid(), large.to_grid()
        assert first.frame == second.frame
        assert np.array_equal(first.probability, second.probability, equal_nan=True)


@pytest.mark.parametrize(("hits_win", "between"), [(True, 0.95), (False, 0.19)])
def test_a_scan_counts_once_for_a_cell_and_its_model_says_as_what(*, hits_win, between):
    """Three beams along a row: two pass the cell in which the third one ends, to a wall."""
    scan = LaserScan(np.array([5.0, 3.0, 5.0]), (0.5, 0.5, 0.0), start_rad=0, step_rad=0)
    model = LaserModel(tolerance_m=0.0, hits_win=hits_win)
    mapper = Mapper(resolution_m=1.0, laser=model)
    mapper.add(scan)
    row = mapper.to_grid().probability[0]
    assert row == pytest.approx([0.19, 0.19, 0.19, between, 0.19, 0.95])


@tried(60, st.lists(scans(), min_size=1, max_size=3), MODELS, st.floats(-7.0, 7.0))
def test_a_turned_lattice_is_that_of_turned_scans(given_scans, model, yaw_rad):
    """Odd places, so that rounding moves no end of a beam over a side of a cell."""
    corner, (cosine, sine) = (0.7, -3.1), (math.cos(yaw_rad), math.sin(yaw_rad))
    level = Mapper(resolution_m=0.25, laser=model)
    turned = Mapper(resolution_m=0.25, laser=model, corner_m=corner, yaw_rad=yaw_rad)
    for scan in (odd(scan) for scan in given_scans):
        x, y, heading = scan.pose
        at = corner[0] + cosine * x - sine * y, corner[1] + sine * x + cosine * y
        area = turned.add(replace(scan, pose=(*at, heading + yaw_rad)))
        box = level.add(scan)
        assert area is not None
        assert box is not None
        corners = [(x, y) for x in box[::2] for y in box[1::2]]
        back = [(cosine * x - sine * y, sine * x + cosine * y) for x, y in corners]
        bounds = np.array([np.min(back, axis=0), np.max(back, axis=0)]) + corner
        assert np.reshape(area, (2, 2)) == pytest.approx(bounds, abs=1e-5)
    assert turned.has_cells is level.has_cells
    if not level.has_cells:
        return
    first, second = level.to_grid(robot_radius_m=0), turned.to_grid(robot_radius_m=0)
    assert second.frame.yaw_rad == yaw_rad
    assert first.probability == pytest.approx(second.probability, abs=1e-6, nan_ok=True)
    cells = np.argwhere(~np.isnan(first.probability))
    x, y = first.frame.points_of(cells).T
    there = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1) + corner
    assert np.array_equal(second.frame.cells_of(there), cells)
    low, high = there.min(axis=0), there.max(axis=0)
    part = turned.to_grid(area=(*low, *high), robot_radius_m=0)
    assert np.array_equal(part.probability, second.probability, equal_nan=True)


def test_a_door_that_opens_becomes_free_after_some_scans() -> None:
    def beam(reach: float) -> LaserScan:
        return LaserScan(np.array([reach]), (0.5, 0.5, 0.0), start_rad=0, step_rad=0)

    mapper = Mapper(resolution_m=1.0)
    for _ in range(1000):
        mapper.add(beam(3.0))
    assert mapper.to_grid().measured[0, 3] == hn.CellClass.OCCUPIED
    for _ in range(4):
        mapper.add(beam(8.0))
    assert mapper.to_grid().measured[0, 3] == hn.CellClass.FREE


def test_beams_without_a_return_are_no_obstacles() -> None:
    beams = LaserScan(np.array([30.0, np.inf, 81.9]), (0, 0, 0), start_rad=0, step_rad=1)
    mapper = Mapper()
    assert mapper.add(beams)
    assert not mapper.has_cells
    clearing = Mapper(laser=LaserModel(clear_range_m=2.0))
    assert clearing.add(beams)
    counts = clearing.to_grid(robot_radius_m=0).class_counts()
    assert counts["occupied"] == 0
    assert counts["free"] > 100


def test_a_scan_that_needs_too_many_cells_changes_nothing() -> None:
    mapper = Mapper(resolution_m=0.1, max_cells=10_000)
    near = LaserScan(np.full(4, 2.0), (0, 0, 0), start_rad=0, step_rad=1)
    far = LaserScan(np.full(4, 2.0), (1e8, -1e8, 0), start_rad=0, step_rad=1)
    assert mapper.add(near)
    assert mapper.add(near)
    before = mapper.to_grid()
    assert mapper.add(far) is None
    assert mapper.n_scans == 2
    assert np.array_equal(mapper.to_grid().probability, before.probability, equal_nan=True)
    assert mapper.add(near)


def test_a_wrong_first_pose_does_not_cost_the_map() -> None:
    mapper, alone = Mapper(resolution_m=0.1, max_cells=10_000), Mapper(resolution_m=0.1)
    near = LaserScan(np.full(4, 2.0), (0, 0, 0), start_rad=0, step_rad=1)
    far = LaserScan(np.full(4, 2.0), (1e8, -1e8, 0), start_rad=0, step_rad=1)
    alone.add(near)
    alone.add(near)
    assert mapper.add(far)
    assert mapper.add(near)
    assert mapper.n_scans == 1
    assert mapper.add(near)
    assert not mapper.add(far)
    assert mapper.n_scans == 2
    found, expected = mapper.to_grid(), alone.to_grid()
    assert found.frame == expected.frame
    assert np.array_equal(found.probability, expected.probability, equal_nan=True)


@tried(60, st.lists(scans(reach=20.0), min_size=1, max_size=4), MODELS)
def test_a_scan_changes_cells_of_its_area_alone(given_scans, model):
    """The area lies on sides of cells, and shrinks to what the cells of the next grid need."""
    corner_m = (0.1, -0.2)
    mapper = Mapper(resolution_m=0.25, laser=model, corner_m=corner_m)
    frame = hn.Frame(0.25, (corner_m[0] - 50.0, corner_m[1] - 50.0))

    def evidence() -> Any:
        whole = np.full((400, 400), np.nan, np.float32)
        if mapper.has_cells:
            grid = mapper.to_grid(robot_radius_m=0)
            row, col = frame.cells_of(grid.frame.points_of([0, 0]))
            whole[row : row + grid.shape[0], col : col + grid.shape[1]] = grid.probability
        return whole

    for scan in given_scans:
        before, area = evidence(), mapper.add(scan)
        after = evidence()
        assert area is not None
        changed = ~((before == after) | (np.isnan(before) & np.isnan(after)))
        low, high = (np.round(frame.positions_of(np.array(at)), 6) for at in (area[:2], area[2:]))
        cells = np.argwhere(changed)
        assert (cells >= low).all()
        assert (cells + 1 <= high).all()
        if len(cells):
            assert (low == np.floor(low)).all()
            assert (high - low <= 2 * np.array(model.max_range_m / 0.25 + 2)).all()


def test_a_mapper_refuses_what_is_no_scan() -> None:
    wrong: list[Any] = [None, np.ones(3), "scan"]
    for thing in wrong:
        with pytest.raises(hn.errors.InvalidValueError, match="make a LaserScan") as refused:
            Mapper().add(thing)
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize("far_m", [1e6, 1e9])
def test_cells_far_from_the_origin_stay_on_the_lattice(far_m: float) -> None:
    mapper = Mapper(resolution_m=0.5, corner_m=(far_m, -far_m))
    mapper.add(LaserScan(np.array([3.0]), (far_m - 0.75, -far_m + 0.25, 0), 0.0, 0.0))
    grid = mapper.to_grid(robot_radius_m=0)
    assert grid.frame.origin_m == pytest.approx((far_m - 1.0, -far_m))
    assert grid.measured[0, -1] == hn.CellClass.OCCUPIED


BAD_SCANS: dict[str, Any] = {
    "no ranges": {"ranges_m": np.array([])},
    "a table": {"ranges_m": np.ones((2, 2))},
    "no place": {"pose": (math.nan, 0.0, 0.0)},
    "endless turn": {"pose": (0.0, 0.0, math.inf)},
    "too far": {"pose": (1e10, 0.0, 0.0)},
    "step": {"step_rad": 1e308},
    "range": {"max_range_m": math.nan},
    "words": {"ranges_m": "far"},
    "lists of two lengths": {"ranges_m": [[1.0], [1.0, 2.0]]},
    "no pose": {"pose": None},
    "a position": {"pose": (0.0, 0.0)},
    "no angle": {"start_rad": "left"},
    "no time": {"time_s": []},
}


@pytest.mark.parametrize("change", BAD_SCANS.values(), ids=BAD_SCANS)
def test_a_scan_refuses_values_that_are_none(change: dict[str, Any]) -> None:
    fine = {"ranges_m": np.ones(3), "pose": (0.0, 0.0, 0.0), "start_rad": 0.0, "step_rad": 0.1}
    with pytest.raises(hn.errors.InvalidValueError) as refused:
        LaserScan(**{**fine, **change})
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "values",
    [
        {"when_hit": 0.5},
        {"when_passed": 0.0},
        {"max_range_m": math.inf},
        {"min_range_m": 40.0},
        {"clear_range_m": 31.0},
        {"tolerance_m": -1.0},
        {"depth_m": math.nan},
        {"hits_win": "always"},
        {"max_range_m": "far"},
        {"when_hit": None},
    ],
)
def test_a_laser_refuses_settings_out_of_range(values: dict[str, Any]) -> None:
    with pytest.raises(hn.errors.InvalidValueError):
        LaserModel(**values)


def corridor(*readings: float) -> Callable[..., float]:
    """The occupancy of the cell 3 m ahead after scans of one beam each."""

    def occupancy(**settings: Any) -> float:
        mapper = Mapper(resolution_m=1.0, **settings)
        for reading in readings:
            mapper.add(
                LaserScan(np.array([reading]), pose=(0.5, 0.5, 0.0), start_rad=0.0, step_rad=0.0)
            )
        return float(mapper.to_grid(robot_radius_m=0).probability[0, 3])

    return occupancy


def test_without_a_limit_all_scans_count_alike() -> None:
    """A hundred scans pass through a door, then three hit it."""
    occupancy = corridor(*[6.0] * 100, *[3.0] * 3)
    assert occupancy() > 0.9
    assert occupancy(least_probability=0.0) < 1e-6
    odds = 100 * PASSED + 3 * HIT
    assert occupancy(least_probability=1e-300) == pytest.approx(1 / (1 + math.exp(-odds)))
    evenly = corridor(*[6.0, 3.0] * 2000)
    assert evenly(least_probability=0.0) == 1.0
    for least in (-0.1, 0.5, math.nan):
        with pytest.raises(hn.errors.InvalidValueError, match="least_probability"):
            Mapper(least_probability=least)


def test_a_scan_without_a_reading_leaves_the_grid_where_later_ones_need_it() -> None:
    mapper = Mapper(resolution_m=0.1, max_cells=1_000_000)
    none, far = np.full(3, np.nan), (5000.0, 0.0, 0.0)
    assert mapper.add(LaserScan(none, pose=far, start_rad=0.0, step_rad=0.1))
    assert not mapper.has_cells
    near = LaserScan(np.full(3, 2.0), pose=(0.0, 0.0, 0.0), start_rad=0.0, step_rad=0.1)
    assert mapper.add(near)
    assert mapper.has_cells


@pytest.mark.parametrize(
    "values",
    [
        {"resolution_m": 0.0},
        {"resolution_m": 1e-4},
        {"corner_m": (math.nan, 0.0)},
        {"max_cells": 0},
        {"max_cells": "many"},
        {"resolution_m": "fine"},
        {"corner_m": 3},
        {"yaw_rad": math.inf},
        {"yaw_rad": "left"},
        {"laser": LaserModel(depth_m=1e9)},
        {"laser": "SICK"},
    ],
)
def test_a_mapper_refuses_settings_out_of_range(values: dict[str, Any]) -> None:
    with pytest.raises(hn.errors.InvalidValueError):
        Mapper(**values)


def test_a_map_of_an_area_is_cut_out_of_the_whole_one():
    mapper = Mapper(resolution_m=0.5, corner_m=(0.25, 0.0))
    mapper.add(LaserScan(np.full(60, 4.0), pose=(1.0, 2.0, 0.3), start_rad=0.0, step_rad=0.1))
    whole, part = mapper.to_grid(), mapper.to_grid(area=(0.3, 1.1, 2.0, 3.4))
    rows, cols = whole.frame.cells_of(part.frame.points_of(np.argwhere(part.probability >= 0))).T
    assert part.shape == (5, 4)
    assert np.array_equal(part.probability.ravel(), whole.probability[rows, cols])
    with pytest.raises(hn.errors.InvalidValueError, match="at least one scan"):
        mapper.to_grid(area=(90.0, 90.0, 91.0, 91.0))
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"expected \(x_min, y_min, x_max, y_max\)"
    ):
        mapper.to_grid(area=(2.0, 1.0, 1.0, 2.0))


Short = tuple[float, float, int]


def faults(*scans: Short) -> list[str | None]:
    """The faults of scans `(x, time, beams)` in turn."""
    sequence = ScanSequence()
    return [
        sequence.fault_of(
            LaserScan(np.ones(n), (x, 0.0, 0.0), start_rad=0.0, step_rad=0.1, time_s=time_s)
        )
        for x, time_s, n in scans
    ]


JUMP, BACK, OTHER = "pose jumps", "time runs back", "other number of beams"


@pytest.mark.parametrize(
    ("scans", "expected"),
    [
        ([(0, 0, 5), (4, 0, 5), (8, 0, 5)], [None, None, None]),
        ([(0, 0, 5), (99, 1, 5), (1, 2, 5)], [None, JUMP, None]),
        ([(0, 0, 5), (99, 60, 5)], [None, None]),  # a long pause
        ([(0, 5, 5), (0, 4, 5), (0, 6, 5)], [None, BACK, None]),
        ([(0, 900, 5), (0, 1, 5), (0, 2, 5), (0, 3, 5)], [None, BACK, None, None]),  # a new clock
        ([(0, 0, 5), (0, 1, 4), (0, 2, 5)], [None, OTHER, None]),
        ([(0, 0, 4), (0, 1, 5), (0, 2, 5), (0, 3, 4)], [None, OTHER, None, OTHER]),
        ([(0, math.nan, 5), (9, math.nan, 5), (1, 3, 5)], [None, JUMP, None]),
        ([(0, 0, 5), (99, 1, 5), (-99, 2, 5), (0, 3, 5)], [None, JUMP, JUMP, None]),
    ],
)
def test_a_fault_costs_one_scan_and_a_new_beginning_holds(scans, expected):
    assert faults(*scans) == expected
