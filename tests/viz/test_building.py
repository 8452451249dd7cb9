"""Pictures of buildings, of graphs that were checked, and animations of replays."""

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import networkx as nx
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from matplotlib.text import Text
from PIL import Image

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet import plot_building
from hybridnav.ext.live import ReplayAnimation, ReplayStep, replay
from hybridnav.graphs import plot_graph_check
from hybridnav.viz.canvas import known_view
from hybridnav.viz.style import PATH
from tests.ext.fleet.test_queries import office


def gids(ax: Any) -> list[str]:
    return [str(child.get_gid()) for child in ax.get_children() if child.get_gid()]


def test_each_floor_has_a_panel_and_the_highest_is_on_top() -> None:
    building = office()
    floors = [hn.ext.fleet.Floor(f.name, f.planner, 3.0 * i) for i, f in enumerate(building.floors)]
    building = hn.ext.fleet.Building(floors, building.links)
    plan = building.plan(("1", (1.5, 3.5)), ("2", (1.5, 4.5)))
    low, high = plot_building(building, plan)
    assert low.get_position().y0 < high.get_position().y0
    assert low.get_title() == "floor 1  ·  map 1  ·  2.0 m"
    for ax, number in ((low, 0), (high, 1)):
        (line,) = [child for child in ax.lines if child.get_gid() == "route-1"]
        path = plan.results[number].path
        np.testing.assert_array_equal(line.get_xydata(), path.points)
        assert {"link-west lift", "link-B"} <= set(gids(ax))
    words = {text.get_gid(): text.get_text() for text in low.texts if text.get_gid()}
    labels = words | {
        str(child.get_gid()): child.get_text()
        for child in low.get_children()
        if child.get_gid() and hasattr(child, "get_text")
    }
    assert labels["link-west lift-label"] == "west lift, to floor 2"
    assert labels["link-B-label"] == "B"
    assert {"start"} <= set(gids(low))
    assert {"goal"} <= set(gids(high))


def test_floors_that_no_route_visits_are_strips() -> None:
    building = office()
    plan = building.plan(("1", (1.5, 3.5)), ("1", (1.5, 4.5)))
    assert plan.floors == ("1",)
    low, high = plot_building(building, plan)
    assert low.get_position().height > 5 * high.get_position().height
    assert high.get_title() == "floor 2  ·  map 2  ·  not visited"
    assert {"link-west lift", "link-B"} <= set(gids(high))
    assert not {"cells", "route-1"} & set(gids(high))
    (mark,) = [line for line in high.lines if line.get_gid() == "link-B"]
    end = building.link("B").end_on("2")
    assert mark.get_xdata() == [end.position_m[0]]
    assert high.get_ylim()[0] < float(np.ravel(mark.get_ydata())[0]) < high.get_ylim()[1]
    low, high = plot_building(building)
    assert low.get_position().height == pytest.approx(high.get_position().height, rel=0.2)


def test_alternatives_have_a_line_each_and_none_is_needed() -> None:
    building = office()
    found = building.alternatives(("1", (1.5, 3.5)), ("2", (1.5, 4.5)), 2, max_stretch=9.0)
    axes = plot_building(building, found)
    legend = axes[0].get_legend() or axes[1].get_legend()
    texts = [text.get_text() for text in legend.get_texts()]
    assert len(set(texts)) == len(texts)
    assert {"lift", "stairs", "rooms", "occupied"} <= set(texts)
    assert {"route-1", "route-2"} <= set(gids(axes[0]))
    assert not [gid for ax in plot_building(building) for gid in gids(ax) if "route" in gid]
    none = building.plan(("1", (1.5, 3.5)), ("2", (1.5, 4.5)), closed_links=["B", "west lift"])
    assert not [gid for ax in plot_building(building, none) for gid in gids(ax) if "route" in gid]


def test_axes_of_the_caller_are_drawn_on() -> None:
    building = office()
    figure = Figure()
    given = list(figure.subplots(1, 2))
    assert plot_building(building, axes=given) == tuple(given)
    with pytest.raises(hn.errors.InvalidValueError, match="2 floors need as many axes, got 1"):
        plot_building(building, axes=given[:1])


def checked(points, edges, *, directed=False):
    cells = np.zeros((20, 40), dtype=np.float32)
    cells[:15, 20] = 1.0
    grid = hn.OccupancyGrid(cells, robot_radius_m=0, name="hall")
    plain: Any = nx.DiGraph(name="drawn") if directed else nx.Graph(name="drawn")
    for node, (x, y) in points.items():
        plain.add_node(node, x=x, y=y)
    plain.add_edges_from(edges)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=8.0))
    return hn.graphs.check_graph(topology, hn.graphs.WaypointGraph.from_networkx(plain))


def checked_links(nodes, links):
    whole = {"directed": True, "nodes": nodes, "links": links}
    grid = hn.OccupancyGrid(np.zeros((20, 40), np.float32), robot_radius_m=0, name="hall")
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=8.0))
    with TemporaryDirectory() as folder:
        path = Path(folder, "graph.json")
        path.write_text(json.dumps(whole))
        return hn.graphs.check_graph(topology, hn.ext.fleet.load_graph(path))


def names(ax):
    return {text.get_text() for text in ax.get_legend().get_texts()}


def marks(ax):
    return {tuple(point) for line in ax.lines for point in np.asarray(line.get_xydata()).tolist()}


def red_lines(ax):
    drawn = [one for one in ax.collections if isinstance(one, LineCollection)]
    return [
        line.tolist()
        for one in drawn
        if np.allclose(np.asarray(one.get_color())[0, :3], to_rgb(PATH))
        for line in one.get_segments()
    ]


def test_a_sound_graph_is_drawn_in_one_colour():
    ax = plot_graph_check(checked({"a": (5, 5), "b": (5, 15)}, [("a", "b")]))
    assert "nothing found" in ax.get_title()
    assert red_lines(ax) == []
    assert names(ax) == {"edges", "nodes", "occupied"}


def test_blocked_edges_and_nodes_are_drawn_where_they_are():
    points = {"a": (5, 5), "b": (35, 5), "c": (20.5, 5), "far": (48, 5), "lost": (5, 12)}
    ax = plot_graph_check(checked(points, [("a", "b"), ("a", "c"), ("b", "far")]))
    wanted = [[[5, 5], [20.5, 5]], [[5, 5], [35, 5]], [[35, 5], [48, 5]]]
    assert sorted(red_lines(ax)) == wanted
    assert names(ax) >= {
        "edges that the robot cannot follow",
        "error: nodes outside the map",
        "error: nodes where the robot does not fit",
        "error: edges that the robot cannot follow",
        "warning: nodes without edges",
    }
    marked = marks(ax)
    assert {(20.5, 5.0), (48.0, 5.0), (5.0, 12.0)} <= marked
    assert {(12.75, 5.0), (20.0, 5.0), (41.5, 5.0)} <= marked  # the middles of blocked edges
    assert ax.get_xlim()[1] > 48
    assert "hall" in ax.get_title()
    assert plot_graph_check(checked(points, []), title="").get_title() == ""


def test_every_finding_is_marked_or_said_not_to_be_drawn():
    points = {"a": (5, 5), "b": (5, 15), "c": (5, 15), "d": (8, 15), "e": (9, 9)}
    edges = [("a", "b"), ("b", "a"), ("b", "c"), ("c", "b"), ("d", "d"), ("a", "gone")]
    nodes: list[Any] = [{"id": name, "x": x, "y": y} for name, (x, y) in points.items()]
    nodes += [{"id": "f", "x": 500, "y": 5}, {"id": "no"}]
    links: list[Any] = [{"source": tail, "target": head} for tail, head in edges]
    links[0]["cost"] = -1
    check = checked_links(nodes, links)
    ax = plot_graph_check(check)
    legend = {name.removesuffix(": not drawn") for name in names(ax)}
    for found in check.findings:
        assert f"{found.severity}: {found.text.partition(',')[0]}" in legend
    assert {name for name in names(ax) if name.endswith("not drawn")} == {
        "error: nodes without coordinates: not drawn"
    }
    marked = marks(ax)
    assert {(5.0, 10.0), (8.0, 15.0), (5.0, 15.0), (9.0, 9.0), (5.0, 5.0)} <= marked
    # A node far away is marked at the rim of the picture.
    right = ax.get_xlim()[1]
    assert any(right - 1.0 <= x <= right and y == 5.0 for x, y in marked)


def test_edges_that_lead_one_way_have_an_arrow_on_them():
    points = {"a": (5, 5), "b": (5, 15), "c": (15, 15)}
    edges = [("a", "b"), ("b", "c"), ("c", "b")]
    ax = plot_graph_check(checked(points, edges, directed=True))
    (arrows,) = [each for each in ax.collections if isinstance(each, Quiver)]
    assert np.asarray(arrows.get_offsets()).tolist() == [[5.0, 10.0]]
    assert np.asarray(arrows.U).tolist() == [0.0]
    assert (np.asarray(arrows.V) > 0).all()
    assert "edges that lead one way" in names(ax)
    both = plot_graph_check(checked(points, edges))
    assert not [each for each in both.collections if isinstance(each, Quiver)]


def steps(count: int, **options: Any) -> list[ReplayStep]:
    """Replay two rooms in which a pallet moves, far from the second room."""
    grids = []
    for at in range(count):
        probability = np.zeros((12, 25), np.float32)
        probability[:, 12], probability[4:7, 12] = 1.0, 0.0
        probability[2 + at % 5, 3] = 1.0
        grids.append(hn.OccupancyGrid(probability, hn.Frame(0.25), robot_radius_m=0))
    return list(replay(grids, merge_distance_m=1.5, **options))


def frames_of(path: Path) -> list[np.ndarray]:
    with Image.open(path) as image:
        frames = []
        for at in range(image.n_frames):  # type: ignore[attr-defined]
            image.seek(at)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
        return frames


def test_colours_last_where_nothing_changes(tmp_path: Path) -> None:
    animation = ReplayAnimation()
    for step in steps(4):
        animation.add(step)
    animation.save(tmp_path / "replay.gif")
    frames = frames_of(tmp_path / "replay.gif")
    assert len(frames) == 4
    height, width, _ = frames[0].shape
    # The map of rooms lies below that of places: its right half is the second room.
    second = np.s_[int(0.6 * height) : int(0.85 * height), int(0.6 * width) : int(0.9 * width)]
    for frame in frames[1:]:
        # GIFs round colours, most of all at the rims of letters.
        assert (np.abs(frame[second] - frames[0][second]) > 16).mean() < 0.01
    left = np.s_[int(0.6 * height) : int(0.85 * height), int(0.2 * width) : int(0.4 * width)]
    middle = [np.median(frames[0][part].reshape(-1, 3), axis=0) for part in (left, second)]
    assert np.abs(middle[0] - middle[1]).max() > 20


def test_rooms_have_names_and_doors_have_numbers() -> None:
    labels = np.zeros((12, 25), np.int32)
    labels[:, 12:] = 1
    rooms = hn.RoomLabels(("kitchen", "lab"), labels, {}, {7: (3.1, 1.4)})
    animation = ReplayAnimation()
    for step in steps(3, rooms=rooms):
        animation.add(step)
    frame = animation._last
    assert frame is not None
    places, of_rooms = animation._drawn(frame, known_view(frame.grid)).axes
    assert places.get_title(loc="left").startswith("map 3")
    assert of_rooms.get_title(loc="left") == "2 rooms, 1 doors"
    written = {text.get_gid(): text.get_text() for text in of_rooms.findobj(Text)}
    assert (written["room-0"], written["room-1"], written["door-7"]) == ("kitchen", "lab", "7")
    (dots,) = (line for line in of_rooms.lines if line.get_gid() == "doors")
    assert np.array_equal(dots.get_xydata(), [frame.rooms.doors[7].position])
    assert not any(text.get_gid() for text in places.findobj(Text))


def test_long_replays_keep_few_frames_and_the_last(tmp_path: Path) -> None:
    animation = ReplayAnimation(most_frames=4, width_in=3.0)
    for step in steps(11):
        animation.add(step)
    animation.save(tmp_path / "replay.gif")
    assert len(frames_of(tmp_path / "replay.gif")) in {3, 4}


def test_hostile_input_ends_in_one_line(tmp_path: Path) -> None:
    empty, full = ReplayAnimation(), ReplayAnimation(width_in=3.0)
    full.add(steps(1)[0])
    for ask, message in (
        (lambda: ReplayAnimation(most_frames=1), "2 or more frames"),
        (lambda: ReplayAnimation(seconds_per_frame=float("nan")), "choose a time"),
        (lambda: ReplayAnimation(width_in=-1.0), "choose a width"),
        (lambda: empty.save(tmp_path / "a.gif"), "without frames"),
        (lambda: full.save(tmp_path / "a.png"), "must end in .gif"),
        (lambda: full.save(tmp_path / "none" / "a.gif"), "cannot write"),
    ):
        with pytest.raises(InvalidValueError, match=message) as error:
            ask()
        assert "\n" not in str(error.value)
