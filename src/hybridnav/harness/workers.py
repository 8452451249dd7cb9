"""Execution of tasks: in processes of this machine, or on a dask.distributed cluster."""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.planning.endpoints import read_points

if TYPE_CHECKING:
    from hybridnav.harness.records import Record
    from hybridnav.harness.task import Task
    from hybridnav.harness.timing import TimingTask
    from hybridnav.planning.planner import HybridPlanner

    Work: TypeAlias = Task | TimingTask

_FLUSH_S = 0.2
_ATTEMPTS = 2
_ENDING_S = 5.0
"""Seconds in which a process that closed its pipe ends."""

CONNECT_S = 10.0
"""Seconds within which a scheduler must answer."""

NO_WORKER_S = 120.0
"""Seconds for which a scheduler may be without a worker."""

_LOOK_S = 5.0

_ENTRIES = 1 << 20
"""Entries of the table that a task finds: some seconds on a building."""
_AHEAD = 2
"""Tasks of each thread of the cluster that wait or run at a time."""


def _serve(connection: Connection, turn: Any) -> None:
    """Run tasks until the other side hangs up; records go back in batches.

    `turn` is shared with the other side: the index of the current record, which a process that ends
    before it sends its batch cannot report otherwise.
    """
    try:
        while True:
            task = connection.recv()
            batch: list[Record] = []
            sent = time.monotonic()
            for record in task.run():
                batch.append(record)
                turn.value += 1
                # The name of a method is known before a query ends its process.
                if turn.value == 1 or time.monotonic() - sent > _FLUSH_S:
                    connection.send(batch)
                    batch, sent = [], time.monotonic()
            connection.send([*batch, None])
    except (EOFError, BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
        return


class _Worker:
    """A process, its task, and the time of its last message."""

    def __init__(self, context: multiprocessing.context.SpawnContext) -> None:
        self.connection, theirs = context.Pipe()
        self._turn = context.Value("q", 0, lock=False)
        self._process = context.Process(target=_serve, args=(theirs, self._turn), daemon=True)
        self._process.start()
        theirs.close()
        self.task: Work | None = None
        self.missing: list[str] = []
        self.heard = time.monotonic()

    def start(self, task: Work) -> None:
        self.task = task
        self.missing = list(task.ids)
        self.heard = time.monotonic()
        self._turn.value = 0
        with suppress(OSError):  # it died while idle, which the next poll notices
            self.connection.send(task)

    def failed_at(self, task: Work) -> int:
        """Return the index of the first missing record of a task, once the process is stopped."""
        turn = int(self._turn.value)
        # After the last one what fails is to send: it must not be tried for ever.
        return turn if turn < len(task.ids) else task.ids.index(self.missing[0])

    def is_alive(self) -> bool:
        """Return whether its process runs."""
        return self._process.is_alive()

    def ending(self) -> str:
        """Return how its process ended, in words."""
        self._process.join(_ENDING_S)
        code = self._process.exitcode
        if code is None:
            return "its process no longer answers"
        if code >= 0:
            return f"its process ended with exit code {code}"
        named = {one.value: f" ({one.name})" for one in signal.Signals}
        return f"its process was ended by signal {-code}{named.get(-code, '')}"

    def stop(self) -> None:
        self.connection.close()
        self._process.kill()
        self._process.join()


def run_local(tasks: Sequence[Work], *, workers: int, timeout_s: float) -> Iterator[list[Record]]:
    """Run tasks in processes of this machine.

    `tasks`: in the order in which they start; `workers`: processes; `timeout_s`: longest silence of
    a process, seconds. After it, or when the process dies, its query is recorded as "timeout" or
    "lost", and another process resumes the rest. Result: records in the order of arrival. Raises
    `InvalidValueError` when there is no worker or no time.
    """
    if workers < 1 or not timeout_s > 0:
        raise InvalidValueError(
            f"at least one worker and a positive timeout are needed, got {workers} and {timeout_s}"
        )
    context = multiprocessing.get_context("spawn")
    waiting = list(reversed(tasks))
    busy: list[_Worker] = []
    idle: list[_Worker] = []
    try:
        while waiting or busy:
            while waiting and len(busy) < workers:
                worker = idle.pop() if idle else _Worker(context)
                worker.start(waiting.pop())
                busy.append(worker)
            ready = wait([worker.connection for worker in busy], timeout=min(1.0, timeout_s / 4))
            for worker in list(busy):
                records, ended = _listen(worker, heard=worker.connection in ready)
                late = not ended and time.monotonic() - worker.heard > timeout_s
                if ended or late:
                    busy.remove(worker)
                if ended and not worker.missing:
                    idle.append(worker)
                elif ended or late:
                    records += _give_up(worker, waiting, "timeout" if late else "lost")
                if records:
                    yield records
    finally:
        for worker in busy + idle:
            worker.stop()


def _listen(worker: _Worker, *, heard: bool) -> tuple[list[Record], bool]:
    """Return what a worker sent, and whether its task ended, well or not."""
    # A process that a method forked may hold the pipe of a dead worker open.
    if not heard and (worker.is_alive() or worker.connection.poll()):
        return [], False
    if not heard:
        return [], True
    try:
        batch: list[Any] = worker.connection.recv()
    except (EOFError, OSError):  # the latter when it died in the middle of a batch
        return [], True
    worker.heard = time.monotonic()
    records = [record for record in batch if record is not None]
    for record in records:
        worker.missing.remove(record["id"])
    return records, len(records) < len(batch)


def _give_up(worker: _Worker, waiting: list[Work], status: str) -> list[Record]:
    """Record the query that a worker failed at; the rest of its task waits for another."""
    ended = {"error": worker.ending()} if status == "lost" else {}
    worker.stop()
    task = worker.task
    if task is None:
        return []
    index = worker.failed_at(task)
    if index == 0 and status == "lost" and task.attempt + 1 < _ATTEMPTS:
        waiting.append(replace(task, attempt=task.attempt + 1))
        return []
    if index == 0:  # it never becomes ready, and no other would
        return [task.failed_record(at, status) | ended for at in range(len(task.ids))]
    left = tuple(
        pair
        for pair, name in zip(task.pairs, task.ids[1:], strict=True)
        if name in worker.missing and name != task.ids[index]
    )
    if left or task.ids[0] in worker.missing:
        waiting.append(replace(task, pairs=left, attempt=0))
    return [task.failed_record(index, status) | ended]


def _whole(task: Work) -> list[Record]:
    return list(task.run())


def run_on_cluster(tasks: Sequence[Work], *, address: str) -> Iterator[list[Record]]:
    """Run tasks on a dask.distributed cluster; those of a lost worker run again elsewhere.

    `tasks`: in any order; `address`: address of the scheduler, such as `tcp://10.0.0.1:8786`. Its
    workers need this package and the map files under the same paths. Result: records of one task,
    when it ends. Raises `InvalidValueError` when dask.distributed is not installed, the scheduler
    cannot be reached, or it has had no worker for `NO_WORKER_S`.
    """
    with _connected(address) as client:
        from dask import distributed  # noqa: PLC0415 - an optional extra

        futures = client.map(_whole, tasks, retries=_ATTEMPTS, pure=False)
        task_of = {future.key: task for future, task in zip(futures, tasks, strict=True)}
        suspects = []
        for future in _as_completed(client, futures):
            try:
                yield future.result()
            except distributed.KilledWorker:
                suspects.append(task_of[future.key])
        # dask blames all tasks that waited for a dead worker: run each again, by itself.
        for task in suspects:
            again = client.submit(_whole, task, pure=False)
            try:
                yield next(_as_completed(client, [again])).result()
            except distributed.KilledWorker:
                yield [task.failed_record(at, "lost") for at in range(len(task.ids))]


def _connected(address: str) -> Any:
    """Return a client of a scheduler; see `run_on_cluster`."""
    try:
        from dask import distributed  # noqa: PLC0415 - an optional extra
    except ImportError:
        raise InvalidValueError(
            "a scheduler needs dask.distributed: pip install 'hybridnav[cluster]'"
        ) from None
    try:
        _knock(address)
        return distributed.Client(address, timeout=CONNECT_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InvalidValueError(f"scheduler {address}: {error}") from None


def _as_completed(client: Any, futures: Iterable[Any]) -> Iterator[Any]:
    """Yield futures when they end; a cluster that no worker joins any more is not waited for."""
    from dask import distributed  # noqa: PLC0415 - an optional extra

    waiting, seen = set(futures), time.monotonic()
    while waiting:
        try:
            done, waiting = distributed.wait(  # type: ignore[no-untyped-call]
                waiting, timeout=_LOOK_S, return_when="FIRST_COMPLETED"
            )
        except distributed.TimeoutError:
            if client.nthreads():
                seen = time.monotonic()
            elif time.monotonic() - seen > NO_WORKER_S:
                raise InvalidValueError(
                    f"scheduler {client.scheduler.address}: it has had no worker for "
                    f"{NO_WORKER_S:g} s: start workers and run this again, records stay"
                ) from None
        else:
            yield from done


def _knock(address: str) -> None:
    """Connect to a scheduler and hang up: a client that cannot lives on and complains at exit."""
    from distributed.comm.core import connect  # noqa: PLC0415 - an optional extra

    async def knock() -> None:
        comm = await connect(address, timeout=CONNECT_S)  # type: ignore[no-untyped-call]
        await comm.close()

    with ThreadPoolExecutor(1) as pool:  # a notebook has a running loop of its own
        pool.submit(asyncio.run, knock()).result()


# Tables of distances, in blocks of starts.


def distances_on_cluster(
    planner: HybridPlanner,
    ends: tuple[ArrayLike, ArrayLike],
    *,
    address: str,
    progress: Progress = no_progress,
    **asked: Any,
) -> Any:
    """Return what `planner.distances` does, found on a dask.distributed cluster.

    The planner is sent once, with the structures that it has built: prepare it before. Each task is
    a block of starts with all goals; blocks of a lost worker are done elsewhere. The results of at
    most two tasks of each thread wait at a time, beside the table itself.

    Parameters
    ----------
    planner
        A planner that can be pickled, as all presets but `ompl` can.
    ends
        Starts and goals, `(x, y)` in metres, map frame, shape (n, 2) and (m, 2).
    address
        Address of the scheduler, such as `tcp://10.0.0.1:8786`. Its workers need this package.
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
    blocks: list[Any] = []
    with _connected(address) as client:
        known = client.scatter([planner, goals], broadcast=True)
        ahead = _AHEAD * max(1, sum(client.nthreads().values()))
        for first in range(0, len(parts), ahead):
            some = parts[first : first + ahead]
            futures = [client.submit(_block, part, *known, asked, pure=False) for part in some]
            for _ in _as_completed(client, futures):
                pass
            blocks += client.gather(futures)
            done = len(goals) * min(len(starts), (first + len(some)) * size)
            progress(done, max(1, len(starts) * len(goals)))
    from scipy import sparse  # noqa: PLC0415 - runs do not need it

    return sparse.vstack(blocks) if sparse.issparse(blocks[0]) else np.concatenate(blocks)


def _block(starts: FloatArray, planner: HybridPlanner, goals: FloatArray, asked: Any) -> Any:
    return planner.distances(starts, goals, **asked)
