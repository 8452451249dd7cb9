"""Charts of methods; colours that everybody can tell apart, and grey that a printer keeps."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from skimage.color import deltaE_ciede2000, rgb2lab

from hybridnav.errors import InvalidValueError
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.viz import method_styles, plot_losses, plot_paths, plot_speed, save_figure, style
from hybridnav.viz.layout import text_width
from tests.viz.pictures import two_rooms


def legend_texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def line_of(ax, gid):
    return next(line for line in ax.lines if line.get_gid() == gid)


def corners(ax, method=0):
    return np.column_stack(ax.lines[method].get_data())


def test_the_legend_has_the_share_without_loss():
    losses = {"exact": np.zeros(3), "good": np.array([0, 1e-10, 0.01, np.nan]), "bad": np.ones(7)}
    assert legend_texts(plot_losses(losses)) == ["exact: 100 %", "good: 66.7 %", "bad: 0 %"]


def test_shares_are_not_rounded_to_certainty():
    most, few = np.zeros(9999), np.ones(9999)
    most[0], few[0] = 1.0, 0.0
    assert legend_texts(plot_losses({"a": most, "b": few})) == ["a: > 99.9 %", "b: < 0.1 %"]


def test_the_line_falls_at_each_loss():
    ax = plot_losses({"a": np.array([0, 0.001, 0.01, 0.01])})
    x, y = corners(ax).T
    falls = x[1:][np.diff(y) < 0]
    assert falls == pytest.approx([0.001, 0.01], rel=0.02)
    assert y[0] == 0.75
    assert y[-1] == ax.get_ylim()[0]


@pytest.mark.parametrize("pairs", [200, 3000])
def test_the_loss_chart_shows_how_many_pairs_lose_much(pairs):
    losses = {"few": np.zeros(pairs), "more": np.zeros(pairs), "common": np.full(pairs, 0.001)}
    losses["few"][:1], losses["more"][:3] = 0.2, 0.2
    ax = plot_losses(losses)
    low = ax.transAxes.transform((0, 0))[1]
    few, more, common = (ax.transData.transform(corners(ax, n)[0])[1] for n in range(3))
    apart = np.diff([low, few, more, common]) * 72 / ax.figure.dpi
    assert (apart > 8).all()  # points


def test_marks_of_methods_that_lose_as_much_stand_side_by_side(tmp_path):
    losses = {name: np.zeros(50) for name in "abcd"} | {"e": np.full(50, 0.1)}
    ax = plot_losses(losses)
    legend = ax.get_legend()
    legend.remove()
    save_figure(ax, tmp_path / "losses.png", dpi=200)
    pixels = np.rint(255 * imread(tmp_path / "losses.png")[..., :3])
    for name, look in method_styles(losses).items():
        seen = (np.abs(pixels - 255 * np.array(to_rgb(look.colour))) < 2).all(axis=-1).sum()
        assert seen > 90, name  # pixels; a mark under others shows a few


def test_methods_are_told_apart_without_colour():
    several = list(method_styles(f"method {i}" for i in range(35)).values())
    assert len({(one.colour, one.dashes) for one in several}) == 35
    assert len({(one.colour, one.marker) for one in several}) == 35
    assert len({one.dashes for one in several[:5]}) == len({one.marker for one in several[:5]}) == 5


def test_a_method_looks_the_same_in_every_chart():
    styles = method_styles(["a", "b"])
    lines = plot_losses({"b": [0.1]}, styles=styles).lines
    dots = plot_speed({"b": [0.1]}, {"b": 1.0}, styles=styles).lines
    assert lines[1].get_marker() == dots[0].get_marker() == "s"
    assert lines[0].get_color() == dots[0].get_color() == style.METHODS[1]


def test_the_speed_chart_has_each_method_s_figures():
    ax = plot_speed({"a": [0.0, 0.02, np.nan], "b": [15.0]}, {"a": 0.25, "b": 1234.0})
    assert legend_texts(ax) == ["a: 0.25 ms, 1 %", "b: 1,234 ms, 1,500 %"]
    assert [tuple(corners(ax, n)[0]) for n in range(2)] == [(0.25, 0.01), (1234.0, 15.0)]


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(1e-4, 1e6), st.floats(-0.5, 60)), min_size=1, max_size=4))
@example([(1.0, 31.0), (1.0, -0.5)])
def test_tick_labels_never_collide(points):
    losses = {str(i): np.array([mean]) for i, (_, mean) in enumerate(points)}
    times = {str(i): time for i, (time, _) in enumerate(points)}
    for ax in (plot_losses(losses), plot_speed(losses, times)):
        for axis, side in ((ax.xaxis, 0), (ax.yaxis, 1)):
            low, high = axis.get_view_interval()
            ticks = np.array([tick for tick in axis.get_majorticklocs() if low <= tick <= high])
            at = ax.transData.transform(np.stack([ticks, ticks], axis=1))[:, side]
            at *= 72 / ax.figure.dpi
            labels = axis.get_major_formatter().format_ticks(ticks.tolist())
            sizes = [8.0 if side else text_width(label, 8.0) for label in labels]
            assert len(ticks) >= 2
            room = np.diff(at) - (np.array(sizes[1:]) + sizes[:-1]) / 2
            assert (room > 1).all()


@pytest.mark.parametrize("name", ["_hidden", "$x_", "\x00\udcff & <b>", "long " * 20])
def test_methods_may_be_called_anything(name, tmp_path):
    for ax in (plot_losses({name: [0.1]}), plot_speed({name: [0.1]}, {name: 1.0})):
        save_figure(ax, tmp_path / "chart.svg")
        (text,) = legend_texts(ax)
        assert text.isprintable()
        assert len(text) < 60
        assert text[0] == (name[0] if name.isprintable() else "\ufffd")


def test_methods_without_values_are_refused():
    for values in ([], [math.nan, math.inf]):
        with pytest.raises(InvalidValueError, match="'a' needs a finite loss, got none: leave"):
            plot_losses({"b": [0.1], "a": values})
    for times in ({}, {"a": 0.0}, {"a": math.nan}):
        with pytest.raises(InvalidValueError, match="'a' needs a finite time above 0 ms"):
            plot_speed({"a": [0.1]}, times)
    with pytest.raises(InvalidValueError, match="one method at least"):
        plot_losses({})


# Paths


def test_both_paths_are_drawn_where_they_are():
    grid = two_rooms().grid
    path, shortest = np.array([[1.0, 1.0], [4.0, 2.0], [5.0, 1.5]]), [[1.0, 1.0], [5.0, 1.5]]
    ax = plot_paths(grid, path, shortest)
    np.testing.assert_array_equal(line_of(ax, "path").get_xydata(), path)
    np.testing.assert_array_equal(line_of(ax, "shortest").get_xydata(), shortest)
    np.testing.assert_array_equal(line_of(ax, "start").get_xydata(), path[:1])
    np.testing.assert_array_equal(line_of(ax, "goal").get_xydata(), path[-1:])
    labels = legend_texts(ax)
    assert labels[:2] == ["path", "shortest path"]
    assert ax.get_title() == "two rooms"


def test_the_picture_holds_both_paths_and_stays_in_the_map():
    grid = OccupancyGrid(np.zeros((50, 120), np.float32), Frame(0.1, (3.0, 4.0), 0.0))
    path = grid.frame.points_of([(0, col) for col in range(100)])
    shortest = grid.frame.points_of([(row, 0) for row in range(11)])
    ax = plot_paths(grid, path, shortest)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    assert (left, low) == (3.0, 4.0)
    assert 12.9 < right <= 15.0
    assert 5.1 < high <= 9.0


def test_a_turned_map_is_shown_round_the_path():
    grid = OccupancyGrid(np.zeros((50, 120), np.float32), Frame(0.1, (3.0, 4.0), 0.6))
    path = grid.frame.points_of([(10, 20), (30, 90)])
    ax = plot_paths(grid, path)
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    assert ((low < path) & (path < high)).all()
    assert (high - low < 1.5 * np.ptp(path, axis=0)).all()
    np.testing.assert_array_equal(line_of(ax, "path").get_xydata(), path)


@pytest.mark.parametrize(
    "points", [[], [[1.0, 1.0]], [[1.0, 1.0]] * 3, [[-50.0, 1.0], [60.0, 9e5]]]
)
def test_odd_paths_are_drawn(points, tmp_path):
    grid = two_rooms().grid
    ax = plot_paths(grid, points)
    save_figure(ax, tmp_path / "odd.png", dpi=50)
    low, high = ax.get_xlim()
    assert 0 <= low < high <= grid.shape[1] * grid.resolution_m + 1e-9


def test_points_that_are_none_are_refused():
    for points in ([1.0, 2.0], [[1.0, math.nan]]):
        with pytest.raises(InvalidValueError, match=r"finite points of shape \(n, 2\)"):
            plot_paths(two_rooms().grid, points)


# Machado, Oliveira, Fernandes 2009, "A Physiologically-based Model for Simulation of Color Vision
# Deficiency", severity 1.0; they act on linear RGB.
_MATRICES = """
protanopia    0.152286 1.052583 -0.204868 0.114503 0.786281 0.099216 -0.003882 -0.048116 1.051998
deuteranopia  0.367322 0.860646 -0.227968 0.280085 0.672501 0.047413 -0.011820 0.042940 0.968881
tritanopia    1.255528 -0.076749 -0.178779 -0.078411 0.930809 0.147602 0.004733 0.691367 0.303900
"""
VISION = {"usual": np.eye(3)}
for name, *values in map(str.split, _MATRICES.strip().splitlines()):
    VISION[name] = np.array(values, float).reshape(3, 3)
PALE = style.rgb(*style.PLACES, strength=style.PALE)


def seen(colours, vision):
    """L*a*b* of uint8 (n, 3) as somebody with that vision sees it."""
    value = np.asarray(colours) / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    linear = (linear @ VISION[vision].T).clip(0, 1)
    value = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return rgb2lab(value[None])[0]


def least(first, second, vision):
    """The least difference (CIEDE2000) between a colour of one list and one of another."""
    one, other = seen(first, vision), seen(second, vision)
    return float(deltaE_ciede2000(one[:, None], other[None]).min())


def least_within(colours, vision):
    return min(least([a], [b], vision) for a, b in itertools.combinations(colours, 2))


def lightness_steps(colours):
    return float(np.diff(np.sort(seen(colours, "usual")[:, 0])).min())


@pytest.mark.parametrize("vision", VISION)
@pytest.mark.parametrize(
    "names",
    [
        ("PATH", "INK", "ARC"),  # path, coarse route, other arcs
        ("PARALLEL", "SELF_LOOP", "INK", "RIM_ARC"),
        ("HOLE", "OUTSIDE", "INK"),
    ],
)
def test_lines_of_one_picture_are_told_apart(names, vision):
    assert least_within(style.rgb(*(getattr(style, name) for name in names)), vision) > 14


@pytest.mark.parametrize("vision", VISION)
def test_routes_are_told_apart_and_stand_out_from_pale_places(vision):
    routes = style.rgb(*style.ROUTES)
    assert least_within(routes, vision) > 20
    assert least(routes, np.concatenate([PALE, style.rgb(style.FREE)]), vision) > 20


@pytest.mark.parametrize("vision", VISION)
def test_places_are_told_apart(vision):
    assert least_within(style.rgb(*style.PLACES), vision) > 8
    assert least_within(PALE, vision) > 2.5


@pytest.mark.parametrize("vision", VISION)
def test_the_corridor_stands_out_and_the_unexplored_too(vision):
    strong, unexplored = style.rgb(*style.PLACES), style.rgb(*style.UNEXPLORED_PLACES)
    assert least(strong, PALE, vision) > 5.5
    assert least(strong, unexplored, vision) > 8
    assert least(PALE, unexplored, vision) > 4.4


@pytest.mark.parametrize("vision", VISION)
def test_the_path_stands_out_from_every_place(vision):
    ground = np.concatenate([style.rgb(*style.PLACES), PALE, style.rgb(style.FREE)])
    assert least(style.rgb(style.PATH), ground, vision) > 18  # a white rim lies between them


def test_classes_of_cells_and_places_differ_in_grey():
    classes = style.rgb(style.OCCUPIED, style.BLOCKED, style.UNEXPLORED, style.FREE)
    assert lightness_steps(classes) > 14
    assert lightness_steps(style.rgb(*style.PLACES)) > 3.5


def test_places_of_the_corridor_are_darker_than_all_others():
    strong = seen(style.rgb(*style.PLACES), "usual")[:, 0]
    assert strong.max() < seen(PALE, "usual")[:, 0].min()
