"""`hybridnav.plan` and `hybridnav.plot`: one call to a path, one to its picture."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapNotFoundError

Point = tuple[float, float]
ENDS = (0.5, 0.5), (2.0, 2.5)


def _map(folder: Path) -> Path:
    """Two rooms of 3 x 3 m with a door between them."""
    walls = np.zeros((30, 61), np.float32)
    walls[[0, -1]], walls[:, [0, 30, -1]] = 1.0, 1.0
    walls[12:20, 30] = 0.0
    hn.write_ros_map(hn.OccupancyGrid(walls, hn.Frame(0.1), robot_radius_m=0.0), folder / "m.yaml")
    return folder / "m.yaml"


def _by_parts(file: Path, ends: tuple[Point, Point], preset: str) -> hn.PlanResult:
    grid = hn.load_map(file, robot_radius_m=hn.load_preset(preset).pyramid.robot_radius_m)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    return hn.HybridPlanner(topology, preset=preset).plan(*ends)


@pytest.mark.parametrize("preset", ["shortest", "octile", "robot"])
def test_one_call_has_the_answer_of_the_parts(tmp_path: Path, preset: str) -> None:
    file, ends = _map(tmp_path), ((0.5, 0.5), (5.5, 2.5))
    alone, parts = hn.plan(file, *ends, preset=preset), _by_parts(file, ends, preset)
    assert alone.cost == parts.cost
    assert alone.route == parts.route
    assert alone.settings == parts.settings


def test_each_kind_of_map_is_taken(tmp_path: Path) -> None:
    grid = hn.example_map("figure1")
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    hn.save(topology, tmp_path / "m.hnm")
    costs = {
        hn.plan(source, *ENDS).cost
        for source in (grid, topology, tmp_path / "m.hnm", hn.load(tmp_path / "m.hnm"))
    }
    assert len(costs) == 1


def test_names_find_rooms_or_read_those_beside_the_map(tmp_path: Path) -> None:
    file = _map(tmp_path)
    found = hn.plan(file, "room-1", "room-2")
    assert found.solved
    assert hn.words(found)
    grid = hn.load_map(file)
    rooms = tmp_path / "rooms.yaml"
    hn.save_rooms(rooms, hn.find_rooms(grid), grid)
    rooms.write_text(rooms.read_text("utf-8").replace("room-1", "kitchen"), encoding="utf-8")
    assert hn.plan(file, "kitchen", "room-2").solved


def test_a_radius_that_the_caller_chose_stays() -> None:
    grid = hn.example_map("figure1", robot_radius_m=0.1)
    assert hn.plan(grid, *ENDS, preset="robot").settings["pyramid"]["robot_radius_m"] == 0.1
    wide = hn.plan(grid, *ENDS, robot_radius_m=0.3)
    assert wide.settings["pyramid"]["robot_radius_m"] == 0.3


def test_a_result_prints_as_three_lines_whatever_its_status() -> None:
    grid = hn.example_map("figure1")
    results = [
        hn.plan(grid, *ENDS),
        hn.plan(grid, *ENDS, preset="robot"),
        hn.plan(grid, (-5, 0), ENDS[1]),
        hn.PlanResult(hn.PlanStatus.NO_PATH),
        pickle.loads(pickle.dumps(hn.plan(grid, *ENDS))),  # noqa: S301 - our own
    ]
    for result in results:
        first, second, third = str(result).splitlines()
        assert first.startswith(str(result.status))
        assert second
        assert third.startswith("from ")
    assert "by preset robot" in str(results[1])
    assert "none below" in str(results[1])
    assert "outside" in str(results[2])


def test_plot_draws_what_was_planned_and_refuses_the_rest() -> None:
    grid = hn.example_map("figure1")
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid)))
    planner = hn.HybridPlanner(topology)
    closed = hn.plan(topology, *ENDS, blocked={"polygons": [[(1, 1), (1.2, 1), (1.2, 1.2)]]})
    drawn = {gid.get_gid() for gid in hn.plot(closed).get_children()}
    assert {"path", "closed"} <= drawn
    tour = hn.plan_tour(planner, [*ENDS, ENDS[0]])
    assert hn.plot(tour).figure
    assert hn.plot(hn.plan_alternatives(planner, *ENDS, 2), title="two").get_title() == "two"
    unsolved = hn.plan(grid, (-5, 0), ENDS[1])
    assert "outside" in hn.plot(unsolved).get_title()
    copy = pickle.loads(pickle.dumps(closed))  # noqa: S301 - our own
    for nothing, words in ((copy, "holds no map"), (3, "got 3"), (grid, "hybridnav.viz")):
        with pytest.raises(InvalidValueError, match=words):
            hn.plot(nothing)  # type: ignore[arg-type]


def test_a_notebook_shows_picture_and_lines() -> None:
    result = hn.plan(hn.example_map("figure1"), *ENDS)
    shown = str(result._repr_html_())
    assert shown.startswith('<img alt="solved by preset shortest')
    assert "none below" in shown
    copy = pickle.loads(pickle.dumps(result))  # noqa: S301 - our own
    assert str(copy._repr_html_()).startswith("<pre>")


def test_a_map_without_sense_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(MapNotFoundError):
        hn.plan(tmp_path / "none.yaml", *ENDS)
    with pytest.raises(InvalidValueError, match="give a file, a grid"):
        hn.plan(3, *ENDS)  # type: ignore[arg-type]
