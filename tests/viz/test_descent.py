"""Pictures of descents: asked what they show."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

import hybridnav as hn
from hybridnav.search.descent import Descent, DescentSettings, WatchedDescent
from hybridnav.viz import plot_descent, save_descent, style

GRID = hn.example_map("figure1")


@pytest.fixture(scope="module")
def watched() -> WatchedDescent:
    pyramid = hn.DualGraphPyramid.build(GRID, merge_distance_m=1.0)
    descent = Descent(pyramid, GRID.enterable(), DescentSettings(field_cells=4, step=4.0))
    found = descent.watch((5, 5), (25, 20))
    assert found is not None
    return found


def test_each_level_and_the_path_have_a_panel(watched: WatchedDescent) -> None:
    axes = plot_descent(GRID, watched)
    assert len(axes) == len(watched.levels) + 1
    for ax, kept in zip(axes, watched.levels, strict=False):
        assert f"route of {len(kept.route)} of {len(kept.kept)} fields" in ax.get_title()
    (line,) = [line for line in axes[-1].lines if line.get_gid() == "path"]
    points = GRID.frame.points_of(watched.cells)
    np.testing.assert_allclose(np.stack(line.get_data(), axis=1), points)


def test_the_route_is_strong_and_what_is_not_kept_is_white(watched: WatchedDescent) -> None:
    strong = {tuple(colour) for colour in style.rgb(*style.PLACES).tolist()}
    pale = {tuple(colour) for colour in style.rgb(*style.PLACES, strength=style.PALE).tolist()}
    white = {tuple(style.rgb(style.FREE)[0].tolist())}
    kept = watched.levels[0]
    image = np.asarray(plot_descent(GRID, watched)[0].images[0].get_array())[..., :3]
    assert image.shape[:2] == GRID.shape
    on_route = np.isin(kept.field_of, kept.route)
    is_kept = np.append(kept.kept, False)[kept.field_of]
    for mask, colours in (
        (on_route, strong),
        (is_kept & ~on_route, pale),
        (~is_kept & (GRID.classes == hn.CellClass.FREE), white),
    ):
        assert {tuple(colour) for colour in image[mask].tolist()} <= colours


def test_small_fields_of_the_route_are_seen(watched: WatchedDescent) -> None:
    """The last fields of a large map have two pixels each, in colours of maps on white."""
    for ax, kept in zip(plot_descent(GRID, watched), watched.levels, strict=False):
        (outline,) = ax.collections
        outlined = outline.get_paths()[0]
        inside = np.argwhere(np.isin(kept.field_of, kept.route))
        assert outlined.contains_points(GRID.frame.points_of(inside)).any()
        box = outlined.get_extents()
        low, high = (GRID.frame.points_of(end(axis=0)) for end in (inside.min, inside.max))
        half = GRID.resolution_m / 2
        np.testing.assert_allclose([box.min, box.max], [low - half, high + half])


def test_an_animation_shows_each_level_and_then_the_path_as_it_grows(watched, tmp_path):
    save_descent(GRID, watched, tmp_path / "descent.gif")
    with Image.open(tmp_path / "descent.gif") as animation:
        frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(animation)]
    assert {frame.shape for frame in frames} == {frames[0].shape}
    red = style.rgb(style.PATH)[0].astype(int)
    n_red = [int((np.abs(frame - red).max(axis=2) < 24).sum()) for frame in frames]
    grown = n_red[len(watched.levels) :]
    assert len(grown) > 4
    assert grown == sorted(grown)
    assert grown[-1] > 2 * max(n_red[: len(watched.levels)])  # the marks of start and goal are red


def test_what_cannot_be_drawn_is_refused(watched: WatchedDescent, tmp_path: Path) -> None:
    other = hn.OccupancyGrid(np.zeros((3, 4), np.float32), robot_radius_m=0)
    with pytest.raises(hn.errors.InvalidValueError, match="the grid has"):
        plot_descent(other, watched)
    with pytest.raises(hn.errors.InvalidValueError, match="at least one column"):
        plot_descent(GRID, watched, columns=0)
    with pytest.raises(hn.errors.InvalidValueError, match=r"1 axes were given for \d panels"):
        plot_descent(GRID, watched, axes=plot_descent(GRID, watched)[:1])
    with pytest.raises(hn.errors.InvalidValueError, match=r"must end in \.gif"):
        save_descent(GRID, watched, tmp_path / "descent.png")
