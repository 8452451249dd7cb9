"""An interrupt at any moment of an update leaves the old version, or returns the new one."""

from __future__ import annotations

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.live import OnlinePyramid
from tests.interrupts import Struck, lines_of, timer
from tests.strategies import occupancy_grid


def state_of(version):
    """Return all that a version consists of."""
    state = version._state
    tiles = {
        key: [values.tobytes() for values in tile] for key, tile in state.tiles.arrays().items()
    }
    numbers = state.places.numbers()
    rows = state.places.read(numbers)
    columns = {name: rows[name].tolist() for name in rows.dtype.names}
    return tiles, numbers, columns, state.vertex_ends.tobytes()


@pytest.fixture
def change():
    """Return a version, and a grid on which places die, split and merge."""
    rng = np.random.default_rng(4)
    classes = np.where(rng.random((40, 90)) < 0.05, 0, 1).astype(np.uint8)
    grid = occupancy_grid(classes)
    changed = classes.copy()
    changed[10:14, 20:70] = 0
    changed[30:38, 5:60] = 1
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=8.0))
    return version, occupancy_grid(changed)


def test_an_interrupt_before_any_line_leaves_the_old_version(change):
    version, grid = change
    expected = state_of(version.update(grid).version)
    before = state_of(version)
    n_lines = lines_of(lambda: version.update(grid))
    rng = np.random.default_rng(0)
    for line in rng.integers(1, n_lines + 1, 40).tolist():
        with pytest.raises(Struck):
            lines_of(lambda: version.update(grid), strike_at=line)
        assert state_of(version) == before
    assert state_of(version.update(grid).version) == expected


def test_an_interrupt_by_a_timer_leaves_the_old_version_or_returns_the_new_one(change):
    version, grid = change
    expected = state_of(version.update(grid).version)
    before = state_of(version)
    struck = 0
    for delay_s in np.linspace(1e-4, 2e-2, 40).tolist():
        try:
            with timer(delay_s):
                after = version.update(grid).version
        except Struck:
            struck += 1
        else:
            assert state_of(after) == expected
        assert state_of(version) == before
    assert struck > 0
    assert state_of(version.update(grid).version) == expected
