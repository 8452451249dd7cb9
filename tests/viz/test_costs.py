"""Pictures of costs: colours by factor, a bar inside the figure, paths, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.viz import plot_costs
from tests.layers import grid_of, layer_of


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
    assert legend is not None
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
    assert box is not None
    assert whole.x0 <= box.x0 < box.x1 <= whole.x1
    assert whole.y0 <= box.y0 < box.y1 < ax.get_window_extent().y0
    texts = [tick.get_text() for tick in bar.get_xticklabels()]
    assert "1" in [text.removesuffix(".0") for text in texts]
    assert label in [text.removesuffix(".0") for text in texts]


def test_a_layer_of_another_map_and_unusable_paths_are_refused() -> None:
    grid = room()
    with pytest.raises(hn.InvalidValueError, match="costs of 2 x 2 cells"):
        plot_costs(grid, layer_of(np.ones((2, 2))))
    with pytest.raises(hn.InvalidValueError, match="points need finite coordinates"):
        plot_costs(grid, layer_of(np.ones(grid.shape)), paths={"a": [(0.0, np.nan)]})
