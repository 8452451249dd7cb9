"""Pictures of buildings: a panel for each floor, routes, links with their names."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import hybridnav as hn
from hybridnav.ext.fleet import plot_building
from tests.ext.fleet.test_queries import office


def gids(ax: Any) -> list[str]:
    return [str(child.get_gid()) for child in ax.get_children() if child.get_gid()]


def test_each_floor_has_a_panel_and_the_highest_is_on_top() -> None:
    building = office()
    floors = [hn.Floor(f.name, f.planner, 3.0 * i) for i, f in enumerate(building.floors)]
    building = hn.Building(floors, building.links)
    plan = building.plan(("1", (1.5, 3.5)), ("2", (1.5, 4.5)))
    low, high = plot_building(building, plan)
    assert low.get_position().y0 < high.get_position().y0
    assert low.get_title() == "floor 1  ·  map 1  ·  2.0 m"
    for ax, number in ((low, 0), (high, 1)):
        (line,) = [child for child in ax.lines if child.get_gid() == "route-1"]
        path = plan.results[number].path
        assert path is not None
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


def test_alternatives_have_a_line_each_and_none_is_needed() -> None:
    building = office()
    found = building.alternatives(("1", (1.5, 3.5)), ("2", (1.5, 4.5)), 2, max_stretch=9.0)
    axes = plot_building(building, found)
    legend = axes[0].get_legend() or axes[1].get_legend()
    assert legend is not None
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
    with pytest.raises(hn.InvalidValueError, match="2 floors need as many axes, got 1"):
        plot_building(building, axes=given[:1])
