"""Pictures of rooms, routes and costs: names that do not hide each other, doors by number."""

import itertools
import re
from typing import Any

import numpy as np
import pytest
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

import hybridnav as hn
from hybridnav.guide.alternatives import Alternatives
from hybridnav.maps import RoomLabels
from hybridnav.viz import plot_alternatives, plot_costs, plot_plan, plot_rooms, plot_tour
from tests.layers import grid_of, layer_of
from tests.strategies import drawn, occupancy_grid

# A ring of corridor round a block, and a closet that nothing leads to.
RING = drawn(
    "#############",
    "#.......#...#",
    "#.#####.#...#",
    "#.#####.#...#",
    "#.#####.#...#",
    "#.......#...#",
    "#############",
)


@pytest.fixture(scope="module")
def ring():
    """West, east and closet; two doors between west and east."""
    label_of = np.full(RING.shape, -1, dtype=np.int32)
    label_of[1:6, 1:4], label_of[1:6, 4:8], label_of[1:6, 9:12] = 0, 1, 2
    rooms = RoomLabels(("west", "east", "closet"), label_of)
    grid = occupancy_grid(RING, resolution_m=0.5)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=2.0, rooms=rooms)
    return hn.HybridPlanner(hn.TopologicalMap(pyramid))


def texts(ax, pattern):
    """Texts by gid, drawn inside the axes."""
    return {
        t.get_gid(): t for t in ax.texts + ax.artists if re.fullmatch(pattern, t.get_gid() or "")
    }


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def many_rooms(side):
    """A map of 8 x 8 rooms, a few cells each, with names far too long for them."""
    cells = np.zeros((8 * side + 1, 8 * side + 1), dtype=np.uint8)
    rows, cols = np.indices(cells.shape)
    wall = (rows % side == 0) | (cols % side == 0)
    label_of = np.where(wall, -1, rows // side * 8 + cols // side).astype(np.int32)
    grid = hn.OccupancyGrid(wall.astype(np.float32), hn.Frame(0.1), robot_radius_m=0)
    return RoomLabels(tuple(f"laboratory {n}" for n in range(64)), label_of), grid


@pytest.mark.parametrize(
    ("side", "width_in"), [pytest.param(9, 2.5, marks=pytest.mark.full), (9, 3.0), (9, 15.0)]
)
def test_names_hide_neither_each_other_nor_the_room_beside(side, width_in):
    labels, grid = many_rooms(side)
    ax = plot_rooms(labels, grid, width_in=width_in)
    ax.figure.figure.set_dpi(600)  # a text is measured in whole dots
    renderer = FigureCanvasAgg(ax.figure.figure).get_renderer()
    names = texts(ax, r"room-\d+")
    boxes = {gid: text.get_window_extent(renderer) for gid, text in names.items()}
    for one, other in itertools.combinations(boxes.values(), 2):
        wide = min(one.x1, other.x1) - max(one.x0, other.x0)
        high = min(one.y1, other.y1) - max(one.y0, other.y0)
        assert wide <= 4 or high <= 0.2 * one.height  # a font's box is higher than its letters
    for gid, box in boxes.items():
        middle = ax.transData.inverted().transform([((box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2)])
        endpoints = ax.transData.inverted().transform([(box.x0 + 4, box.y0), (box.x1 - 4, box.y0)])
        endpoints[:, 1] = middle[0, 1]
        cells = grid.frame.cells_of(np.concatenate([middle, endpoints]))
        assert set(labels.label_of[tuple(cells.T)].tolist()) <= {-1, int(gid.split("-")[1])}
    numbers = texts(ax, r"number-\d+")
    assert len(names) + len(numbers) == 64  # every room has one or the other
    assert (not numbers) is (width_in == 15.0)
    for gid, text in numbers.items():
        label = int(gid.split("-")[1])
        assert text.get_text() == str(label + 1)
        assert f"{label + 1}  laboratory {label}" in legend(ax)


def test_a_room_too_small_for_its_number_is_pointed_out():
    cells = np.zeros((40, 60), dtype=np.uint8)
    label_of = np.zeros(cells.shape, dtype=np.int32)
    label_of[20, 30] = 1
    grid = hn.OccupancyGrid(cells.astype(np.float32), hn.Frame(0.5), robot_radius_m=0)
    ax = plot_rooms(RoomLabels(("hall", "shaft"), label_of), grid, width_in=3.0)
    assert texts(ax, r"number-1")["number-1"].get_text() == "2"
    (line,) = (line for line in ax.lines if line.get_gid() == "lead-1")
    assert np.asarray(line.get_xydata())[0].tolist() == pytest.approx([15.25, 10.25])
    assert "2  shaft" in legend(ax)


def test_a_tour_numbers_the_doors_that_its_words_tell_of(ring):
    tour = hn.plan_tour(ring, ["west", (3.75, 1.75)], at="point")
    passed = [leg.door.number for leg in tour.legs if leg.door is not None]
    assert len(passed) == 1
    ax = plot_tour(ring.topology, tour)
    numbers = texts(ax, r"door-\d+")
    assert [text.get_text() for text in numbers.values()] == [str(n) for n in passed]
    assert f"door {passed[0]} " in " ".join(tour.words())
    (door,) = (d for d in ring.topology.rooms.doors if d.number == passed[0])
    assert np.hypot(*np.subtract(numbers[f"door-{passed[0]}"].get_position(), door.position)) < 0.5


@pytest.mark.parametrize(("width_in", "size_m"), [(4.0, 0.2), (6.0, 0.5), (9.0, 0.5)])
def test_names_lie_beside_the_way_where_there_is_room(width_in, size_m):
    cells = np.zeros((21, 41), dtype=np.uint8)
    cells[[0, -1]], cells[:, [0, 20, -1]], cells[9:12, 20] = 1, 1, 0
    label_of = np.where(cells, -1, 0).astype(np.int32)
    label_of[1:-1, 21:-1] = 1
    rooms = RoomLabels(("west", "east"), label_of)
    grid = hn.OccupancyGrid(cells.astype(np.float32), hn.Frame(size_m))
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=4 * size_m, rooms=rooms)
    planner = hn.HybridPlanner(hn.TopologicalMap(pyramid), preset="grid-astar")
    endpoints = np.array([[3.5, 10.5], [37.5, 10.5]]) * size_m  # along the middle of both rooms
    ax = plot_tour(planner.topology, hn.plan_tour(planner, endpoints), width_in=width_in)
    (line,) = (line for line in ax.lines if line.get_gid() == "path")
    path = ax.transData.transform(line.get_xydata())
    renderer = FigureCanvasAgg(ax.figure.figure).get_renderer()
    names = texts(ax, r"room-\d+")
    assert len(names) == 2
    for text in names.values():
        box = text.get_window_extent(renderer)
        inside = (path >= [box.x0, box.y0]) & (path <= [box.x1, box.y1])
        assert not inside.all(axis=1).any(), text.get_text()


def test_labels_of_start_and_goal_keep_off_a_straight_path():
    """It has two points, both at its ends."""
    grid = occupancy_grid(np.ones((24, 60), dtype=np.uint8), resolution_m=0.25)
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    for start, goal in (((3.0, 3.0), (12.0, 3.0)), ((12.0, 2.0), (3.0, 2.5)), ((7, 1), (7, 5))):
        result = planner.plan(start, goal)
        assert len(result.path.points) == 2
        ax = plot_plan(planner.topology, result)
        renderer = FigureCanvasAgg(ax.get_figure(root=True)).get_renderer()
        line = shapely.LineString(ax.transData.transform(result.path.points))
        for text in texts(ax, "(start|goal)-label").values():
            box = text.get_window_extent(renderer)
            assert not line.intersects(shapely.box(*box.extents)), text.get_text()


def test_rooms_number_all_their_doors_where_there_is_room(ring):
    numbers = texts(plot_rooms(ring.topology), r"door-\d+")
    assert sorted(numbers) == [f"door-{door.number}" for door in ring.topology.rooms.doors]


def routes_of(ax):
    lines = {
        line.get_gid(): line for line in ax.lines if (line.get_gid() or "").startswith("route-")
    }
    return [lines[f"route-{n + 1}"] for n in range(len(lines))]


def test_all_alternatives_are_drawn_each_in_its_colour(ring):
    found = hn.plan_alternatives(ring, "west", (3.75, 1.75), 3, at="point")
    assert len(found) == 2
    ax = plot_alternatives(ring.topology, found)
    lines = routes_of(ax)
    for line, alternative in zip(lines, found, strict=True):
        assert np.array_equal(np.column_stack(line.get_data()), alternative.path.points)
    assert len({to_rgb(line.get_color()) for line in lines}) == 2
    # Where they share cells, the shorter lies on the longer, which shows on both its sides.
    assert lines[0].get_zorder() > lines[1].get_zorder()
    assert lines[0].get_linewidth() < lines[1].get_linewidth()
    told = [
        f"route {n}, {a.path.length_m:.2f} m, by door {a.doors[0]}"
        for n, a in enumerate(found, start=1)
    ]
    assert legend(ax)[:2] == told
    doors = {door.number for door in ring.topology.rooms.doors}
    assert set(texts(ax, r"door-\d+")) == {f"door-{number}" for number in doors}


def test_openings_are_no_doors_in_legend_and_list(tmp_path, cli):
    free = np.zeros((64, 204), dtype=np.uint8)
    free[2:22, 2:202] = free[22:62, 60:135] = 1  # a bay, open along its side
    label_of = np.where(free, 0, -1)
    label_of[22:] = np.where(free[22:], 1, -1)
    grid = occupancy_grid(free, resolution_m=0.1)
    rooms = hn.RoomLabels(("corridor", "bay"), label_of)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    found = hn.plan_alternatives(hn.HybridPlanner(topology), "corridor", "bay", 2, at="point")
    assert legend(plot_alternatives(topology, found))[0].endswith(", by opening 1")
    hn.write_ros_map(grid, tmp_path / "map.yaml")
    hn.save_rooms(tmp_path / "rooms.yaml", rooms, grid)
    query = ("plan", tmp_path / "map.yaml", "--from", "corridor", "--to", "bay")
    done = cli(*query, "--robot-radius", 0, "--at", "point", "--alternatives", 2)
    assert "by corridor (opening 1), bay" in done.out


def test_twenty_routes_are_all_told_apart(ring):
    (first, *_) = found = hn.plan_alternatives(ring, "west", "east", 2)
    many = hn.Alternatives((first,) * 20, complete=found.complete)
    lines = routes_of(plot_alternatives(ring.topology, many))
    looks = {(line.get_color(), str(line._unscaled_dash_pattern)) for line in lines}
    assert len(looks) == 20


def test_routes_that_share_all_their_way_show_each(ring):
    (path, *_) = hn.plan_alternatives(ring, "west", "east", 2, at="point")
    same = Alternatives((path,) * 5, complete=True)
    ax = plot_alternatives(ring.topology, same, width_in=4.0)
    picture = FigureCanvasAgg(ax.figure.figure)
    picture.draw()
    pixels = np.asarray(picture.buffer_rgba())[..., :3].astype(int)
    lines = {line.get_gid(): line for line in ax.lines}
    along = ax.transData.transform(lines["route-1"].get_xydata())
    low, high = along.min(axis=0) - 8, along.max(axis=0) + 8
    height = len(pixels)  # the legend, which has all colours, lies outside
    part = pixels[int(height - high[1]) : int(height - low[1]), int(low[0]) : int(high[0])]
    for number in range(1, 6):
        colour = np.array(to_rgb(lines[f"route-{number}"].get_color())) * 255
        alike = (np.abs(part - colour) < 40).all(axis=-1).sum()
        assert alike > np.hypot(*np.diff(along, axis=0).T).sum() / 4, number


def test_alternatives_on_a_map_without_rooms_and_without_a_path():
    grid = occupancy_grid(RING, resolution_m=0.5)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))
    planner = hn.HybridPlanner(topology)
    found = hn.plan_alternatives(planner, (0.75, 1.75), (3.75, 1.75), 2)
    ax = plot_alternatives(topology, found, title="")
    assert (len(routes_of(ax)), ax.get_title()) == (1, "")
    assert "places" in legend(ax)
    none = hn.plan_alternatives(planner, (0.75, 1.75), (5.25, 1.75), 2)
    ax = plot_alternatives(topology, none)
    assert not routes_of(ax)
    assert "no path" in ax.get_title()


@pytest.mark.parametrize("endpoints", [("0.75,1.75", "3.75,1.75"), ("west", "3.75,1.75")])
def test_the_command_draws_all_routes(cli, tmp_path, ring, endpoints):
    grid = occupancy_grid(RING, resolution_m=0.5)
    image = np.where(np.flipud(grid.measured) == hn.CellClass.OCCUPIED, 0, 254).astype(np.uint8)
    (tmp_path / "m.pgm").write_bytes(b"P5\n13 7\n255\n" + image.tobytes())
    (tmp_path / "m.yaml").write_text(
        "image: m.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    rooms = ring.topology.rooms
    hn.save_rooms(tmp_path / "rooms.yaml", rooms.labels, rooms.grid)
    picture = tmp_path / "m.svg"
    query = ("--from", endpoints[0], "--to", endpoints[1], "--alternatives", 2, "--robot-radius", 0)
    done = cli("plan", tmp_path / "m.yaml", *query, "--at", "point", "--plot", picture)
    assert done.code == 0
    drawn_routes = set(re.findall(r'id="(route-\d)"', picture.read_text()))
    assert drawn_routes == {f"route-{n}" for n in (1, 2)}
    assert done.out.count("\nroute ") == 2


def room() -> hn.OccupancyGrid:
    probability = np.zeros((20, 30))
    probability[[0, -1]] = probability[:, [0, -1]] = 1.0
    return grid_of(probability, hn.Frame(0.1), robot_radius_m=0.1, name="room")


def colour_at(ax: Any, row: int, col: int) -> list[int]:
    image = next(shown for shown in ax.images if shown.get_gid() == "cells")
    colour: list[int] = image.get_array()[row, col].tolist()
    return colour


def test_dearer_cells_are_darker_and_walls_stay_visible() -> None:
    grid = room()
    factors = np.ones(grid.shape)
    factors[5:15, 10:15], factors[5:15, 20:25] = 1.5, 3.0
    closed = np.zeros(grid.shape, np.bool_)
    closed[10:12, 3:6] = True
    ax = plot_costs(grid, layer_of(factors, closed), paths={"a path": [(0.5, 0.5), (2.5, 1.2)]})
    plain, mild, dear, wall = (
        sum(colour_at(ax, *cell)) for cell in ((3, 5), (8, 12), (8, 22), (0, 0))
    )
    assert colour_at(ax, 3, 5) == [255, 255, 255]
    assert wall < dear < mild < plain
    assert colour_at(ax, 10, 4) not in ([255, 255, 255], colour_at(ax, 8, 22))
    legend = ax.get_legend()
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels == ["occupied", "within 0.1 m of occupied", "closed", "a path"]
    assert ax.get_title() == "room  ·  metres cost 1 to 3 times as much"


@pytest.mark.parametrize(("most", "label"), [(3.0, "3"), (400.0, "200")])
def test_the_bar_states_factors_inside_the_figure(most: float, label: str) -> None:
    grid = room()
    factors = np.ones(grid.shape)
    factors[5:15, 10:15] = most
    ax = plot_costs(grid, layer_of(factors))
    figure = ax.figure
    figure.canvas.draw()
    bar = ax.child_axes[0]
    box, whole = bar.get_tightbbox(), figure.bbox
    assert whole.x0 <= box.x0 < box.x1 <= whole.x1
    assert whole.y0 <= box.y0 < box.y1 < ax.get_window_extent().y0
    texts = [tick.get_text() for tick in bar.get_xticklabels()]
    assert "1" in [text.removesuffix(".0") for text in texts]
    assert label in [text.removesuffix(".0") for text in texts]


def test_a_layer_of_another_map_and_unusable_paths_are_refused() -> None:
    grid = room()
    with pytest.raises(hn.errors.InvalidValueError, match="costs of 2 x 2 cells"):
        plot_costs(grid, layer_of(np.ones((2, 2))))
    with pytest.raises(hn.errors.InvalidValueError, match="points need finite coordinates"):
        plot_costs(grid, layer_of(np.ones(grid.shape)), paths={"a": [(0.0, np.nan)]})
