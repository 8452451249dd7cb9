"""Kernels that move changed cells, many steps in one call; see `_cell_kernels` for windows and
tables.

A call from Python takes longer than most of the steps do.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.online._cell_kernels import join_each_other, join_nearest, look_again
from hybridnav.online._merge_kernels import absorbing, merge_pairs, pairs_at


@guarded
@njit(cache=True, nogil=True)
def let_join(window, low, table, places, waiting, limit):
    """Bring places that lost cells up to date, and let cells without a place join others.

    Parameters
    ----------
    window, low, table
        See above; changed.
    places
        int64 (n,), places to look at again; two integers, the first number of more of them, and
        the one beyond the last.
    waiting
        int64 (m,), flat cells that are vertices and have no place.
    limit
        The squared distance to a surviving cell stays below it.

    Returns
    -------
    int64 (o,)
        All cells that had no place.
    int64 (p,)
        The places that have another surviving cell.
    int64 (q, 4)
        The boxes, in the window, of the places with numbers from that one on that the cells which
        no place took in have now; they are not in the table yet.
    """
    altered, first, beyond = places
    again = with_range(altered, first, beyond)
    lost, moved = look_again(window[0], low, table, again, limit)
    cells = np.concatenate((waiting, lost))
    join_nearest(window, low, table, cells, limit)
    return cells, moved, join_each_other(window, cells, beyond)


@guarded
@njit(cache=True, nogil=True)
def merge_after(window, low, table, places, cells, limit):
    """Merge the places that may merge after cells moved.

    Parameters
    ----------
    window, low, table
        See above; changed.
    places
        Three arrays and three integers: int64 (n,), new places that `let_join` made, to be brought
        up to date; int64 (k,), those that have another surviving cell; int64 (m,), those that only
        lost cells; the first number that was new in this window, that beyond the last one, and the
        least one that the version before does not have.
    cells
        int64 (o,), the flat cells that joined places.
    limit
        The squared distance to a surviving cell stays below it.

    Returns
    -------
    int64 (p, 2)
        The pairs that cannot be decided on in the window.
    """
    made, moved, lost, first, beyond, oldest = places
    look_again(window[0], low, table, made, limit)
    again = with_range(moved, first, beyond)
    pairs = np.empty((again.size, 2), np.int64)
    pairs[:, 0] = pairs[:, 1] = again
    if lost.size > 0:  # the whole table is searched
        pairs = np.concatenate((pairs, absorbing(window, low, table, lost, limit)))
    pairs = np.concatenate((pairs, pairs_at(window, cells)))
    return merge_pairs(window, low, table, pairs, limit, oldest)


@njit(cache=True, nogil=True)
def with_range(numbers, first, beyond):
    """Return numbers, and after them all from a first one to the one before another."""
    longer = np.empty(numbers.size + beyond - first, np.int64)
    longer[: numbers.size] = numbers
    for k in range(beyond - first):
        longer[numbers.size + k] = first + k
    return longer
