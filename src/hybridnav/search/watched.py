"""What a search reached, read from the marks that it left: for pictures, and for viewers of others.

`GridSearch.watch` and `JumpSearch.watch` run the search that planners run, and return its record.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hybridnav._base.moves import DIAGONAL, STRAIGHT
from hybridnav._base.typing import BoolArray, FloatArray, LongArray

TRACE_SUFFIX = ".trace.json"
"""Ending of the names of search traces of Posthoc."""
_TYPES = ("generating", "expanding")


class SearchRecord(NamedTuple):
    """The cells that a search reached, by rising f; those of equal f by rising g, for the order
    among them is not kept."""

    cells: LongArray
    """int64 (n, 2), (row, col)."""
    parents: LongArray
    """int64 (n,), from which of them each was reached; -1 for those reached from an end."""
    g: FloatArray
    """float64 (n,), cost from the end that it was reached from, in steps."""
    f: FloatArray
    """float64 (n,), g and the least that the rest can cost, in steps."""
    expanded: BoolArray
    """bool (n,), whether its f is below the cost of the path: all such cells were expanded."""
    path: LongArray
    """int64 (k, 2), cells of the path; none without one."""

    def trace(self, shape: tuple[int, int]) -> dict[str, Any]:
        """Return a search trace for Posthoc (https://posthoc.pathfinding.ai), as plain values.

        Its y runs down, as in MovingAI's maps: `write_movingai_map` writes the map to show below.

        `shape`: rows and columns of the map.
        """

        def at(cell: LongArray) -> dict[str, int]:
            return {"x": int(cell[1]), "y": shape[0] - 1 - int(cell[0])}

        ids = np.arange(1, len(self.cells) + 1)  # its viewer takes a parent 0 for none
        events: list[dict[str, Any]] = []
        if len(self.path):
            ends = zip(("source", "destination"), self.path[[0, -1]], strict=True)
            events += [{"type": kind, "id": f"{kind}", **at(cell)} for kind, cell in ends]
        rows = zip(self.cells, self.parents, self.g, self.f, self.expanded, strict=True)
        for number, (cell, parent, g, f, expanded) in zip(ids.tolist(), rows, strict=True):
            event = {"type": _TYPES[int(expanded)], "id": number, **at(cell)}
            event |= {"g": round(float(g), 6), "f": round(float(f), 6)}
            events.append(event | ({"pId": int(ids[parent])} if parent >= 0 else {}))
        before: str | None = None
        for number, cell in enumerate(self.path):
            event = {"type": "end", "id": f"path {number}", **at(cell)}
            events.append(event | ({} if before is None else {"pId": before}))
            before = f"path {number}"
        square = {"$": "rect", "width": 1, "height": 1, "fill": "${{ color[$.type] }}"}
        square |= {"x": "${{ $.x }}", "y": "${{ $.y }}"}
        pivot = {"x": "${{ $.x + 0.5 }}", "y": "${{ $.y + 0.5 }}", "scale": 1}
        views = {"main": [square]}
        return {"version": "1.4.0", "views": views, "pivot": pivot, "events": events}


def recorded(
    cells: LongArray,
    parents: LongArray,
    steps: LongArray,
    aims: LongArray,
    found: tuple[int | None, LongArray | None],
) -> SearchRecord:
    """Return the record of what a search reached, in any order.

    `cells`: int64 (n, 2); `parents`: by which of them each was reached, -1 for an end; `steps`: the
    cost of the way from there, in the units of `_base.moves`; `aims`: the end to which each search
    went, int64 (n, 2) or (2,); `found`: cost and cells of the path, None for both without one.
    """
    at = np.arange(len(cells))
    above, g = np.where(parents < 0, at, parents), steps.copy()
    rest = np.where(parents < 0, 0, g)
    while (above != above[above]).any():  # each round adds up twice as many steps
        rest, above = rest + rest[above], above[above]
    g = rest + g[above]
    f = g + octile_of(abs(cells - aims))
    order = np.lexsort((g, f))
    rank = np.empty(len(order) + 1, np.int64)
    rank[order], rank[-1] = at, -1
    best, path = found
    way = np.empty((0, 2), np.int64) if best is None or path is None else path
    below = np.ones(len(order), np.bool_) if best is None else f[order] < best
    sizes = g[order] / STRAIGHT, f[order] / STRAIGHT
    return SearchRecord(cells[order], rank[parents[order]], *sizes, below, way)


def octile_of(offsets: LongArray) -> LongArray:
    """Return the costs of ways without obstacles, of offsets int64 (n, 2) that are not below 0."""
    long, short = offsets.max(axis=1), offsets.min(axis=1)
    costs: LongArray = STRAIGHT * (long - short) + DIAGONAL * short
    return costs
