"""Kernel of the judge's own Dijkstra: costs of paths of cells, in floating point."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._base.jit import njit


@njit(cache=True, nogil=True)
def cheapest_cost(factors, cuts_corners, start, goal):
    """Return the cost of a cheapest path of cells between two cells, infinite for none.

    Buckets are one straight step of factor 1 wide, which no move costs less than: so no cell can be
    improved from its own bucket, and its cost is final when its bucket is opened (Dinic 1978).
    Buckets take turns; each is a chain of entries, and those left behind by a better cost are
    skipped.

    Parameters
    ----------
    factors
        float64 (rows, cols) with a rim of zeros: at least 1 in cells that may be entered, else 0.
    cuts_corners
        Whether a diagonal may pass a cell that may not be entered.
    start, goal
        Flat cells.
    """
    cols = factors.shape[1]
    factor = factors.ravel()
    diagonal = math.sqrt(2.0)

    # The dearest move must lead less than once round the ring, or buckets would mix costs.
    n_buckets = int(diagonal * factors.max()) + 2
    cost = np.full(factor.size, np.inf)
    first = np.full(n_buckets, -1, np.int64)

    # Entries of all chains share two arrays; those taken out form a chain too, and are used again.
    following = np.empty(1024, np.int64)
    cell_of = np.empty(1024, np.int64)
    unused = np.int64(-1)
    n_entries, left, turn = 0, 1, 0
    cost[start] = 0.0
    first[0], following[0], cell_of[0], n_entries = 0, -1, start, 1
    while left > 0:
        slot = turn % n_buckets
        # What is found from now on costs `turn` + 1 or more, so this is the least.
        if cost[goal] < turn + 1:
            return cost[goal]
        while first[slot] >= 0:
            entry = first[slot]
            first[slot] = following[entry]
            following[entry] = unused
            unused = entry
            left -= 1
            cell = cell_of[entry]
            # A better cost put the cell into an earlier bucket, where it was expanded.
            if int(cost[cell]) != turn:
                continue
            for k in range(9):
                up, right = k // 3 - 1, k % 3 - 1
                to = cell + up * cols + right
                # The middle of the nine is the cell itself; the rim of zeros keeps `to` on the map.
                if k == 4 or factor[to] == 0.0:
                    continue
                length = 1.0
                if up != 0 and right != 0:
                    length = diagonal
                    is_past = factor[cell + up * cols] == 0.0 or factor[cell + right] == 0.0
                    if is_past and not cuts_corners:
                        continue
                # Half of a move lies in each of its two cells, and pays the factor of that cell.
                new_cost = cost[cell] + length * (factor[cell] + factor[to]) / 2.0
                if new_cost >= cost[to]:
                    continue
                cost[to] = new_cost
                if unused < 0 and n_entries == cell_of.size:
                    following = np.append(following, np.empty_like(following))
                    cell_of = np.append(cell_of, np.empty_like(cell_of))
                # So room grows with the entries that wait, not with all that ever did.
                entry = unused
                if entry >= 0:
                    unused = following[entry]
                else:
                    entry = np.int64(n_entries)
                    n_entries += 1
                into = int(new_cost) % n_buckets
                cell_of[entry] = to
                following[entry] = first[into]
                first[into] = entry
                left += 1
        turn += 1
    return np.inf
