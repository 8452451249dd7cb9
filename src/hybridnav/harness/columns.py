"""The columns of tables: which a page shows, and the meaning of each."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hybridnav.harness.yardstick import Optimum, Yardstick

YARDSTICKS: dict[Yardstick, tuple[Optimum, ...]] = {
    "both": ("any-angle", "octile"),
    "any-angle": ("any-angle",),
    "octile": ("octile",),
    "weighted": ("weighted",),
}
"""The optima that losses refer to, one table each, by the metric that is asked for."""

OPTIMA: dict[Optimum, str] = {
    "any-angle": "the any-angle optimum",
    "octile": "the octile optimum",
    "weighted": "the least cost of paths of cells",
}
"""The name of each optimum in captions."""

_OF_LOSS = ("mean %", "95 % interval", "median %", "p95 %", "max %", "without loss %")
_OF_COSTS = ("length mean m", "cost mean m", "gap mean %", "gap max %", "gap to cells mean %")

EFFICIENCY_COLUMNS = (
    "expansions",
    "an expansion in cells",
    "work in cells",
    "query ms, median",
    "query ms, p95",
    "spread %",
    "speed-up",
    "speed-up of means",
    "preparation s",
    "memory MB",
    "break-even queries",
)
"""Columns of the table of efficiency."""


def loss_columns(optimum: Optimum) -> tuple[str, ...]:
    """Return the columns of the table of losses over an optimum."""
    losses = tuple(f"{optimum} loss {what}" for what in _OF_LOSS)
    plan = () if optimum == "any-angle" else ("loss of the plan %",)
    costs = _OF_COSTS if optimum == "weighted" else ()
    return ("metric", "solved %", "by the grid %", *losses, *plan, *costs)


def shown(column: str) -> str:
    """Return the heading of a column in a table whose caption names the optimum."""
    for optimum in OPTIMA:
        column = column.removeprefix(f"{optimum} loss ")
    return column


MEANINGS: dict[str, str] = {
    "method": "name of the method",
    "maps": "number of maps",
    "kind": "what the method is: a preset of this package, a baseline of it, a planner of others, "
    "a class, or a graph",
    "version": "version of the package that plans, or the hash of the file of a class",
    "settings": "settings that differ from the usual ones",
    "not asked": "maps that the method cannot take by a limit of its own, and the reason; they are "
    "no fault, and it is in no table of theirs",
    "nodes": "mean over the maps of the nodes of its graph or topological layer",
    "edges": "mean over the maps of the edges of the same, both directions as one",
    "metric": "metric of its paths: octile, paths of cells; any-angle, paths of points; weighted "
    "and any-angle-weighted, the same, planned by costs",
    "solved %": "share of the pairs of two joined cells for which it found a path of its own "
    "without a fault",
    "by the grid %": "share of these pairs for which the path of the grid, shortened by line of "
    "sight, replaced one that it did not find; it counts in no other column",
    "mean %": "mean of length (or cost) over the optimum of the caption, minus 1, over the pairs "
    "that all methods solved",
    "95 % interval": "bootstrap interval of that mean, over pairs, not over maps",
    "median %": "median of the same losses over the same pairs",
    "p95 %": "their 95th percentile",
    "max %": "the largest of them",
    "without loss %": "share of the same pairs whose loss is 0",
    "loss of the plan %": "Thrun's loss: mean over the same pairs of the best path of cells inside "
    "the regions of the plan over the best of all, minus 1, whatever path the method takes there",
    "length mean m": "mean length over the same pairs, metres",
    "cost mean m": "mean cost over the same pairs, metres times factors",
    "gap mean %": "mean of cost over the lower bound that the method proved, minus 1, over the "
    "same pairs",
    "gap max %": "the largest of these gaps",
    "gap to cells mean %": "the mean gap to a proved bound on paths of cells alone, for any-angle "
    "paths; below 0 where they cost less",
    "expansions": "mean over the pairs that all methods solved of the things taken from the queue "
    "of a search: cells, border cells, intervals of the mesh, nodes; maps.csv has each kind by "
    "itself. They differ in price: see the next two columns",
    "an expansion in cells": "price of one such thing, with its look-ups in tables, tests of sight "
    "and unpacking: time of all queries over all expansions, divided by the same ratio of the "
    "reference, which expands cells alone (a ratio of sums)",
    "work in cells": "expansions times that price: the mean time of a query in the unit in which "
    "the reference expands one cell. Work of different methods can be compared, their expansions "
    "cannot",
    "query ms, median": "median wall-clock time of one query over these pairs, kernels warm; with "
    "repeats the time of a pair is their median",
    "query ms, p95": "95th percentile of these times",
    "spread %": "longest minus shortest time of the repeats of a pair, over their median: the "
    "median of this over these pairs",
    "speed-up": "median over these pairs of the ratio of the reference's time to the method's",
    "speed-up of means": "ratio of the reference's mean time to the method's, over the same pairs: "
    "what a robot saves that asks them all",
    "preparation s": "mean over the maps of the seconds from the loaded map to the first query",
    "memory MB": "mean over the maps of the arrays that the prepared method holds, without those "
    "of OMPL's process and those inside packages of others",
    "break-even queries": "queries after which the longer preparation has paid off, by mean times; "
    "never without a gain",
    "regions": "contradictions in checks of a map: every region is connected, and regions are "
    "joined by edges exactly when moves join their cells, for all pairs of cells at once",
    "plan to path": "contradictions in checked plans: a metric path leads through the regions of "
    "the plan, arc by arc, in their order",
    "path to plan": "contradictions in checked paths: each step between two regions has an edge",
    "paths": "contradictions in checked paths: endpoints, steps, exact intersection with blocked "
    "cells",
    '"no path", right': "pairs for which it said rightly that there is no path",
    '"no path", wrong': "answers that contradict the grid on whether there is a path: no path "
    "where there is one, or a path where there is none",
    "bounds": "contradictions in checked answers by the optima: a length or cost below the "
    "optimum, a bound that is broken, a claim about its own path that is wrong",
    "without an answer": "queries that ended in an error, out of time, or with a lost process",
}
"""What each column of the report holds."""
