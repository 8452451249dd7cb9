"""Cheapest walks on the arcs of a graph, against networkx."""

from typing import Any

import networkx as nx
import numpy as np
from hypothesis import strategies as st

from hybridnav.route.kernels import arcs as _kernels
from tests.strategies import tried


def arcs_out(n: int, arcs: list[tuple[int, int]]) -> tuple[Any, Any, Any]:
    """Arcs by the vertex that they leave, each from both its endpoints."""
    out: list[list[tuple[int, int]]] = [[] for _ in range(n)]
    for arc, (u, v) in enumerate(arcs):
        out[u].append((v, arc))
        out[v].append((u, arc))
    first = np.cumsum([0, *map(len, out)]).astype(np.int64)
    flat = np.array([entry for entries in out for entry in entries], dtype=np.int64).reshape(-1, 2)
    return first, flat[:, 0].copy(), flat[:, 1].copy()


@st.composite
def multigraphs(draw: st.DrawFn) -> tuple[int, list[tuple[int, int]], list[int], list[int]]:
    """Multigraphs, self-loops included, with few different costs so that ties are the rule."""
    n = draw(st.integers(1, 9))
    vertex = st.integers(0, n - 1)
    arcs = draw(st.lists(st.tuples(vertex, vertex), max_size=24))
    costs = draw(st.lists(st.integers(1, 3), min_size=len(arcs), max_size=len(arcs)))
    ties = draw(st.lists(st.integers(0, 6), min_size=len(arcs), max_size=len(arcs)))
    return n, arcs, costs, ties


@tried(300, multigraphs(), st.data())
def test_cheapest_arcs_are_those_of_networkx_and_ties_go_by_the_second_cost(graph, data):
    n, arcs, costs, ties = graph
    start, goal = data.draw(st.integers(0, n - 1)), data.draw(st.integers(0, n - 1))
    allowed = np.array(data.draw(st.lists(st.sampled_from([1, 1, 1, 0]), min_size=n, max_size=n)))
    allowed = allowed.astype(np.bool_)
    allowed[[start, goal]] = True
    found, reached, _ = _kernels.cheapest_arcs(
        *arcs_out(n, arcs), np.array(costs, float), np.array(ties, float), allowed, start, goal
    )
    oracle: nx.MultiGraph[int] = nx.MultiGraph()
    oracle.add_nodes_from(np.flatnonzero(allowed).tolist())
    for (u, v), cost, tie in zip(arcs, costs, ties, strict=True):
        if allowed[u] and allowed[v]:
            oracle.add_edge(u, v, weight=1000 * cost + tie)
    assert bool(reached) == nx.has_path(oracle, start, goal)
    if not reached:
        return
    at = start
    for arc in found.tolist():
        assert at in arcs[arc]
        u, v = arcs[arc]
        at = v if at == u else u
        assert allowed[at]
    assert at == goal
    weight = sum(1000 * costs[arc] + ties[arc] for arc in found.tolist())
    assert weight == nx.dijkstra_path_length(oracle, start, goal)


def test_a_goal_that_may_not_be_passed_is_not_reached() -> None:
    out = arcs_out(3, [(0, 1), (1, 2)])
    costs = np.ones(2)
    for blocked in (1, 2):
        allowed = np.arange(3) != blocked
        found, reached, _ = _kernels.cheapest_arcs(*out, costs, costs, allowed, 0, 2)
        assert not reached
        assert len(found) == 0
