"""Hub labels answer as searches do, within the memory that is allowed."""

import copy
import itertools
import tempfile
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import InvalidValueError, ModelError
from hybridnav.maps import CellClass
from hybridnav.search.mesh import MeshSearch, build_mesh, shortest_paths
from hybridnav.search.mesh.kernels import squares
from hybridnav.search.mesh.kernels.views import view_room
from tests.oracle.any_angle import some_positions
from tests.strategies import class_grids, examples, occupancy_grid

seeds = st.integers(0, 2**32 - 1)


def rooms(rows: int, cols: int, seed: int = 3) -> Any:
    """Classes of rooms with doors and pillars."""
    rng = np.random.default_rng(seed)
    classes = np.full((rows, cols), CellClass.FREE, dtype=np.uint8)
    for row in range(19, rows, 20):
        classes[row] = CellClass.OCCUPIED
    for col in range(24, cols, 25):
        classes[:, col] = CellClass.OCCUPIED
    for row, col in rng.integers(0, (rows - 3, cols - 3), (rows * cols // 150, 2)):
        classes[row : row + 2, col : col + 2] = CellClass.OCCUPIED
    for row, col in rng.integers(0, (rows - 3, cols - 3), (rows * cols // 200, 2)):
        classes[row : row + 4, col : col + 4] = CellClass.FREE
    return classes


def labels_of(planner: hn.HybridPlanner) -> Any:
    """The hub labels of a planner."""
    search = planner.prepared
    assert isinstance(search, MeshSearch)
    return search.labels


def labelled(free: Any, most_mb: float = 20.0) -> MeshSearch:
    search = MeshSearch(build_mesh(free))
    assert search.label(most_mb)
    return search


def ends_in(free: Any, seed: int, count: int) -> Any:
    rng = np.random.default_rng(seed)
    cells = rng.choice(np.argwhere(free), (2, count))
    return tuple(cells), tuple(cells + rng.random(cells.shape))


@settings(max_examples=examples(60), deadline=None)
@given(class_grids(max_side=14), seeds, st.sampled_from([1, 2, 3, 4, 8]))
def test_lengths_are_those_of_a_search_for_squares_of_any_side(
    classes: Any, seed: int, side: int
) -> None:
    free = classes == CellClass.FREE
    assume(free.any())
    mesh = build_mesh(free)
    plain, search = MeshSearch(mesh), MeshSearch(mesh)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hybridnav.search.mesh.hubs._SIDES", (side,))
        assert search.label(20.0)
    for (first, start), (last, goal) in itertools.permutations(some_positions(free, seed), 2):
        asked = (first, last), (start, goal)
        length = plain.path(*asked).length_cells
        assert search.length(*asked, epsilon=0.0) == pytest.approx(length, rel=0, abs=1e-9)
        found = search.path(*asked)
        assert found.length_cells == pytest.approx(length, rel=0, abs=1e-9)
        assert found.lower_bound_cells == found.length_cells


def test_ends_at_the_corner_where_two_cells_meet_belong_to_their_cells() -> None:
    free = np.array([[1, 1, 1, 1], [1, 1, 0, 1], [1, 0, 1, 1], [1, 1, 1, 1]], dtype=bool)
    plain, search = MeshSearch(build_mesh(free)), labelled(free)
    pinch = 2.0, 2.0
    for cells in itertools.product([(1, 1), (2, 2)], [(1, 1), (2, 2), (0, 3), (3, 3), (0, 0)]):
        goal = pinch if cells[1] in {(1, 1), (2, 2)} else (cells[1][0] + 0.5, cells[1][1] + 0.5)
        for asked in ((cells, (pinch, goal)), (cells[::-1], (goal, pinch))):
            assert search.path(*asked).length_cells == plain.path(*asked).length_cells


@pytest.mark.parametrize("shape", [(3, 4), (1, 1)])
def test_open_maps_and_maps_without_a_free_cell_are_labelled(shape: tuple[int, int]) -> None:
    search = labelled(np.ones(shape, dtype=bool))
    cells = (0, 0), (shape[0] - 1, shape[1] - 1)
    positions = (0.5, 0.5), (shape[0] - 0.5, shape[1] - 0.5)
    assert search.path(cells, positions).length_cells == np.hypot(*np.subtract(*cells))
    assert labelled(np.zeros(shape, dtype=bool)).labels is not None


def test_labels_keep_to_the_memory_that_is_allowed() -> None:
    free = rooms(90, 140) == CellClass.FREE
    cells, positions = ends_in(free, 1, 200)
    wide = labelled(free)
    lengths = shortest_paths(MeshSearch(wide.mesh), cells, positions).length_cells
    least = np.inf
    for most_mb in (20.0, 2.0, 1.0, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.01):
        search = MeshSearch(wide.mesh)
        is_made = search.label(most_mb)
        assert is_made == (search.labels is not None)
        if search.labels is not None:
            assert search.labels.n_bytes <= most_mb * 1e6
            least = most_mb
        found = shortest_paths(search, cells, positions).length_cells
        np.testing.assert_allclose(found, lengths, rtol=0, atol=1e-9)
    assert 0.01 < least < 2.0


def test_a_budget_or_a_path_that_is_known_changes_nothing() -> None:
    free = rooms(60, 80) == CellClass.FREE
    search = labelled(free)
    (starts, goals), points = ends_in(free, 2, 1)
    asked = (tuple(starts[0]), tuple(goals[0])), (tuple(points[0][0]), tuple(points[1][0]))
    length = search.path(*asked).length_cells
    assert search.path(*asked, budget_s=0.0).length_cells == length
    known = search.path(*asked).positions
    assert search.path(*asked, known=known).length_cells == length


def planner_of(grid: hn.OccupancyGrid, preset: Any = "shortest") -> hn.HybridPlanner:
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    return hn.HybridPlanner(topology, preset=preset)


@pytest.mark.parametrize("compress", [False, True])
def test_models_hold_labels(tmp_path: Path, *, compress: bool) -> None:
    grid = occupancy_grid(rooms(60, 80))
    planner = planner_of(grid)
    planner.prepare(labels=5)
    hn.save(planner, tmp_path / "office.hnm", compress=compress)
    loaded = hn.load(tmp_path / "office.hnm").planner()
    ours, theirs = labels_of(planner), labels_of(loaded)
    for mine, other in zip(ours.arrays, theirs.arrays, strict=True):
        assert mine.dtype == other.dtype
        np.testing.assert_array_equal(mine, other)
        assert not other.flags.writeable
    _, points = ends_in(grid.classes == CellClass.FREE, 3, 40)
    starts, goals = map(grid.frame.points_of_grid, points)
    for start, goal in zip(starts, goals, strict=True):
        assert loaded.distance(start, goal) == planner.distance(start, goal)
        assert loaded.plan(start, goal).cost == planner.plan(start, goal).cost


@pytest.mark.parametrize(
    ("name", "at", "value"),
    [
        ("layout", 0, 0.5),
        ("layout", 0, 16.0),
        ("layout", 1, 1.0),
        ("layout", 2, 60.0),
        ("layout", 3, 0.0),
        ("views", (0, 0), 10**9),
        ("views", (0, 2), 10**8),
        ("views", (0, 1), -1),
        ("entries", 0, 1 << 61),
        ("heads", 0, 10**6),
        ("offset", 1, 10**8),
        ("begin", -1, 3),
    ],
)
def test_labels_that_lead_out_of_their_arrays_are_refused(
    tmp_path: Path, name: str, at: Any, value: float
) -> None:
    planner = planner_of(occupancy_grid(rooms(60, 80)))
    planner.prepare(labels=5)
    array = getattr(labels_of(planner), name)
    array.flags.writeable = True
    array[at] = value
    hn.save(planner, tmp_path / "office.hnm")
    with pytest.raises(ModelError, match="hub labels"):
        hn.load(tmp_path / "office.hnm").planner()


def test_a_change_of_the_map_drops_labels_and_they_can_be_built_again() -> None:
    grid = occupancy_grid(rooms(60, 80))
    planner = planner_of(grid)
    planner.prepare(labels=5)
    rng = np.random.default_rng(4)
    classes = grid.classes.copy()
    for _ in range(4):
        row, col = rng.integers(0, 50), rng.integers(0, 70)
        classes[row : row + 6, col : col + 6] = rng.integers(1, 3, (6, 6))
        changed = occupancy_grid(classes)
        planner.update(grid=changed)
        assert planner.prepared is None
        planner.prepare(labels=5)
        assert labels_of(planner) is not None
        free = classes == CellClass.FREE
        cells, points = ends_in(free, 5, 60)
        lengths = shortest_paths(MeshSearch(build_mesh(free)), cells, points).length_cells
        starts, goals = map(changed.frame.points_of_grid, points)
        found = [planner.distance(*pair) for pair in zip(starts, goals, strict=True)]
        wanted = lengths * changed.frame.resolution_m
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-8)


def built_meanwhile() -> None:
    """Wait for labels that are being built."""
    for thread in threading.enumerate():
        if thread.name == "hybridnav labels":
            thread.join()


@settings(max_examples=examples(12), deadline=None)
@given(
    st.lists(st.sampled_from(["ask", "close", "change", "save", "copy", "label", "wait"])), seeds
)
def test_plans_are_the_same_whenever_labels_are_built_in_the_background(
    steps: list[str], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    classes = rooms(40, 50, seed % 100)
    preset = hn.load_preset("shortest", overrides=["planner.labels_mb=5"])
    planner, is_closed = planner_of(occupancy_grid(classes), preset), np.zeros((40, 50), np.bool_)
    planner.prepare()
    for step in [*steps, "ask", "wait", "ask"]:
        row, col = rng.integers(0, (34, 44))
        if step == "wait":
            built_meanwhile()
        elif step == "label":
            planner.prepare(labels=5)
        elif step == "copy":
            planner = copy.deepcopy(planner)
        elif step == "save":
            with tempfile.TemporaryDirectory() as folder:
                hn.save(planner, Path(folder) / "office.hnm")
                planner = hn.load(Path(folder) / "office.hnm").planner(preset)
        elif step == "change":
            classes = classes.copy()
            classes[row : row + 5, col : col + 5] = rng.integers(1, 3, (5, 5))
            planner.update(topology=planner_of(occupancy_grid(classes)).topology)
            planner.prepare()
        elif step == "close":
            is_closed[row : row + 4, col : col + 6] ^= True
        else:
            free = classes == CellClass.FREE
            cells, points = ends_in(free & ~is_closed, seed, 8)
            open_mesh = build_mesh(free & ~is_closed)
            wanted = shortest_paths(MeshSearch(open_mesh), cells, points).length_cells
            starts, goals = map(planner.grid.frame.points_of_grid, points)
            blocked = {"cells": np.argwhere(is_closed)} if is_closed.any() else None
            found = [
                planner.distance(*pair, blocked=blocked) for pair in zip(starts, goals, strict=True)
            ]
            # Plans round closed cells measure from the ends before they are rounded.
            wanted *= planner.grid.resolution_m
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-6)
    assert labels_of(planner) is not None


@pytest.mark.parametrize("labels", [0, -1.0, float("nan"), float("inf"), True])
def test_other_budgets_are_refused(labels: Any) -> None:
    planner = planner_of(hn.example_map("figure1"))
    with pytest.raises(InvalidValueError, match="labels must be a number of MB"):
        planner.prepare(labels=labels)


def test_too_little_memory_and_presets_without_labels_are_named() -> None:
    planner = planner_of(occupancy_grid(rooms(60, 80)))
    with pytest.raises(InvalidValueError, match=r"need more than 0\.001 MB"):
        planner.prepare(labels=0.001)
    assert labels_of(planner) is None
    with pytest.raises(InvalidValueError, match="no hub labels"):
        planner_of(hn.example_map("figure1"), "grid-astar").prepare(labels=5)


def test_squares_seen_whole_are_those_of_views_that_began_with_more_room(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One corner sees some 1,200 others on a quarter of a circle: its view begins anew."""
    free = np.ones((950, 950), np.bool_)
    angles = np.linspace(0.02, np.pi / 2 - 0.02, 613)
    rows, cols = (np.round(2 + 900 * part(angles)).astype(int) for part in (np.sin, np.cos))
    free[rows, cols] = free[2, 2] = False
    mesh = build_mesh(free)
    walls = np.full(len(mesh.corners), -1, np.int32)
    slots = np.flatnonzero(mesh.twins < 0)
    walls[mesh.begins[slots]] = slots
    walls[(mesh.corners > 3).any(axis=1)] = -1
    arrays = MeshSearch(mesh).arrays
    layout = 16.0, 61, 61 * 61
    parts = squares.squares_of_polygons(arrays, *layout[:2])

    def seen(views: Any) -> list[int]:
        found = np.empty(1 << 14, np.int32)
        return found[: views(arrays, walls, parts, layout, found)[-1]].tolist()

    asked: list[int] = []
    found = seen(squares.squares_of_views)
    python = getattr(squares.squares_of_views, "py_func", squares.squares_of_views)
    for least in (0, 1 << 15):

        def larger(n: int, least: int = least) -> Any:
            asked.append(n)
            return view_room(max(n, least))

        monkeypatch.setattr(squares, "view_room", larger)
        assert seen(python) == found
    assert asked == [1024, 2048, 1024]
