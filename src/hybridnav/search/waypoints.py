"""The cheapest waypoints, one cell from each of several sets that are visited in order."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.moves import legal_moves
from hybridnav.search.kernels import waypoints as _waypoint_kernels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray


def cheapest_waypoints(
    enterable: BoolArray,
    sets: Sequence[LongArray],
    *,
    corner_cutting: bool = False,
    units: IntArray | None = None,
) -> list[int] | None:
    """Choose a cell from each set so that the path through them, in order, is cheapest.

    Dijkstra's algorithm runs from set to set: the search for the next set begins with the costs of
    the cells of the last one.

    Parameters
    ----------
    enterable
        bool (rows, cols), cells that the path may use. Moves go to the 8 neighbours; a diagonal
        needs both side cells, unless corners may be cut.
    sets
        Two or more sets, int64 (n,), of flat enterable cells.
    corner_cutting
        Whether a diagonal needs no side cell.
    units
        int32 (rows, cols), the factor of each cell in units; None makes costs lengths.

    Returns
    -------
    list of int | None
        A flat cell of each set; None if one of them cannot be reached.
    """
    moves = legal_moves(np.ascontiguousarray(enterable), corner_cutting).ravel()
    weights = None if units is None else np.ascontiguousarray(units).ravel()
    sources, costs = sets[0], np.zeros(len(sets[0]), dtype=np.int64)
    origins: list[LongArray] = []
    for number, goals in enumerate(sets[1:], start=2):
        is_target = np.zeros(moves.size, dtype=np.bool_)
        is_target[goals] = True
        cost, came = _waypoint_kernels.spread(
            moves, weights, enterable.shape[1], sources, costs, is_target, number < len(sets)
        )
        reached = goals[cost[goals] >= 0]
        if len(reached) == 0:
            return None
        origins.append(np.stack([reached, sources[came[reached]]], axis=1))
        sources, costs = reached, cost[reached]
    waypoints = [int(sources[np.argmin(costs)])]
    for pairs in reversed(origins):
        waypoints.append(int(pairs[np.argmax(pairs[:, 0] == waypoints[-1]), 1]))
    return waypoints[::-1]


def costs_from(moves: ByteArray, cell: tuple[int, int], targets: LongArray) -> LongArray:
    """Return the octile costs of shortest paths from a cell, int64 (rows * cols,), -1 where
    unsettled.

    Parameters
    ----------
    moves
        uint8 (rows, cols), legal moves of each cell.
    cell
        Where the search starts, (row, col).
    targets
        int64 (n,), flat cells: the search ends once all that can be reached are settled.
    """
    cols = moves.shape[1]
    is_target = np.zeros(moves.size, dtype=np.bool_)
    is_target[targets] = True
    source = np.array([cell[0] * cols + cell[1]])
    start_cost = np.zeros(1, dtype=np.int64)
    costs: LongArray = _waypoint_kernels.spread(
        moves.ravel(), None, cols, source, start_cost, is_target, True
    )[0]
    return costs
