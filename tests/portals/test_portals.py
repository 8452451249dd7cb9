"""Portals, and the shortest paths inside fields, against scipy's searches on the legal moves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.portals.build import (
    PathTooLongError,
    Portals,
    PortalsTooLargeError,
    build_portals,
)
from hybridnav.portals.fields import compact_labels
from hybridnav.search.moves import DIAGONAL, STRAIGHT
from tests.divided import GATES, Divided, costs_from, fields_of, halves, partitions
from tests.strategies import drawn, examples, occupancy_grid

MOVES = 8
"""Moves that one stored direction stands for, where it has this bit set."""
ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1])
COL_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1])
ENOUGH = settings(max_examples=examples(120), derandomize=True, deadline=None)
FEWER = settings(max_examples=examples(40), derandomize=True, deadline=None)


def position_of(portals: Portals, cells: Any, cols: int) -> Any:
    """Position of cells, by the squares of 8 x 8 cells that the index is made of."""
    row, col = np.divmod(cells, cols)
    square = row // 8 * -(-cols // 8) + col // 8
    return portals.position[square * 64 + row % 8 * 8 + col % 8]


def exits_of(portals: Portals) -> tuple[Any, Any]:
    """Cells at the tail and the head of each move out of a field."""
    tail = np.repeat(portals.gate_cell, np.diff(portals.exit_start)).astype(np.int64)
    return tail, portals.gate_cell[portals.exit_gate].astype(np.int64)


def group_of(divided: Divided, low: Any, high: Any, spacing: int) -> Any:
    """The fields of moves, from the lower one to the higher, and the square of their lower cell."""
    cols = divided.grid.shape[1]
    lattice = low // cols // spacing, low % cols // spacing
    return np.stack([divided.label[low], divided.label[high], *lattice], axis=1)


def lower_to_higher(divided: Divided) -> tuple[Any, Any, Any]:
    """Each move between two fields once: cells in the lower one and in the higher, cost."""
    tail, head, cost = divided.crossings
    up = divided.label[tail] < divided.label[head]
    return tail[up], head[up], cost[up]


def middle_cells(divided: Divided, spacing: int) -> list[list[frozenset[int]]]:
    """Ends of the moves that may stand for each group: those nearest to the middle of all of its
    lower cells, where a diagonal counts as a cell farther off."""
    low, high, cost = lower_to_higher(divided)
    place = np.stack(np.divmod(low, divided.grid.shape[1]), axis=1)
    groups, group = np.unique(group_of(divided, low, high, spacing), axis=0, return_inverse=True)
    found = []
    for g in range(len(groups)):
        own = np.flatnonzero(group.ravel() == g)
        away = np.linalg.norm(place[own] - place[own].mean(axis=0), axis=1)
        away += cost[own] == DIAGONAL
        best = own[away <= away.min() + 1e-9]
        found.append(
            [frozenset(pair) for pair in zip(low[best].tolist(), high[best].tolist(), strict=True)]
        )
    return found


# Portals


@ENOUGH
@given(partitions(), st.sampled_from(GATES))
def test_every_move_between_gates_of_two_fields_is_an_exit(divided: Divided, gates: str) -> None:
    portals, label = divided.portals(gates), divided.label
    tail, head, cost = divided.crossings
    if gates == "all":
        assert np.array_equal(np.sort(portals.gate_cell), np.unique(tail))
    kept = np.isin(tail, portals.gate_cell) & np.isin(head, portals.gate_cell)
    expected = zip(tail[kept].tolist(), head[kept].tolist(), cost[kept].tolist(), strict=True)
    endpoints = (part.tolist() for part in exits_of(portals))
    found = zip(*endpoints, portals.exit_cost.tolist(), strict=True)
    assert sorted(found) == sorted(expected)
    assert portals.n_fields == divided.n_fields
    assert len(np.unique(portals.gate_cell)) == portals.n_gates
    assert (label[portals.gate_cell] == fields_of(portals.gate_start)).all()
    places = position_of(portals, portals.gate_cell, divided.grid.shape[1])
    assert (np.diff(places) > 0).all(), "gates do not stand in the order of cells"


@ENOUGH
@given(partitions(), st.sampled_from(GATES))
def test_the_sides_of_a_field_are_those_of_its_portals(divided: Divided, gates: str) -> None:
    portals = divided.portals(gates)
    low, high, _ = lower_to_higher(divided)
    spacing = divided.spacings[gates == "sparse"]
    expected: dict[tuple[int, ...], set[int]] = {}
    is_gate = np.isin(low, portals.gate_cell) & np.isin(high, portals.gate_cell)
    keys = group_of(divided, low, high, spacing).tolist()
    for key, endpoints, leads in zip(
        keys, np.stack([low, high], axis=1).tolist(), is_gate, strict=True
    ):
        for end in (0, 1):
            gates_of_side = expected.setdefault((key[end], end, *key), set())
            gates_of_side |= {endpoints[end]} if leads else set()
    fields, starts = fields_of(portals.side_start), portals.side_gates_start
    found = []
    for side, field in enumerate(fields.tolist()):
        own = portals.side_gates[starts[side] : starts[side + 1]]
        assert (np.diff(own) > 0).all()
        found.append((field, sorted(portals.gate_cell[own].tolist())))
    assert sorted(found) == sorted((key[0], sorted(cells)) for key, cells in expected.items())
    assert all(cells for _, cells in found), "a side without a gate"


@ENOUGH
@given(partitions(), st.sampled_from([1, 2, 4, 8]))
def test_gates_are_where_the_middles_are(divided: Divided, spacing: int) -> None:
    low, high, _ = lower_to_higher(divided)
    portals = divided.portals(spacing_cells=8, gate_spacing_cells=spacing)
    gates = set(portals.gate_cell.tolist())
    border = middle_cells(divided, spacing)
    assert all(any(pair <= gates for pair in pairs) for pairs in border)
    if spacing == 1:
        assert gates == {*low.tolist(), *high.tolist()}
    else:
        assert gates <= set().union(*(pair for pairs in border for pair in pairs))
    # Sources: from where a move between gates leads up to a higher field.
    leads = np.isin(low, portals.gate_cell) & np.isin(high, portals.gate_cell)
    assert np.array_equal(np.sort(portals.gate_cell[portals.source_gate]), np.unique(low[leads]))
    assert (np.diff(portals.source_gate) > 0).all()


@ENOUGH
@given(partitions(), st.sampled_from(GATES))
def test_paths_inside_fields_are_those_that_dijkstra_finds(divided: Divided, gates: str) -> None:
    portals, cols, label = divided.portals(gates), divided.grid.shape[1], divided.label
    exact = costs_from(divided.inside, portals.gate_cell)
    positions = position_of(portals, np.arange(label.size), cols)
    assert np.array_equal(np.sort(positions[label >= 0]), np.arange((label >= 0).sum()))
    assert (positions[label < 0] == -1).all()
    legal = divided.inside_by_direction
    for gate, field in enumerate(fields_of(portals.gate_start).tolist()):
        cells = np.flatnonzero(label == field)
        place = positions[cells] - portals.field_start[field]
        assert np.array_equal(np.sort(place), np.arange(len(cells)))
        row = portals.first_move[
            portals.first_move_start[gate] : portals.first_move_start[gate + 1]
        ]
        assert len(row) == -(-len(cells) // 2)
        code = row[place // 2] >> place % 2 * 4 & 15
        away = cells != portals.gate_cell[gate]
        cells, k, leaps = cells[away], code[away] % 8, code[away] >= 8
        assert np.array_equal(leaps, may_leap(legal, exact[gate], cells, cols).any(axis=0))
        for move in range(MOVES):
            here, k = (cells, k) if move == 0 else (cells[leaps], k[leaps])
            leaps = leaps if move == 0 else leaps[leaps]
            assert legal[k, here].all(), "a direction is no legal move inside the field"
            cells = here + ROW_STEP[k] * cols + COL_STEP[k]
            # One step on, what is left is less by exactly that step.
            step = np.where(k % 2 == 1, DIAGONAL, STRAIGHT)
            assert (exact[gate, cells] + step == exact[gate, here]).all()
    for f in range(portals.n_fields):
        own = slice(portals.gate_start[f], portals.gate_start[f + 1])
        clique = portals.clique[portals.clique_start[f] : portals.clique_start[f + 1]]
        assert np.array_equal(clique, exact[own, portals.gate_cell[own]].ravel())


def may_leap(legal: Any, exact: Any, cells: Any, cols: int) -> Any:
    """bool (8, n), whether a shortest path goes on from each cell for eight moves that way."""
    goes_on = np.ones((8, len(cells)), dtype=np.bool_)
    for k in range(8):
        here = cells.copy()
        for _ in range(MOVES):
            goes_on[k] &= legal[k, here]
            there = np.where(goes_on[k], here + ROW_STEP[k] * cols + COL_STEP[k], here)
            goes_on[k] &= exact[there] < exact[here]
            here = there
        step = MOVES * (DIAGONAL if k % 2 else STRAIGHT)
        goes_on[k] &= exact[here] + step == exact[cells]
    return goes_on


@ENOUGH
@given(partitions(), st.sampled_from(GATES))
def test_steps_lead_to_the_nearest_gate_of_each_side(divided: Divided, gates: str) -> None:
    portals, cols, label = divided.portals(gates), divided.grid.shape[1], divided.label
    exact, starts = costs_from(divided.inside, portals.gate_cell), portals.side_gates_start
    for f in range(portals.n_fields):
        cells = np.flatnonzero(label == f)
        sides = range(portals.side_start[f], portals.side_start[f + 1])
        stored = portals.side_cost[portals.side_cost_start[f] : portals.side_cost_start[f + 1]]
        stored = stored.reshape(len(cells), len(sides))
        place = position_of(portals, cells, cols) - portals.field_start[f]
        for column, side in zip(stored[place].T, sides, strict=True):
            nearest = exact[portals.side_gates[starts[side] : starts[side + 1]]].min(axis=0)
            rounded = nearest[cells].astype(np.int64) >> portals.side_cost_shift[f]
            assert np.array_equal(column, rounded)


def test_fields_that_meet_at_a_point_only_have_a_portal_there() -> None:
    grid = occupancy_grid(drawn("..", ".."))
    portals = build_portals(grid, np.array([[0, 1], [2, 3]], dtype=np.int32))
    assert portals.n_sides == 12
    assert np.sort(portals.exit_cost).tolist() == [STRAIGHT] * 8 + [DIAGONAL] * 4
    walled = build_portals(occupancy_grid(drawn("#.", "..")), np.array([[0, 1], [2, 3]], np.int32))
    assert walled.exit_cost.tolist() == [STRAIGHT] * 4


def test_the_gate_of_a_part_of_the_border_lies_in_its_middle() -> None:
    for every in (8, 4):
        portals = halves(24, 6, 3).portals(gate_spacing_cells=every)
        row, col = np.divmod(portals.gate_cell, 6)
        n = 24 // every
        assert col.tolist() == [2] * n + [3] * n, "no straight move across"
        middle = np.isin(row[:n] - np.arange(0, 24, every), [every // 2 - 1, every // 2])
        assert middle.all()
        assert np.array_equal(row[n:], row[:n])
        assert np.array_equal(portals.source_gate, np.arange(n))
        assert portals.n_sides == 2 * 3


# Little maps, and what is refused


@pytest.mark.parametrize("drawing", [("#",), ("?",), ("#?", "??"), (".",), ("..", ".."), ("#.#",)])
def test_without_a_border_there_are_no_gates(drawing: tuple[str, ...]) -> None:
    classes = drawn(*drawing)
    free = classes == CellClass.FREE
    divided = Divided(occupancy_grid(classes), np.where(free, 4, -1).astype(np.int32))
    for gates in GATES:
        portals = divided.portals(gates)
        assert portals.n_fields == int(free.any())
        assert portals.n_gates == portals.n_sides == len(portals.source_gate) == 0


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


@pytest.mark.parametrize("spacings", [(0, 1), (4, 0), (-8, -4), (16, 5)])
def test_spacings_that_make_no_lattice_are_refused(spacings: tuple[int, int]) -> None:
    divided = halves(3, 4, 2)
    with pytest.raises(InvalidValueError, match="spacings of at least one cell") as refused:
        divided.portals(spacing_cells=spacings[0], gate_spacing_cells=spacings[1])
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
            assert portals.side_cost.max() == int(farthest) >> portals.side_cost_shift[0]
            continue
        with pytest.raises(PathTooLongError, match="longer than 6,600 cells") as refused:
            divided.portals()
        assert "\n" not in str(refused.value)


@FEWER
@given(partitions(), st.sampled_from(GATES))
def test_portals_that_take_too_much_memory_are_refused(divided: Divided, gates: str) -> None:
    portals = divided.portals(gates)
    cells, n_gates = np.diff(portals.field_start), np.diff(portals.gate_start)
    size = 0.5 * (cells * n_gates).sum() + portals.clique.nbytes + portals.side_cost.nbytes
    table = 4 * portals.n_gates * len(portals.source_gate)
    divided.portals(gates, max_bytes=size + table)
    # Where gates are sparse, other moves between them than those that were chosen may add sources.
    most = size if gates == "sparse" else size + table
    with pytest.raises(PortalsTooLargeError, match="portals would take 0 MB"):
        divided.portals(gates, max_bytes=most - 1)
    assert portals.first_move.nbytes <= 0.5 * (cells * n_gates).sum() + 0.5 * portals.n_gates
