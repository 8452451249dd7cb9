"""The portal table against scipy's searches: sources to gates, sides to sides, paths down a row."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.portals import PortalOptions, build_tables
from hybridnav.portals._descent_kernels import descend
from hybridnav.portals._path_kernels import UNREACHED
from hybridnav.search.moves import FAR, STRAIGHT
from tests.divided import (
    GATES,
    Divided,
    costs_from,
    fields_of,
    gate_graph,
    halves,
    partitions,
)
from tests.strategies import examples

if TYPE_CHECKING:
    from hybridnav.portals import Portals

ENOUGH = settings(max_examples=examples(40), derandomize=True, deadline=None)
FEWER = settings(max_examples=examples(20), derandomize=True, deadline=None)
ROUNDED = st.sampled_from([0, 0, 1, 3, 9])
"""Bits that costs lose, as on maps with paths that are too long for the table."""


def made(divided: Divided, gates: str, bits: int = 0) -> tuple[Portals, Any]:
    """Portals and their tables."""
    portals = divided.portals(gates)
    options = PortalOptions(dropped_bits=bits)
    if portals.n_gates % 2:  # else one part is enough for maps as small as these
        options = replace(options, rows_at_once=1 + portals.n_gates % 19)
    tables = build_tables(portals, options)
    assert tables.shift == bits
    return portals, tables


def stored(costs: Any, bits: int) -> Any:
    """Return the entries of a table for costs, which may be infinite."""
    found = np.full(costs.shape, UNREACHED)
    reached = np.isfinite(costs)
    found[reached] = costs[reached].astype(np.int64) >> bits
    return found


def gates_of_side(portals: Portals, side: int) -> Any:
    return portals.side_gates[slice(*portals.side_gates_start[side : side + 2])]


def moves_into(portals: Portals, gate: int) -> Any:
    """Gates in other fields next to one, and what it costs to come from there."""
    exits = slice(*portals.exit_start[gate : gate + 2])
    return portals.exit_gate[exits], portals.exit_cost[exits]


def between_sides(portals: Portals, costs: Any) -> Any:
    """Least costs from any gate of a side to any of another that is entered there: a gate that is
    the lower end of a move counts as entered, whatever the path to it."""
    own = [gates_of_side(portals, side) for side in range(portals.n_sides)]
    lowest = [costs[gates].min(axis=0) for gates in own]
    from_side = np.array(lowest).reshape(portals.n_sides, portals.n_gates)
    field = fields_of(portals.gate_start)
    entered = np.full(from_side.shape, np.inf)
    for gate in range(portals.n_gates):
        others, steps = moves_into(portals, gate)
        if (field[others] > field[gate]).any():
            entered[:, gate] = from_side[:, gate]
        elif len(others):
            entered[:, gate] = (from_side[:, others] + steps).min(axis=1)
    lowest = [entered[:, gates].min(axis=1) for gates in own]
    return np.array(lowest).reshape(portals.n_sides, portals.n_sides).T


@ENOUGH
@given(partitions(), st.sampled_from(GATES), ROUNDED)
def test_the_table_has_the_costs_of_shortest_paths(divided: Divided, gates: str, bits: int) -> None:
    portals, tables = made(divided, gates, bits)
    costs = costs_from(gate_graph(portals), portals.source_gate)
    assert np.array_equal(tables.distance, stored(costs, bits))
    true = costs_from(divided.moves, portals.gate_cell[portals.source_gate])[:, portals.gate_cell]
    if gates == "all":
        assert np.array_equal(costs, true)
    assert (costs >= true).all()
    assert np.array_equal(np.isfinite(costs), np.isfinite(true)), "too few gates to get there"
    assert tables.distance.dtype == tables.between.dtype == np.uint32
    assert np.array_equal(tables.gate_field, divided.label[portals.gate_cell])
    sources = np.full(portals.n_gates, -1)
    sources[portals.source_gate] = np.arange(len(portals.source_gate))
    assert np.array_equal(tables.source_at, sources)


@ENOUGH
@given(partitions(), st.sampled_from(GATES), ROUNDED)
def test_costs_between_sides_are_the_least_of_those_of_their_gates(
    divided: Divided, gates: str, bits: int
) -> None:
    portals, tables = made(divided, gates, bits)
    costs = costs_from(gate_graph(portals), np.arange(portals.n_gates))
    if gates == "all":
        true = costs_from(divided.moves, portals.gate_cell)[:, portals.gate_cell]
        assert np.array_equal(costs, true)
    exact = between_sides(portals, costs)
    if bits == 0:
        assert np.array_equal(tables.between, stored(exact, 0))
        return
    # The cost of the last move is rounded down by itself.
    assert np.array_equal(tables.between == UNREACHED, np.isinf(exact))
    reached = np.isfinite(exact)
    rounded = tables.between[reached].astype(np.int64) << bits
    assert (rounded <= exact[reached]).all()
    assert (rounded > exact[reached] - 2 * (1 << bits)).all()


@FEWER
@given(partitions(), st.sampled_from(GATES), st.integers(0, 2**32 - 1))
def test_no_way_over_two_sides_costs_less_than_the_table_says(
    divided: Divided, gates: str, seed: int
) -> None:
    portals, tables = made(divided, gates)
    costs = costs_from(gate_graph(portals), np.arange(portals.n_gates))
    field = fields_of(portals.gate_start)
    sides = np.arange(portals.n_sides)
    if len(sides) > 20:
        sides = np.random.default_rng(seed).choice(sides, 20, replace=False)
    for last in sides.tolist():
        into = gates_of_side(portals, last)
        moves = [(*pair, v) for v in into for pair in zip(*moves_into(portals, v), strict=True)]
        assert all(field[u] != field[v] for u, _, v in moves)
        for first in sides.tolist():
            out = gates_of_side(portals, first)
            over = min((costs[out, u] + step).min() for u, step, _ in moves)
            assert tables.between[first, last] <= over
            assert tables.between[first, last] >= stored(costs[np.ix_(out, into)].min(), 0)


@ENOUGH
@given(partitions(), st.sampled_from(GATES), ROUNDED, st.integers(0, 2**32 - 1))
def test_ways_down_the_table_cost_what_it_says(
    divided: Divided, gates: str, bits: int, seed: int
) -> None:
    portals, tables = made(divided, gates, bits)
    costs = costs_from(gate_graph(portals), portals.source_gate)
    rng, n = np.random.default_rng(seed), portals.n_gates
    sources = range(len(portals.source_gate))
    for source in rng.choice(sources, min(8, len(sources)), replace=False) if n else ():
        others, steps = moves_into(portals, portals.source_gate[source])
        lasts = [(-1, 0), *zip(others.tolist(), steps.tolist(), strict=True)]
        for gate in rng.choice(n, min(12, n), replace=False).tolist():
            last, step = lasts[rng.integers(len(lasts))]
            path = descend(portals, tables, gate, source, last)
            cost = costs[source, gate] + step
            if np.isinf(cost):
                assert path[-1] >= FAR
                continue
            found = cost_of_path(portals, gate, portals.source_gate[source], last, path)
            assert found == cost if bits == 0 else found >= cost


def cost_of_path(portals: Portals, gate: int, goal: int, last: int, path: Any) -> int:
    """What a path costs, after a look at each of its parts: its legs inside fields, and its moves
    between them."""
    out, into, legs, over = path
    field = fields_of(portals.gate_start)
    assert len(out) == len(into) == len(legs) - 1
    left, crossed = [*out.tolist()], 0
    for a, b in zip(left, into.tolist(), strict=True):
        others, steps = moves_into(portals, a)
        assert b in others
        crossed += int(steps[others == b][0])
    assert crossed == over
    begins = [gate, *into.tolist()]
    endpoints = [*left, into[-1] if last >= 0 else goal]
    if last >= 0:
        assert into[-1] == last
        assert left[-1] == goal
    for begin, end, leg in zip(begins, endpoints, legs.tolist(), strict=True):
        f = field[begin]
        assert f == field[end]
        row = portals.clique[portals.clique_start[f] : portals.clique_start[f + 1]]
        first, size = portals.gate_start[f], portals.gate_start[f + 1] - portals.gate_start[f]
        assert row.reshape(size, size)[begin - first, end - first] == leg
    return int(legs.sum() + over)


def test_a_little_table_is_as_counted_by_hand() -> None:
    # Rows of two cells, the left one of each in field 0: gates 0, 1, 2, and 3, 4, 5 to their right.
    portals = halves(3, 2, 1).portals()
    tables = build_tables(portals)
    assert portals.gate_cell.tolist() == [0, 2, 4, 1, 3, 5]
    assert portals.source_gate.tolist() == [0, 1, 2]
    straight = (tables.distance // STRAIGHT).tolist()
    assert straight == [[0, 1, 2, 1, 1, 2], [1, 0, 1, 1, 1, 1], [2, 1, 0, 2, 1, 1]]
    # One side each. From the left one: at the left it stays, to the right it takes a step; and
    # from the right one a step to the left, from where another leads back.
    assert tables.between.tolist() == [[0, STRAIGHT], [STRAIGHT, 2 * STRAIGHT]]


def test_a_map_without_gates_has_empty_tables() -> None:
    one_field = Divided(halves(3, 3, 3).grid, np.zeros((3, 3), dtype=np.int32))
    for gates in GATES:
        tables = build_tables(one_field.portals(gates))
        assert tables.distance.shape == tables.between.shape == (0, 0)
