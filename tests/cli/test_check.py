"""`hybridnav check` and `hybridnav evaluate --graph`: output, files, exit codes."""

import json
import re
from pathlib import Path
from unittest.mock import ANY

import pytest

from hybridnav.graphs import KINDS
from tests.harness.small_runs import run_here, write_map

FIGURE = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
POINT = ("--robot-radius", "0")


@pytest.fixture
def sound(cli, tmp_path):
    """A graph of the map without a fault."""
    path = tmp_path / "sound.geojson"
    assert cli("export", FIGURE, "-o", path, *POINT, "--spacing", "1").code == 0
    return path


@pytest.fixture
def faulty(sound, tmp_path):
    """The same graph with a node in a wall, whose edges are blocked, and one outside."""
    whole = json.loads(sound.read_text())
    nodes = [one for one in whole["features"] if one["geometry"]["type"] == "Point"]
    nodes[0]["geometry"]["coordinates"] = [100.0, 100.0]
    path = tmp_path / "faulty.geojson"
    path.write_text(json.dumps(whole))
    return path


def test_a_sound_graph(cli, sound, tmp_path):
    done = cli("check", FIGURE, sound, *POINT, "-o", tmp_path / "page.html")
    assert (done.code, done.err) == (0, "")
    words = " ".join(line.split()[0] for line in done.out.splitlines())
    assert words == "graph map nodes edges in doors rooms found seconds"
    assert "found      nothing\n" in done.out
    assert "Nothing is wrong" in (tmp_path / "page.html").read_text()


def test_a_faulty_graph(cli, faulty, tmp_path):
    page, plot = tmp_path / "page.html", tmp_path / "plot.png"
    done = cli("check", FIGURE, faulty, *POINT, "--json", "-o", page, "--plot", plot)
    assert (done.code, done.err) == (1, "")
    findings = done.answer["findings"]
    assert findings["node-outside"]["count"] == 1
    assert findings["node-outside"]["cases"][0]["points"] == [[100.0, 100.0]]
    assert findings["edge-through-wall"]["count"] > 1
    assert done.answer["free_nodes"] == done.answer["nodes"] - 1
    text = page.read_text()
    assert "nodes outside the map" in text
    assert "data:image/png;base64," in text
    assert "http" not in text
    assert plot.read_bytes().startswith(b"\x89PNG")
    done = cli("check", FIGURE, faulty, *POINT)
    assert "\nerror      1 nodes outside the map (node-outside)\n" in done.out
    (counts,) = [line for line in done.out.splitlines() if line.startswith("found ")]
    assert re.fullmatch(r"found      \d+ errors(, \d+ warnings?)?(, \d+ notes?)?", counts)
    assert "           node 0\n" in done.out


LEVELS = ("error", "warning", "note", "never")


def test_edges_are_checked_along_their_lines(cli, sound, tmp_path):
    whole = json.loads(sound.read_text())
    edge = next(one for one in whole["features"] if one["geometry"]["type"] == "LineString")
    edge["geometry"]["coordinates"].insert(1, [100.0, 100.0])  # a detour outside the map
    path = tmp_path / "detour.geojson"
    path.write_text(json.dumps(whole))
    assert cli("check", FIGURE, path, *POINT).code == 0
    done = cli("check", FIGURE, path, *POINT, "--along-lines", "--json")
    assert (done.code, done.answer["findings"]["edge-through-wall"]["count"]) == (1, 1)


def codes(cli, path):
    levels = [cli("check", FIGURE, path, *POINT, "--fail-on", level).code for level in LEVELS]
    return [*levels, cli("check", FIGURE, path, *POINT).code]


def test_errors_warnings_and_notes_fail_from_the_level_asked_for(cli, sound, faulty, tmp_path):
    assert codes(cli, sound) == [0, 0, 0, 0, 0]
    assert codes(cli, faulty) == [1, 1, 1, 0, 1]
    whole = json.loads(sound.read_text())
    edges = [one for one in whole["features"] if one["geometry"]["type"] == "LineString"]
    twice = whole["features"] + [edges[0] | {"properties": edges[0]["properties"] | {"id": 99_999}}]
    path = tmp_path / "some.geojson"
    path.write_text(json.dumps(whole | {"features": twice}))
    assert codes(cli, path) == [0, 1, 1, 0, 1]
    assert cli("check", FIGURE, path, *POINT, "--json").answer["findings"] == {
        "repeated-edge": {
            "severity": "warning",
            "count": 1,
            "text": KINDS["repeated-edge"],
            "cases": [{"where": ANY, "points": ANY}],
        }
    }
    # A closet without nodes is a note.
    closet = write_map(tmp_path, ["#######", "#..#..#", "#..#..#", "#######"])
    nodes = [{"id": 1, "x": 1.5, "y": 1.5}, {"id": 2, "x": 2.5, "y": 2.5}]
    path = tmp_path / "few.json"
    path.write_text(json.dumps({"nodes": nodes, "links": [{"source": 1, "target": 2}]}))
    done = cli("check", closet, path, *POINT)
    assert done.code == 0
    assert "\nfound      2 notes\nnote       1 rooms that the robot fits in" in done.out
    assert cli("check", closet, path, *POINT, "--fail-on", "note").code == 1
    refused = cli("check", FIGURE, path, *POINT, "--fail-on", "walls")
    assert refused.refuses(2, "--fail-on", "error, warning, note, never")


def test_files_of_unknown_formats_say_so_in_one_line(cli, tmp_path):
    for name, content in {
        "graph.dot": b"digraph { a -> b }",
        "graph.csv": b"x,y\n1,2\n",
        "graph.zip": b"PK\x03\x04\x00\xff",
        "graph": b"\x00\x01",
    }.items():
        (tmp_path / name).write_bytes(content)
        done = cli("check", FIGURE, tmp_path / name)
        suffix = Path(name).suffix
        assert done.refuses(3, f"unknown format '{suffix}'", "GeoJSON of Nav2", "GraphML", "LIF")


def test_findings_that_are_ignored_are_no_failure(cli, faulty):
    kinds = ("node-outside", "edge-through-wall", "line-elsewhere", "missing-room")
    ignored = [word for kind in kinds for word in ("--ignore", kind)]
    done = cli("check", FIGURE, faulty, *POINT, *ignored)
    assert (done.code, done.err) == (0, "")
    assert "found      nothing\n" in done.out


def test_wrong_usage_and_unreadable_files(cli, sound, tmp_path):
    assert cli("check", FIGURE).refuses(2, "GRAPH")
    assert cli("check", FIGURE, tmp_path / "none.json").refuses(3, "none.json: no such file")
    assert cli("check", FIGURE, FIGURE).refuses(3, "expected a topological map")
    assert cli("check", tmp_path / "none.yaml", sound).refuses(3, "none.yaml")
    assert cli("check", FIGURE, sound, "--ignore", "walls").refuses(2, "--ignore", "one-way")
    assert cli("check", FIGURE, sound, "-o", tmp_path / "page.txt").refuses(2, "--out", ".html")
    assert cli("check", FIGURE, sound, "--plot", "x.bmp").refuses(2, "--plot")


@pytest.mark.usefixtures("_here")
def test_names_that_break_lines_and_pages_do_not(cli, tmp_path):
    path = tmp_path / "odd.json"
    name = "<b>\n\x1b[31m\ud800"
    nodes = [{"id": name, "x": 1, "y": 1}, {"id": 2, "x": 99, "y": 9}]
    links = [{"source": name, "target": 2}]
    whole = {"graph": {"name": f"$\\frac{{{name}"}, "nodes": nodes, "links": links}
    path.write_text(json.dumps(whole))
    plot = tmp_path / "plot.png"
    done = cli("check", FIGURE, path, *POINT, "-o", tmp_path / "page.html", "--plot", plot)
    assert (done.code, done.err) == (1, "")
    assert "\x1b" not in done.out
    assert plot.read_bytes().startswith(b"\x89PNG")
    query = ("evaluate", FIGURE, *POINT, "--pairs", 2, "--graph", path, "-o", tmp_path / "run")
    done = cli(*query)
    assert (done.code, done.err.count("\n")) in {(0, 0), (1, 1)}
    assert "\x1b" not in (tmp_path / "run" / "report.html").read_text("utf-8")
    page = (tmp_path / "page.html").read_text("utf-8")
    assert "<b>" not in page
    assert "\x1b" not in page


@pytest.mark.usefixtures("_here")
def test_evaluate_follows_a_graph(cli, sound, faulty, tmp_path):
    query = ("evaluate", FIGURE, *POINT, "--pairs", 20)
    done = cli(*query, "--graph", sound, "-o", tmp_path / "run")
    assert (done.code, done.err) == (0, "")
    assert "| graph figure1 | any-angle | 100 |" in done.out
    assert json.loads((tmp_path / "run" / "runs.jsonl").read_text())["graphs"] == [str(sound)]
    done = cli(*query, "--graph", faulty, "--clear-edges", "-o", tmp_path / "clear")
    assert "| graph figure1 (clear edges) |" in done.out
    two = cli(*query, "--graph", sound, "--graph", faulty, "-o", tmp_path / "two")
    assert two.out.count("| graph figure1") >= 2
    assert cli(*query, "--clear-edges", "-o", tmp_path / "no").refuses(2, "goes with --graph")
    assert cli(*query, FIGURE, "--graph", sound, "-o", tmp_path / "no").refuses(2, "one map")
    assert cli(*query, "--graph", "none.json", "-o", tmp_path / "no").refuses(3, "none.json")


@pytest.fixture
def _here(monkeypatch):
    """No processes."""
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
