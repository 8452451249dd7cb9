"""Kernels of the pyramid are compiled for one set of types."""

from __future__ import annotations

import os

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

import hybridnav as hn
from hybridnav.pyramid.kernels import base as _base_kernels
from tests.strategies import occupancy_grid


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled")
def test_a_pyramid_with_rooms_is_built_by_the_same_kernels() -> None:
    grid = occupancy_grid(np.ones((8, 64), np.uint8))
    label_of = np.where(np.arange(64) < 32, 0, 1) + np.zeros((8, 1), np.int32)
    hn.DualGraphPyramid.build(grid)
    kernels = [
        kernel for kernel in vars(_base_kernels).values() if isinstance(kernel, CPUDispatcher)
    ]
    before = [kernel.signatures for kernel in kernels]
    hn.DualGraphPyramid.build(grid, rooms=hn.RoomLabels(("west", "east"), label_of))
    assert [kernel.signatures for kernel in kernels] == before
