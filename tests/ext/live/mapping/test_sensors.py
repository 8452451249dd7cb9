"""Simulated sensors: readings against every cell of the map, and maps made of them."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import distance_transform_edt

import hybridnav as hn
from hybridnav.ext.live.mapping import LaserModel, Mapper, SimulatedLaser
from tests.layers import grid_of
from tests.oracle.beams import position
from tests.strategies import tried

LASER: Any = SimulatedLaser
"""To be called with values of wrong types."""
WORLDS = arrays(np.bool_, st.tuples(st.integers(1, 8), st.integers(1, 8)))
FAR_M = 10.0


def entry(cell: Any, start: Any, direction: Any) -> float:
    """Return where a ray enters a cell of side 1, infinite if it misses its inside."""
    low, high = 0.0, math.inf
    for axis in range(2):
        sides = cell[axis] - start[axis], cell[axis] + 1 - start[axis]
        if abs(direction[axis]) < 1e-12:
            if not sides[0] < 0 < sides[1]:
                return math.inf
            continue
        first, second = sorted(side / direction[axis] for side in sides)
        low, high = max(low, first), min(high, second)
    return low if low < high else math.inf


@tried(
    150,
    WORLDS,
    st.floats(-1, 9),
    st.floats(-1, 9),
    st.floats(-4, 4),
    st.sampled_from([0.0, 0.5, -2.0]),
)
def test_a_beam_runs_to_the_first_occupied_cell(world, row, col, heading, yaw):
    frame = hn.Frame(0.5, (3.0, -2.0), yaw)
    grid = grid_of(np.where(world, 1.0, 0.0), frame, robot_radius_m=0)
    x, y = frame.points_of_grid([row, col]).tolist()
    laser = SimulatedLaser(n_beams=5, start_rad=0.0, step_rad=1.0, max_range_m=FAR_M)
    found = laser.scan(grid, (x, y, heading)).ranges_m
    start = [position(cells) / 2**16 for cells in frame.position_of(x, y)]
    for k, reading in enumerate(found.tolist()):

        def reach(turn: float, k: int = k) -> float:
            angle = heading + k - yaw + turn
            direction = math.sin(angle), math.cos(angle)
            hits = [entry(cell, start, direction) for cell in np.argwhere(world).tolist()]
            nearest = min(hits, default=math.inf) * 0.5
            return nearest if nearest < FAR_M else math.inf

        # Ends are rounded to 2^-16 of a cell: a ray that grazes a corner may go either way.
        assert any(reading == pytest.approx(reach(turn), abs=1e-3) for turn in (0.0, 1e-5, -1e-5))


def driven(sensor: SimulatedLaser, world: hn.OccupancyGrid) -> hn.OccupancyGrid:
    """Map a world from poses on a ring of free cells, with noise."""
    mapper = Mapper(resolution_m=world.resolution_m, laser=LaserModel(clear_range_m=2.0))
    noise = np.random.default_rng(1)
    free = np.argwhere(distance_transform_edt(world.measured == hn.CellClass.FREE) > 4)
    for row, col in noise.permutation(free)[:150].tolist():
        x, y = world.frame.points_of([row, col]).tolist()
        assert mapper.add(sensor.scan(world, (x, y, noise.uniform(-4, 4)), seed=noise))
    return mapper.to_grid(robot_radius_m=0)


def office() -> hn.OccupancyGrid:
    """A part of the office, with rooms, doors and walls."""
    whole = hn.example_map("office", robot_radius_m=0)
    return hn.OccupancyGrid(whole.probability[150:400, 150:450], hn.Frame(0.05), robot_radius_m=0)


def test_a_map_of_simulated_scans_is_the_world() -> None:
    """What the map calls free is free, and nine tenths of what it calls occupied are at a wall."""
    world = office()
    mapped = driven(SimulatedLaser(noise_m=0.01), world)

    def true_cells(kind: hn.CellClass) -> Any:
        cells = np.argwhere(mapped.measured == kind)
        there = world.frame.cells_of(mapped.frame.points_of(cells))
        return there[((there >= 0) & (there < world.shape)).all(axis=1)].T

    free, occupied = (true_cells(kind) for kind in (hn.CellClass.FREE, hn.CellClass.OCCUPIED))
    assert free.shape[1] * 0.05**2 > 140.0
    assert (world.measured[tuple(free)] == hn.CellClass.OCCUPIED).mean() < 1e-3
    wall_m = distance_transform_edt(world.measured != hn.CellClass.OCCUPIED) * 0.05
    assert np.quantile(wall_m[tuple(occupied)], 0.9) <= 0.05


def test_noise_depends_on_the_seed_alone() -> None:
    grid, laser = office(), SimulatedLaser(noise_m=0.1)
    first, second = (laser.scan(grid, (5.0, 5.0, 0.0), seed=3).ranges_m for _ in range(2))
    assert np.array_equal(first, second)
    other = laser.scan(grid, (5.0, 5.0, 0.0), seed=4).ranges_m
    assert not np.array_equal(first, other)


@pytest.mark.parametrize(
    "make",
    [
        lambda: SimulatedLaser(n_beams=0),
        lambda: SimulatedLaser(max_range_m=math.inf),
        lambda: SimulatedLaser(noise_m=-1.0),
        lambda: SimulatedLaser().scan(office(), (math.nan, 0.0, 0.0)),
        lambda: SimulatedLaser(max_range_m=1e5).scan(office(), (0.0, 0.0, 0.0)),
        lambda: LASER(n_beams=1.5),
        lambda: LASER(max_range_m="far"),
        lambda: LASER(noise_m=None),
        lambda: LASER(step_rad=[]),
        lambda: LASER().scan("office", (0.0, 0.0, 0.0)),
        lambda: LASER().scan(office(), "here"),
        lambda: LASER().scan(office(), (0.0, 0.0, 0.0), seed="noise"),
    ],
)
def test_values_out_of_range_are_refused(make: Any) -> None:
    with pytest.raises(hn.errors.InvalidValueError) as refused:
        make()
    assert "\n" not in str(refused.value)
