"""Names that nothing has are refused before anything costly is done for them."""

import pytest

import hybridnav as hn
from tests.topology.test_doors import flat, map_file  # noqa: F401 - the fixture


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
        with pytest.raises(hn.InvalidValueError, match="'kitchn': did you mean kitchen"):
            ask()


def test_what_is_closed_is_found_once_for_named_ends(monkeypatch):
    grid, labels = flat()
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)))
    found = []
    find = hn.Blocked.cells_of

    def counted(blocked, topology):
        found.append(blocked)
        return find(blocked, topology)

    monkeypatch.setattr(hn.Blocked, "cells_of", counted)
    blocked = {"rooms": ["lab"]}
    assert planner.plan("kitchen", "lab", blocked=blocked).status == "goal blocked"
    assert len(found) == 1
    assert not hn.plan_tour(planner, ["kitchen", "lab", "kitchen"], blocked=blocked).solved
    assert len(hn.plan_alternatives(planner, "kitchen", "lab", 2, blocked=blocked)) == 0
    assert len(found) == 1  # what is closed again is not searched for again


@pytest.mark.parametrize(
    ("command", "reads"),
    [("plan", True), ("view", True), ("rooms", False), ("export", False), ("check", False)],
)
def test_help_says_whether_rooms_beside_the_map_are_read(cli, command, reads):
    said = " ".join(cli(command, "--help").out.replace("│", " ").split())
    assert ("rooms.yaml beside the map" in said) == reads
    assert ("without it they are found" in said) == (not reads)


def test_rooms_are_found_anew_beside_a_file_of_rooms(cli, tmp_path):
    hn.write_ros_map(hn.example_map("office"), tmp_path / "map.yaml")
    before = cli("rooms", tmp_path / "map.yaml", "--json").answer
    out = tmp_path / "rooms.yaml"
    assert cli("rooms", tmp_path / "map.yaml", "-o", out).code == 0
    out.write_text(out.read_text().replace("name: room-1\n", "name: kitchen\n"))
    assert cli("rooms", tmp_path / "map.yaml", "--json").answer["rooms"] == before["rooms"]
    named = cli("rooms", tmp_path / "map.yaml", "--rooms", out, "--json").answer["rooms"]
    assert "kitchen" in [room["name"] for room in named]
