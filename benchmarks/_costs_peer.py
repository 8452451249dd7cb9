"""pyroutingkit's customizable contraction hierarchies on the same moves and costs."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from benchmarks._costs_judge import graph_of
from benchmarks._costs_measure import clocked
from hybridnav.harness.outcome import nanquantile

if TYPE_CHECKING:
    from benchmarks._costs_measure import Bench
    from hybridnav.harness.tables import Row

_SHIFT = 4
"""Bits by which costs are shortened: its distances have 32 bits."""


def peer(bench: Bench) -> list[Row]:
    """Return a row of figures, none where the package is missing.

    Its preparation is an order of the cells for any costs, and the customization for these. Its
    answers are cells, which are turned into coordinates here as the overlay's are.
    """
    if find_spec("pyroutingkit") is None:
        sys.stderr.write('pyroutingkit is missing (pip install -e ".[bench]"): no peer\n')
        return []
    routing = import_module("pyroutingkit")
    graph, number = graph_of(bench)
    tail, head = graph.row.astype(np.uint32), graph.col.astype(np.uint32)
    tails, heads = np.concatenate([tail, head]), np.concatenate([head, tail])
    weights = np.tile(graph.data.astype(np.int64) >> _SHIFT, 2).astype(np.uint32)
    rows, cols = np.nonzero(bench.grid.enterable())
    topology = routing.CCHTopology()
    places = rows.astype(np.float32), cols.astype(np.float32)
    order_s = clocked(topology.build, tails, heads, *places, bench.n_free)
    metric = routing.CCHMetric(topology)
    customize_s = clocked(metric.customize, weights)
    cells = np.stack([rows, cols], axis=1)
    times, ratios = [], []
    for start, goal in bench.pairs:
        ends = int(number[start]), int(number[goal])
        times.append(clocked(lambda ends=ends: cells[np.array(metric.query(*ends)[1])]))
        ratios.append(times[-1] / clocked(bench.search.path, start, goal))
    return [
        {
            "order s": order_s,
            "customization s": customize_s,
            "ms": 1e3 * nanquantile(np.array(times), 0.5),
            "p95": 1e3 * nanquantile(np.array(times), 0.95),
            "times the overlay's": nanquantile(np.array(ratios), 0.5),
        }
    ]
