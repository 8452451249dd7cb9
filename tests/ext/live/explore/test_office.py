"""The map that the robot made of the office: made anew, it is the committed one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.live.explore import explore

MAPS = Path(__file__).parents[4] / "maps"
MADE = MAPS / "office-explored" / "office-explored.yaml"
RADIUS_M = 0.25


@pytest.mark.full
def test_the_committed_map_is_what_the_robot_makes(cli: Any, tmp_path: Path) -> None:
    office, again = MAPS / "office" / "office.yaml", tmp_path / "office-explored.yaml"
    options = ("--robot-radius", RADIUS_M, "--start", "6,17.2", "-o", again)
    assert cli("explore", office, *options).code == 0
    made, committed = (hn.load_map(file, robot_radius_m=RADIUS_M) for file in (again, MADE))
    assert made.frame == committed.frame
    assert np.array_equal(made.probability, committed.probability, equal_nan=True)


@pytest.mark.full
def test_noise_that_closes_a_gap_behind_the_robot_does_not_end_it() -> None:
    office = hn.example_map("office", robot_radius_m=RADIUS_M)
    done = explore(office, (6.0, 17.2), by="frontier")  # it drives in between two shelves
    assert done.share_known == 1.0


def test_the_explored_office_agrees_with_the_office_off_its_walls() -> None:
    made = hn.load_map(MADE, robot_radius_m=0)
    office = hn.example_map("office", robot_radius_m=RADIUS_M)
    walls = np.where(office.measured == hn.CellClass.FREE, np.float32(0.0), np.float32(1.0))
    plan = replace(office, probability=walls)  # to the robot, what is not free is a wall
    free = np.argwhere(plan.classes == hn.CellClass.FREE)  # no wall within the radius
    rows, cols = made.frame.cells_of(office.frame.points_of(free)).T
    inside = (rows >= 0) & (cols >= 0) & (rows < made.shape[0]) & (cols < made.shape[1])
    found = made.measured[rows[inside], cols[inside]]
    assert (found == hn.CellClass.OCCUPIED).sum() == 0
    assert (found == hn.CellClass.FREE).sum() > 0.98 * len(free)
