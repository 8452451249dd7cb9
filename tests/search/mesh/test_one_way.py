"""Shortest paths across directed sides are those of an independent visibility graph."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from hybridnav.search.directed import DirectedSides
from hybridnav.search.mesh import DetourSearch, MeshSearch, build_mesh, cells_across, shortest_paths
from tests.one_way import Scene, random_scene
from tests.oracle.mesh import assert_sides_agree, twice_the_area
from tests.oracle.one_way import OneWayPlane
from tests.strategies import examples

NONE = np.empty(0, np.int64)
OPEN = np.ones((4, 6), bool)


def detour_of(scene: Scene, closed: Any = NONE) -> DetourSearch:
    return DetourSearch(MeshSearch(build_mesh(scene.free)), scene.free, closed, sides=scene.sides)


def exact(positions: Any) -> list[tuple[Fraction, Fraction]]:
    return [(Fraction(row), Fraction(col)) for row, col in positions.tolist()]


def floats(point: tuple[Fraction, Fraction]) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def assert_shortest(scene: Scene, detour: DetourSearch, opened: MeshSearch) -> None:
    """Hold that each path is as short as the oracle's, legal, and passes the cells that it lists;
    and that an undirected path which no side is said to bar is the answer."""
    plane = scene.plane
    lengths = plane.lengths(scene.ends, scene.ends)
    sides = DirectedSides.of([("sides", scene.sides)] * bool(len(scene.sides)), scene.free.shape)
    for i, (first, start) in enumerate(scene.ends):
        for j, (last, goal) in enumerate(scene.ends):
            ends = floats(start), floats(goal)
            found = detour.search.path((first, last), ends)
            assert found.length_cells == pytest.approx(lengths[i, j], abs=1e-9)
            assert found.lower_bound_cells == pytest.approx(lengths[i, j], abs=1e-9)
            straight = opened.path((first, last), ends)
            if not detour.is_met_by(straight):
                assert straight.length_cells == pytest.approx(lengths[i, j], abs=1e-9)
            if found.positions is not None:
                assert plane.allows((first, last), exact(found.positions))
                cells = cells_across(scene.free, sides, found.positions, (first, last))
                listed = [tuple(cell) for cell in cells.tolist()]
                assert listed[0] == first
                assert listed[-1] == last
                assert plane.allows_moves(listed, strict=False)


@pytest.mark.parametrize("part", range(4))
def test_paths_on_random_maps_are_shortest(part: int) -> None:
    for seed in range(part, examples(1_000), 4):
        scene = random_scene(seed)
        if scene is not None:
            detour = detour_of(scene)
            assert_shortest(scene, detour, MeshSearch(build_mesh(scene.free)))


def test_closed_cells_and_directed_sides_are_cut_at_once() -> None:
    for seed in range(examples(200)):
        scene = random_scene(seed)
        if scene is None:
            continue
        shut = np.random.default_rng(seed).random(scene.free.shape) < 0.15
        shut[tuple(np.array([cell for cell, _ in scene.ends]).T)] = False
        detour = detour_of(scene, np.flatnonzero(shut))
        left = Scene(scene.free & ~shut, scene.sides, scene.ends)
        assert_shortest(left, detour, MeshSearch(build_mesh(left.free)))


def test_polygons_beside_slits_are_those_of_the_map() -> None:
    for seed in range(examples(200)):
        scene = random_scene(seed)
        if scene is not None:
            mesh = detour_of(scene).search.mesh
            assert twice_the_area(mesh) == 2 * scene.free.sum()
            # A corner of slits occurs several times: of equal ones the first one is taken.
            equal = (mesh.corners[:, None] == mesh.corners).all(axis=2)
            assert_sides_agree(replace(mesh, begins=equal.argmax(axis=1)[mesh.begins]))


def test_paths_of_many_pairs_are_those_of_each() -> None:
    scene = random_scene(17, n_ends=8)
    assert scene is not None
    search = detour_of(scene).search
    cells = np.array([cell for cell, _ in scene.ends])
    points = np.array([floats(point) for _, point in scene.ends])
    pairs = (cells, cells[::-1]), (points, points[::-1])
    lengths = shortest_paths(search, *pairs).length_cells
    alone = [
        search.path((tuple(a), tuple(b)), (tuple(p), tuple(q))).length_cells
        for a, b, p, q in zip(*(of.tolist() for of in (*pairs[0], *pairs[1])), strict=True)
    ]
    assert lengths.tolist() == alone


@pytest.mark.parametrize(
    ("sides", "there", "back"),
    [
        # A line across columns 0 to 3 below row 2, crossed downwards.
        ([(2, c, 1, c) for c in range(4)], 3.0, 2 * np.hypot(1.5, 3.5)),
        # The same side listed both ways is shut.
        ([(2, c, 1, c) for c in range(4)] + [(1, 0, 2, 0)], np.hypot(1.5, 0.5) * 2, None),
        # All the way: there is no way back.
        ([(2, c, 1, c) for c in range(6)], 3.0, np.inf),
    ],
)
def test_a_line_is_crossed_in_its_direction(sides: Any, there: float, back: float | None) -> None:
    ends = ((3, 0), (0, 0)), ((3.5, 0.5), (0.5, 0.5))
    search = detour_of(Scene(OPEN, np.array(sides), [])).search
    assert search.path(*ends).length_cells == pytest.approx(there, abs=1e-12)
    found = search.path(ends[0][::-1], ends[1][::-1])
    if back is not None:
        assert found.length_cells == pytest.approx(back, abs=1e-12)
        assert found.lower_bound_cells == pytest.approx(back, abs=1e-12)


def test_a_path_turns_back_round_the_end_of_a_line() -> None:
    """From one lip of a side to the other, the way leads along it, round its end, and back."""
    sides, point = np.array([[1, 0, 2, 0], [1, 1, 2, 1]]), (2.0, 0.0)
    found = detour_of(Scene(OPEN, sides, [])).search.path(((2, 0), (1, 0)), (point, point))
    assert found.positions is not None
    assert found.positions.tolist() == [[2, 0], [2, 2], [2, 0]]
    plane = OneWayPlane(OPEN, sides)
    assert plane.allows(((2, 0), (1, 0)), exact(found.positions))
    assert not plane.allows(((2, 0), (1, 0)), exact(found.positions[[0, 2]]))


def test_a_walk_round_a_corner_that_all_sides_allow_ends() -> None:
    """Four sides at one corner, all crossed counter-clockwise."""
    sides = np.array([[2, 3, 2, 2], [2, 2, 1, 2], [1, 2, 1, 3], [1, 3, 2, 3]])
    search = detour_of(Scene(OPEN, sides, [])).search
    found = search.path(((2, 3), (1, 3)), ((2.5, 3.5), (1.5, 3.5)))
    plane = OneWayPlane(OPEN, sides)
    half = Fraction(1, 2)
    starts = [((2, 3), (2 + half, 3 + half))]
    goals = [((1, 3), (1 + half, 3 + half))]
    assert found.length_cells == pytest.approx(plane.lengths(starts, goals)[0, 0], abs=1e-9)
