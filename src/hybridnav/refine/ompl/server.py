"""The worker process: `python -m hybridnav.refine.ompl.server DESCRIPTOR`.

It reads the map once and then forks for each query. The fork may hang, crash or leak, as OMPL's
bindings sometimes do: it is killed when the time is up, which frees its memory. Random numbers
start from the seed in each fork.
"""

from __future__ import annotations

import contextlib
import gc
import os
import select
import signal
import sys
import time
from collections.abc import Callable
from multiprocessing.connection import Connection

import numpy as np

from hybridnav.errors import HybridNavError
from hybridnav.refine.ompl.client import (
    SEARCH_S,
    Failure,
    OmplQuery,
    Reply,
    Setup,
    ended,
    without_answer,
)
from hybridnav.refine.ompl.problem import Base

GRACE = 0.03
"""Share of the budget after its end at which a fork is killed."""
_ALONE_S = 0.5
"""Seconds after that at which a fork that was not killed ends by itself."""


def serve(connection: Connection) -> None:
    """Answer queries until the other side closes the connection."""
    # Before the map, which the other side may still be reading.
    from ompl import util  # noqa: PLC0415

    import hybridnav.refine.ompl.answer  # noqa: F401, PLC0415

    setup: Setup = connection.recv()
    util.setLogLevel(util.LOG_NONE)
    try:
        base = Base(setup)
        _warm_up(base)
    except HybridNavError as error:
        connection.send(Failure(str(error)))
        return
    gc.freeze()
    connection.send(None)
    while True:
        number, query = connection.recv()

        def tell(reply: Reply, number: int = number) -> None:
            connection.send((number, reply))

        tell(_answer(base, query, connection, tell))


def _warm_up(base: Base) -> None:
    """Load kernels before the first fork, and let OMPL check the parameters."""
    from hybridnav.refine.ompl.solve import StateSpace, make  # noqa: PLC0415

    inside = np.ones(base.setup.grid.shape, dtype=np.bool_)
    check = base.check.confined(inside=inside, closed=np.empty(0, dtype=np.int64))
    x, y = base.setup.grid.frame.points_of((0, 0)).tolist()
    check.state_valid(x, y)
    check.motion_valid(x, y, x, y)
    check.path_valid(np.array([[x, y]]))
    make(
        base.setup.settings,
        StateSpace(base.setup.settings, check, np.zeros(2), np.ones(2)).information,
    )
    radius_m = base.setup.settings.turning_radius_m
    if base.setup.settings.has_heading:
        check.turn_valid(x, y, 0.0, x, y, 1.0)
        check.path_valid(np.array([[x, y, 0.0]]))
    if base.setup.settings.space == "differential":
        check.drive_valid(x, y, 0.0, x, y, 1.0)
        check.spin(x, y, 0.0, 1.0)
    if radius_m is not None:
        check.dubins_valid(x, y, 0.0, x, y, 1.0, radius_m)


def _answer(
    base: Base, query: OmplQuery, connection: Connection, tell: Callable[[Reply], None]
) -> Reply:
    """Fork, pass on its replies, kill it if it takes too long, and return the last reply."""
    left_s = query.deadline_s - time.monotonic()
    kill_s = query.deadline_s + GRACE * max(left_s, 0.0)
    if query.tells_search:
        kill_s += SEARCH_S
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        # Ends the fork even if this process is gone and OMPL never returns to Python.
        signal.setitimer(signal.ITIMER_REAL, max(kill_s - time.monotonic(), 0.0) + _ALONE_S)
        connection.close()
        os.close(reading)
        _run(base, query, Connection(writing, readable=False))
    os.close(writing)
    try:
        with Connection(reading, writable=False) as replies:
            return _last_reply(replies, connection, kill_s, tell)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def _last_reply(
    replies: Connection, connection: Connection, kill_s: float, tell: Callable[[Reply], None]
) -> Reply:
    best = without_answer()
    reason = "killed when the time was over"
    while _replied(replies, connection, kill_s):
        try:
            reply: Reply | Failure = replies.recv()
        except (EOFError, OSError):
            reason = "the planner crashed"
            break
        if isinstance(reply, Failure):
            reason = reply.reason
            break
        if reply.is_last:
            return reply
        best = reply
        tell(reply)
    return ended(best, reason)


def _replied(replies: Connection, connection: Connection, until_s: float) -> bool:
    """Wait until the fork replies or dies, or the time is up; return whether it did.

    Raises `EOFError` when the planner's process is gone, however much time the search has left.
    """
    waiting = select.poll()
    waiting.register(replies, select.POLLIN)
    waiting.register(connection, 0)  # only its end: the next query may wait there
    ready = [which for which, _ in waiting.poll(max(until_s - time.monotonic(), 0.0) * 1000)]
    if connection.fileno() in ready:
        raise EOFError
    return bool(ready)


def _run(base: Base, query: OmplQuery, replies: Connection) -> None:
    """Run a query in a fork; never return."""
    try:
        from ompl import util  # noqa: PLC0415

        from hybridnav.refine.ompl.answer import answer  # noqa: PLC0415

        util.RNG.setSeed(base.setup.settings.seed)
        replies.send(answer(base, query, replies.send))
    except BaseException as error:  # noqa: BLE001 - whatever it is, it ends here
        text = " ".join(f"{type(error).__name__}: {error}".split())
        with contextlib.suppress(OSError):
            replies.send(Failure(f"the search failed, {text[:200]}"))
    finally:
        os._exit(0)


if __name__ == "__main__":
    # A parent that ignores the ends of children passes that on, and no child could be waited for.
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    # The planner's process closes the connection when it is done, or is gone.
    with contextlib.suppress(EOFError, OSError):
        serve(Connection(int(sys.argv[1])))
    # At an orderly exit the bindings complain about remaining instances.
    os._exit(0)
