"""Pictures: what they show, where, and how they are saved."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

import hybridnav as hn
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.viz import plot_level, plot_map, plot_places, plot_plan, save_figure, style
from hybridnav.viz.layout import round_length, text_width, wrapped
from hybridnav.viz.places import Places, colour_vertices
from tests.strategies import class_grids, occupancy_grid, tried

MAPS = Path(__file__).parents[2] / "maps"
FREE, OCCUPIED, UNKNOWN = 0.0, 1.0, math.nan
START, GOAL = (1.0, 1.0), (11.0, 5.0)


def _two_rooms(frame=None, margin=0, name="two rooms"):
    """Two rooms of 6 x 6 m with two doors between them, cells of 0.2 m, unexplored margin."""
    cells = np.full((32, 62), FREE)
    cells[[0, -1]] = cells[:, [0, 30, 31, -1]] = OCCUPIED
    cells[5:9, 30:32] = cells[22:26, 30:32] = FREE
    cells = np.pad(cells, margin, constant_values=UNKNOWN).astype(np.float32)
    return hn.OccupancyGrid(cells, frame or hn.Frame(0.2), robot_radius_m=0.25, name=name)


def _grid(cells, resolution_m=1.0, **settings):
    return hn.OccupancyGrid(
        np.asarray(cells, np.float32), hn.Frame(resolution_m), **{"robot_radius_m": 0, **settings}
    )


BY_PLACES = hn.load_preset("paper", overrides=["planner.levels=places"])


def _plan(topology, start, goal, preset=BY_PLACES):
    return hn.HybridPlanner(topology, preset=preset).plan(start, goal)


def _figure(ax):
    return ax.figure


def _legend(ax):
    return ax.get_legend()


def _topology(grid, merge_distance_m=6.0):
    return hn.TopologicalMap(DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m))


@pytest.fixture(scope="module")
def rooms():
    return _topology(_two_rooms())


@pytest.fixture(scope="module")
def plan(rooms):
    return _plan(rooms, START, GOAL)


@pytest.fixture(scope="module")
def figure1():
    grid = hn.load_map(MAPS / "figure1" / "figure1.yaml", robot_radius_m=0)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=10.0))


def _find(ax, gid):
    found = [artist for artist in ax.findobj() if artist.get_gid() == gid]
    return found[0] if found else None


def _lines(ax, *gids):
    return [line for gid in gids if (drawn := _find(ax, gid)) for line in drawn.get_segments()]


def _pixel(ax, point):
    """Colour of the image at a point of the map frame."""
    image = _find(ax, "cells")
    to_image = image.get_transform() - ax.transData
    x, y = to_image.inverted().transform(np.asarray(point, dtype=float))
    left, right, bottom, top = image.get_extent()
    rgb = image.get_array()
    assert left <= x <= right
    assert bottom <= y <= top
    return tuple(rgb[int((y - bottom) / (top - bottom) * len(rgb)), int(x - left)].tolist())


def _bytes(colour):
    return tuple(round(255 * channel) for channel in to_rgb(colour))


def _title(ax):
    return ax.get_title().replace("\n", "  ·  ")


@tried(40, class_grids(), st.integers(0, 9))
def test_neighbouring_places_have_different_colours_on_every_level(classes, index):
    pyramid = DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=3.0)
    level = pyramid[min(index, len(pyramid) - 1)]
    colours = Places(level).colours()
    endpoints = level.arcs[~level.is_self_loop]
    assert (colours[endpoints[:, 0]] != colours[endpoints[:, 1]]).any(axis=1).all()


def test_six_colours_do_for_a_wheel_with_a_thousand_spokes():
    rim = np.arange(1, 1001)
    spokes = np.stack([np.zeros_like(rim), rim], axis=1)
    wheel = np.concatenate([spokes, np.stack([rim, np.roll(rim, 1)], axis=1)]).astype(np.int32)
    colours = colour_vertices(wheel, 1001)
    assert (colours[wheel[:, 0]] != colours[wheel[:, 1]]).all()
    assert set(colours) <= set(range(6))
    np.testing.assert_array_equal(colours, colour_vertices(wheel[::-1], 1001))


def test_two_doors_are_two_lines(figure1):
    pairs, counts = np.unique(
        np.sort(figure1.arcs[~figure1.level.is_self_loop], axis=1), axis=0, return_counts=True
    )
    assert counts.max() == 2
    endpoints = figure1.positions[pairs[counts.argmax()]]
    drawn = _lines(plot_places(figure1), "arcs", "rim-arcs", "unexplored-arcs")
    between = [line for line in drawn if np.isin(line[[0, -1]], endpoints).all()]
    assert len(between) == 2
    assert not np.allclose(between[0][1], between[1][1])


def test_an_arc_runs_from_place_to_place_through_its_own_boundary(rooms):
    drawn = {tuple(line.ravel()) for line in _lines(plot_places(rooms), "arcs")}
    plain = np.flatnonzero(~rooms.level.is_self_loop)
    assert len(drawn) == len(plain) > 0
    for arc in plain:
        first, last = rooms.positions[rooms.arcs[arc]]
        assert (*first, *rooms.level.boundary_middles[arc], *last) in drawn


def test_self_loops_are_drawn_on_request_through_their_boundary(figure1):
    assert _find(plot_places(figure1), "self-loops") is None
    loops = _lines(plot_places(figure1, self_loops=True), "self-loops")
    indices = np.flatnonzero(figure1.level.is_self_loop)
    assert len(loops) == len(indices) > 0
    for line, arc in zip(loops, indices, strict=True):
        at = figure1.positions[figure1.arcs[arc, 0]]
        np.testing.assert_allclose(line[[0, -1]], [at, at])
        np.testing.assert_allclose(line[len(line) // 2], figure1.level.boundary_middles[arc])


def test_arcs_can_be_left_out(rooms):
    ax = plot_places(rooms, arcs=False)
    assert not _lines(ax, "arcs")
    assert len(_find(ax, "free-dots").get_offsets()) == rooms.n_places


def test_specks_have_neither_dots_nor_arcs():
    cells = _two_rooms().probability.copy()
    cells[15, 12] = UNKNOWN
    topology = _topology(_grid(cells, 0.2))
    speck = topology.place_at((15, 12))
    ax = plot_places(topology)
    lines = _lines(ax, "arcs", "rim-arcs", "unexplored-arcs")
    assert not any(np.isin(line, topology.positions[speck]).all(axis=1).any() for line in lines)
    assert len(_find(ax, "unexplored-dots").get_offsets()) == 0


def test_a_level_of_thousands_of_vertices_is_drawn_as_fields_alone():
    ax = plot_level(DualGraphPyramid.build(_grid(np.zeros((50, 60))))[0])
    assert _find(ax, "cells") is not None
    assert _find(ax, "arcs") is None
    assert _find(ax, "free-dots") is None
    assert "level 0" in _title(ax)
    assert "3,000 vertices" in _title(ax)


def test_cells_of_each_class_have_their_own_tone():
    cells = np.full((20, 20), FREE)
    cells[:, 15:] = UNKNOWN
    cells[5, 5] = OCCUPIED
    ax = plot_map(_grid(cells, 0.1, robot_radius_m=0.25))
    assert _pixel(ax, (0.55, 0.55)) == _bytes(style.OCCUPIED)
    assert _pixel(ax, (0.75, 0.55)) == _bytes(style.BLOCKED)
    assert _pixel(ax, (1.25, 1.25)) == _bytes(style.FREE)
    assert _pixel(ax, (1.52, 1.25)) == _bytes(style.UNEXPLORED)


@pytest.mark.parametrize("yaw", [0.0, 0.6, 3.14])
def test_the_picture_is_in_metres_of_the_map_frame(yaw):
    frame = hn.Frame(0.2, (10.0, -20.0), yaw)
    grid = _two_rooms(frame)
    ax = plot_map(grid)
    for cell, colour in (((15, 15), style.FREE), ((31, 40), style.OCCUPIED)):
        assert _pixel(ax, frame.points_of(cell)) == _bytes(colour)
    corners = frame.points_of_grid([[0, 0], [0, 62], [32, 0], [32, 62]])
    np.testing.assert_allclose(ax.get_xlim(), [corners[:, 0].min(), corners[:, 0].max()])
    np.testing.assert_allclose(ax.get_ylim(), [corners[:, 1].min(), corners[:, 1].max()])
    assert ax.get_aspect() == 1


@pytest.mark.parametrize("yaw", [0.0, 0.6])
def test_the_picture_is_cropped_to_the_known_part(yaw):
    grid = _two_rooms(hn.Frame(0.2, (0.0, 0.0), yaw), margin=100)
    corners = grid.frame.points_of_grid([[100, 100], [100, 162], [132, 100], [132, 162]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    ax = plot_map(grid)
    limits = np.array([ax.get_xlim(), ax.get_ylim()]).T
    assert (limits[0] < low).all()
    assert (limits[1] > high).all()
    assert (limits[1] - limits[0] <= (high - low) + 0.03 * (high - low).max() + 0.4).all()


def test_a_map_without_a_known_cell_is_drawn_whole():
    ax = plot_map(_grid(np.full((10, 20), UNKNOWN)))
    assert (ax.get_xlim(), ax.get_ylim()) == ((0, 20), (0, 10))


def test_a_map_without_free_cells_has_no_places_and_still_a_picture():
    ax = plot_places(_topology(_grid(np.ones((5, 5)))))
    assert "0 free and 0 unexplored places" in _title(ax)


def test_a_map_finer_than_any_page_is_averaged_in_place(monkeypatch):
    monkeypatch.setattr("hybridnav.viz.canvas.MAX_IMAGE_SIDE", 10)
    cells = np.zeros((25, 33))
    cells[:, :8] = OCCUPIED
    ax = plot_map(_grid(cells))
    image = _find(ax, "cells")
    assert max(image.get_array().shape) <= 10
    assert image.get_extent() == [0, 36, 0, 28]
    assert (ax.get_xlim(), ax.get_ylim()) == ((0, 33), (0, 25))


def test_a_plan_shows_its_path_route_and_ends(rooms, plan):
    ax = plot_plan(rooms, plan, start=START, goal=GOAL)
    np.testing.assert_array_equal(_find(ax, "path").get_xydata(), plan.path.points)
    (route,) = _lines(ax, "route")
    np.testing.assert_array_equal(route, plan.path.points)
    dots = np.asarray(_find(ax, "route-places").get_offsets())
    cells = rooms.grid.frame.cells_of(dots)
    assert rooms.place_ids[rooms.level.field_of[tuple(cells.T)]].tolist() == list(plan.route.places)
    line = shapely.LineString(plan.path.points)
    assert max(line.distance(shapely.Point(dot)) for dot in dots) < 1e-9
    start, goal = _find(ax, "start"), _find(ax, "goal")
    np.testing.assert_allclose(start.get_xydata(), [START])
    np.testing.assert_allclose(goal.get_xydata(), [GOAL])
    assert start.get_marker() != goal.get_marker()


def test_a_route_without_a_path_runs_from_place_to_place(rooms, plan):
    ax = plot_plan(rooms, replace(plan, path=None))
    middles = [line[1] for line in _lines(ax, "route")]
    np.testing.assert_allclose(
        sorted(map(tuple, middles)),
        sorted(tuple(rooms.level.boundary_middles[a]) for a in plan.route.arcs),
    )


def test_a_plan_shows_what_costs_more_and_what_is_closed(rooms, plan):
    factors = np.ones(rooms.grid.shape)
    factors[20:25, 5:10] = 4.0
    closed = hn.Blocked(cells=[(7, 31)])
    ax = plot_plan(rooms, plan, costs=hn.CostLayer(factors), blocked=closed)
    plain = plot_plan(rooms, plan)
    costs, shut = (np.asarray(_find(ax, gid).get_array())[..., 3] for gid in ("costs", "closed"))
    assert costs[22, 7] > 0 == costs[22, 15]
    assert shut[7, 31] > 0 == shut[7, 15]
    texts = [text.get_text() for text in _legend(ax).get_texts()]
    assert {"a metre costs up to 4", "closed"} <= set(texts)
    assert not {"a metre costs up to 4", "closed"} & {
        text.get_text() for text in _legend(plain).get_texts()
    }


def test_unexplored_places_are_drawn_where_they_are_asked_for():
    topology = _topology(_two_rooms(margin=10))
    result = _plan(topology, (3.0, 3.0), (5.0, 5.0))
    gids = ("unexplored-arcs", "unexplored-dots", "rim-arcs")
    drawn = {child.get_gid() for child in plot_plan(topology, result).get_children()}
    assert not drawn & set(gids)
    drawn = {
        child.get_gid() for child in plot_plan(topology, result, unexplored=True).get_children()
    }
    assert "unexplored-dots" in drawn


def test_places_of_the_corridor_stand_out(rooms):
    preset = hn.load_preset("paper", overrides=["planner.levels=places", "planner.corridor=route"])
    result = _plan(rooms, START, (2.0, 1.0), preset)
    ax = plot_plan(rooms, result)
    inside = set(result.route.places)
    assert 0 < len(inside) < rooms.n_places
    saturation = {}
    for place, position in enumerate(rooms.positions):
        colour = _pixel(ax, position)
        saturation[place] = max(colour) - min(colour)
    assert min(saturation[p] for p in inside) > max(
        s for p, s in saturation.items() if p not in inside
    )


def test_neighbours_of_the_route_stand_out_where_they_are_in_the_corridor(rooms):
    preset = hn.load_preset("paper", overrides=["planner.levels=places"])
    wide = preset.planner.model_copy(update={"corridor": "neighbours"})
    result = _plan(rooms, START, (2.0, 1.0), preset.model_copy(update={"planner": wide}))
    endpoints = rooms.arcs[np.isin(rooms.arcs, result.route.places).any(axis=1)]
    beside = set(endpoints.ravel().tolist()) - set(result.route.places)
    strong = {_bytes(colour) for colour in style.PLACES}
    ax = plot_plan(rooms, result)
    assert beside
    assert all(_pixel(ax, rooms.positions[place]) in strong for place in beside)


def test_ends_default_to_those_of_the_path(rooms, plan):
    ax = plot_plan(rooms, plan)
    np.testing.assert_allclose(_find(ax, "start").get_xydata()[0], plan.path.points[0])
    np.testing.assert_allclose(_find(ax, "goal").get_xydata()[0], plan.path.points[-1])


def test_the_title_tells_map_length_loss_and_places(rooms, plan):
    length = plan.path.length_m
    title = _title(plot_plan(rooms, plan, optimum_m=length / 1.05))
    for words in ("two rooms", f"{length:.1f} m", "loss 5.0%", f"{len(plan.route.places)} places"):
        assert words in title
    assert "loss 0.0%" in _title(plot_plan(rooms, plan, optimum_m=length * (1 + 1e-7)))
    assert "loss" not in _title(plot_plan(rooms, plan))
    assert _title(plot_plan(rooms, plan, title="mine")) == "mine"
    assert _title(plot_plan(rooms, plan, title="")) == ""


@pytest.mark.parametrize("preset", ["shortest", "octile", "grid-astar"])
def test_a_route_that_is_read_off_the_path_is_shown_and_no_corridor(rooms, preset):
    result = _plan(rooms, START, GOAL, preset)
    ax = plot_plan(rooms, result)
    assert _find(ax, "path") is not None
    assert _find(ax, "route") is not None
    words = [text.get_text() for text in _legend(ax).get_texts()]
    assert {"route", "its places"} <= set(words)
    assert not {"coarse route", "corridor"} & set(words)


def test_an_unsolved_plan_shows_its_ends_and_says_why(rooms):
    wall = (6.2, 3.0)
    result = _plan(rooms, START, wall)
    ax = plot_plan(rooms, result, start=START, goal=wall)
    assert "goal occupied" in _title(ax)
    np.testing.assert_allclose(_find(ax, "goal").get_xydata(), [wall])
    assert _find(ax, "path") is None
    assert _find(plot_plan(rooms, result), "goal") is None


def test_a_goal_beside_the_map_is_in_the_picture(rooms):
    beside = (15.0, 3.0)
    result = _plan(rooms, START, beside)
    ax = plot_plan(rooms, result, start=START, goal=beside)
    np.testing.assert_allclose(_find(ax, "goal").get_xydata(), [beside])
    assert ax.get_xlim()[1] > 15.0


def test_a_goal_far_away_is_at_the_rim_with_its_coordinates(rooms):
    far = (1000.0, 3.0)
    result = _plan(rooms, START, far)
    ax = plot_plan(rooms, result, start=START, goal=far)
    assert ax.get_xlim()[1] < 20
    np.testing.assert_allclose(_find(ax, "goal").get_xydata(), [(ax.get_xlim()[1], 3.0)])
    assert _find(ax, "goal-label").get_text() == "goal (1000, 3)"


@pytest.mark.parametrize("goal", [(1.2, 1.0), (1.0, 2.0), START])
def test_labels_of_ends_close_together_do_not_touch(rooms, goal):
    ax = plot_plan(rooms, _plan(rooms, START, goal), width_in=3.0)
    _figure(ax).draw_without_rendering()
    start, end = (_find(ax, f"{name}-label").get_window_extent() for name in ("start", "goal"))
    assert not start.overlaps(end)


@pytest.mark.parametrize("width", [3.0, 7.0, 12.0])
def test_nothing_round_the_map_touches_or_leaves_the_figure(rooms, plan, width):
    ax = plot_plan(rooms, plan, width_in=width)
    _figure(ax).draw_without_rendering()
    picture, figure = ax.get_window_extent(), _figure(ax).bbox
    title, legend = ax.title.get_window_extent(), _legend(ax).get_window_extent()
    bar = _find(ax, "scale-bar-label").get_window_extent()
    for first, second in ((title, picture), (legend, picture), (bar, picture), (bar, legend)):
        assert not first.overlaps(second)
    for box in (title, legend, bar):
        assert box.x0 >= figure.x0 - 1
        assert box.x1 <= figure.x1 + 1
        assert box.y0 >= figure.y0 - 1
        assert box.y1 <= figure.y1 + 1
    assert _figure(ax).get_size_inches()[0] == width


@given(st.floats(1e-3, 1e6))
def test_a_scale_bar_has_a_round_length(limit):
    length = round_length(limit)
    digits = f"{length:e}".split("e")[0].rstrip("0").rstrip(".")
    assert digits in ("1", "2", "5")
    assert 0.39 * limit <= length <= limit * (1 + 1e-9)


@pytest.mark.parametrize("yaw", [0.0, 0.6])
def test_the_scale_bar_is_as_long_as_it_says(yaw):
    topology = _topology(_two_rooms(hn.Frame(0.2, (3.0, 4.0), yaw)))
    result = _plan(topology, *topology.grid.frame.points_of([[5, 5], [20, 50]]))
    ax = plot_plan(topology, result)
    bar, label = _find(ax, "scale-bar"), _find(ax, "scale-bar-label")
    length = float(label.get_text().removesuffix(" m"))
    assert np.ptp(bar.get_xdata()) == pytest.approx(length)
    endpoints = bar.get_transform().transform(bar.get_xydata())
    metre = ax.transData.transform([[0, 0], [1, 0]])
    assert np.ptp(endpoints[:, 0]) == pytest.approx(length * np.ptp(metre[:, 0]))
    assert length <= 0.2 * np.ptp(ax.get_xlim())


def test_titles_break_between_pieces_and_are_cut_where_one_is_too_long():
    assert wrapped(["one", "", "two"], 8, 1000) == "one  ·  two"
    assert wrapped(["one", "two"], 8, text_width("one · t", 8)) == "one\ntwo"
    room = text_width("aaaa  ·  bbbb  ·  cccc  ·  d", 8)  # the last piece would stand alone
    assert wrapped(["aaaa", "bbbb", "cccc", "dddd"], 8, room) == "aaaa  ·  bbbb\ncccc  ·  dddd"
    cut = wrapped(["x" * 500], 8, 200)
    assert cut.endswith("x…")
    assert text_width(cut, 8) <= 200


def test_a_map_may_be_called_anything():
    topology = _topology(_two_rooms(name="cost $x^ \n 100 %"))
    ax = plot_places(topology)
    _figure(ax).draw_without_rendering()
    assert "cost $x^ 100 %" in _title(ax)


def test_a_saved_picture_has_the_size_of_its_figure(rooms, plan, tmp_path):
    ax = plot_plan(rooms, plan, width_in=5.0)
    save_figure(ax, tmp_path / "plan.png", dpi=100)
    width, height = np.round(100 * _figure(ax).get_size_inches()).astype(int)
    with Image.open(tmp_path / "plan.png") as image:
        assert image.width == width == 500
        assert abs(image.height - height) <= 1


def test_what_stands_out_of_the_figure_is_saved_too(rooms, plan, tmp_path):
    figure = Figure(figsize=(3, 2))
    plot_plan(rooms, plan, ax=figure.add_axes((0, 0, 1, 1)))  # no room left for the legend
    save_figure(figure, tmp_path / "plan.png", dpi=100)
    with Image.open(tmp_path / "plan.png") as image:
        assert image.height > 220


@pytest.mark.parametrize("suffix", ["PNG", "pdf", "svg"])
def test_the_same_picture_gives_the_same_bytes(rooms, plan, tmp_path, suffix):
    for name in ("one", "two"):
        save_figure(plot_plan(rooms, plan), tmp_path / f"{name}.{suffix}", dpi=80)
    first = (tmp_path / f"one.{suffix}").read_bytes()
    assert len(first) > 1000
    assert first == (tmp_path / f"two.{suffix}").read_bytes()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("picture.gif", ".pdf, .png, .svg"),
        ("picture", ".pdf, .png, .svg"),
        ("absent/picture.png", "No such file or directory"),
        ("folder.png", "Is a directory"),
    ],
)
def test_a_file_that_cannot_be_written_gives_one_line(rooms, tmp_path, name, words):
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(hn.errors.InvalidValueError) as caught:
        save_figure(plot_map(rooms.grid), tmp_path / name, dpi=20)
    message = str(caught.value)
    assert words in message
    assert name in message
    assert "\n" not in message


@pytest.mark.parametrize("dpi", [0, -1, math.nan, math.inf, 1e6])
def test_dpi_out_of_range_are_refused(rooms, tmp_path, dpi):
    with pytest.raises(hn.errors.InvalidValueError, match="dpi must be above 0"):
        save_figure(plot_map(rooms.grid), tmp_path / "map.png", dpi=dpi)


def test_arguments_that_make_no_sense_are_refused(rooms, plan):
    for point in ((1.0,), (1.0, math.nan), "here"):
        with pytest.raises(
            hn.errors.InvalidValueError, match="goal must be two finite coordinates"
        ):
            plot_plan(rooms, plan, goal=point)
    for optimum in (-1.0, math.nan):
        with pytest.raises(hn.errors.InvalidValueError, match="optimum must be a length"):
            plot_plan(rooms, plan, optimum_m=optimum)
    for width in (0.0, math.inf, math.nan, 1e9):
        with pytest.raises(hn.errors.InvalidValueError, match="width must be"):
            plot_map(rooms.grid, width_in=width)
