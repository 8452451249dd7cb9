"""Kernels of what searches of cells share: records of cells, and an open list in buckets.

A record holds the generation of the search that wrote it, so that nothing has to be cleared between
searches, the cost modulo 2^b, in weighted searches whether the cell was expanded at that cost, and
the direction of arrival, lowest. The bits of the cost are enough, W being the width of a bucket and
M the cost of the dearest move: (1) A cell p is expanded within W of its least cost g*(p), for its f
lies in the first bucket that is not empty, and some cell of an optimal path to p waits there or
later at its least cost. (2) So p offers its neighbour q less than g*(p) + W + M, which is less than
W + 2 M above the record of q. (3) The record of q had an f of less than W + 2 M above the start of
the bucket from which it was written, and no later offer has an f below that start: the offer is
less than W + 2 M below the record. As W + 2 M < 2^(b - 1), the difference modulo 2^b has the sign
of the difference. Likewise the bucket of a waiting cell determines its full cost, and an entry
whose cell has been improved since is found outside its bucket, or is as good as the newer one.

The open list is a ring of buckets of f, each a stack of cells: the newest comes first, which breaks
ties in favour of the deeper cell.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit

BUCKET_FULL = -2
"""Returned by a search when a bucket of its open list is full."""


@njit(cache=True, nogil=True)
def is_no_gain(known, low_bits, cost_mask, cost):
    """Return whether an offer is no better than a record of the same search.

    `known` is the record without its generation, `low_bits` are the bits below the cost.
    """
    gain = (known >> low_bits) - cost & cost_mask
    return gain == 0 or gain > cost_mask >> 1


@njit(cache=True, nogil=True)
def full_cost(record, low_bits, cost_mask, least):
    """Return the cost of a record, of which the lowest bits are known, from the least that it can
    be."""
    return least + ((record >> low_bits) - least & cost_mask)


@njit(cache=True, nogil=True)
def put(waiting, count, room, slot, cell):
    """Put a cell into a bucket with some room; return whether there was any left."""
    at = np.uint64(slot)
    if count[at] == room:
        return False
    waiting[np.uint64(slot * room + count[at])] = cell
    count[at] += 1
    return True
