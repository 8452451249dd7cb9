"""Scans that do not follow from those before."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hybridnav.ext.live.mapping import LaserScan, ScanSequence

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
def test_a_fault_costs_one_scan_and_a_new_beginning_holds(
    scans: list[Short], expected: list[str | None]
) -> None:
    assert faults(*scans) == expected
