"""`hybridnav check` of the graph of a building of several floors, and what `evaluate` says."""

from __future__ import annotations

import pytest

import hybridnav as hn
from tests.houses import FIGURE, write_house

POINT = ("--robot-radius", "0")


@pytest.fixture
def house(tmp_path):
    """Two floors of one map, whose lift stops at other points of each."""
    return write_house(tmp_path, links=("lift",))


@pytest.fixture
def graph(cli, house, tmp_path):
    """Its graph, whose floors have one frame: the lift stops at one point of it."""
    path = tmp_path / "graph.yaml"
    given = ("--format", "rmf", "--spacing", "1", *POINT, "-o", path)
    assert cli("export", house, *given).code == 0
    return path


def test_a_sound_graph_in_a_frame_of_its_own(cli, house, graph, tmp_path):
    page = tmp_path / "page.html"
    done = cli("check", house, graph, *POINT, "--align", "--pairs", "40", "-o", page)
    assert (done.code, done.err) == (0, "")
    assert "graph      house, 2 of 2 floors, 1 of 1 links\n" in done.out
    assert "two floors 20 pairs: 20 solved\n" in done.out
    assert "found      nothing\n" in done.out
    assert "hint" not in done.out
    text = page.read_text()
    assert text.count("data:image/png;base64,") == 2
    assert "Floor 2: nothing is wrong" in text
    assert "http" not in text
    figures = cli("check", house, graph, *POINT, "--align", "--pairs", "8", "--json").answer
    assert figures["links"] == {"lift": "lift"}
    assert figures["routes"]["all"]["answers"] == {"solved": 8}
    drawn = {floor.name: floor.graph.n_nodes for floor in hn.load_building_graph(graph).floors}
    assert {name: one["nodes"] for name, one in figures["floors"].items()} == drawn
    assert figures["findings"] == {}


def test_a_graph_in_another_frame_is_not_taken_for_sound(cli, house, graph):
    done = cli("check", house, graph, *POINT, "--pairs", "40")
    assert done.code == 1
    assert "1 ends of links that are not where the building has them (stop-elsewhere)" in done.out
    assert "lift lift at floor 2: 2.24 m from that of the building" in done.out
    assert "routes     " in done.out
    assert "hint       links stop up to 2.24 m from those of the building: --align, if" in done.out
    figures = cli("check", house, graph, *POINT, "--pairs", "0", "--json").answer
    assert figures["findings"]["stop-elsewhere"]["count"] == 1
    assert (figures["routes"], figures["contradictions"]) == (None, [])


def test_floors_are_matched_and_findings_left_out(cli, house, graph):
    graph.write_text(graph.read_text().replace('"2"', '"L2"').replace("'2'", "'L2'"))
    done = cli("check", house, graph, *POINT, "--pairs", "0")
    assert done.code == 1
    assert "warning    1 floors of the building that the graph does not have" in done.out
    assert "           floor L2\n" in done.out
    kinds = ("floor-missing", "floor-unknown", "stop-missing")
    done = cli(
        "check", house, graph, *POINT, "--pairs", "0", *(f"--ignore={kind}" for kind in kinds)
    )
    assert (done.code, "found      nothing\n" in done.out) == (0, True)
    done = cli("check", house, graph, *POINT, "--align", "--match", "L2=2", "--pairs", "10")
    assert (done.code, "found      nothing\n" in done.out) == (0, True)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("--match", "L2"), "--match must be NAME=FLOOR, got 'L2'"),
        (("--match", "2=7"), "no floor is called '7': there are 1, 2"),
        (("--match", "3=2"), "no floor is called '3': there are 1, 2"),
        (("--match", "2=1", "--match", "2=2"), "has floor '2' of the graph twice"),
        (("--along-lines",), "--along-lines is for one map, and this is a building"),
        (("--floor", "1"), "--floor is for one map, and this is a building"),
        (("--ignore", "walls"), "--ignore must be one of no-coordinates, "),
        (("--preset", "octile"), "load it with preset shortest"),
    ],
)
def test_wrong_usage_is_one_line(cli, house, graph, given, words):
    assert cli("check", house, graph, *POINT, *given).refuses(2, words)


def test_a_damaged_graph_is_one_line(cli, house, tmp_path):
    path = tmp_path / "damaged.yaml"
    path.write_text("levels: {L1: {vertices: [")
    assert cli("check", house, path, *POINT).refuses(3, "graph ")
    features = tmp_path / "graph.geojson"
    features.write_text('{"type": "FeatureCollection", "features": []}')
    assert cli("check", house, features, *POINT).refuses(3, "graph ")
    path.write_text("levels: {L1: {vertices: [[0, 0, {}]], lanes: []}}")
    assert cli("check", house, path, *POINT).refuses(2, "has the floors L1 and the building has 1")


def test_options_of_buildings_mean_nothing_on_one_map(cli, graph):
    for given in (("--align",), ("--match", "1=2"), ("--pairs", "9"), ("--no-stairs",)):
        done = cli("check", FIGURE, graph, "--floor", "1", *given)
        assert done.refuses(2, f"{given[0]} is for a building, and this is one map: leave it out")
    done = cli("check", FIGURE, graph, "--floor", "1", "--ignore", "pieces")
    assert done.refuses(2, "--ignore must be one of ")


def test_evaluate_names_the_command_for_buildings(cli, house, graph, tmp_path):
    done = cli("evaluate", house, "--graph", graph, "-o", tmp_path / "run")
    words = "is a building, and methods are measured on maps: give the maps of its floors"
    assert done.refuses(2, words, "`hybridnav check BUILDING GRAPH`")
