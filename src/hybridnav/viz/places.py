"""The parts of a picture that represent a level: fields, dots, arcs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.grid import CellClass
from hybridnav.viz import style
from hybridnav.viz.colouring import colour_vertices

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, ByteArray, FloatArray
    from hybridnav.pyramid import Level
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
        free: BoolArray = self.level.classes == CellClass.FREE
        return free

    @cached_property
    def large(self) -> BoolArray:
        """Mask of the places that are no specks; of all places if all are specks."""
        areas = self.level.areas * np.float64(self.level.grid.resolution_m**2)
        large: BoolArray = areas >= min(TINY_M2, areas.max(initial=0.0))
        return large

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
    ax, diameter = canvas.ax, places.dot(canvas.sizes)
    for mask, colour, share, gid in (
        (~places.free, style.UNEXPLORED_DOT, 0.75, "unexplored-dots"),
        (places.free, style.INK, 1.0, "free-dots"),
    )[0 if unexplored else 1 :]:
        x, y = places.positions[mask & places.large].T
        size = (share * diameter) ** 2
        ax.scatter(x, y, s=size, c=colour, linewidths=0, zorder=4, gid=gid)
