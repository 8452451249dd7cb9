"""Files of Open-RMF: navigation graphs by the rules of its fleet adapter, maps of its editor."""

import cmath
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import shapely
import yaml
from hypothesis import assume
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.fleet import BuildingGraph, LinkEnd, align_floors, join_links
from tests.ext.fleet.files.drawn_buildings import buildings
from tests.ext.fleet.files.rmf_reader import read_rmf
from tests.strategies import tried


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("rmf") / "graph.yaml"


def has_edges(building):
    return any(floor.graph.n_edges for floor in building.floors)


def lifts_apart(building):
    """Whether the vertices of every lift would be its own: no node in two lifts."""
    ends = [(end.floor, end.position_m) for link in building.links for end in link.ends]
    return len(set(ends)) == len(ends) and all(
        math.dist(a[1], b[1]) > 0.1 for a in ends for b in ends if a[0] == b[0] and a != b
    )


@tried(150, buildings(aligned=True))
def test_the_fleet_adapter_sees_every_node_edge_door_and_lift(file, building):
    assume(has_edges(building) and lifts_apart(building))
    hn.ext.fleet.export_rmf(building, file)
    found = read_rmf(file)
    joined = join_links(building)
    offset = 0
    lanes: Counter[tuple[int, int]] = Counter()
    for floor in joined.floors:
        graph = floor.graph
        for node, point in enumerate(graph.points.tolist()):
            level, *at = found.waypoints[offset + node]
            assert level == floor.name
            assert at == pytest.approx(point, abs=1e-6)
            is_charger = graph.node_facts.get(node, {}).get("is_charger", False)
            assert ("is_charger" in found.flags[offset + node]) == is_charger
        for tail, head in graph.edges.tolist():
            lanes[tail + offset, head + offset] += 1
        offset += graph.n_nodes
    assert len(found.waypoints) == offset
    n_lanes = sum(lanes.values())
    assert Counter(lane[:2] for lane in found.lanes[:n_lanes]) == lanes
    lifts = [link for link in building.links if link.kind == "lift"]
    assert set(found.lifts) == {link.name for link in lifts}
    for link in lifts:
        stops = [at for at, name in found.lift_of.items() if name == link.name]
        assert [found.waypoints[at][0] for at in stops] == [end.floor for end in link.ends]
    names = {door.name: floor.name for floor in building.floors for door in floor.doors}
    assert {name: where for name, (_, where) in found.doors.items()} == names


@tried(150, buildings(kinds=["lift"], aligned=True))
def test_what_is_read_back_is_what_was_written(file, building):
    assume(has_edges(building) and lifts_apart(building))
    hn.ext.fleet.export_rmf(building, file)
    back = hn.ext.fleet.load_building_graph(file)
    joined = join_links(building)
    assert back.name == building.name
    assert [floor.name for floor in back.floors] == [floor.name for floor in joined.floors]
    for read, written in zip(back.floors, joined.floors, strict=True):
        assert read.graph.points == pytest.approx(written.graph.points, abs=1e-6)
        assert read.graph.edges.tolist() == written.graph.edges.tolist()
        assert [door.name for door in read.doors] == [door.name for door in written.doors]
        assert not read.graph.findings
        for edge, facts in written.graph.edge_facts.items():
            known = read.graph.edge_facts.get(edge, {})
            assert known.get("door_name") == facts.get("door_name")
            assert known.get("speed_limit") == facts.get("speed_limit")
    for link, known in zip(back.links, building.links, strict=True):
        assert (link.name, link.kind) == (known.name, "lift")
        radius = known.max_radius_m
        assert link.max_radius_m == (1.0 if math.isinf(radius) else radius)
        for one, other in zip(link.ends, known.ends, strict=True):
            assert one.floor == other.floor
            assert one.position_m == pytest.approx(other.position_m, abs=0.011)


HOUSE = """
building_name: house
levels:
  L1: {vertices: [[0, 0, {name: a}], [3, 4, {name: "", lift: east}]], lanes: [[0, 1, {}]]}
  L2: {vertices: [[3, 4, {lift: east}], [9, 4, {name: b}]], lanes: [[0, 1, {}]]}
lifts: {east: {position: [3, 4, 0], dims: [1.5, 2.0]}}
doors: {d: {endpoints: [[1, 0], [0, 1]], map: L1}}
"""


@pytest.fixture
def house(tmp_path):
    path = tmp_path / "house.yaml"
    path.write_text(HOUSE)
    return hn.ext.fleet.load_building_graph(path)


def test_a_file_drawn_by_hand(house):
    (lift,) = house.links
    assert (lift.name, lift.kind, lift.max_radius_m) == ("east", "lift", 0.75)
    assert lift.ends == (LinkEnd("L1", (3.0, 4.0)), LinkEnd("L2", (3.0, 4.0)))
    assert house.floor("L1").graph.names == ("a", 1)
    assert house.floor("L1").doors[0].ends == ((1.0, 0.0), (0.0, 1.0))
    assert house.floor("L1").graph.edges.tolist() == [[0, 1]]


def test_lifts_that_do_not_line_up_are_refused_and_aligned(house, tmp_path):
    (lift,) = house.links
    moved = replace(lift, ends=(lift.ends[0], LinkEnd("L2", (9.0, 4.0))))
    apart = BuildingGraph(name="house", floors=house.floors, links=(moved,))
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"lie 6\.00 m apart, and Open-RMF allows 0\.1 m"
    ):
        hn.ext.fleet.export_rmf(apart, tmp_path / "a.yaml")
    hn.ext.fleet.export_rmf(align_floors(apart), tmp_path / "a.yaml")
    assert read_rmf(tmp_path / "a.yaml").lifts["east"][:2] == (3.0, 4.0)


def test_the_ends_of_a_lift_that_lie_apart_on_maps_are_joined_at_their_mean(house, tmp_path):
    (lift,) = house.links
    moved = replace(lift, ends=(lift.ends[0], LinkEnd("L2", (3.3, 4.2))))
    notes = hn.ext.fleet.export_rmf(replace(house, links=(moved,)), tmp_path / "a.yaml")
    assert notes == ("lift east: its own ends, 0.36 m apart: vertices lie at their mean",)
    found = read_rmf(tmp_path / "a.yaml")
    stops = [at for at, name in found.lift_of.items() if name == "east"]
    assert [found.waypoints[at] for at in stops] == [("L1", 3.15, 4.1), ("L2", 3.15, 4.1)]
    for stop in stops:
        joined = {lane[0] for lane in found.lanes if lane[1] == stop}
        (node,) = {at for at in joined if found.waypoints[at][0] == found.waypoints[stop][0]}
        assert math.dist(found.waypoints[node][1:3], (3.15, 4.1)) < 0.25
        assert any(lane[:2] == (stop, node) for lane in found.lanes)
    back = hn.ext.fleet.load_building_graph(tmp_path / "a.yaml")
    assert back.links[0].ends == (LinkEnd("L1", (3.15, 4.1)), LinkEnd("L2", (3.15, 4.1)))


def test_what_the_format_has_no_place_for_is_said(house, tmp_path):
    (lift,) = house.links
    stairs = replace(lift, name="steps", kind="stairs")
    both = BuildingGraph(name="h", floors=house.floors, links=(replace(lift, wait_s=9.0), stairs))
    assert hn.ext.fleet.export_rmf(both, tmp_path / "a.yaml", doors=False) == (
        "lift east: its waiting time, ride time and cost",
        "stairs steps: Open-RMF knows lifts only",
        "doors: as asked",
    )
    assert not read_rmf(tmp_path / "a.yaml").doors
    # parse_graph.cpp of open-rmf/rmf_ros2 (rmf_fleet_adapter) joins the floors of a lift both ways.
    up = replace(house, links=(replace(lift, one_way="up"),))
    assert hn.ext.fleet.export_rmf(up, tmp_path / "a.yaml") == (
        "lift east ↑: its direction, Open-RMF takes lifts both ways",
    )


def test_two_lifts_at_one_point_are_refused(house, tmp_path):
    twin = replace(house.links[0], name="west")
    both = replace(house, links=(*house.links, twin))
    with pytest.raises(
        hn.errors.InvalidValueError, match="the lifts 'east' and 'west' end at one node"
    ):
        hn.ext.fleet.export_rmf(both, tmp_path / "a.yaml")


COORDINATES = st.integers(0, 4000).map(lambda value: value / 100)
POINTS = st.lists(st.tuples(COORDINATES, COORDINATES), min_size=2, max_size=7, unique=True)
MARKS = {"a": 1 + 2j, "b": 30 + 5j, "c": 12 + 31j}
"""Fiducials in metres, in the frame of the reference level."""


@pytest.fixture(scope="module")
def drawing(tmp_path_factory):
    return tmp_path_factory.mktemp("editor") / "house.building.yaml"


class Level:
    """A level drawn over an image that lies turned, scaled and moved; y of pixels points down."""

    def __init__(self, points, pose):
        self.points = points
        self.scale, self.yaw, self.at = pose
        self.lanes, self.doors = [], []

    def pixel(self, metres):
        """Pixel of a point in metres."""
        at = (metres - self.at) * cmath.exp(-1j * self.yaw) / self.scale
        return [at.real, -at.imag]

    def content(self, elevation):
        points = [complex(*point) for point in self.points]
        ends = [end for door in self.doors for end in door]
        measured = [0j, 5 + 0j]
        vertices = [
            [*self.pixel(at), 0, "", {}]
            for at in [*points, *(complex(*end) for end in ends), *measured]
        ]
        for number in range(len(points)):
            vertices[number][3] = f"{elevation:g}-{number}"
        first = len(points)
        return {
            "elevation": elevation,
            "drawing": {"filename": "a.png"},
            "vertices": vertices,
            "fiducials": [[*self.pixel(at), name] for name, at in MARKS.items()],
            "measurements": [[len(vertices) - 2, len(vertices) - 1, {"distance": [3, 5.0]}]],
            "doors": [
                [first + 2 * k, first + 2 * k + 1, {"name": [1, f"{elevation:g}d{k}"]}]
                for k in range(len(self.doors))
            ],
            "lanes": [
                [
                    tail,
                    head,
                    {"graph_idx": [2, graph], "bidirectional": [4, both], "speed_limit": [3, 0]},
                ]
                for tail, head, graph, both in self.lanes
            ],
        }


@st.composite
def drawn(draw):
    poses = [(draw(st.floats(0.01, 0.2)), 0.0, 0j)]
    poses += [
        (
            draw(st.floats(0.01, 0.2)),
            draw(st.floats(-3, 3)),
            complex(*draw(st.tuples(COORDINATES, COORDINATES))),
        )
        for _ in range(draw(st.integers(0, 2)))
    ]
    levels = []
    for pose in poses:
        level = Level(draw(POINTS), pose)
        nodes = st.integers(0, len(level.points) - 1)
        lane = st.tuples(nodes, nodes, st.sampled_from([0, 0, 3]), st.booleans())
        level.lanes = [(0, 1, 0, True), *draw(st.lists(lane, max_size=6))]
        level.doors = draw(
            st.lists(st.tuples(*[st.tuples(COORDINATES, COORDINATES)] * 2), max_size=2)
        )
        levels.append(level)
    return levels


@tried(120, drawn(), st.randoms())
def test_pixels_become_the_metres_that_they_were_drawn_from(drawing, levels, order):
    contents = {f"L{k}": level.content(4.0 * k) for k, level in enumerate(levels)}
    names = list(contents)
    order.shuffle(names)
    data = {
        "name": "house",
        "coordinate_system": "reference_image",
        "reference_level_name": "L0",
        "levels": {name: contents[name] for name in names},
    }
    drawing.write_text(yaml.safe_dump(data))
    building = hn.ext.fleet.load_building_graph(drawing)
    assert [floor.name for floor in building.floors] == [f"L{k}" for k in range(len(levels))]
    for number, (floor, level) in enumerate(zip(building.floors, levels, strict=True)):
        lanes = [lane for lane in level.lanes if lane[2] == 0]
        used = {end for lane in lanes for end in lane[:2]}
        assert set(floor.graph.names) == {f"{4 * number}-{end}" for end in used}
        at = {name: node for node, name in enumerate(floor.graph.names)}
        for end in used:
            point = floor.graph.points[at[f"{4 * number}-{end}"]]
            assert point == pytest.approx(level.points[end], abs=1e-6)
        ways = [lane[:2] for lane in lanes] + [lane[1::-1] for lane in lanes if lane[3]]
        assert Counter(map(tuple, floor.graph.edges.tolist())) == Counter(
            (at[f"{4 * number}-{tail}"], at[f"{4 * number}-{head}"]) for tail, head in ways
        )
        lines = {
            f"{4 * number}d{k}": shapely.LineString(door) for k, door in enumerate(level.doors)
        }
        assert {door.name for door in floor.doors} == set(lines)
        for edge, ends in enumerate(floor.graph.points[floor.graph.edges]):
            named = floor.graph.edge_facts.get(edge, {}).get("door_name")
            lane = shapely.LineString(ends)
            crossed = {
                name
                for name, line in lines.items()
                if line.crosses(lane)  # by more than pixels are rounded
                and min(line.boundary.distance(lane), lane.boundary.distance(line)) > 1e-6
            }
            assert bool(crossed) <= (named is not None)
            assert named is None or lines[named].distance(lane) < 1e-6


LANE = {"graph_idx": [2, 0], "orientation": [1, "forward"], "bidirectional": [4, True]}
CORNER = [0, 0, 0, ""]
UNMEASURED = [[0, 9, {}]]


def write(path, **changes):
    data = {
        "building_name": "small",
        "levels": {
            name: {
                "elevation": height,
                "vertices": [
                    [100, 100, 0, "", {}],
                    [300, 100, 0, f"desk{name}", {"is_charger": [4, True]}],
                    [200, 300, 0, "", {}],
                ],
                "measurements": [[0, 1, {"distance": [3, 10.0]}]],
                "lanes": [[1, 2, LANE]],
            }
            for name, height in (("up", 3.0), ("down", 0))
        },
        "lifts": {
            "hoist": {
                "x": 210, "y": 300, "yaw": 0.3, "width": 2.0, "depth": 1.4,
                "reference_floor_name": "down",
                "level_doors": {"up": ["d"], "down": ["d"]},
            }
        },
    }  # fmt: skip
    path.write_text(yaml.safe_dump(data | changes))
    return path


def test_a_lift_ends_at_the_vertices_in_its_cabin(tmp_path):
    building = hn.ext.fleet.load_building_graph(write(tmp_path / "a.building.yaml"))
    assert building.name == "small"
    assert [(floor.name, floor.elevation_m) for floor in building.floors] == [
        ("down", 0.0),
        ("up", 3.0),
    ]
    (lift,) = building.links
    assert (lift.name, lift.max_radius_m) == ("hoist", 0.7)
    assert lift.ends == (LinkEnd("down", (10.0, -15.0)), LinkEnd("up", (10.0, -15.0)))
    graph = building.floor("up").graph
    assert graph.points.tolist() == [[15.0, -5.0], [10.0, -15.0]]
    assert graph.node_facts[0] == {"is_charger": True, "name": "deskup"}
    assert [facts["orientation_constraint"] for facts in graph.edge_facts.values()] == [
        "forward",
        "backward",
    ]


@pytest.mark.parametrize("yaw", np.linspace(0, math.pi, 7))
def test_a_cabin_is_a_turned_rectangle_with_its_gap(tmp_path, yaw):
    rng = np.random.default_rng(3)
    for x, y in rng.uniform(150, 270, (12, 2)):
        sides = {"width": 3.0, "depth": 1.4, "yaw": float(yaw)}
        facts = {"x": float(x), "y": float(y) + 80, "level_doors": {"up": [], "down": []}} | sides
        building = hn.ext.fleet.load_building_graph(
            write(tmp_path / "a.yaml", lifts={"hoist": facts})
        )
        box = shapely.affinity.rotate(shapely.box(-1.55, -0.75, 1.55, 0.75), yaw, use_radians=True)
        cabin = shapely.affinity.translate(box, x * 0.05, -(y + 80) * 0.05)
        assert bool(building.links) == cabin.covers(shapely.Point(10.0, -15.0))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"coordinate_system": "wgs84"}, "coordinate_system 'wgs84' is not read"),
        ({"reference_level_name": "roof"}, "the reference level 'roof' is not there"),
        ({"lifts": {"a": {"x": 1, "y": 1, "yaw": 0, "width": 0, "depth": 1}}}, "width and depth"),
        ({"lifts": {"a": 7}}, "expected the lift as a mapping"),
        ({"lifts": {"a": {"x": 1, "y": 1, "yaw": 0, "width": 1, "depth": 1,
                          "reference_floor_name": "attic"}}}, "level attic is not there"),
        ({"levels": {"a": {"vertices": [CORNER], "measurements": UNMEASURED, "lanes": []}}},
         "no lane of graph 0; graphs with lanes: none"),
        ({"levels": {"a": {"vertices": [CORNER], "measurements": UNMEASURED,
                           "lanes": [[0, 0, LANE]]}}}, "expected two points and distance"),
        ({"levels": {"a": {"vertices": [CORNER], "lanes": [[0, "b", LANE]]}},
          "coordinate_system": "cartesian_meters", "lifts": {}}, "with two numbers"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line(tmp_path, change, words):
    with pytest.raises(hn.errors.MapError, match=words) as caught:
        hn.ext.fleet.load_building_graph(write(tmp_path / "a.yaml", **change))
    assert "\n" not in str(caught.value)


def test_lanes_are_not_tested_against_doors_without_end(tmp_path, monkeypatch):
    monkeypatch.setattr("hybridnav.ext.fleet.files.rmf_editor._MOST_CROSSINGS", 1)
    vertices = [[0, 0, 0, ""], [9, 0, 0, ""], [4, -5, 0, ""], [4, 5, 0, ""]]
    level = {"vertices": vertices, "lanes": [[0, 1, {}]], "doors": [[2, 3, {"name": [1, "d"]}]]}
    changes = {"coordinate_system": "cartesian_meters", "lifts": {}, "levels": {"a": level}}
    graph = hn.ext.fleet.load_graph(write(tmp_path / "a.yaml", **changes))
    assert graph.edge_facts[0]["door_name"] == "d"
    level["doors"].append([2, 3, {"name": [1, "e"]}])
    with pytest.raises(hn.errors.MapError, match="2 doors and 1 lanes, at most 1 pairs"):
        hn.ext.fleet.load_graph(write(tmp_path / "a.yaml", **changes))


def told(building):
    return [
        (found.kind, each.where)
        for floor in building.floors
        for found in floor.graph.findings
        for each in found.examples
    ]


def changed(tmp_path, change):
    path = write(tmp_path / "a.yaml")
    data = yaml.safe_load(path.read_text())
    change(data)
    path.write_text(yaml.safe_dump(data))
    return hn.ext.fleet.load_building_graph(path)


# rmf_building_map_tools of open-rmf/rmf_traffic_editor (main of 2025), building_map/level.py,
# calculate_scale_using_measurements: set_scale(1.0) without measurements, "Nav graph generated in
# pixel units, not meters!".
def test_a_level_without_measurements_is_in_pixels(tmp_path):
    building = changed(tmp_path, lambda data: data["levels"]["up"].pop("measurements"))
    assert building.floor("up").graph.points.tolist() == [[300.0, -100.0], [200.0, -300.0]]
    text = "level up: no measurement has a length: a pixel is taken as 1 m"
    assert ("scale-unsure", text) in told(building)


# There a measurement of 0 counts as the scale 0 in the mean, and one between two vertices at one
# point divides by zero: both say nothing of the scale.
@pytest.mark.parametrize("useless", [[0, 1, {"distance": [3, 0.0]}], [1, 1, {"distance": [3, 2]}]])
def test_measurements_without_a_length_are_findings(tmp_path, useless):
    building = changed(
        tmp_path, lambda data: data["levels"]["down"]["measurements"].append(useless)
    )
    assert building.floor("down").graph.points.tolist() == [[15.0, -5.0], [10.0, -15.0]]
    (text,) = [where for kind, where in told(building) if kind == "scale-unsure"]
    assert text.startswith("level down: measurement 1 is ")


def fiducials(data, of_up):
    data["reference_level_name"] = "down"
    corners = {"a": [0, 0], "b": [400, 0], "c": [0, 400], "d": [400, 400]}
    for level, known in (("down", corners), ("up", corners | of_up)):
        marks = [[*at, name] for name, at in known.items() if at]
        data["levels"][level]["fiducials"] = marks


# building.py and transform.py, set_from_fiducials, by which 1.87 m was computed apart: without two
# fiducials of one name the level keeps the identity.
@pytest.mark.parametrize(
    ("of_up", "expected"),
    [
        ({}, []),
        ({"d": [480, 400]}, ["fiducials lie up to 1.87 m from their fit, d the farthest"]),
        ({"c": None, "d": None, "b": [800, 0]},
         ["a pixel is 0.025 m by fiducials, 0.05 m by measurements"]),
        ({"b": None, "c": None, "d": None},
         ["fiducials as on down: a, expected two: it is not aligned"]),
    ],
)  # fmt: skip
def test_fiducials_that_do_not_fit_are_findings(tmp_path, of_up, expected):
    building = changed(tmp_path, lambda data: fiducials(data, of_up))
    kinds = {"fiducial-off", "level-unaligned"}
    found = [where for kind, where in told(building) if kind in kinds]
    assert found == [f"level up: {text}" for text in expected]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"vertices": [[0, 0, 0, "x"], [50, 0, 0, "y"]], "lanes": [[0, 1, LANE]],
          "measurements": [[0, 1, {"distance": [3, 2.5]}]]},
         "lift hoist: no vertex in its cabin on level roof"),
        (None, "lift hoist: level_doors names roof, which is not there"),
        ({"vertices": [[0, 0, 0, "x"]], "lanes": []}, None),
    ],
)  # fmt: skip
def test_a_stop_of_a_lift_that_is_lost_is_a_finding(tmp_path, change, text):
    def change_all(data):
        data["lifts"]["hoist"]["level_doors"]["roof"] = ["d"]
        if change:
            data["levels"]["roof"] = change

    building = changed(tmp_path, change_all)
    assert [end.floor for end in building.links[0].ends] == ["down", "up"]
    found = [where for kind, where in told(building) if kind == "stop-unread"]
    assert found == ([text] if text else [])


def test_graphs_of_other_fleets_are_read_by_number(tmp_path):
    path = write(tmp_path / "a.yaml")
    with pytest.raises(hn.errors.MapError, match="no lane of graph 2; graphs with lanes: 0"):
        hn.ext.fleet.load_building_graph(path, graph_index=2)


@pytest.mark.parametrize(
    "change",
    [{"x": 900}, {"level_doors": {"up": ["d"], "attic": ["d"]}}],
    ids=["beside its vertices", "a level that is not there"],
)
def test_a_lift_that_is_lost_is_a_finding(tmp_path, change):
    building = changed(tmp_path, lambda data: data["lifts"]["hoist"].update(change))
    assert building.links == ()
    ((kind, where),) = [each for each in told(building) if each[0].startswith(("link", "stop"))]
    assert kind == "link-unread"
    assert where.startswith("lift hoist, vertices in its cabin on ")
