"""Colours for the vertices of a plane graph, so that neighbours differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, IntArray, LongArray

N_COLOURS = 6


def colour_vertices(arcs: IntArray, n_vertices: int) -> LongArray:
    """Colour a plane graph with six colours, so that the endpoints of an arc differ.

    Vertices of degree at most five are peeled off in layers until none is left (a plane graph
    always has one) and coloured in the reverse order, so that each has at most five coloured
    neighbours (Matula and Beck's smallest-last order, in layers for numpy: networkx takes minutes
    on the base of a map with two million cells). Equal input has equal colours.

    Parameters
    ----------
    arcs
        int (n_arcs, 2), the vertices that each arc joins; self-loops and parallel arcs allowed.
    n_vertices
        Vertices of the graph.

    Returns
    -------
    LongArray
        (n_vertices,), colours from 0 to 5, all six used about equally often.
    """
    low, high = arcs.min(axis=1).astype(np.int64), arcs.max(axis=1)
    pairs = np.sort((low * n_vertices + high)[low != high])
    pairs = pairs[np.diff(pairs, prepend=-1) > 0]  # np.unique takes five times as long
    plain = np.stack(divmod(pairs, n_vertices), axis=1)
    darts = np.concatenate([plain, plain[:, ::-1]])
    random = np.random.default_rng(0)
    rank, wish = random.permutation(n_vertices), random.integers(0, N_COLOURS, n_vertices)
    colours = np.full(n_vertices, -1, dtype=np.int64)
    layer_of = _peel(darts, n_vertices)
    by_layer = np.argsort(layer_of[darts[:, 0]], kind="stable")
    darts = darts[by_layer]
    bounds = np.searchsorted(layer_of[darts[:, 0]], np.arange(layer_of.max(initial=-1) + 2))
    for layer in range(len(bounds) - 2, -1, -1):
        members = layer_of == layer
        _colour_layer(members, darts[bounds[layer] : bounds[layer + 1]], rank, wish, colours)
    return colours


def _peel(darts: LongArray, n_vertices: int) -> LongArray:
    layer_of = np.full(n_vertices, -1, dtype=np.int64)
    layer = 0
    while (left := layer_of < 0).any():
        degree = np.bincount(darts[:, 0], minlength=n_vertices)
        layer_of[left & (degree < N_COLOURS)] = layer
        darts = darts[(layer_of[darts] < 0).all(axis=1)]
        layer += 1
    return layer_of


def _colour_layer(
    members: BoolArray, darts: LongArray, rank: LongArray, wish: LongArray, colours: LongArray
) -> None:
    """Colour a layer in rounds; each round takes the vertices of highest rank among neighbours."""
    waiting = members.copy()
    while waiting.any():
        source, target = darts.T
        blocked = waiting[target] & (rank[target] > rank[source])
        ready = waiting.copy()
        ready[source[blocked]] = False
        beside = ready[source] & (colours[target] >= 0)
        taken = np.zeros((len(colours), N_COLOURS), dtype=np.bool_)
        taken[source[beside], colours[target[beside]]] = True
        chosen = np.flatnonzero(ready)
        # Start at a random wish: greedy from colour 0 would leave the last colours unused.
        order = (wish[chosen, None] + np.arange(N_COLOURS)) % N_COLOURS
        first = np.take_along_axis(taken[chosen], order, axis=1).argmin(axis=1)
        colours[chosen] = order[np.arange(len(chosen)), first]
        waiting &= ~ready
        darts = darts[waiting[source]]
