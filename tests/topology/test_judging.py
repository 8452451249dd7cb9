"""The judge of boundaries between segments: what it sees, how it decides, how segments merge."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.topology.rooms.cutting import Ground, fine_segments, wall_directions
from hybridnav.topology.rooms.growing import Likely, Small, contract
from hybridnav.topology.rooms.judging import EVIDENCE, Forest, JudgedSegments
from tests.strategies import class_grids, occupancy_grid
from tests.topology.test_find_rooms import floor

NO_OUTSIDE = np.zeros((1, 1), dtype=bool)


def segments_of(free, label_of, resolution_m=0.1):
    grid = occupancy_grid(free.astype(np.uint8), resolution_m=resolution_m)
    return JudgedSegments(label_of.astype(np.int32), Ground.of(grid, NO_OUTSIDE))


def evidence_of(free, label_of):
    """The evidence on the one boundary of two segments, by name."""
    (row,) = segments_of(free, label_of).evidence(np.array([0]))
    return dict(zip(EVIDENCE, row.tolist(), strict=True))


def two_rooms():
    """Rooms of 4 m x 4 m with a door of 1 m in the wall between."""
    free = np.zeros((44, 86), dtype=bool)
    free[2:42, 2:42] = free[2:42, 44:84] = free[17:27, 42:44] = True
    label_of = np.where(free, 0, -1)
    label_of[:, 43:][free[:, 43:]] = 1
    return free, label_of


def corridor():
    """A corridor of 2 m x 16 m, and segments that meet in its middle."""
    free = np.zeros((24, 164), dtype=bool)
    free[2:22, 2:162] = True
    label_of = np.where(free, 0, -1)
    label_of[:, 82:][free[:, 82:]] = 1
    return free, label_of


def test_a_door_has_jambs_and_a_cut_through_a_corridor_has_walls_that_run_on():
    door, cut = evidence_of(*two_rooms()), evidence_of(*corridor())
    assert door["open_m"] == pytest.approx(1.0)
    assert door["jamb_low"] > 0.6
    assert cut["jamb_low"] < 0.2
    assert cut["open_m"] == pytest.approx(2.0)
    assert cut["flush_low"] > 0.9
    assert door["flush_low"] < 0.3
    assert cut["solid_both"] == pytest.approx(1.0, abs=0.02)
    assert cut["open_of_small_breadth"] > 0.9
    assert door["open_of_small_breadth"] < 0.5


def test_the_shipped_judge_keeps_a_door_and_joins_a_corridor():
    forest = Forest.shipped()
    for (free, label_of), n_rooms in ((two_rooms(), 2), (corridor(), 1)):
        segments = segments_of(free, label_of)
        contract(segments, [Likely(forest.judge, 0.5)])
        assert len(np.unique(segments.label_of[free])) == n_rooms


@given(seed=st.integers(0, 2**32 - 1))
def test_a_forest_adds_the_leaves_that_its_thresholds_lead_to(seed):
    rng = np.random.default_rng(seed)
    forest = Forest(
        rng.integers(0, 4, (5, 3)), rng.normal(size=(5, 3)), rng.normal(size=(5, 4)), 0.3
    )
    evidence = rng.normal(size=(6, 4))
    found = forest.judge(np.arange(6), evidence)
    for row, likely in zip(evidence, found, strict=True):
        odds = 0.3
        for features, thresholds, leaves in zip(
            forest.features, forest.thresholds, forest.leaves, strict=True
        ):
            low = int(row[features[0]] > thresholds[0])
            side = 1 + low
            odds += leaves[2 * low + int(row[features[side]] > thresholds[side])]
        assert likely == pytest.approx(1 / (1 + np.exp(-odds)))


@given(classes=class_grids(), seed=st.integers(0, 2**32 - 1))
def test_merged_segments_have_the_evidence_of_segments_that_were_never_apart(classes, seed):
    rng = np.random.default_rng(seed)
    free = classes == hn.CellClass.FREE
    label_of = np.where(free, rng.integers(0, 4, free.shape), -1)
    if not free.any():
        return
    segments = segments_of(free, label_of)
    contract(segments, [Likely(lambda pairs, _: rng.random(len(pairs)), 0.7)])
    again = segments_of(free, segments.label_of)
    state, fresh = segments.state, again.state
    kept = np.flatnonzero(state.versions >= 0)
    for name in ("free", "moments", "rims", "peaks", "opened", "hull_areas", "degrees"):
        assert getattr(fresh, name) == pytest.approx(getattr(state, name)[kept]), name
    alive = np.flatnonzero((state.endpoints[:, 0] >= 0) & (state.open_sides > 0))
    order = np.argsort(
        np.sort(np.searchsorted(kept, state.endpoints[alive]), axis=1) @ [len(kept), 1]
    )
    before = segments.evidence(alive[order])
    after = again.evidence(np.flatnonzero(fresh.open_sides > 0))
    sizes = np.sort(state.free[state.endpoints[alive[order]]], axis=1)
    differ = sizes[:, 0] != sizes[:, 1]  # else either may count as the smaller
    assert after[differ] == pytest.approx(before[differ])


def test_small_segments_go_to_the_neighbour_with_the_longest_open_border():
    free, label_of = corridor()
    label_of[2:22, 80:83] = 2
    label_of[2:8, 80] = 0  # a step makes its border there longer
    segments = segments_of(free, label_of)
    contract(segments, [Small(100)])
    merged = segments.label_of
    assert merged[12, 81] == merged[12, 40] != merged[12, 120]


def test_walls_are_found_in_every_direction_of_a_turned_wing():
    straight, _ = floor()
    turned, _ = floor(0.3)
    sides = [grid.measured == hn.CellClass.OCCUPIED for grid in (straight, turned)]
    rims = []
    for grid, occupied in zip((straight, turned), sides, strict=True):
        rims.append(Ground.of(grid, np.zeros(occupied.shape, dtype=bool)).wall)
    wide = np.zeros((700, 200), dtype=bool)
    wide[: rims[0].shape[0], : rims[0].shape[1]] = rims[0]
    wide[-rims[1].shape[0] :, : rims[1].shape[1]] = rims[1]
    found = sorted(angle for angle, _ in wall_directions(wide, 0.1))
    assert found == pytest.approx([0.0, 0.3], abs=0.01)


def test_a_bay_of_8_m_is_cut_from_its_corridor():
    free = np.zeros((104, 304), dtype=bool)
    free[2:22, 2:302] = True
    free[22:102, 102:182] = True
    grid = occupancy_grid(free.astype(np.uint8), resolution_m=0.1)
    found = fine_segments(Ground.of(grid, NO_OUTSIDE))
    bay, hall = np.unique(found[30:100, 105:180]), np.unique(found[3:20, 5:300])
    assert not set(bay.tolist()) & set(hall.tolist())
