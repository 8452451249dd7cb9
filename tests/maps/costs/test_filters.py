"""Costmap filters of Nav2 from their two messages."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.maps.costs import filter_costs
from tests.layers import grid_of

GRID = grid_of(np.zeros((1, 4)), robot_radius_m=0)
MASK = GRID.to_message("floor") | {"data": [0, -1, 40, 100]}
UNIT = 2.0**-14


def info(kind: Any, base: Any, multiplier: Any) -> Any:
    return SimpleNamespace(type=kind, base=base, multiplier=multiplier, filter_mask_topic="/mask")


@pytest.mark.parametrize(
    ("of", "full", "expected"),
    [
        (info(1, 100.0, -1.0), None, [1, 1, 100 / 60, 1]),  # 40 limits to 60 %, 100 to nothing
        (info(1, 0.0, 1.0), None, [1, 1, 100 / 40, 1]),  # the value is the percentage
        (info(2, 2.0, -0.015), 2.0, [1, 1, 2 / 1.4, 2 / 0.5]),
        (info(0, 0.0, 1.0), None, [1, 1, 1 + 2 * 102 / 252, 1]),  # 40 costs round(101.6)
    ],
)
def test_type_base_and_multiplier_are_read(of: Any, full: Any, expected: list[float]) -> None:
    layer = filter_costs(GRID, of, MASK, full_speed_mps=full)
    assert (np.abs(layer.factors[0] - expected) <= UNIT).all()
    closes = layer.keepout is not None
    assert closes == (of.type == 0)
    if layer.keepout is not None:
        assert layer.keepout.tolist() == [[False, False, False, True]]


def test_the_frame_of_the_mask_has_a_pose() -> None:
    # Half a turn about (4, 1): the last cell of the mask lies on the first one of the map.
    layer = filter_costs(GRID, info(0, 0, 1), MASK, pose=(4.0, 1.0, math.pi))
    assert layer.keepout is not None
    assert layer.keepout.tolist() == [[True, False, False, False]]


@pytest.mark.parametrize(
    ("of", "words"),
    [
        (info(3, 0, 1), "type must be 0"),
        (info(0.5, 0, 1), "type must be 0"),
        (info(math.nan, 0, 1), "type must be a finite number"),
        (info(0, 100.0, -1.0), "base and multiplier of a keepout filter must be 0 and 1"),
        (info(1, math.inf, 1), "base must be a finite number"),
        (info(1, 1, "1"), "multiplier must be a finite number"),
        (info(2, 1, 1), "full_speed_mps is needed"),
        ({}, "costmap filter info has no field type"),
        (None, "costmap filter info has no field type"),
    ],
)
def test_wrong_infos_are_refused_in_one_line(of: Any, words: str) -> None:
    with pytest.raises(hn.InvalidValueError, match=words):
        filter_costs(GRID, of, MASK)


def test_wrong_masks_are_refused_as_masks() -> None:
    with pytest.raises(hn.InvalidValueError, match="filter mask: data has 1 values"):
        filter_costs(GRID, info(0, 0, 1), MASK | {"data": [0]})
