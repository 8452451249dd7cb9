"""The parts of a picture that represent a level: fields, dots, arcs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray
from hybridnav.maps import CellClass
from hybridnav.pyramid import Level
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas
from hybridnav.viz.style import Sizes

TINY_M2 = 0.5
"""Area in square metres below which a place has no dot and its arcs are not drawn, unless a route
uses them: specks of a scan's noise, which would hide the rest."""
_LOOP_POINTS = 25


@dataclass(frozen=True, eq=False)
class Places:
    """A level, ready to draw."""

    level: Level

    @cached_property
    def positions(self) -> FloatArray:
        """Surviving cells, (x, y) in metres."""
        return self.level.grid.frame.points_of(self.level.cells)

    @cached_property
    def free(self) -> BoolArray:
        """Places of free cells."""
        return self.level.classes == CellClass.FREE

    @cached_property
    def large(self) -> BoolArray:
        """Mask of the places that are no specks; of all places if all are specks."""
        return are_large(self.level, TINY_M2)

    def colours(self, strong: BoolArray | None = None, *, unexplored: bool = True) -> ByteArray:
        """Return RGB per place and one row more, for cells without a place; `strong` are not pale,
        and unexplored places are all of one grey if they are not drawn."""
        index = colour_vertices(self.level.arcs, self.level.n_vertices)
        table = style.rgb(*style.PLACES)[index]
        if strong is not None:
            table[~strong] = style.rgb(*style.PLACES, strength=style.PALE)[index[~strong]]
        greys = style.rgb(*(style.UNEXPLORED_PLACES if unexplored else [style.UNEXPLORED]))
        table[~self.free] = greys[index[~self.free] % len(greys)]
        return np.concatenate([table, style.rgb(style.BLOCKED)])

    def dot(self, sizes: Sizes) -> float:
        """Return the diameter of a place's dot in points, a share of the distance between
        places."""
        seen = self.free & self.large
        if not seen.any():
            seen = self.large
        areas = self.level.areas[seen]
        spacing_m = np.sqrt(np.median(areas)) * self.level.grid.resolution_m if len(areas) else 0.0
        fitting = 0.16 * spacing_m * sizes.points_per_metre
        return float(np.clip(fitting, 0.6, 3.2 * sizes.line))

    def lines(self, arcs: BoolArray) -> list[FloatArray]:
        """Return a line from place to place through the middle of the boundary, for each arc of a
        mask."""
        endpoints = self.positions[self.level.arcs[arcs]]
        middles = self.level.boundary_middles[arcs]
        return list(np.stack([endpoints[:, 0], middles, endpoints[:, 1]], axis=1))

    def loops(self, arcs: BoolArray) -> list[FloatArray]:
        """Return a closed curve from a place through the middle of its boundary, for each
        self-loop."""
        at = self.positions[self.level.arcs[arcs, 0]][:, None]
        to = (self.level.boundary_middles[arcs][:, None] - at) * 4 / 3
        across = np.stack([-to[..., 1], to[..., 0]], axis=-1) / 2
        t = np.linspace(0, 1, _LOOP_POINTS)[:, None]
        # A cubic curve whose inner control points lie 4/3 out passes through the middle at 1/2.
        out, back = 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t)
        return list(at + out * (to + across) + back * (to - across))


def are_large(level: Level, least_m2: float) -> BoolArray:
    """Return which places have some area in square metres, the largest ones in any case."""
    areas = level.areas * np.float64(level.grid.resolution_m**2)
    return areas >= min(least_m2, areas.max(initial=0.0))


def draw_arcs(
    canvas: Canvas, places: Places, *, self_loops: bool = False, unexplored: bool = True
) -> None:
    """Draw the arcs between places that are no specks, the fainter the less a route can use them.

    Unexplored places cover most of many maps: their arcs must not hide those between free ones.
    """
    sizes, level = canvas.sizes, places.level
    seen = places.large[level.arcs].all(axis=1) & ~level.is_self_loop
    n_free = places.free[level.arcs].sum(axis=1)
    width = min(0.9 * sizes.line, 0.3 * places.dot(sizes))
    look: dict[str, Any] = {"capstyle": "round", "joinstyle": "round", "zorder": 3}
    for free_endpoints, colour, share, gid in (
        (0, style.UNEXPLORED_ARC, 0.6, "unexplored-arcs"),
        (1, style.RIM_ARC, 0.6, "rim-arcs"),
        (2, style.ARC, 1.0, "arcs"),
    )[0 if unexplored else 2 :]:
        lines = places.lines(seen & (n_free == free_endpoints))
        canvas.add_lines(lines, colors=colour, linewidths=share * width, **look, gid=gid)
    if self_loops:
        loops = places.loops(level.is_self_loop)
        look |= {"colors": style.ARC, "linewidths": 0.7 * width}
        canvas.add_lines(loops, **look, gid="self-loops")


def draw_dots(canvas: Canvas, places: Places, *, unexplored: bool = True) -> None:
    """Draw the positions of the places that are no specks: free ones dark, unexplored ones grey."""
    diameter = places.dot(canvas.sizes)
    for mask, colour, share, gid in (
        (~places.free, style.UNEXPLORED_DOT, 0.75, "unexplored-dots"),
        (places.free, style.INK, 1.0, "free-dots"),
    )[0 if unexplored else 1 :]:
        at = places.positions[mask & places.large]
        canvas.add_dots(at, share * diameter, c=colour, linewidths=0, zorder=4, gid=gid)


# Colours for the vertices of a plane graph, so that neighbours differ.

N_COLOURS = 6


def colour_vertices(arcs: IntArray, n_vertices: int) -> LongArray:
    """Colour a plane graph with six colours, so that the endpoints of an arc differ.

    Vertices of degree at most five are peeled off in layers until none is left (a plane graph
    always has one) and coloured in the reverse order, so that each has at most five coloured
    neighbours (Matula and Beck's smallest-last order, in layers for numpy: networkx takes minutes
    on the base of a map with two million cells). Equal input has equal colours.

    `arcs`: int (n_arcs, 2), the vertices that each arc joins; self-loops and parallel arcs allowed;
    `n_vertices`: vertices of the graph. Result: (n_vertices,), colours from 0 to 5, all six used
    about equally often.
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
