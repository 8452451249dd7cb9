"""Entry points: what other packages add is found by name; what is not there is said in a line."""

from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav._base import extension
from hybridnav.maps.files import formats as loading


def read_text(path: Any, **reading: Any) -> hn.OccupancyGrid:
    """A format of another package: rows of digits, 1 for occupied."""
    lines = Path(path).read_text(encoding="utf-8").split()
    rows = [[float(digit) for digit in line] for line in lines]
    return hn.OccupancyGrid(np.array(rows), robot_radius_m=reading["robot_radius_m"])


@pytest.fixture
def text_maps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A package that registers the suffix `.digits`, installed for one test."""
    known = extension.extensions
    everything = {".digits": f"{__name__}:read_text"} | known("formats")

    def extensions(group: str) -> Any:
        return everything if group == "formats" else known(group)

    monkeypatch.setattr(loading, "extensions", extensions)
    monkeypatch.setattr(extension, "extensions", extensions)


@pytest.mark.usefixtures("text_maps")
def test_a_map_format_of_another_package_is_read_by_its_suffix(tmp_path: Any) -> None:
    (tmp_path / "cells.digits").write_text("010\n000\n")
    grid = hn.load_map(tmp_path / "cells.digits", robot_radius_m=0)
    assert grid.classes.tolist() == [[1, 0, 1], [1, 1, 1]]


def test_the_wing_is_registered() -> None:
    commands = {"check", "explore", "export", "map", "replay", "view"}
    assert set(extension.extensions("commands")) >= commands
    assert {".hnm", "building", "bag"} <= set(extension.extensions("formats"))
    assert "graph" in set(extension.extensions("methods"))


def test_entry_points_are_those_that_importlib_finds(monkeypatch, tmp_path):
    about = tmp_path / "planners_of_mine-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: planners-of-mine\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[console_scripts]\nplan = mine:plan\n\n# Formats.\n[hybridnav.formats]\n# none = no:ne\n"
        ".mine = mine.maps : read [extra]\nsvg=mine\n[hybridnav.methods]\nsvg = other\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    extension.registered.cache_clear()
    try:
        for group in ("commands", "formats", "pictures", "methods", "none"):
            points = entry_points(group=f"hybridnav.{group}")
            right = {one.name: one.module + f":{one.attr}" * bool(one.attr) for one in points}
            assert extension.extensions(group) == right
        assert extension.extensions("formats")[".mine"] == "mine.maps:read"
    finally:
        extension.registered.cache_clear()


def test_what_nothing_registers_is_said_in_one_line() -> None:
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"^nothing is registered as svg in hybridnav"
    ):
        extension.extension("formats", "svg")
