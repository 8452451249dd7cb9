"""`hybridnav export` of a building of several floors."""

from __future__ import annotations

import pytest

import hybridnav as hn
from tests.houses import write_house


@pytest.fixture
def house(tmp_path):
    """Two floors of one map, a lift, and stairs that lead sideways."""
    return write_house(tmp_path)


@pytest.mark.parametrize(
    ("more", "links"),
    [
        (("rmf", "-o", "a.yaml"), {"lift"}),
        (("osm", "-o", "a.osm", "--anchor", "48.15,11.57"), {"lift", "ladder"}),
        (("lif", "-o", "a.json", "--vehicle", "A.B"), {"lift", "ladder"}),
    ],
)
def test_floors_and_links_are_read_back(cli, house, more, links, monkeypatch):
    monkeypatch.chdir(house.parent)
    given = ("--robot-radius", "0", "--spacing", "1", "--format", *more)
    done = cli("export", house, *given, "--json")
    assert (done.code, done.err) == (0, "")
    read = hn.load_building_graph(more[2])
    counts = {
        floor.name: {"nodes": floor.graph.n_nodes, "edges": floor.graph.n_edges}
        for floor in read.floors
    }
    assert counts == done.answer["floors"]
    assert {link.name for link in read.links} == links
    lift = next(link for link in read.links if link.name == "lift")
    ends = [end.position_m for end in lift.ends]
    assert ends[0] == pytest.approx(ends[1], abs=0.02)
    shown = cli("export", house, *given).out
    assert "links      lift, ladder\n" in shown
    assert ("Open-RMF knows lifts only" in shown) == ("rmf" in more)


def test_what_is_for_one_map_is_refused(cli, house, tmp_path):
    done = cli("export", house, "-o", tmp_path / "a.geojson")
    assert done.refuses(2, "--format nav2 is for one map, and this is a building")
    done = cli("export", house, "-o", tmp_path / "a.yaml", "--format", "rmf", "--floor", "1")
    assert done.refuses(2, "--floor is for one map, and this is a building")
    assert not list(tmp_path.glob("a.*"))


def test_a_link_that_the_robot_does_not_fit_in_is_left_out(house):
    text = house.read_text().replace("kind: lift,", "kind: lift, max_radius_m: 0.05,")
    house.write_text(text)
    building = hn.load_building(house, robot_radius_m=0.1)
    assert [link.name for link in hn.building_graph(building, nodes=10).links] == ["ladder"]
