"""Portals and their table against scipy's searches on the legal moves."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.route.portal_table import build_tables
from hybridnav.search._costs import DIAGONAL, STRAIGHT
from hybridnav.topology.portals import (
    PathTooLongError,
    Portals,
    PortalsTooLargeError,
    build_portals,
    compact_labels,
)
from hybridnav.topology.thin_portals import beside_sources, thinned
from tests.divided import Divided, costs_from, halves, partitions
from tests.strategies import drawn, occupancy_grid

AT_GATE = 8
ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1])
COL_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1])
ENOUGH = settings(max_examples=120, derandomize=True, deadline=None)
FEWER = settings(max_examples=40, derandomize=True, deadline=None)


def fields_of(starts: Any) -> Any:
    """The field of each of what is sorted by field."""
    return np.repeat(np.arange(len(starts) - 1), np.diff(starts))


def position_of(portals: Portals, cells: Any, cols: int) -> Any:
    """Position of cells, by the squares of 8 x 8 cells that the index is made of."""
    row, col = np.divmod(cells, cols)
    square = row // 8 * -(-cols // 8) + col // 8
    return portals.position[square * 64 + row % 8 * 8 + col % 8]


def exits_of(portals: Portals) -> tuple[Any, Any]:
    """Cells at the tail and the head of each move out of a field."""
    tail = np.repeat(portals.gate_cell, np.diff(portals.exit_start)).astype(np.int64)
    return tail, portals.gate_cell[portals.exit_gate].astype(np.int64)


def side_moves(divided: Divided, portals: Portals) -> list[tuple[Any, Any, Any]]:
    """For each side the moves of its portal out of its field, by the definition of portals."""
    tail, head, cost = divided.crossings
    label, cols, spacing = divided.label, divided.grid.shape[1], divided.spacings[0]
    low = np.where(label[tail] < label[head], tail, head)
    high = np.where(label[tail] < label[head], head, tail)
    key = np.stack([label[low], label[high], low // cols // spacing, low % cols // spacing])
    found = []
    field = fields_of(portals.side_start)
    for side, p in enumerate(portals.side_portal.tolist()):
        ends = portals.gate_cell[portals.side_gate[portals.portal_sides[p]]]
        at = ends[0] // cols // spacing, ends[0] % cols // spacing
        own = (key == np.array([label[ends[0]], label[ends[1]], *at])[:, None]).all(axis=0)
        own &= label[tail] == field[side]
        found.append((tail[own], head[own], cost[own]))
    return found


# Portals


@ENOUGH
@given(partitions())
def test_every_move_between_fields_is_an_exit_of_one_portal(divided: Divided) -> None:
    portals, label, cols = divided.portals(), divided.label, divided.grid.shape[1]
    tail, head = exits_of(portals)
    found = list(zip(tail.tolist(), head.tolist(), portals.exit_cost.tolist(), strict=True))
    expected = zip(*(part.tolist() for part in divided.crossings), strict=True)
    assert sorted(found) == sorted(expected)
    assert np.array_equal(np.unique(portals.gate_cell), np.unique(tail))
    assert (label[portals.gate_cell] == fields_of(portals.gate_start)).all()
    low = np.where(label[tail] < label[head], tail, head)
    other = np.maximum(label[tail], label[head])
    spacing = divided.spacings[0]
    keys = zip(label[low], other, low // cols // spacing, low % cols // spacing, strict=True)
    pairs = set(zip(portals.exit_portal.tolist(), keys, strict=True))
    assert len(pairs) == len({key for _, key in pairs}) == portals.n_portals


@ENOUGH
@given(partitions())
def test_sides_and_portals_name_each_other(divided: Divided) -> None:
    portals, label = divided.portals(), divided.label
    n = portals.n_portals
    sides, fields = portals.portal_sides, fields_of(portals.side_start)
    assert portals.n_fields == len(np.unique(label[label >= 0]))
    assert np.array_equal(np.sort(sides.ravel()), np.arange(2 * n))
    assert (portals.side_portal[sides] == np.arange(n)[:, None]).all()
    assert (fields[sides[:, 0]] < fields[sides[:, 1]]).all()
    assert (label[portals.gate_cell[portals.side_gate]] == fields).all()
    starts = portals.side_gates_start
    for side, (tail, head, cost) in enumerate(side_moves(divided, portals)):
        gates = portals.side_gates[starts[side] : starts[side + 1]]
        assert (np.diff(gates) > 0).all()
        assert np.array_equal(np.sort(portals.gate_cell[gates]), np.unique(tail))
        p = portals.side_portal[side]
        here, there = portals.side_gate[sides[p] if sides[p, 0] == side else sides[p, ::-1]]
        own = (tail == portals.gate_cell[here]) & (head == portals.gate_cell[there])
        assert cost[own].tolist() == [portals.portal_cost[p]]


@ENOUGH
@given(partitions(), st.sampled_from([1, 1, 2, 4]))
def test_paths_inside_fields_are_those_that_dijkstra_finds(divided: Divided, every: int) -> None:
    portals, cols = divided.portals(gate_spacing_cells=every), divided.grid.shape[1]
    label, exact = divided.label, costs_from(divided.inside, portals.gate_cell)
    positions = position_of(portals, np.arange(label.size), cols)
    assert np.array_equal(np.sort(positions[label >= 0]), np.arange((label >= 0).sum()))
    assert (positions[label < 0] == -1).all()
    legal = divided.moves.astype(bool).todok()
    steps: set[tuple[int, int]] = set()
    for gate, field in enumerate(fields_of(portals.gate_start).tolist()):
        cells = np.flatnonzero(label == field)
        place = positions[cells] - portals.field_start[field]
        row = portals.rows[portals.row_start[gate] : portals.row_start[gate + 1]]
        assert len(row) == -(-len(cells) // 2)
        assert np.array_equal(np.sort(place), np.arange(len(cells)))
        towards = row[place // 2] >> place % 2 * 4 & 15
        assert (towards <= AT_GATE).all()
        assert np.array_equal(towards == AT_GATE, cells == portals.gate_cell[gate])
        leads = towards < AT_GATE
        tail, k = cells[leads], towards[leads]
        head = tail + ROW_STEP[k] * cols + COL_STEP[k]
        assert (tail % cols + COL_STEP[k] == head % cols).all()
        assert (label[head] == field).all()
        # One step on, what is left is less by exactly that step.
        step = np.where(k % 2 == 1, DIAGONAL, STRAIGHT)
        assert (exact[gate, head] + step == exact[gate, tail]).all()
        steps.update(zip(tail.tolist(), head.tolist(), strict=True))
    assert steps <= set(legal.keys()), "a direction is no legal move"
    for f in range(portals.n_fields):
        own = slice(portals.gate_start[f], portals.gate_start[f + 1])
        clique = portals.clique[portals.clique_start[f] : portals.clique_start[f + 1]]
        assert np.array_equal(clique, exact[own, portals.gate_cell[own]].ravel())


@ENOUGH
@given(partitions(), st.sampled_from([1, 1, 2, 4]))
def test_steps_and_radii_are_true(divided: Divided, every: int) -> None:
    portals, cols = divided.portals(gate_spacing_cells=every), divided.grid.shape[1]
    label = divided.label
    exact = costs_from(divided.inside, portals.gate_cell[portals.side_gate])
    for f in range(portals.n_fields):
        cells = np.flatnonzero(label == f)
        sides = np.arange(portals.side_start[f], portals.side_start[f + 1])
        stored = portals.steps[portals.steps_start[f] : portals.steps_start[f + 1]]
        stored = stored.reshape(len(cells), len(sides))
        place = position_of(portals, cells, cols) - portals.field_start[f]
        rounded = exact[np.ix_(sides, cells)].astype(np.int64) >> portals.steps_shift[f]
        assert np.array_equal(stored[place], rounded.T)
    for side, (tail, _, _) in enumerate(side_moves(divided, portals)):
        assert exact[side, tail].max() == portals.side_radius[side]


@ENOUGH
@given(partitions(), st.sampled_from([1, 1, 2, 4]))
def test_each_gate_has_a_source_of_its_portal_at_a_true_cost(divided: Divided, every: int) -> None:
    portals, cols = divided.portals(gate_spacing_cells=every), divided.grid.shape[1]
    at_source = portals.gate_cell[portals.source_gate]
    lower = portals.side_gate[portals.portal_sides[:, 0]]
    assert (portals.source_gate[portals.portal_source] == lower).all()
    inside = costs_from(divided.inside, at_source)
    true = costs_from(divided.moves, at_source)
    starts, square = portals.side_gates_start, divided.spacings[1]
    used: set[int] = set()
    for side, (tail, head, cost) in enumerate(side_moves(divided, portals)):
        p = portals.side_portal[side]
        is_low = portals.portal_sides[p, 0] == side
        low = tail if is_low else head
        squares = set(zip(low // cols // square, low % cols // square, strict=True))
        sources = set()
        for q in range(starts[side], starts[side + 1]):
            gate, source = portals.gate_cell[portals.side_gates[q]], portals.side_gates_source[q]
            stored = portals.side_gates_cost[q]
            over = np.zeros(1) if is_low else cost[tail == gate]
            cells = np.array([gate]) if is_low else head[tail == gate]
            assert stored in (inside[source, cells] + over).tolist(), "the cost of no path"
            assert stored >= true[source, gate]
            assert at_source[source] in low
            sources.add(int(source))
        if every == 1 and is_low:
            at = at_source[list(sources)]
            assert set(zip(at // cols // square, at % cols // square, strict=True)) == squares
            assert len(sources) == len(squares)
            assert not sources & used, "a source of two portals"
            used |= sources
    assert every > 1 or used == set(range(len(at_source)))


def test_fields_that_meet_at_a_point_only_have_a_portal_there() -> None:
    grid = occupancy_grid(drawn("..", ".."))
    portals = build_portals(grid, np.array([[0, 1], [2, 3]], dtype=np.int32))
    assert portals.n_portals == 6
    assert np.sort(portals.portal_cost).tolist() == [STRAIGHT] * 4 + [DIAGONAL] * 2
    walled = build_portals(occupancy_grid(drawn("#.", "..")), np.array([[0, 1], [2, 3]], np.int32))
    assert walled.portal_cost.tolist() == [STRAIGHT] * 2


def test_a_portal_lies_in_the_middle_of_its_part_of_the_border() -> None:
    portals = halves(24, 6, 3).portals()
    low = portals.gate_cell[portals.side_gate[portals.portal_sides[:, 0]]]
    assert (low % 6).tolist() == [2, 2, 2]
    assert np.isin(low // 6 - np.array([0, 8, 16]), [3, 4]).all()
    assert portals.portal_cost.tolist() == [STRAIGHT] * 3
    assert len(portals.source_gate) == 6


# The table


def rounded_down(costs: Any) -> Any:
    """Float32 values nearest below."""
    near = costs.astype(np.float32)
    return np.where(near > costs, np.nextafter(near, np.float32(0)), near)


@ENOUGH
@given(partitions())
def test_the_table_has_the_costs_of_shortest_paths(divided: Divided) -> None:
    portals, tables = build_tables(divided.portals())
    true = costs_from(divided.moves, portals.gate_cell[portals.source_gate])
    assert np.array_equal(tables.bound, rounded_down(true[:, portals.gate_cell]))
    assert tables.route is tables.bound
    assert np.array_equal(tables.gate_field, divided.label[portals.gate_cell])
    for side, (tail, _, _) in enumerate(side_moves(divided, portals)):
        source = portals.portal_source[portals.side_portal[side]]
        assert true[source, tail].max() <= tables.reach[side]


@ENOUGH
@given(partitions(), st.booleans())
def test_with_fewer_gates_bounds_stay_and_routes_are_no_shorter(
    divided: Divided,
    keep_more: bool,  # noqa: FBT001 - drawn
) -> None:
    every = divided.portals()
    kept = beside_sources(every)
    if keep_more:
        kept = kept | (np.random.default_rng(every.n_gates).random(every.n_gates) < 0.3)
    portals, tables = build_tables(every, kept=kept)
    assert np.array_equal(portals.gate_cell, every.gate_cell[kept])
    true = costs_from(divided.moves, portals.gate_cell[portals.source_gate])
    assert np.array_equal(tables.bound, rounded_down(true[:, portals.gate_cell]))
    assert (tables.route >= tables.bound).all()
    assert np.array_equal(np.isfinite(tables.route), np.isfinite(tables.bound))
    # The routes are those of the graph that is left: paths inside fields, and its exits.
    tail, head = exits_of(portals)
    entries = portals.exit_cost.astype(float), (tail, head)
    pairs = [
        np.array(list(itertools.product(portals.gate_cell[a:b].tolist(), repeat=2)))
        for a, b in itertools.pairwise(portals.gate_start.tolist())
    ]
    u, v = np.concatenate([np.empty((0, 2), int), *(p.reshape(-1, 2) for p in pairs)]).T
    legs = portals.clique.astype(float), (u, v)
    size = divided.label.size
    graph = sparse.coo_array(entries, shape=(size, size)) + sparse.coo_array(legs, (size, size))
    over_gates = costs_from(graph.tocsr(), portals.gate_cell[portals.source_gate])
    assert np.array_equal(tables.route, rounded_down(over_gates[:, portals.gate_cell]))
    names = ("side_radius", "portal_sides", "portal_source", "portal_cost", "position", "steps")
    for name in names:
        assert np.array_equal(getattr(portals, name), getattr(every, name)), name
    assert np.array_equal(every.gate_cell[every.side_gate], portals.gate_cell[portals.side_gate])
    at_source = every.gate_cell[every.source_gate]
    assert np.array_equal(at_source, portals.gate_cell[portals.source_gate])


def test_keeping_all_gates_changes_nothing() -> None:
    portals = halves(9, 9, 4).portals()
    same = thinned(portals, np.ones(portals.n_gates, dtype=np.bool_))
    for name in Portals._fields:
        assert np.array_equal(getattr(portals, name), getattr(same, name)), name


# Little maps, and what is refused


@pytest.mark.parametrize("drawing", [("#",), ("?",), ("#?", "??"), (".",), ("..", ".."), ("#.#",)])
def test_without_a_border_there_are_no_portals(drawing: tuple[str, ...]) -> None:
    classes = drawn(*drawing)
    free = classes == CellClass.FREE
    portals = build_portals(occupancy_grid(classes), np.where(free, 4, -1).astype(np.int32))
    assert portals.n_fields == int(free.any())
    portals, tables = build_tables(portals, kept=beside_sources(portals))
    assert portals.n_portals == portals.n_gates == 0
    assert tables.route.shape == tables.bound.shape == (0, 0)


@FEWER
@given(partitions(), st.integers(0, 2**32 - 1))
def test_the_numbers_of_the_fields_count_by_their_order_only(divided: Divided, seed: int) -> None:
    rng = np.random.default_rng(seed)
    given_names = divided.field_of.copy()
    given_names.setflags(write=False)
    top = int(divided.field_of.max()) + 1
    names = np.cumsum(rng.integers(1, 9, size=top + 1)).astype(np.int32)
    names[-1] = -1  # what -1 is renamed to
    first, second = divided.portals(), replace(divided, field_of=names[given_names]).portals()
    for name in Portals._fields:
        array, other = getattr(first, name), getattr(second, name)
        assert np.array_equal(array, other), name
        assert array.dtype == other.dtype, name
        assert array.flags.c_contiguous, name  # kernels are compiled anew for other layouts


def test_many_fields_are_numbered_in_32_bits() -> None:
    names = np.arange(200 * 200, dtype=np.int32).reshape(200, 200)
    label = compact_labels(names, np.ones(names.shape, dtype=np.bool_))
    assert label.dtype == np.int32
    assert np.array_equal(label, names)
    few = compact_labels(names, names < 1000)
    assert few.dtype == np.int16
    assert np.array_equal(few, np.where(names < 1000, names, -1))


@pytest.mark.parametrize("spacings", [(0, 1, 1), (4, 0, 1), (4, 4, 0), (-8, -4, 1), (16, 5, 1)])
def test_spacings_that_make_no_lattice_are_refused(spacings: tuple[int, int, int]) -> None:
    divided = halves(3, 4, 2)
    with pytest.raises(InvalidValueError, match="spacings of at least one cell") as refused:
        build_portals(
            divided.grid,
            divided.field_of,
            spacing_cells=spacings[0],
            source_spacing_cells=spacings[1],
            gate_spacing_cells=spacings[2],
        )
    assert "\n" not in str(refused.value)


def test_a_free_cell_without_a_field_is_refused_and_others_may_have_none() -> None:
    grid = occupancy_grid(drawn(".?#"))
    assert build_portals(grid, np.array([[0, -1, -1]], dtype=np.int32)).n_fields == 1
    message = "every cell that may be entered must be in a field"
    for field_of in (np.array([[-1, 0, 0]]), np.array([[0, 0]])):
        with pytest.raises(InvalidValueError, match=message):
            build_portals(grid, field_of.astype(np.int32))
    with pytest.raises(InvalidValueError, match=message):
        build_portals(grid, np.array([[0, -1, 0]], dtype=np.int32), allow_unexplored=True)


def test_a_field_in_two_pieces_is_refused() -> None:
    grid = occupancy_grid(drawn("...", "..."))
    with pytest.raises(PathTooLongError, match="a field is not connected") as refused:
        build_portals(grid, np.array([[0, 1, 0], [0, 1, 0]], dtype=np.int32))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("folded", [False, True])
def test_a_field_with_too_long_a_path_is_refused(folded: bool) -> None:  # noqa: FBT001
    for length, fits in ((6600, True), (6700, False)):
        free = np.ones((1, length), dtype=np.uint8)
        if folded:  # a serpentine: lanes of 99 cells, joined at either end in turn
            free = np.zeros((2 * (length // 100), 99), dtype=np.uint8)
            free[::2] = 1
            free[1::4, -1] = free[3::4, 0] = 1
        field_of = np.zeros(free.shape, dtype=np.int32)
        field_of[0, 0] = 1
        divided = Divided(occupancy_grid(free), field_of)
        if fits:
            far = costs_from(divided.inside, np.array([1]))[0]
            portals = divided.portals()
            farthest = np.where(np.isfinite(far), far, 0).max()
            assert portals.steps.max() == int(farthest) >> portals.steps_shift[0]
            continue
        with pytest.raises(PathTooLongError, match="longer than 6,600 cells") as refused:
            divided.portals()
        assert "\n" not in str(refused.value)


@FEWER
@given(partitions())
def test_portals_that_take_too_much_memory_are_refused(divided: Divided) -> None:
    portals = divided.portals()
    size = portals.rows.nbytes + portals.clique.nbytes + portals.steps.nbytes
    size += 4 * len(portals.source_gate) * portals.n_gates
    divided.portals(max_bytes=size)
    with pytest.raises(PortalsTooLargeError, match="portals would take 0 MB"):
        divided.portals(max_bytes=size - 1)
