"""The convex mesh covers free space exactly, and paths on it are shortest."""

import copy
import csv
import itertools
import math
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume
from scipy import ndimage

from benchmarks.worlds import office_world, tiled
from hybridnav.harness.judges import VisibilityGraph, segment_faults
from hybridnav.maps import CellClass
from hybridnav.search.mesh import (
    ConvexMesh,
    CornerGraph,
    CornerHierarchy,
    MeshSearch,
    build_mesh,
    shortest_paths,
)
from hybridnav.search.mesh.kernels.corner_graph import edges_of
from tests.oracle.any_angle import some_positions
from tests.oracle.mesh import (
    KINDS,
    assert_sides_agree,
    endpoints_of_sides,
    polygon,
    search_of,
    twice_the_area,
)
from tests.strategies import class_grids, drawn, occupancy_grid, seeds, tried

DATA = Path(os.environ.get("HYBRIDNAV_DATA", "no data")) / "any_angle_optima"
OPTIMA = sorted(path.stem for path in DATA.glob("*.csv"))


@tried(40, class_grids())
def test_polygons_are_convex_and_their_area_is_that_of_the_free_cells(classes: Any) -> None:
    free = classes == CellClass.FREE
    assert twice_the_area(build_mesh(free)) == 2 * free.sum()


@tried(40, class_grids())
def test_sides_are_shared_by_two_polygons_or_are_walls(classes: Any) -> None:
    free = classes == CellClass.FREE
    mesh = build_mesh(free)
    assert_sides_agree(mesh)
    endpoints = endpoints_of_sides(mesh)
    walls = mesh.corners[mesh.begins[mesh.twins < 0]], mesh.corners[endpoints[mesh.twins < 0]]
    length = int(np.abs(walls[0] - walls[1]).sum())
    padded = np.pad(free, 1).astype(np.int8)
    assert length == sum(int(np.abs(np.diff(padded, axis=axis)).sum()) for axis in (0, 1))


@tried(40, class_grids())
def test_each_free_cell_knows_a_polygon_round_its_centre(classes: Any) -> None:
    free = classes == CellClass.FREE
    mesh = build_mesh(free)
    assert ((mesh.polygon_at >= 0) == free).all()
    for row, col in np.argwhere(free).tolist():
        points = polygon(mesh, mesh.polygon_at[row, col])
        ahead = np.roll(points, -1, axis=0) - points
        offset = np.array([col, row]) + 0.5 - points
        assert (ahead[:, 0] * offset[:, 1] - ahead[:, 1] * offset[:, 0] >= 0).all()
    # Cells that meet at a corner alone are not connected.
    labels, _ = ndimage.label(free)
    component = mesh.component[mesh.polygon_at[free]]
    assert len(np.unique(np.stack([labels[free], component]), axis=1).T) == labels.max(initial=0)


def searches(mesh: ConvexMesh) -> list[MeshSearch]:
    return [search_of(mesh, kind) for kind in KINDS]


@tried(60, class_grids(max_side=14), seeds)
def test_paths_are_as_short_as_those_of_the_visibility_graph(classes: Any, seed: int) -> None:
    free = classes == CellClass.FREE
    assume(free.any())
    grid = occupancy_grid(classes)
    graph, mesh = VisibilityGraph(grid), build_mesh(free)
    endpoints = some_positions(free, seed)
    for search, ((first, start), (last, goal)) in itertools.product(
        searches(mesh), itertools.pairwise(endpoints)
    ):
        found = search.path((first, last), (start, goal))
        assert found.length_cells == pytest.approx(graph.between(start, goal).length_m)
        if found.positions is not None:
            points = grid.frame.points_of_grid(found.positions)
            assert found.positions[0].tolist() == list(start)
            assert found.positions[-1].tolist() == list(goal)
            assert not segment_faults(grid, points)
        back = search.path((last, first), (goal, start))
        assert back.length_cells == pytest.approx(found.length_cells)


def test_a_graph_with_an_edge_without_its_reverse_is_not_used(monkeypatch):
    classes = drawn(".....", ".###.", ".###.", ".....")
    graph, mesh = VisibilityGraph(occupancy_grid(classes)), build_mesh(classes == CellClass.FREE)
    whole = MeshSearch(mesh)
    whole.prepare()
    assert whole.edges is not None
    for edge in range(len(whole.edges[1])):

        def all_but_one(*given: Any, edge: int = edge) -> Any:
            first, heads = edges_of(*given)
            return first - (first > edge), np.delete(heads, edge)

        monkeypatch.setattr("hybridnav.search.mesh.kernels.corner_graph.edges_of", all_but_one)
        search = MeshSearch(mesh)
        search.prepare()
        assert search.is_prepared
        assert search.graph is None
        assert search.edges is None
        found = search.path(((0, 0), (3, 4)), ((0.5, 0.5), (3.5, 4.5)))
        assert found.length_cells == found.lower_bound_cells
        assert found.length_cells == pytest.approx(graph.shortest((0, 0), (3, 4)).length_m)


def test_copies_of_a_search_answer_by_the_kernels_that_are_compiled() -> None:
    cells = (0, 0), (3, 4)
    centres = (0.5, 0.5), (3.5, 4.5)
    for search in searches(build_mesh(drawn(".....", ".###.", ".###.", ".....") == 1)):
        copied = copy.deepcopy(search)
        assert (copied.graph is None) == (search.graph is None)
        assert copied.path(cells, centres).length_cells == search.path(cells, centres).length_cells
        # To numba an array that may be written is of another type.
        for array in vars(copied.mesh).values():
            assert not array.flags.writeable


def test_threads_may_share_a_search_while_it_prepares_itself(monkeypatch):
    monkeypatch.setattr("hybridnav.search.mesh.search._WORTH", 0)
    free = np.random.default_rng(3).random((40, 40)) > 0.2
    endpoints = [tuple(map(tuple, np.argwhere(free)[[k, -1 - k]].tolist())) for k in range(60)]
    alone, shared = MeshSearch(build_mesh(free)), MeshSearch(build_mesh(free))

    def length(search: MeshSearch, cells: Any) -> float:
        centres = tuple((row + 0.5, col + 0.5) for row, col in cells)
        return search.path(cells, centres).length_cells  # type: ignore[arg-type]

    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda cells: length(shared, cells), endpoints))
    assert found == pytest.approx([length(alone, cells) for cells in endpoints])
    assert shared.graph is not None


def test_all_kinds_of_search_agree_on_a_building(monkeypatch: pytest.MonkeyPatch) -> None:
    """Corners are fewer than intervals, and on a large building those of the hierarchy fewest."""
    monkeypatch.setattr("hybridnav.search.mesh.search._WORTH", 10**9)
    world = tiled(office_world(), rows=2, cols=2)
    free = world.grid(robot_radius_m=0.25).classes == CellClass.FREE
    cells = np.argwhere(free)[np.random.default_rng(6).integers(int(free.sum()), size=(60, 2))]
    plain, landmarks, hierarchy = searches(build_mesh(free))
    assert isinstance(landmarks.graph, CornerGraph)
    assert isinstance(hierarchy.graph, CornerHierarchy)
    expanded = np.zeros(3)
    for (a, b), (c, d) in cells.tolist():
        endpoints = ((a, b), (c, d)), ((a + 0.5, b + 0.5), (c + 0.5, d + 0.5))
        found = [search.path(*endpoints) for search in (plain, landmarks, hierarchy)]
        assert found[1].length_cells == pytest.approx(found[0].length_cells, abs=1e-9)
        assert found[2].length_cells == pytest.approx(found[0].length_cells, abs=1e-9)
        assert found[2].lower_bound_cells == found[2].length_cells
        expanded += [each.expanded for each in found]
    assert plain.graph is None
    assert expanded[0] > 3 * expanded[1]
    assert expanded[1] > 1.5 * expanded[2] > 0


@pytest.mark.parametrize("kind", KINDS)
def test_many_queries_get_the_answers_of_each_alone(kind: str) -> None:
    free = np.random.default_rng(3).random((30, 30)) > 0.25
    search = search_of(build_mesh(free), kind)
    cells = np.argwhere(free)[np.random.default_rng(4).integers(int(free.sum()), size=(2, 300))]
    many = shortest_paths(search, (cells[0], cells[1]), (cells[0] + 0.5, cells[1] + 0.25))
    for query, (start, goal) in enumerate(zip(*cells.tolist(), strict=True)):
        endpoints = (start[0] + 0.5, start[1] + 0.5), (goal[0] + 0.25, goal[1] + 0.25)
        alone = search.path((tuple(start), tuple(goal)), endpoints)
        assert many.length_cells[query] == alone.length_cells
        assert many.lower_bound_cells[query] == alone.lower_bound_cells
        found = many.positions[slice(*many.path_start[query : query + 2])]
        expected = np.empty((0, 2)) if alone.positions is None else alone.positions
        np.testing.assert_array_equal(found, expected)


def test_two_cells_that_meet_at_a_corner_are_not_connected() -> None:
    free = drawn(".#", "#.") == CellClass.FREE
    for search in searches(build_mesh(free)):
        assert search.path(((0, 1), (1, 0)), ((1.0, 1.0), (1.0, 1.0))).positions is None
        assert search.path(((0, 1), (0, 1)), ((1.0, 1.0), (0.0, 2.0))).length_cells == math.sqrt(2)


def test_a_path_may_turn_at_a_corner_and_follow_walls() -> None:
    classes = drawn(".....", ".###.", ".###.", ".....")
    for search in searches(build_mesh(classes == CellClass.FREE)):
        found = search.path(((0, 0), (3, 4)), ((1.0, 0.5), (3.0, 4.5)))
        assert found.positions.tolist() in (
            [[1.0, 0.5], [1.0, 4.0], [3.0, 4.0], [3.0, 4.5]],
            [[1.0, 0.5], [1.0, 4.0], [3.0, 4.5]],
            [[1.0, 0.5], [3.0, 1.0], [3.0, 4.5]],
        )
        assert found.length_cells == pytest.approx(2 * math.hypot(0.5, 2) / 2 + 3.5)


def test_intervals_lead_round_the_end_of_a_side_on_whose_line_the_start_lies() -> None:
    rows = (
        "...#......#.....#",
        "...#.......#.....",
        ".................",
        "....##...........",
        ".......#..##.....",
        "..#..............",
    )
    free = np.array([[cell == "." for cell in row] for row in rows])
    path = MeshSearch(build_mesh(free)).path(((0, 11), (0, 1)), ((1.0, 11.5), (0.0, 2.0)))
    bends = np.array([(1, 11.5), (1, 12), (2, 12), (2, 3), (0, 2)])
    np.testing.assert_array_equal(path.positions, bends)
    assert path.lower_bound_cells == path.length_cells == pytest.approx(1.5 + 9 + math.sqrt(5))


def test_maps_of_one_kind_of_cell() -> None:
    assert build_mesh(np.zeros((3, 4), np.bool_)).n_polygons == 0
    for search in searches(build_mesh(np.ones((3, 4), np.bool_))):
        assert search.mesh.n_polygons == 1
        assert search.path(((0, 0), (2, 3)), ((0.0, 0.0), (3.0, 4.0))).length_cells == 5.0


def test_a_search_finds_room_for_its_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hybridnav.search.mesh.search._ROOM", 4)
    rng = np.random.default_rng(3)
    free = rng.random((40, 40)) > 0.2
    free[0, 0] = free[-1, -1] = True
    endpoints = ((0, 0), (39, 39)), ((0.5, 0.5), (39.5, 39.5))
    graph = VisibilityGraph(occupancy_grid(np.where(free, np.uint8(1), np.uint8(0))))
    expected = graph.shortest((0, 0), (39, 39)).length_m
    for search in searches(build_mesh(free)):
        assert search.path(*endpoints).length_cells == pytest.approx(expected)


@pytest.mark.skipif(not OPTIMA, reason="HYBRIDNAV_DATA is not set")
@pytest.mark.parametrize("name", OPTIMA or ["none"])
def test_lengths_are_the_stated_optima(name: str) -> None:
    lines = (DATA / f"{name}.map").read_text().split("\n")[4:]
    free = np.array([[letter == "." for letter in line] for line in lines if line])
    every = searches(build_mesh(free))
    with (DATA / f"{name}.csv").open() as file:
        problems = np.array([list(map(float, row)) for row in list(csv.reader(file))[1:]])
    assert len(problems) == 200
    for sx, sy, gx, gy, length in problems.tolist():
        cells = (int(sy), int(sx)), (int(gy), int(gx))
        for search in every:
            found = search.path(cells, ((sy, sx), (gy, gx)))
            assert abs(found.length_cells - length) < 1e-6
