"""MovingAI maps that are written."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings

import hybridnav as hn
from tests.strategies import class_grids, drawn, examples, occupancy_grid

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("maps")


@given(class_grids())
@settings(max_examples=examples(60))
def test_free_cells_survive_and_all_others_are_occupied(folder, classes):
    hn.write_movingai_map(occupancy_grid(classes), folder / "again.map")
    again = hn.load_map(folder / "again.map", robot_radius_m=0)
    free = classes == hn.CellClass.FREE
    assert np.array_equal(again.measured == hn.CellClass.FREE, free)
    assert np.array_equal(again.measured == hn.CellClass.OCCUPIED, ~free)


def test_a_file_that_was_read_is_written_with_equal_bytes(folder):
    text = "type octile\nheight 2\nwidth 3\nmap\n.@.\n@..\n"
    (folder / "one.map").write_text(text)
    grid = hn.load_map(folder / "one.map", robot_radius_m=5.0)
    hn.write_movingai_map(grid, folder / "two.map")
    assert (folder / "two.map").read_bytes() == text.encode()


def test_the_first_line_of_the_map_is_its_highest_row(folder):
    hn.write_movingai_map(occupancy_grid(drawn(".#?", "...")), folder / "rows.map")
    assert (folder / "rows.map").read_text().splitlines()[4:] == [".@@", "..."]


def test_what_cannot_be_written_is_refused(folder):
    grid = occupancy_grid(drawn("."))
    with pytest.raises(hn.MapError, match=r"must be named \.map"):
        hn.write_movingai_map(grid, folder / "map.txt")
    with pytest.raises(hn.MapError, match="cannot write"):
        hn.write_movingai_map(grid, folder / "none" / "one.map")
