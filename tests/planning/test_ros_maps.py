"""The hybrid planner on every ROS map of the reference data, judged by independent means."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridnav as hn
from hybridnav.maps import CellClass
from tests.oracle.corridors import corridor_of
from tests.oracle.grid import assert_legal, components, inflated, length_of_points, recounted

Cells = NDArray[np.int64]

RADIUS_M = 0.25
MERGE_DISTANCE_M = 4.0
WITHIN_LARGEST, ANYWHERE, ACROSS = 70, 20, 10
WHOLE_GRID = 10
"""Pairs of each map that are also planned on the whole grid."""


def ros_maps() -> list[str]:
    """Every map of the reference data; one that cannot be there without it."""
    table = Path(os.environ.get("HYBRIDNAV_DATA", "")) / "maps.tsv"
    if not table.is_file():
        return ["none"]
    rows = [line.split("\t") for line in table.read_text().splitlines()[1:]]
    return [name for name, kind in rows if kind == "map"]


@dataclass(frozen=True)
class KnownMap:
    """A map, the cells that may be entered found by other means, and their components."""

    topology: hn.TopologicalMap
    enterable: Any
    component: Any

    @classmethod
    def of(cls, path: Path) -> KnownMap:
        with warnings.catch_warnings():
            # Some maps call grey free; they are planned on all the same.
            warnings.simplefilter("ignore", hn.errors.MapWarning)
            raw = hn.load_map(path, robot_radius_m=0)
            grid = hn.load_map(path, robot_radius_m=RADIUS_M)
        blocked = inflated(raw.classes == CellClass.OCCUPIED, RADIUS_M / raw.resolution_m)
        enterable = (raw.classes == CellClass.FREE) & ~blocked
        pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=MERGE_DISTANCE_M)
        return cls(hn.TopologicalMap(pyramid), enterable, components(enterable))

    def pairs(self, rng: np.random.Generator) -> Cells:
        """Pairs of free cells within the largest component, anywhere, and across components."""
        cells, label = np.argwhere(self.enterable), self.component[self.enterable]
        largest = cells[label == np.bincount(label).argmax()]
        within = rng.integers(len(largest), size=(WITHIN_LARGEST, 2))
        anywhere = rng.integers(len(cells), size=(ANYWHERE, 2))
        across = rng.integers(len(cells), size=(ACROSS, 2))
        if label.min() < label.max():
            for pair in across:
                while label[pair[0]] == label[pair[1]]:
                    pair[1] = rng.choice(len(cells))
                    if rng.random() < 0.5:
                        pair[0] = rng.choice(len(cells))
        return np.concatenate([largest[within], cells[anywhere], cells[across]])


def test_the_reference_data_lists_43_maps(data: Path) -> None:
    assert (data / "maps.tsv").is_file()
    assert len(ros_maps()) == 43


@pytest.mark.parametrize("name", ros_maps())
def test_the_hybrid_planner_solves_what_is_connected_and_its_paths_are_legal(data, name):
    site = KnownMap.of(data / name)
    grid = site.topology.grid
    assert np.array_equal(grid.classes == CellClass.FREE, site.enterable)
    by_places = hn.load_preset("paper", overrides=["planner.levels=places"])
    hybrid = hn.HybridPlanner(site.topology, preset=by_places)
    down = hn.HybridPlanner(site.topology, preset="paper")
    whole = hn.HybridPlanner(site.topology, preset="grid-astar")
    rng = np.random.default_rng(list(name.encode()))
    pairs = site.pairs(rng)
    assert len(pairs) == 100
    on_the_whole_grid = set(np.linspace(0, len(pairs) - 1, WHOLE_GRID).astype(int).tolist())
    for number, pair in enumerate(pairs):
        # Anywhere in the cell, not only its centre.
        start, goal = grid.frame.points_of_grid(pair + rng.uniform(0.02, 0.98, size=(2, 2)))
        result = hybrid.plan(start, goal)
        connected = site.component[tuple(pair[0])] == site.component[tuple(pair[1])]
        assert result.status is (hn.PlanStatus.SOLVED if connected else hn.PlanStatus.NO_PATH)
        if connected:
            judge(result, site, pair)
        by_levels = down.plan(start, goal)
        assert by_levels.status is result.status
        if by_levels.path is not None:
            assert by_levels.path.cells[[0, -1]].tolist() == pair.tolist()
            assert_legal(by_levels.path.cells, site.enterable)
        if number in on_the_whole_grid:
            compare(result, whole.plan(start, goal), site, pair)


def judge(result: hn.PlanResult, site: KnownMap, pair: Cells) -> None:
    """Assert what a user may take for granted of a solved plan."""
    path, route, topology = result.path, result.route, site.topology
    assert path.cells[[0, -1]].tolist() == pair.tolist()
    # A corridor has the fields of the route's places, of those that touch it twice, and no other.
    places = np.searchsorted(topology.place_ids, route.places)
    assert topology.place_ids[places].tolist() == list(route.places)
    at = topology.level.field_of[path.cells[:, 0], path.cells[:, 1]]
    inside = corridor_of(topology, places.tolist())
    assert np.isin(at, inside).all()
    assert_legal(path.cells, site.enterable)
    assert at[0] == places[0]
    assert at[-1] == places[-1]
    joined = topology.arcs[np.searchsorted(topology.arc_ids, route.arcs)]
    assert len(joined) == len(places) - 1
    assert (np.sort(joined) == np.sort(np.stack([places[:-1], places[1:]], axis=1))).all()
    # Lengths are measured on the points and counted from the moves.
    assert np.array_equal(path.points, topology.grid.frame.points_of(path.cells))
    assert path.length_m == pytest.approx(length_of_points(path.points), rel=1e-9)
    exact = recounted(path.cells) * topology.grid.resolution_m
    assert path.length_m == result.cost == pytest.approx(exact, rel=1e-12)
    assert 0 <= result.lower_bound <= result.cost
    assert result.stats.corridor_cells == topology.level.areas[inside].sum()


def compare(hybrid: hn.PlanResult, whole: hn.PlanResult, site: KnownMap, pair: Cells) -> None:
    """Assert that the whole grid's answer agrees with the hybrid one and is never longer."""
    assert whole.status is hybrid.status
    if whole.path is None:
        return
    assert whole.route is not None
    assert whole.path.cells[[0, -1]].tolist() == pair.tolist()
    assert_legal(whole.path.cells, site.enterable)
    assert whole.gap == 0
    assert whole.cost <= hybrid.cost + 1e-9
    assert hybrid.lower_bound <= whole.cost + 1e-9
