"""The frame alone converts between cells and metres: one point, many, and in kernels alike."""

from __future__ import annotations

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.maps.centres import position_of

FRAMES = [
    hn.Frame(),
    hn.Frame(0.05, (-3.0, 7.5), 0.3),
    hn.Frame(0.1, (4e5, -5e6), -2.5),
]
POSITIONS = np.random.default_rng(3).uniform(-40, 40, (4, 5, 2))


@pytest.mark.parametrize("frame", FRAMES)
def test_positions_come_back_from_their_points_in_any_shape(frame: hn.Frame) -> None:
    points = frame.points_of_grid(POSITIONS)
    assert frame.positions_of(points) == pytest.approx(POSITIONS, abs=1e-6)
    assert np.array_equal(frame.positions_of(points[1]), frame.positions_of(points)[1])
    assert np.array_equal(frame.cells_of(points), np.floor(POSITIONS))


@pytest.mark.parametrize("frame", FRAMES)
def test_one_point_is_converted_like_many_and_in_kernels(frame: hn.Frame) -> None:
    points = frame.points_of_grid(POSITIONS).reshape(-1, 2)
    many = frame.positions_of(points)
    assert np.array_equal([frame.position_of(x, y) for x, y in points.tolist()], many)
    assert np.array_equal([position_of(x, y, frame.for_kernels) for x, y in points], many)


@pytest.mark.parametrize("frame", FRAMES)
def test_axes_and_rates_describe_one_cell_and_one_metre(frame: hn.Frame) -> None:
    corner, up, along = frame.points_of_grid([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert frame.axes_m == pytest.approx(np.stack([up, along]) - corner, abs=1e-8)
    metre = frame.positions_of(corner + np.eye(2)) - frame.positions_of(corner)
    assert frame.per_metre == pytest.approx(metre.T, abs=1e-6)
