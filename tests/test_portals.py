"""Portals and their table against scipy's and networkx's searches on the legal moves."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.sparse import csgraph

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.route import portal_table
from hybridnav.route.portal_table import PortalRoute, PortalTable
from hybridnav.search._costs import DIAGONAL, STRAIGHT
from hybridnav.topology.portals import STEPS_PER_CELL, Portals, build_portals
from tests.oracle.grid import assert_legal, components, distances, move_graph, recounted
from tests.strategies import MAX_SIDE, class_grids, drawn, occupancy_grid, scenes
from tests.test_search import block_labels

if TYPE_CHECKING:
    from hybridnav.grid import OccupancyGrid

SIDE = min(MAX_SIDE, 18)
SOURCE, UNREACHED = 8, 9
ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1])
COL_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1])
KINDS = ("pyramid", "pyramid", "blocks", "blocks", "pieces", "pieces", "one", "cells")


@dataclass(frozen=True)
class Divided:
    """A map, a partition of its free cells, and its legal moves as plain lists."""

    grid: OccupancyGrid
    field_of: Any
    spacing: int

    @property
    def free(self) -> Any:
        """Whether each cell may be entered."""
        return self.grid.classes == CellClass.FREE

    @property
    def label(self) -> Any:
        """Flat, 0 to n - 1 in the order of the given numbers, -1 where not free."""
        names = np.unique(self.field_of[self.free])
        dense = np.searchsorted(names, self.field_of)
        return np.where(self.free, dense, -1).ravel()

    def portals(self) -> Portals:
        """What is tested."""
        return build_portals(self.grid, self.field_of, spacing_cells=self.spacing)

    def moves(self) -> tuple[Any, Any, Any]:
        """Each legal move once: its cells and its integer cost."""
        if not self.grid.corner_cutting:
            graph = move_graph(self.free).tocoo()
            cost = np.where(graph.data > 1, DIAGONAL, STRAIGHT)
            return graph.row.astype(np.int64), graph.col.astype(np.int64), cost
        cells = {(row, col) for row, col in np.argwhere(self.free).tolist()}
        cols = self.grid.shape[1]
        found = [
            (
                row * cols + col,
                (row + up) * cols + col + right,
                DIAGONAL if up * right else STRAIGHT,
            )
            for row, col in sorted(cells)
            for up, right in ((0, 1), (1, 1), (1, 0), (1, -1))
            if (row + up, col + right) in cells
        ]
        tail, head, cost = np.array(found, dtype=np.int64).reshape(-1, 3).T
        return tail, head, cost

    def crossings(self) -> set[tuple[int, int]]:
        """Legal moves between two fields: cell in the lower one, cell in the higher."""
        label, (tail, head, _) = self.label, self.moves()
        apart = label[tail] != label[head]
        ends = zip(tail[apart].tolist(), head[apart].tolist(), strict=True)
        return {(u, v) if label[u] < label[v] else (v, u) for u, v in ends}

    def inside(self) -> Any:
        """Graph of the moves that stay in their field."""
        label, (tail, head, cost) = self.label, self.moves()
        within = label[tail] == label[head]
        entries = cost[within].astype(float), (tail[within], head[within])
        return sparse.coo_array(entries, shape=(label.size, label.size)).tocsr()

    def costs_inside(self, cells: Any) -> Any:
        """Integer costs inside the field from each given cell to every cell of the map."""
        found, back = np.unique(cells, return_inverse=True)
        if not len(found):
            return np.empty((0, self.free.size))
        return csgraph.dijkstra(self.inside(), directed=False, indices=found)[back]

    def optimum(self, start: int, goal: int) -> float:
        """Length of the shortest path on the whole map, infinite where there is none."""
        tail, head, cost = self.moves()
        entries = np.where(cost == DIAGONAL, math.sqrt(2), 1.0), (tail, head)
        graph: Any = sparse.coo_array(entries, shape=(self.free.size,) * 2).tocsr()
        start_cell = divmod(start, self.grid.shape[1])
        return float(distances(graph, self.grid.shape, start_cell).ravel()[goal])

    @property
    def fields_connected(self) -> bool:
        """Whether moves inside each field join all its cells."""
        _, piece = csgraph.connected_components(self.inside(), directed=False)
        label, free = self.label, self.free.ravel()
        return len(np.unique(piece[free])) == len(np.unique(label[free]))


def pieces_of(divided: Divided) -> Any:
    """The connected pieces of the fields, as a partition."""
    _, piece = csgraph.connected_components(divided.inside(), directed=False)
    return piece.reshape(divided.grid.shape).astype(np.int32)


@st.composite
def partitions(draw: st.DrawFn) -> Divided:
    """Draw maps with the fields of a pyramid, blocks, their pieces, one field, or single cells."""
    kind = draw(st.sampled_from(KINDS))
    spacing = draw(st.sampled_from([1, 2, 3, 4, 8, 100]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if kind == "pyramid":
        scene = draw(scenes(SIDE))
        pyramid = DualGraphPyramid.build(
            scene.grid,
            merge_distance_m=scene.merge_distance_m,
            linkage=draw(st.sampled_from(["radius", "survivor", "diameter"])),
            seed=scene.seed,
        )
        return Divided(scene.grid, pyramid[-1].field_of, spacing)
    classes = draw(class_grids(SIDE if kind != "cells" else 7))
    grid = replace(
        occupancy_grid(classes), corner_cutting=draw(st.sampled_from([False] * 4 + [True]))
    )
    if kind == "one":
        return Divided(grid, np.zeros(classes.shape, dtype=np.int32), spacing)
    if kind == "cells":
        names = rng.permutation(classes.size).reshape(classes.shape).astype(np.int32)
        return Divided(grid, names, spacing)
    # Numbers of fields have gaps; cells that are not free may have one or none.
    labels = 5 * block_labels(classes.shape, rng) + 3
    labels[(classes != CellClass.FREE) & (rng.random(classes.shape) < 0.5)] = -1
    divided = Divided(grid, labels.astype(np.int32), spacing)
    return replace(divided, field_of=pieces_of(divided)) if kind == "pieces" else divided


def halves(rows: int, cols: int, at: int) -> Divided:
    """A free map, its left part one field and its right part another."""
    field_of = np.zeros((rows, cols), dtype=np.int32)
    field_of[:, at:] = 1
    return Divided(occupancy_grid(np.ones((rows, cols), dtype=np.uint8)), field_of, 8)


def row_of(fields_of_cells: list[int]) -> Divided:
    """A free map of one row."""
    field_of = np.array([fields_of_cells], dtype=np.int32)
    return Divided(occupancy_grid(np.ones(field_of.shape, dtype=np.uint8)), field_of, 8)


def side_cells(portals: Portals) -> Any:
    ends = np.stack([portals.low_cell, portals.high_cell])
    return ends[portals.side_is_high, portals.side_portal]


def side_fields(portals: Portals) -> Any:
    return np.repeat(np.arange(portals.n_fields), np.diff(portals.side_start))


def entries_of(portals: Portals) -> tuple[Any, Any]:
    """Side and cell of each entry of `steps` and `towards`."""
    label, fields_of_sides = portals.field_of, side_fields(portals)
    members = [np.flatnonzero(label == f) for f in range(portals.n_fields)]
    side = np.repeat(np.arange(len(fields_of_sides)), portals.field_sizes[fields_of_sides])
    cells = [members[f] for f in fields_of_sides.tolist()]
    return side, np.concatenate([np.empty(0, dtype=np.int64), *cells])


# Portals


@given(partitions())
def test_each_border_has_one_portal_in_each_square_where_it_is_crossed(divided: Divided) -> None:
    portals, label = divided.portals(), divided.label
    cols = divided.grid.shape[1]
    assert (portals.field_of == label).all()
    found = list(zip(portals.low_cell.tolist(), portals.high_cell.tolist(), strict=True))
    crossings = divided.crossings()
    assert set(found) <= crossings, "a portal is no legal move between two fields"

    def key(low: int, high: int) -> tuple[int, ...]:
        row, col = divmod(low, cols)
        return int(label[low]), int(label[high]), row // divided.spacing, col // divided.spacing

    assert sorted(itertools.starmap(key, found)) == sorted(set(itertools.starmap(key, crossings)))
    touching = {(int(label[low]), int(label[high])) for low, high in crossings}
    assert {(int(label[low]), int(label[high])) for low, high in found} == touching
    apart = np.abs(portals.low_cell // cols - portals.high_cell // cols)
    straight = (apart == 0) | (portals.low_cell % cols == portals.high_cell % cols)
    assert (portals.cost == np.where(straight, STRAIGHT, DIAGONAL)).all()


@given(partitions())
def test_sides_are_sorted_by_field_and_found_by_their_offsets(divided: Divided) -> None:
    portals, label = divided.portals(), divided.label
    free = label >= 0
    assert portals.n_fields == len(np.unique(label[free]))
    assert (portals.field_sizes == np.bincount(label[free], minlength=portals.n_fields)).all()
    for f in range(portals.n_fields):
        size = portals.field_sizes[f]
        assert (np.sort(portals.place_in_field[label == f]) == np.arange(size)).all()
    n_sides = 2 * portals.n_portals
    assert portals.side_start[0] == 0
    assert portals.side_start[-1] == n_sides == len(portals.side_portal)
    assert (np.diff(portals.side_start) >= 0).all()
    both = list(zip(portals.side_portal.tolist(), portals.side_is_high.tolist(), strict=True))
    assert sorted(both) == list(itertools.product(range(portals.n_portals), (0, 1)))
    of = side_fields(portals)
    assert (label[side_cells(portals)] == of).all()
    assert portals.offset[0] == portals.between_start[0] == 0
    assert (np.diff(portals.offset) == portals.field_sizes[of]).all()
    assert len(portals.steps) == len(portals.towards) == portals.offset[-1]
    assert (np.diff(portals.between_start) == np.diff(portals.side_start)[of]).all()
    assert len(portals.between) == portals.between_start[-1]


@given(partitions())
def test_paths_inside_fields_are_those_that_dijkstra_finds(divided: Divided) -> None:
    portals, cols = divided.portals(), divided.grid.shape[1]
    cells, label = side_cells(portals), divided.label
    exact = divided.costs_inside(cells)
    side, cell = entries_of(portals)
    at = portals.offset[side] + portals.place_in_field[cell]
    assert (np.sort(at) == np.arange(len(portals.steps))).all()
    cost, towards = exact[side, cell], portals.towards[at]
    reached = np.isfinite(cost)
    assert ((towards == UNREACHED) == ~reached).all()
    assert ((towards == SOURCE) == (cell == cells[side])).all()
    off = portals.steps[at][reached] - cost[reached] * STEPS_PER_CELL / STRAIGHT
    assert (np.abs(off) <= 0.5).all()
    # One step on, what is left is less by exactly that step.
    leads = towards < SOURCE
    assert (leads | ~reached | (towards == SOURCE)).all()
    side, cell, direction = side[leads], cell[leads], towards[leads]
    up, right = ROW_STEP[direction], COL_STEP[direction]
    col = cell % cols + right
    assert ((col >= 0) & (col < cols)).all()
    following = cell + up * cols + right
    assert (label[following] == label[cell]).all()
    step = np.where(up * right != 0, DIAGONAL, STRAIGHT)
    assert (exact[side, following] + step == exact[side, cell]).all()
    tail, head, _ = divided.moves()
    size = label.size
    assert np.isin(
        np.minimum(cell, following) * size + np.maximum(cell, following),
        np.minimum(tail, head) * size + np.maximum(tail, head),
    ).all(), "a direction is no legal move"


@given(partitions())
def test_costs_between_the_sides_of_a_field_are_exact(divided: Divided) -> None:
    portals = divided.portals()
    cells = side_cells(portals)
    exact = divided.costs_inside(cells)
    beyond = np.iinfo(np.int32).max
    for side, field in enumerate(side_fields(portals).tolist()):
        row = portals.between[portals.between_start[side] : portals.between_start[side + 1]]
        others = cells[portals.side_start[field] : portals.side_start[field + 1]]
        expected = exact[side, others]
        assert (row == np.where(np.isinf(expected), beyond, expected)).all()


def test_a_portal_lies_in_the_middle_of_its_part_of_the_border() -> None:
    portals = halves(24, 6, 3).portals()
    assert (portals.low_cell % 6).tolist() == [2, 2, 2]
    assert (portals.high_cell - portals.low_cell).tolist() == [1, 1, 1]
    offsets = portals.low_cell // 6 - np.array([0, 8, 16])
    assert np.isin(offsets, [3, 4]).all()


def test_fields_that_meet_at_a_point_only_have_a_portal_there() -> None:
    field_of = np.array([[0, 2, 4], [3, 1, 5]], dtype=np.int32)
    divided = Divided(occupancy_grid(np.ones((2, 3), dtype=np.uint8)), field_of, 8)
    portals = divided.portals()
    ends = zip(portals.low_cell.tolist(), portals.high_cell.tolist(), strict=True)
    assert {(0, 4), (1, 3), (1, 5), (4, 2)} <= {(u, v) for u, v in ends} | {
        (v, u) for u, v in zip(portals.high_cell, portals.low_cell, strict=True)
    }
    walled = occupancy_grid(drawn("#.", ".."))
    walls = build_portals(walled, np.array([[0, 1], [2, 3]], dtype=np.int32))
    assert (walls.cost == STRAIGHT).all()
    assert walls.n_portals == 2


@given(partitions(), st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_the_numbers_of_the_fields_count_by_their_order_only(divided: Divided, seed: int) -> None:
    rng = np.random.default_rng(seed)
    given_names = divided.field_of.copy()
    given_names.setflags(write=False)
    first = divided.portals()
    top = int(divided.field_of.max()) + 1
    names = np.cumsum(rng.integers(1, 9, size=top + 1)).astype(np.int32)
    names[-1] = -1  # what -1 is renamed to
    second = replace(divided, field_of=names[given_names]).portals()
    again = replace(divided, field_of=given_names).portals()
    for field in fields(Portals):
        array = getattr(first, field.name)
        assert np.array_equal(array, getattr(second, field.name)), field.name
        assert np.array_equal(array, getattr(again, field.name)), field.name
        assert array.dtype == getattr(second, field.name).dtype


@given(class_grids(SIDE), st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_unexplored_cells_are_as_free_ones_when_they_may_be_entered(
    classes: Any, seed: int
) -> None:
    labels = block_labels(classes.shape, np.random.default_rng(seed))
    explored = np.where(classes == CellClass.UNEXPLORED, CellClass.FREE, classes).astype(np.uint8)
    entered = build_portals(occupancy_grid(classes), labels, allow_unexplored=True)
    expected = build_portals(occupancy_grid(explored), labels)
    for field in fields(Portals):
        assert np.array_equal(getattr(entered, field.name), getattr(expected, field.name))


# Routes


class Oracle:
    """Best ways over portals: the graph of their cells, weighed by distances inside fields."""

    def __init__(self, divided: Divided, portals: Portals) -> None:
        self.divided, self.portals = divided, portals
        self.graph: nx.Graph[Any] = nx.Graph()
        cells = side_cells(portals)
        unique = np.unique(cells)
        exact = divided.costs_inside(unique)
        self.graph.add_nodes_from(unique.tolist())
        for source, row in zip(unique.tolist(), exact, strict=True):
            reached = unique[np.isfinite(row[unique])]
            self.graph.add_weighted_edges_from(
                (source, other, float(row[other]) / STRAIGHT) for other in reached.tolist()
            )
        self.graph.add_weighted_edges_from(
            (low, high, cost / STRAIGHT)
            for low, high, cost in zip(
                portals.low_cell.tolist(),
                portals.high_cell.tolist(),
                portals.cost.tolist(),
                strict=True,
            )
        )
        self.own = [np.unique(cells[side_fields(portals) == f]) for f in range(portals.n_fields)]

    def bounds(self, start: int, goal: int) -> tuple[float, float]:
        """Least length over any portal's cell, and over any portal's lower cell.

        Between fields the two are one: every crossing passes a lower cell.
        """
        graph = self.graph.copy()
        for name, cell in (("start", start), ("goal", goal)):
            graph.add_node(name)
            costs = self.divided.costs_inside(np.array([cell]))[0]
            for other in self.own[self.divided.label[cell]].tolist():
                if np.isfinite(costs[other]):
                    graph.add_edge(name, other, weight=float(costs[other]) / STRAIGHT)
        ahead = nx.single_source_dijkstra_path_length(graph, "start")
        back = nx.single_source_dijkstra_path_length(graph, "goal")
        lower = set(self.portals.low_cell.tolist()) & ahead.keys() & back.keys()
        over_lower = min((ahead[cell] + back[cell] for cell in lower), default=math.inf)
        return ahead.get("goal", math.inf), over_lower


def check_cells(divided: Divided, portals: Portals, route: PortalRoute, ends: Any) -> Any:
    """A legal path between the ends that changes fields at the portals alone, in their order."""
    cells = np.stack(np.divmod(route.cells, divided.grid.shape[1]), axis=1)
    assert (route.cells[0], route.cells[-1]) == ends
    if not divided.grid.corner_cutting:
        assert_legal(cells, divided.free)
    else:
        assert divided.free[cells[:, 0], cells[:, 1]].all()
        assert (np.abs(np.diff(cells, axis=0)).max(axis=1, initial=1) == 1).all()
    label, left = divided.label, iter(route.portals.tolist())
    for u, v in itertools.pairwise(route.cells.tolist()):
        if label[u] != label[v]:
            move = (u, v) if label[u] < label[v] else (v, u)
            assert any((portals.low_cell[p], portals.high_cell[p]) == move for p in left)
    return cells


def check_route(divided: Divided, table: PortalTable, oracle: Oracle, ends: Any) -> None:
    portals, label = table.portals, divided.label
    start, goal = ends
    route = table.route(start, goal)
    least, over_lower = oracle.bounds(start, goal)
    one_field = label[start] == label[goal]
    if divided.fields_connected:
        joined = math.isfinite(divided.optimum(start, goal))
        has_portal = len(oracle.own[label[start]]) > 0
        assert (route is not None) == (joined and (has_portal or not one_field))
    if math.isinf(least):
        assert route is None
        return
    assert route is not None
    length = recounted(check_cells(divided, portals, route, ends))
    rounding = (len(route.portals) + 1) / STEPS_PER_CELL + 1e-6
    assert length >= divided.optimum(start, goal) - 1e-9
    assert least - 1e-6 <= length <= over_lower + rounding
    if not one_field:
        assert over_lower == pytest.approx(least)
        assert len(set(route.cells.tolist())) == len(route.cells)
    if len(divided.crossings()) == portals.n_portals:
        # All moves across are portals: what is lost is the rounding alone. A path that stays in
        # its field needs none of them.
        inside = divided.costs_inside(np.array([start]))[0, goal] / STRAIGHT
        best = min(length, inside) if one_field else length
        assert best <= divided.optimum(start, goal) + rounding


@given(partitions(), st.integers(0, 2**32 - 1))
@settings(max_examples=100)
def test_routes_are_the_best_over_portals(divided: Divided, seed: int) -> None:
    rng = np.random.default_rng(seed)
    free = np.flatnonzero(divided.free)
    assume(len(free))
    portals = divided.portals()
    table, oracle = PortalTable(portals, divided.grid.shape[1]), Oracle(divided, portals)
    at_portals = np.concatenate([portals.low_cell, portals.high_cell])
    for pick in ("any", "any", "portal", "portals", "same cell", "one field", "neighbours"):
        start, goal = rng.choice(free), rng.choice(free)
        if pick.startswith("portal") and len(at_portals):
            start = rng.choice(at_portals)
            goal = rng.choice(at_portals) if pick == "portals" else goal
        elif pick == "same cell":
            goal = start
        elif pick == "one field":
            goal = rng.choice(np.flatnonzero(divided.label == divided.label[start]))
        elif pick == "neighbours" and len(at_portals):
            p = rng.integers(portals.n_portals)
            start, goal = portals.low_cell[p], portals.high_cell[p]
        check_route(divided, table, oracle, (int(start), int(goal)))
        check_route(divided, table, oracle, (int(goal), int(start)))


@given(class_grids(7), st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_where_each_cell_is_a_field_routes_are_optimal(classes: Any, seed: int) -> None:
    # Wider fields, even at spacing 1, have one portal for up to three moves from a cell: a path
    # may have to cross by another one than the best.
    divided = Divided(
        occupancy_grid(classes), np.arange(classes.size, dtype=np.int32).reshape(classes.shape), 1
    )
    free = np.flatnonzero(divided.free)
    assume(len(free))
    portals = divided.portals()
    assert portals.n_portals == len(divided.crossings())
    table, rng = PortalTable(portals, classes.shape[1]), np.random.default_rng(seed)
    for start, goal in rng.choice(free, size=(8, 2)).tolist():
        route, optimum = table.route(start, goal), divided.optimum(start, goal)
        if start == goal:
            continue
        assert (route is None) == math.isinf(optimum)
        if route is not None:
            length = recounted(check_cells(divided, portals, route, (start, goal)))
            # Fields of one cell have no distances to round but the move across, in float32.
            assert length == pytest.approx(optimum, rel=0, abs=1e-3)


@given(partitions(), st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_a_route_is_the_same_each_time_and_stays_as_it_is(divided: Divided, seed: int) -> None:
    rng = np.random.default_rng(seed)
    free = np.flatnonzero(divided.free)
    assume(len(free))
    table = PortalTable(divided.portals(), divided.grid.shape[1])
    ends = rng.choice(free, size=(6, 2)).tolist()
    first = [table.route(*pair) for pair in ends]
    kept = [None if route is None else route.cells.copy() for route in first]
    fresh = PortalTable(divided.portals(), divided.grid.shape[1])
    for pair, route, cells in reversed(list(zip(ends, first, kept, strict=True))):
        for again in (table.route(*pair), fresh.route(*pair)):
            assert (again is None) == (route is None)
            if again is not None and route is not None:
                assert np.array_equal(again.cells, route.cells)
                assert np.array_equal(again.portals, route.portals)
        assert cells is None or (route is not None and np.array_equal(cells, route.cells))


def test_neighbours_across_a_border_and_portals_themselves() -> None:
    divided = halves(8, 6, 3)
    portals = divided.portals()
    table = PortalTable(portals, 6)
    low, high = int(portals.low_cell[0]), int(portals.high_cell[0])
    for start, goal, cells in (
        (low, high, [low, high]),
        (high, low, [high, low]),
        (low, low, [low]),
        (high, high, [high]),
        (low - 1, high + 1, [low - 1, low, high, high + 1]),
        (high + 1, low - 1, [high + 1, high, low, low - 1]),
        (low - 1, low, [low - 1, low]),
        (high, high + 1, [high, high + 1]),
    ):
        route = table.route(start, goal)
        assert route is not None
        assert route.portals.tolist() == [0]
        assert route.cells.tolist() == cells


def test_of_two_fields_that_join_the_same_portals_the_nearer_way_is_taken() -> None:
    # From a over b back to a: longer inside a, and longer by c, e, d too, but not as much.
    names = np.array(
        [list(line) for line in ("ceeeed", "c####d", "cabbad", "#a##a#", "#a##a#", "#aaaa#")]
    )
    grid = occupancy_grid(
        np.where(names == "#", CellClass.OCCUPIED, CellClass.FREE).astype(np.uint8)
    )
    for order in itertools.permutations("abcde"):
        field_of = np.full(names.shape, -1, dtype=np.int32)
        for number, name in enumerate(order):
            field_of[names == name] = number
        table = PortalTable(build_portals(grid, field_of, spacing_cells=1), 6)
        for cells in (range(12, 18), range(17, 11, -1)):
            route = table.route(cells[0], cells[-1])
            assert route is not None
            assert route.cells.tolist() == list(cells)


def test_in_one_field_a_route_goes_to_a_portal_and_back_however_far_that_is() -> None:
    # There and back are more cells than the map has.
    divided = row_of([0] * 39 + [1])
    route = PortalTable(divided.portals(), 40).route(0, 1)
    assert route is not None
    assert route.cells.tolist() == [*range(39), *range(37, 0, -1)]


def test_a_field_in_two_pieces_is_crossed_by_way_of_the_field_between() -> None:
    # The pieces lie in different squares: in one square they would share a portal, and one piece
    # of a field that is not connected would have none.
    for n in (10, 100, 2060, 2300):
        divided = row_of([0, *[1] * (n - 2), 0])
        route = PortalTable(divided.portals(), n).route(0, n - 1)
        assert route is not None
        assert route.cells.tolist() == list(range(n))


def test_paths_longer_than_the_stored_distances_go_the_shorter_way() -> None:
    # A ring, three cells high: by the left portal 5202 cells, by the right one 5002, and all
    # distances to them beyond 65535 / 32 cells.
    n = 5101
    classes = np.ones((3, n), dtype=np.uint8)
    classes[1, 1:-1] = CellClass.OCCUPIED
    field_of = np.zeros((3, n), dtype=np.int32)
    field_of[2] = 1
    divided = Divided(occupancy_grid(classes), field_of, 8)
    portals = divided.portals()
    assert portals.n_portals == 2
    start, goal = 2600, 2 * n + 2600
    route = PortalTable(portals, n).route(start, goal)
    assert route is not None
    expected = divided.optimum(start, goal)
    assert recounted(np.stack(np.divmod(route.cells, n), axis=1)) == pytest.approx(expected)


# Little maps, and what is refused


@pytest.mark.parametrize(
    "drawing",
    [("#",), ("?",), ("#?", "??"), (".",), ("..", ".."), ("#.#",), ("..?", "?..")],
)
def test_without_a_border_there_are_no_portals_and_no_routes(drawing: tuple[str, ...]) -> None:
    classes = drawn(*drawing)
    free = classes == CellClass.FREE
    grid = occupancy_grid(classes)
    portals = build_portals(grid, np.where(free, 4, -1).astype(np.int32))
    assert portals.n_portals == 0
    assert portals.n_fields == int(free.any())
    assert len(portals.steps) == len(portals.between) == 0
    table = PortalTable(portals, classes.shape[1])
    assert table.memory_bytes > 0
    for start, goal in itertools.product(np.flatnonzero(free).tolist(), repeat=2):
        assert table.route(start, goal) is None


def test_fields_walled_off_from_each_other_have_no_route() -> None:
    classes = drawn("..#..", "..#..")
    field_of = np.array([[0, 1, 9, 2, 3]] * 2, dtype=np.int32)
    table = PortalTable(build_portals(occupancy_grid(classes), field_of), 5)
    labels = components(classes == CellClass.FREE).ravel()
    cells = np.flatnonzero(labels).tolist()
    for start, goal in itertools.product(cells, repeat=2):
        assert (table.route(start, goal) is not None) == (labels[start] == labels[goal])


@pytest.mark.parametrize("spacing", [0, -1, -8])
def test_a_spacing_of_less_than_a_cell_is_refused(spacing: int) -> None:
    divided = halves(3, 4, 2)
    with pytest.raises(InvalidValueError, match="at least one cell"):
        build_portals(divided.grid, divided.field_of, spacing_cells=spacing)


def test_a_free_cell_without_a_field_is_refused_and_others_may_have_none() -> None:
    grid = occupancy_grid(drawn(".?#"))
    assert build_portals(grid, np.array([[0, -1, -1]], dtype=np.int32)).n_fields == 1
    with pytest.raises(
        InvalidValueError, match="every cell that may be entered must be in a field"
    ):
        build_portals(grid, np.array([[-1, 0, 0]], dtype=np.int32))


def test_too_many_portals_for_a_table_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    portals = replace(halves(6, 4, 2), spacing=1).portals()
    assert portals.n_portals == 6
    monkeypatch.setattr(portal_table, "MAX_PORTALS", 6)
    PortalTable(portals, 4)
    monkeypatch.setattr(portal_table, "MAX_PORTALS", 5)
    with pytest.raises(InvalidValueError, match="a table of 6 portals is too large, at most 5"):
        PortalTable(portals, 4)
