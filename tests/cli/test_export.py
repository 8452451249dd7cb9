"""`hybridnav export`: a route graph from a map file."""

import json
import math
import sys
from pathlib import Path
from typing import Any, cast

import pytest
from rosbags.highlevel import AnyReader

import hybridnav as hn
from hybridnav.ext.fleet.fleet_options import read_points
from tests.nav2_reader import read_nav2

FIGURE = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
OFFICE = FIGURE.parents[1] / "office" / "office.yaml"
SMALL = ("--robot-radius", "0", "--spacing", "1")


def test_a_map_becomes_a_graph_with_a_report_and_a_picture(cli, tmp_path):
    out, plot = tmp_path / "graph.geojson", tmp_path / "graph.png"
    done = cli("export", FIGURE, "-o", out, *SMALL, "--report", "50", "--plot", plot, "--json")
    assert (done.code, done.err) == (0, "")
    graph, report = read_nav2(out), done.answer["report"]
    assert (done.answer["nodes"], done.answer["edges"]) == (len(graph.points), len(graph.edges))
    assert sum(done.answer["kinds"].values()) == len(graph.points)
    assert report["best"]["solved"] == 1.0
    assert 0 <= report["best"]["mean"] <= report["nearest"]["mean"]
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_the_summary_describes_the_graph_and_its_routes(cli, tmp_path):
    done = cli("export", FIGURE, "-o", tmp_path / "graph.geojson", *SMALL, "--report", "20")
    assert done.code == 0
    words = [line.split()[0] for line in done.out.splitlines()]
    assert words == ["graph", "map", "nodes", "pairs", "best", "nearest", "seconds"]


def test_lanes_for_robots_that_pass_each_other(cli, tmp_path):
    out = tmp_path / "graph.geojson"
    done = cli("export", FIGURE, "-o", out, *SMALL, "--lanes", "0.1", "--json")
    assert (done.code, done.err) == (0, "")
    assert done.answer["kinds"]["lane"] > 0
    facts = read_nav2(out).edge_facts.values()
    assert {one.get("lane") for one in facts} == {None, "right"}
    assert cli("export", FIGURE, "-o", out, "--force", *SMALL, "--lanes", "-1").refuses(
        2, "apart_m"
    )


def test_wrong_usage_ends_in_one_line(cli, tmp_path):
    out = tmp_path / "graph.geojson"
    assert cli("export", FIGURE, "-o", tmp_path / "graph.txt").refuses(2, "--out", ".geojson")
    assert cli("export", FIGURE, "-o", out, "--format", "shapefile").refuses(2, "--format", "nav2")
    assert cli("export", FIGURE, "-o", tmp_path / "no" / "g.json").refuses(2, "no folder")
    assert cli("export", FIGURE, "-o", out, *SMALL[:2], "--spacing", "nan").refuses(2, "spacing_m")
    assert cli("export", FIGURE, "-o", out, "--report", 10**20, *SMALL).refuses(2, "--report")
    assert cli("export", tmp_path / "none.yaml", "-o", out).refuses(3, "none.yaml")
    assert not out.exists()


def test_lanes_keep_the_ids_of_a_graph_before(cli, tmp_path):
    first, second = tmp_path / "a.geojson", tmp_path / "b.geojson"
    done = cli("export", FIGURE, "-o", first, *SMALL[:2], "--json")
    assert (done.code, done.err) == (0, "")
    assert set(done.answer["kinds"]) <= {"room", "door", "crossing", "end", "bend"}
    few = done.answer["nodes"]
    facts = read_nav2(first).node_facts
    assert {one["class"] for one in facts.values()} == set(done.answer["kinds"])
    done = cli("export", FIGURE, "-o", second, "--force", *SMALL[:2], "--keep", first, "--json")
    assert (done.code, first.read_bytes()) == (0, second.read_bytes())
    done = cli("export", FIGURE, "-o", second, "--force", *SMALL, "--json")
    assert done.answer["nodes"] >= few
    given = ("export", FIGURE, "-o", second, "--force", *SMALL[:2])
    assert cli(*given, "--keep", tmp_path / "no.geojson").refuses(3, "no.geojson")


@pytest.mark.parametrize(
    ("command", "option", "instead"),
    [
        ("export", "--style", "graphs are lanes"),
        ("export", "--nodes", "a larger --spacing"),
        ("evaluate", "--methods", "--preset and --baseline, or in Python RunSettings(methods=)"),
    ],
)
def test_options_that_went_say_what_to_do_instead(cli, command, option, instead):
    assert cli(command, FIGURE, option, "5").refuses(2, f"{option} is gone", instead)


def test_named_points_come_from_a_file(cli, tmp_path):
    out, again = tmp_path / "a.geojson", tmp_path / "b.geojson"
    (tmp_path / "points.yaml").write_text(
        "dock: [1.5, 2.5]\n'shelf 7': {position: {x: 0.35, y: 1.5}, orientation: {w: 1.0}}\n"
    )
    given = ("export", FIGURE, *SMALL[:2], "--points", tmp_path / "points.yaml")
    done = cli(*given, "-o", out, "--json")
    assert (done.code, done.err) == (0, "")
    named = {
        facts["name"]: read_nav2(out).points[n]
        for n, facts in read_nav2(out).node_facts.items()
        if "name" in facts
    }
    assert named["dock"] == pytest.approx((1.5, 2.5), abs=0.01)
    assert named["shelf 7"] == pytest.approx((0.35, 1.5), abs=0.01)
    assert cli(*given, "-o", again, "--keep", out).code == 0
    assert out.read_bytes() == again.read_bytes()
    # Through the file of a fleet, nodes keep their ids, too.
    fleet = ("--format", "rmf", "-o", tmp_path / "a.yaml", "--floor", "2")
    assert cli(*given, *fleet, "--keep", out).code == 0
    done = cli(*given, *fleet, "--keep", tmp_path / "a.yaml", "--force", "--json")
    assert (done.code, set(map(len, done.answer["changes"]["nodes"].values()))) == (0, {0})
    for text in ("dock: [1.5]\n", "dock: here\n", "dock: {x: a, y: 1}\n"):
        (tmp_path / "points.yaml").write_text(text)
        assert cli(*given, "-o", out, "--force").refuses(2, "'dock' must be [x, y] in metres")
    for text in ("a: [1, 2]\nlifts: {a: [1.5, 2.5]}\n", "lifts: {1: [1, 2], '1': [1.5, 2.5]}\n"):
        (tmp_path / "points.yaml").write_text(text)
        assert cli(*given, "-o", out, "--force").refuses(2, "must be", "there once")


@pytest.mark.parametrize(
    ("text", "points", "lifts"),
    [
        ("a: [1, 2]\nlifts: {b: [3, 4], 5: {x: 6, y: 7}}", "a b 5", "b 5"),
        ("lifts: {}\na: [1, 2]", "a", ""),
        # A point or pose of that name, as of a room, is none.
        ("lifts: [1, 2]", "lifts", ""),
        ("lifts: {position: {x: 1, y: 2}, orientation: {x: 0, y: 0}}", "lifts", ""),
        ("lifts: {pose: {position: {x: 1, y: 2}}}", "lifts", ""),
    ],
)
def test_lifts_have_a_section_of_the_points(tmp_path, text, points, lifts):
    (tmp_path / "points.yaml").write_text(text)
    found = read_points(tmp_path / "points.yaml")
    assert ([*found[0]], [*found[1]]) == (points.split(), lifts.split())


def test_a_bundle_holds_the_graph_masks_and_parameters(cli, tmp_path):
    folder = tmp_path / "robot"
    given = ("export", FIGURE, *SMALL[:2], "--bundle", folder)
    done = cli(*given, "--json")
    assert (done.code, done.err, done.answer["left_out"]) == (0, "", [])
    graph = read_nav2(folder / "graph.geojson")
    assert (done.answer["nodes"], done.answer["edges"]) == (len(graph.points), len(graph.edges))
    assert "changes" not in done.answer
    # The map is the same, so are the ids, and the folder is a bundle of before.
    done = cli(*given, "--operations", "--keep", folder / "graph.geojson")
    assert (done.code, "changed    nothing" in done.out.splitlines()) == (0, True)
    assert read_nav2(folder / "graph.geojson").edges == graph.edges
    (tmp_path / "points.yaml").write_text("lifts: {north: [0.35, 1.5]}")
    lift = ("--points", tmp_path / "points.yaml", "--operations", "--bundle", tmp_path / "lift")
    assert cli(*given[:4], *lift).code == 0
    assert "/lift_north/call" in (tmp_path / "lift" / "graph.geojson").read_text()
    # Edges in a keepout zone are gone, and at the next time nothing has changed.
    (x, y), (u, v) = next(iter(graph.lines.values()))
    corner = [(x + u) / 2 - 0.05, (y + v) / 2 - 0.05, 0]
    (tmp_path / "zone.pgm").write_bytes(b"P5 1 1 255 " + bytes([100]))
    (tmp_path / "zone.yaml").write_text(
        f"{{image: zone.pgm, resolution: 0.1, origin: {corner}, negate: 0, mode: raw, "
        "free_thresh: 0.196, occupied_thresh: 0.65}"
    )
    zone = (*given, "--costs", f"keepout:{tmp_path / 'zone.yaml'}")
    done = cli(*zone, "--keep", folder / "graph.geojson", "--json")
    gone = done.answer["changes"]["edges"]["gone"]
    assert set(gone) == set(graph.edges) - set(read_nav2(folder / "graph.geojson").edges)
    assert gone
    assert done.answer["left_out"] == [f"{len(gone)} edges through keepout zones"]
    assert "changed    nothing" in cli(*zone, "--keep", folder / "graph.geojson").out
    assert cli(*given, "-o", tmp_path / "g.geojson").refuses(2, "--out does not go with --bundle")
    assert cli(*given, "--format", "rooms").refuses(2, "--format rooms does not go with --bundle")
    assert cli(*given, "--costs", "clearance").refuses(2, "costs of a bundle are")
    assert cli(*given, "--costs", "speed:none.yaml").refuses(3, "none.yaml")
    assert cli("export", FIGURE).refuses(2, "--out is missing")
    plain = ("export", FIGURE, "-o", tmp_path / "g.geojson")
    assert cli(*plain, "--operations").refuses(2, "--operations needs --bundle")
    assert cli(*plain, "--costs", "speed:x").refuses(2, "--costs needs --bundle")
    (folder / "notes.txt").write_text("mine")
    assert cli(*given).refuses(2, "bundle", "it holds notes.txt")
    assert cli("export", FIGURE, "--bundle", tmp_path / "a" / "b").refuses(2, "there is no folder")
    assert cli("export", FIGURE, "--bundle", folder / "notes.txt").refuses(2, "Not a directory")
    assert cli("export", FIGURE, "--bundle", tmp_path / ("x" * 300)).refuses(2, "too long")


def test_what_changed_since_a_graph_to_keep_is_listed(cli, tmp_path):
    first, second = tmp_path / "a.geojson", tmp_path / "b.geojson"
    cli("export", FIGURE, "-o", first, *SMALL[:2])
    whole = json.loads(first.read_text())
    gone = next(f for f in whole["features"] if f["geometry"]["type"] == "LineString")
    whole["features"].remove(gone)
    first.write_text(json.dumps(whole))
    given = ("export", FIGURE, "-o", second, "--force", *SMALL[:2], "--keep", first)
    changes = cli(*given, "--json").answer["changes"]
    assert (len(changes["edges"]["added"]), changes["edges"]["gone"]) == (1, [])
    assert changes["nodes"] == {"added": [], "gone": [], "moved": []}
    (line,) = [each for each in cli(*given).out.splitlines() if each.startswith("added ")]
    assert line == f"added      1 edges: {changes['edges']['added'][0]}"


def test_ids_that_messages_do_not_hold_are_named(cli, tmp_path, monkeypatch):
    given = ("export", FIGURE, "-o", tmp_path / "g.geojson", "--force", *SMALL)
    assert "ids  " not in cli(*given).out
    monkeypatch.setattr("hybridnav.messages.MOST_ID", 5)
    (line,) = [each for each in cli(*given).out.splitlines() if each.startswith("ids  ")]
    features = json.loads((tmp_path / "g.geojson").read_text())["features"]
    most = max(each["properties"]["id"] for each in features)
    assert f"up to {most};" in line
    assert "messages of ComputeRoute hold 5" in line


def test_rooms_and_places_are_written_as_tables_and_features(cli, tmp_path):
    for kind, counted in (("rooms", ["rooms", "doors"]), ("places", ["places", "arcs"])):
        for ending in ("csv", "geojson"):
            out = tmp_path / f"{kind}.{ending}"
            done = cli("export", FIGURE, *SMALL[:2], "--format", kind, "-o", out, "--json")
            assert (done.code, done.err) == (0, "")
            assert list(done.answer)[:2] == counted
        lines = (tmp_path / f"{kind}.csv").read_text().splitlines()
        assert len(lines) == 1 + done.answer[kind]
        features = json.loads((tmp_path / f"{kind}.geojson").read_text())["features"]
        assert len(features) == sum(done.answer[name] for name in counted)
    shown = cli("export", FIGURE, *SMALL[:2], "--format", "places", "-o", tmp_path / "p.csv").out
    assert [line.split()[0] for line in shown.splitlines()] == ["file", "map", "seconds"]


def test_options_of_graphs_are_refused_for_rooms_and_places(cli, tmp_path):
    places = ("export", FIGURE, "--format", "places", "-o", tmp_path / "p.csv")
    for option in (("--spacing", 3), ("--report", 9), ("--plot", tmp_path / "p.png")):
        assert cli(*places, *option).refuses(2, option[0], "--format nav2")
    assert cli(*places[:-1], tmp_path / "p.json").refuses(2, "--out", ".csv, .geojson")
    graph = ("export", FIGURE, "-o", tmp_path / "g.csv")
    assert cli(*graph).refuses(2, "--out", ".geojson, .json")


def test_a_path_is_written_as_a_line(cli, tmp_path):
    out = tmp_path / "path.geojson"
    query = ("plan", FIGURE, "--robot-radius", 0, "--start", "0.5,0.5", "--goal", "2.0,2.5")
    done = cli(*query, "--poses", out, "--json")
    assert done.code == 0
    (line,) = json.loads(out.read_text())["features"]
    assert line["geometry"]["coordinates"] == done.answer["points"]
    assert line["properties"]["length_m"] == done.answer["length_m"]
    assert cli(*query, "--poses", tmp_path / "path.gpx").refuses(2, ".csv, .json, .geojson")


def test_the_yaw_of_start_and_goal_is_in_every_file(cli, tmp_path):
    """In CSV, JSON, GeoJSON and a bag, by a preset that plans without headings."""
    ends = ("--start", "0.5,0.5,2.5", "--goal", "2.0,2.5,-1.57")
    query = ("plan", FIGURE, "--robot-radius", 0, *ends, "--json")
    done = cli(*query, "--poses", tmp_path / "path.csv", "--bag", tmp_path / "bag")
    assert done.code == 0
    assert (done.answer["start"], done.answer["goal"]) == ([0.5, 0.5, 2.5], [2.0, 2.5, -1.57])
    assert [done.answer["headings_rad"][at] for at in (0, -1)] == [2.5, -1.57]
    lines = (tmp_path / "path.csv").read_text().splitlines()
    assert (lines[1], lines[-1]) == ("0.5,0.5,2.5,1", "2.0,2.5,-1.57,1")
    for ending in ("json", "geojson"):
        assert cli(*query, "--poses", tmp_path / f"path.{ending}").code == 0
    poses = json.loads((tmp_path / "path.json").read_text())["poses"]
    assert (poses[0], poses[-1]) == ([0.5, 0.5, 2.5, 1], [2.0, 2.5, -1.57, 1])
    (line,) = json.loads((tmp_path / "path.geojson").read_text())["features"]
    assert [line["properties"]["headings_rad"][at] for at in (0, -1)] == [2.5, -1.57]
    with AnyReader([tmp_path / "bag"]) as reader:
        (plan,) = [each for each in reader.connections if each.topic == "/plan"]
        ((_, _, raw),) = reader.messages([plan])
        poses = cast("Any", reader.deserialize(raw, plan.msgtype)).poses
        turned = [poses[at].pose.orientation for at in (0, -1)]
    assert [2 * math.atan2(q.z, q.w) for q in turned] == pytest.approx([2.5, -1.57])
    assert cli("plan", FIGURE, "--start", "0.5,0.5,nan", "--goal", "2,2").refuses(2, "radians")


def test_a_plan_is_written_into_a_bag(cli, tmp_path, monkeypatch):
    query = ("plan", FIGURE, "--robot-radius", 0, "--start", "0.5,0.5", "--goal", "2.0,2.5")
    for name in ("plan.bag", "plan"):
        bag = tmp_path / name
        done = cli(*query, "--bag", bag, "--json")
        assert (done.code, done.err) == (0, "")
        assert (hn.ext.live.load_bag_map(bag).measured == hn.load_map(FIGURE).measured).all()
        with AnyReader([bag]) as reader:
            (plan,) = [each for each in reader.connections if each.topic == "/plan"]
            ((_, _, raw),) = reader.messages([plan])
            last = cast("Any", reader.deserialize(raw, plan.msgtype)).poses[-1].pose.position
        assert [last.x, last.y] == done.answer["points"][-1]
        assert cli(*query, "--bag", bag).refuses(2, "--bag", "exists, expected a new name")
    assert cli(*query, "--bag", tmp_path / "none" / "a.bag").refuses(2, "--bag: there is no folder")
    assert cli(*query, "--bag", tmp_path / ("x" * 300)).refuses(2, "--bag", "too long")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "rosbags.highlevel", None)
        assert cli(*query, "--bag", tmp_path / "c.bag").refuses(3, "--bag", "rosbags is needed")
    several = (*query, "--alternatives", 2, "--bag", tmp_path / "b.bag")
    assert cli(*several).refuses(2, "--bag writes one path")
    far = cli(*query[:-1], "99,99", "--bag", tmp_path / "far.bag")
    assert far.code == 1
    assert not (tmp_path / "far.bag").exists()


def test_formats_of_fleets_are_read_back_as_the_same_graph(cli, tmp_path):
    formats = {
        "rmf": ("a.yaml", ()),
        "osm": ("a.osm", ("--anchor", "48.15,11.57,20")),
        "lif": ("a.json", ("--vehicle", "A.B", "--vehicle", "C.D")),
    }
    for kind, (name, more) in formats.items():
        out = tmp_path / name
        done = cli("export", FIGURE, "-o", out, "--format", kind, *SMALL, *more, "--json")
        assert done.code == 0
        loss = done.answer["report"]["nearest"]["mean"]
        assert ("warning: routes on the graph of figure1" in done.err) == (loss > 0.1)
        graph = hn.ext.fleet.load_graph(out)
        assert (graph.n_nodes, graph.n_edges) == (done.answer["nodes"], done.answer["edges"])
        assert [floor.name for floor in hn.ext.fleet.load_building_graph(out).floors] == ["0"]
        done = cli("check", FIGURE, out, *SMALL[:2], "--floor", "0", "--json")
        assert (done.code, done.answer["findings"]) == (0, {})


def test_what_a_format_does_not_hold_is_printed(cli, tmp_path):
    out = tmp_path / "a.yaml"
    done = cli("export", OFFICE, "-o", out, "--format", "rmf", "--no-doors")
    assert done.code == 0
    assert "left out   doors: as asked\n" in done.out
    assert hn.ext.fleet.load_building_graph(out).floors[0].doors == ()


def test_options_of_fleets_are_refused_elsewhere(cli, tmp_path):
    out = tmp_path / "a.geojson"
    refused = {
        ("--anchor", "1,2"): "--anchor is for --format osm, got nav2",
        ("--vehicle", "A.B"): "--vehicle is for --format lif, got nav2",
        ("--no-doors",): "--no-doors is for --format rmf, got nav2",
        ("--floor", "1"): "--floor is for --format rmf, osm, lif, got nav2",
        ("--format", "osm"): "--out",
    }
    for given, words in refused.items():
        assert cli("export", FIGURE, "-o", out, *given).refuses(2, words)
    out = tmp_path / "a.osm"
    for anchor in ("here", "1", "1,2,3,4", "1,nan", "99,0"):
        done = cli("export", FIGURE, "-o", out, "--format", "osm", "--anchor", anchor)
        assert done.refuses(2, "--anchor")
    assert cli("export", FIGURE, "-o", out, "--format", "osm").refuses(2, "needs --anchor")
    out = tmp_path / "a.json"
    assert cli("export", FIGURE, "-o", out, "--format", "lif").refuses(2, "needs --vehicle")


def test_one_floor_of_several_is_judged(cli, tmp_path):
    graph = tmp_path / "two.yaml"
    level = "{vertices: [[1, 1, {name: a%d}], [1, 2, {}]], lanes: [[0, 1, {}], [1, 0, {}]]}"
    graph.write_text(f"levels: {{L1: {level % 1}, L2: {level % 2}}}")
    assert cli("check", FIGURE, graph).refuses(3, "it has the floors L1, L2: choose one")
    done = cli("check", FIGURE, graph, *SMALL[:2], "--floor", "L2", "--json")
    assert (done.answer["nodes"], done.answer["edges"]) == (2, 2)
    assert cli("check", FIGURE, graph, "--floor", "L3").refuses(3, "no floor is called 'L3'")
    done = cli(
        "evaluate", FIGURE, "--graph", graph, "--floor", "L1", "--pairs", "3", "-o", tmp_path / "r"
    )
    assert "two L1" in done.out
    refused = cli("evaluate", FIGURE, "--floor", "L1", "-o", tmp_path / "r")
    assert refused.refuses(2, "--floor goes with --graph")


@pytest.mark.parametrize("name", ["office/office.yaml", "building/building.yaml"])
def test_a_map_and_a_building_become_indoorgml(cli, tmp_path, name):
    out = tmp_path / "a.json"
    done = cli("export", FIGURE.parents[1] / name, "-o", out, "--format", "indoorgml", "--json")
    assert (done.code, done.err) == (0, "")
    layers = hn.ext.fleet.load_indoorgml(out).layers
    assert done.answer["layers"] == {
        each: {"cells": len(layer), "edges": layer.number_of_edges()}
        for each, layer in layers.items()
    }
    assert list(layers) == ["places", "rooms"]
    refused = cli("export", FIGURE, "-o", tmp_path / "a.gml", "--format", "indoorgml")
    assert refused.refuses(2, "must end in .json")
