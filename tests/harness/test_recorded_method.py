"""A folder of recorded paths as a method of `evaluate`."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.harness import NamedMethod, RunSettings, load_study, to_frame, write_records

OFFICE = Path(hn.__file__).parents[2] / "maps" / "office" / "office.yaml"
ENDS = [((1.0, 13.2), (40.6, 19.4)), ((6.0, 17.2), (11.1, 7.0)), ((27.5, 7.5), (33.0, 17.5))]


@pytest.fixture(scope="module")
def planner() -> hn.HybridPlanner:
    return hn.HybridPlanner(hn.load_map(OFFICE, robot_radius_m=0.25))


@pytest.fixture
def folder(planner: hn.HybridPlanner, tmp_path: Path) -> Path:
    """Shortest paths, the last one with a detour there and back, and one into a wall."""
    place = tmp_path / "driven"
    place.mkdir()
    for number, (start, goal) in enumerate(ENDS):
        path = planner.plan(start, goal).path
        points = path.points
        if number == 2:
            points = np.insert(points, 1, [points[0] + [0.4, 0.0], points[0]], axis=0)
        np.savetxt(place / f"{number}.csv", points, delimiter=",", header="x,y", comments="")
    np.savetxt(
        place / "through.csv", [(6.0, 17.2), (40.6, 19.4)], delimiter=",", header="x,y", comments=""
    )
    return place


def table(folder: Path, out: Path, **settings: Any) -> Any:
    methods = (NamedMethod("recorded", str(folder)),)
    made = {"maps": (str(OFFICE),), "presets": ("shortest",), "methods": methods} | settings
    write_records(RunSettings(**made), out)
    return to_frame(load_study(out)).set_index(["method", "start_row", "start_col", "goal_row"])


def test_recorded_paths_are_judged_beside_a_live_method(folder: Path, tmp_path: Path) -> None:
    frame = table(folder, tmp_path / "out", repeat=1)
    driven, live = frame.loc["recorded driven"], frame.loc["shortest"]
    assert len(driven) == len(live) == 4  # the pairs are those that were recorded
    assert (driven["status"] == "solved").all()
    assert driven["seconds"].isna().all()
    assert not live["seconds"].isna().any()
    assert sorted(driven["faults"] > 0) == [False, False, False, True]  # the one through walls
    legal = driven[driven["faults"] == 0].index
    losses = driven.loc[legal, "any_angle_loss"]
    assert (losses > -1e-9).all()
    extra = driven.loc[legal, "length_m"] - live.loc[legal, "length_m"]
    assert extra.max() == pytest.approx(0.8, abs=0.15)  # joined to the centres of the end cells
    assert sorted(extra)[1] < 0.15


def test_a_pair_that_was_not_recorded_has_no_answer(folder: Path, tmp_path: Path) -> None:
    frame = table(folder, tmp_path / "out", lattice_step_m=12.0)
    driven = frame.loc["recorded driven"]
    assert len(driven) > 3
    assert (driven["status"] == "not recorded").all()
    assert (driven["faults"] == 0).all()
    assert driven["any_angle_loss"].isna().all()


@pytest.mark.full
def test_paths_that_are_recorded_again_are_another_method(folder: Path, tmp_path: Path) -> None:
    frame = table(folder, tmp_path / "out")
    (folder / "1.csv").unlink()
    again = table(folder, tmp_path / "out")
    assert len(frame.loc["recorded driven"]) == 4
    assert len(again.loc["recorded driven"]) == 3


def test_the_command_takes_a_folder(folder: Path, tmp_path: Path, cli: Any) -> None:
    done = cli("evaluate", OFFICE, "--recorded", folder, "-o", tmp_path / "out")
    assert done.code == 1  # the path through walls is a counter-example
    assert "recorded driven" in done.out
    (folder / "through.csv").unlink()
    assert cli("evaluate", OFFICE, "--recorded", folder, "-o", tmp_path / "again").code == 0


def test_hostile_folders_end_in_one_line(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(MapNotFoundError, match="no such folder"):
        table(tmp_path / "none", tmp_path / "out")
    (tmp_path / "empty").mkdir()
    with pytest.raises(MapError, match="is empty"):
        table(tmp_path / "empty", tmp_path / "out")
    (folder / "notes.csv").write_text("hello\n")
    with pytest.raises(MapError, match="notes"):
        table(folder, tmp_path / "out")
    (folder / "notes.csv").unlink()
    with pytest.raises(InvalidValueError, match="one map"):
        table(folder, tmp_path / "out", maps=(str(OFFICE), str(OFFICE)))
    with pytest.raises(InvalidValueError, match="unit and frame"):
        table(
            folder, tmp_path / "out", methods=(NamedMethod("recorded", str(folder), "a", {"x": 1}),)
        )
