"""Tables of distances on a dask.distributed cluster, in blocks of starts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from hybridnav._base.progress import no_progress
from hybridnav.harness.workers import as_completed, connected
from hybridnav.planner.endpoints import read_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import FloatArray
    from hybridnav.planner.planner import HybridPlanner

_ENTRIES = 1 << 20
"""Entries of the table that a task finds: some seconds on a building."""
_AHEAD = 2
"""Tasks of each thread of the cluster that wait or run at a time."""


def distances_on_cluster(
    planner: HybridPlanner,
    ends: tuple[ArrayLike, ArrayLike],
    *,
    address: str,
    progress: Progress = no_progress,
    **asked: Any,
) -> Any:
    """Return what `planner.distances` does, found on a dask.distributed cluster.

    The planner is sent once, with the structures that it has built: prepare it before. Each task
    is a block of starts with all goals; what a worker that is lost had to do is done elsewhere. The
    results of at most two tasks of each thread wait at a time, beside the table itself.

    Parameters
    ----------
    planner
        A planner that can be pickled, as all presets but `ompl` can.
    ends
        Starts and goals, `(x, y)` in metres, map frame, shape (n, 2) and (m, 2).
    address
        Address of the scheduler, such as "tcp://10.0.0.1:8786". Its workers need this package.
    progress
        Called after each task with the number of pairs done and of all pairs.
    asked
        `nearest` and `blocked`, as in `HybridPlanner.distances`.

    Returns
    -------
    FloatArray or scipy.sparse.csr_array
        As `HybridPlanner.distances`, with the same bits.

    Raises
    ------
    InvalidValueError
        As `HybridPlanner.distances`, and when dask.distributed is not installed, the scheduler
        cannot be reached, or it has had no worker for two minutes.

    Examples
    --------
    >>> from hybridnav.harness import distances_on_cluster
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map())))
    >>> distances_on_cluster(planner, ([(0.5, 0.5)], [(0.5, 0.5)]), address="nowhere")
    Traceback (most recent call last):
    hybridnav.errors.InvalidValueError: scheduler nowhere: ...
    """
    starts, goals = (read_points(*one) for one in zip(("starts", "goals"), ends, strict=True))
    size = max(1, _ENTRIES // max(len(goals), 1))
    parts = [starts[at : at + size] for at in range(0, max(len(starts), 1), size)]
    found: list[Any] = []
    with connected(address) as client:
        known = client.scatter([planner, goals], broadcast=True)
        ahead = _AHEAD * max(1, sum(client.nthreads().values()))
        for first in range(0, len(parts), ahead):
            some = parts[first : first + ahead]
            futures = [client.submit(_block, part, *known, asked, pure=False) for part in some]
            for _ in as_completed(client, futures):
                pass
            found += client.gather(futures)
            done = len(goals) * min(len(starts), (first + len(some)) * size)
            progress(done, max(1, len(starts) * len(goals)))
    return sparse.vstack(found) if sparse.issparse(found[0]) else np.concatenate(found)


def _block(starts: FloatArray, planner: HybridPlanner, goals: FloatArray, asked: Any) -> Any:
    return planner.distances(starts, goals, **asked)
