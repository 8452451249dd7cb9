"""What is refused before anything costly is done for it: unknown names, costs."""

import json
from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn
from tests.rooms.test_doors import flat, map_file  # noqa: F401 - the fixture


def test_names_are_checked_before_anything_is_built(cli, map_file, monkeypatch):  # noqa: F811
    def built(*_, **__):
        raise AssertionError

    monkeypatch.setattr(hn.DualGraphPyramid, "build", built)
    query = ("plan", map_file, "--robot-radius", "0", "--from", "kitchn", "--to", "lab")
    assert cli(*query).refuses(2, "'kitchn'", "did you mean kitchen")
    (map_file.parent / "rooms.yaml").unlink()
    monkeypatch.undo()  # rooms are found on levels of a pyramid
    monkeypatch.setattr(hn, "HybridPlanner", built)
    done = cli(*query)
    assert done.code == 2
    assert "no room or point is called 'kitchn'" in done.err


@pytest.mark.parametrize(
    ("closed", "never", "message"),
    [
        ("room:kitchn", (hn.DualGraphPyramid, "build"), "did you mean kitchen"),
        ("door:99", (hn, "HybridPlanner"), "99"),
    ],
)
def test_what_is_closed_is_checked_before_it_costs(  # noqa: PLR0913, PLR0917
    cli,
    map_file,  # noqa: F811
    monkeypatch,
    closed,
    never,
    message,
):
    def built(*_, **__):
        raise AssertionError

    monkeypatch.setattr(*never, built)
    query = ("plan", map_file, "--robot-radius", "0", "--from", "kitchen", "--to", "lab")
    assert cli(*query, "--blocked", closed).refuses(2, message)


def test_python_checks_names_before_what_is_blocked():
    grid, labels = flat()
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)))
    nowhere = {"cells": [[-1, -1]]}
    for ask in (
        lambda: planner.plan("kitchn", "lab", blocked=nowhere),
        lambda: hn.plan_tour(planner, ["lab", "kitchn"], blocked=nowhere),
    ):
        with pytest.raises(hn.errors.InvalidValueError, match="'kitchn': did you mean kitchen"):
            ask()


def test_what_is_closed_is_found_once_for_named_ends(monkeypatch):
    grid, labels = flat()
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)))
    found = []
    find = hn.Blocked.cells_on

    def counted(blocked, *on):
        found.append(blocked)
        return find(blocked, *on)

    monkeypatch.setattr(hn.Blocked, "cells_on", counted)
    blocked = {"rooms": ["lab"]}
    assert planner.plan("kitchen", "lab", blocked=blocked).status == "goal blocked"
    assert len(found) == 1
    assert not hn.plan_tour(planner, ["kitchen", "lab", "kitchen"], blocked=blocked).solved
    assert len(hn.plan_alternatives(planner, "kitchen", "lab", 2, blocked=blocked)) == 0
    assert len(found) == 1  # what is closed again is not searched for again


@pytest.mark.parametrize(
    ("command", "reads"),
    [("plan", True), ("view", True), ("rooms", True), ("export", True), ("check", True)],
)
def test_help_says_whether_rooms_beside_the_map_are_read(cli, command, reads):
    said = " ".join(cli(command, "--help").out.replace("│", " ").split())
    assert ("rooms.yaml beside the map" in said) == reads
    assert "in place of a model's or of found ones" in said


def test_rooms_are_found_anew_beside_a_file_of_rooms_on_demand(cli, tmp_path):
    hn.write_ros_map(hn.example_map("office"), tmp_path / "map.yaml")
    before = cli("rooms", tmp_path / "map.yaml", "--json").answer
    out = tmp_path / "rooms.yaml"
    assert cli("rooms", tmp_path / "map.yaml", "-o", out).code == 0
    out.write_text(out.read_text().replace("name: room-1\n", "name: kitchen\n"))
    found = cli("rooms", tmp_path / "map.yaml", "--find", "--json").answer
    assert found["rooms"] == before["rooms"]
    named = cli("rooms", tmp_path / "map.yaml", "--json").answer["rooms"]
    assert "kitchen" in [room["name"] for room in named]


MAP = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
QUERY = ("plan", MAP, "--start", "0.5,0.5", "--goal", "2.0,2.5", "--robot-radius", "0")


def test_a_plan_by_clearance_is_one_of_robot_and_says_so(cli: Any) -> None:
    costs = ("--costs", "clearance:multiplier=4")
    answer = json.loads(cli(*QUERY, *costs, "--json").out)
    grid = hn.load_map(MAP, robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    preset = hn.load_preset("robot", overrides=["planner.costs.clearance.multiplier=4"])
    result = hn.HybridPlanner(topology, preset=preset).plan((0.5, 0.5), (2.0, 2.5))
    assert answer["settings"]["preset"] == "robot"
    assert answer["settings"]["costs"] == hn.CostLayer.clearance(grid, multiplier=4.0).source
    assert (answer["cost"], answer["lower_bound"]) == (result.cost, result.lower_bound)
    told = cli(*QUERY, *costs).out.splitlines()
    assert "preset     robot, which plans by costs" in told
    assert f"length     {result.path.length_m:.2f} m" in told
    assert f"cost       {result.cost:.2f} m (any-angle-weighted)" in told
    # The cheapest path of cells, which is optimal among these alone.
    cells = json.loads(cli(*QUERY, *costs, "--preset", "grid-astar", "--json").out)
    assert cells["metric"] == "weighted"
    assert answer["cost"] <= cells["cost"] == cells["lower_bound"]


@pytest.mark.parametrize("preset", ["shortest", "octile", "paper"])
def test_every_answer_names_its_preset(cli: Any, preset: str) -> None:
    for query in (QUERY, (*QUERY[:2], "--start", "0.5,0.5", "--goal", "9,9")):
        assert f"\npreset     {preset}\n" in cli(*query, "--preset", preset).out
    assert "\npreset     shortest\n" in cli(*QUERY).out


def test_the_corridor_is_compared_with_the_cheapest_path(cli: Any) -> None:
    query = (*QUERY, "--costs", "clearance", "--preset", "paper", "--compare")
    answer = json.loads(cli(*query, "--json").out)
    assert answer["metric"] == "weighted"
    assert answer["loss"] == answer["cost"] / answer["optimum_m"] - 1
    assert answer["grid_length_m"] < answer["optimum_m"] == answer["grid_cost"]
    taut = cli(*query, "--smooth", "line-of-sight").out
    length, cost = (f"{answer[key]:.2f} m" for key in ("grid_length_m", "grid_cost"))
    assert f"grid       {length}, cost {cost} (weighted), " in taut


def test_masks_are_read_and_joined(cli: Any, tmp_path: Path) -> None:
    rows, cols = hn.load_map(MAP, robot_radius_m=0).shape
    for name, grey in (("slow", 50), ("shut", 100)):
        (tmp_path / f"{name}.pgm").write_bytes(b"P5 1 1 255 " + bytes([grey]))
        (tmp_path / f"{name}.yaml").write_text(
            f"{{image: {name}.pgm, resolution: {max(rows, cols) * 0.1}, origin: [0, 0, 0], "
            "negate: 0, mode: raw, free_thresh: 0.196, occupied_thresh: 0.65}"
        )
    query = (*QUERY, "--preset", "grid-astar")
    slow = json.loads(cli(*query, "--costs", f"speed:{tmp_path / 'slow.yaml'}", "--json").out)
    assert slow["cost"] == pytest.approx(2 * slow["length_m"])
    base = f"speed:{tmp_path / 'slow.yaml'},base=90,multiplier=-1.3"
    slower = json.loads(cli(*query, "--costs", base, "--costs", "clearance", "--json").out)
    assert slower["cost"] == pytest.approx(4 * slower["length_m"], rel=1e-3)
    shut = cli(*query, "--costs", f"keepout:{tmp_path / 'shut.yaml'}", "--json")
    assert shut.code == 1
    assert json.loads(shut.out)["status"] == "start blocked"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--costs", "height"), "--costs must begin with clearance, speed, keepout, got 'height'"),
        (("--costs", "clearance:radius=1"), "--costs clearance takes KEY=VALUE with"),
        (("--costs", "clearance:scaling=high"), "scaling must be a number, got 'high'"),
        (("--costs", "clearance:scaling=-1"), "planner.costs.clearance.scaling"),
        (("--costs", "speed"), "--costs speed: expected speed:FILE, got 'speed'"),
        (
            ("--costs", "clearance", "--preset", "shortest"),
            "planner.costs: no key of method shortest, but of ",
        ),
    ],
)
def test_wrong_costs_are_wrong_usage_in_one_line(cli: Any, options: Any, message: str) -> None:
    done = cli(*QUERY, *options)
    assert done.code == 2
    assert message in done.err
    assert done.err.count("\n") == 1


def test_a_missing_mask_is_unreadable_input(cli: Any) -> None:
    done = cli(*QUERY, "--costs", "speed:nowhere.yaml")
    assert done.code == 3
    assert done.err.count("\n") == 1
