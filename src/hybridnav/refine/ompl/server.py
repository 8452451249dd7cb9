"""The worker process: `python -m hybridnav.refine.ompl.server DESCRIPTOR`.

It reads the map once and then forks for each query. The fork may hang, crash or leak, as OMPL's
bindings do now and then: it is killed when the time is over, and its memory goes with it. Random
numbers start from the seed in each fork.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import time
import traceback
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.refine.ompl.corridor import Base
from hybridnav.refine.ompl.messages import SEARCH_S, Reply

if TYPE_CHECKING:
    from hybridnav.refine.ompl.messages import Query, Setup

GRACE = 0.03
"""Part of the budget after its end at which a fork is killed."""


def serve(connection: Connection) -> None:
    """Answer queries until the other side closes the connection."""
    setup: Setup = connection.recv()
    from ompl import util  # noqa: PLC0415 - after the map, which the other side is waiting to send

    util.setLogLevel(util.LOG_NONE)
    base = Base(setup)
    _warm_up(base)
    gc.freeze()
    connection.send(None)
    while True:
        try:
            number, query = connection.recv()
        except EOFError:
            return
        connection.send((number, _answer(base, query)))


def _warm_up(base: Base) -> None:
    """Load modules and kernels, so that forks need not."""
    import hybridnav.refine.ompl.answer  # noqa: F401, PLC0415

    inside = np.ones(base.setup.grid.shape, dtype=np.bool_)
    check = base.check.confined(inside=inside, closed=np.empty(0, dtype=np.int64))
    x, y = base.setup.grid.frame.points_of((0, 0)).tolist()
    check.state_valid(x, y)
    check.motion_valid(x, y, x, y)
    check.path_valid(np.array([[x, y]]))
    if base.clearance is not None:
        base.clearance.cost(x, y, x, y)
    radius_m = base.setup.settings.turning_radius_m
    if base.setup.settings.has_heading:
        check.turn_valid(x, y, 0.0, x, y, 1.0)
    if radius_m is not None:
        check.dubins_valid(x, y, 0.0, x, y, 1.0, radius_m)


def _answer(base: Base, query: Query) -> Reply:
    """Fork, wait, kill where it takes too long; the best reply that came."""
    left_s = query.deadline_s - time.monotonic()
    kill_s = query.deadline_s + GRACE * max(left_s, 0.0)
    if query.tells_search:
        kill_s += SEARCH_S
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _run(base, query, Connection(writing, readable=False))
    os.close(writing)
    with Connection(reading, writable=False) as replies:
        best = _last_reply(replies, kill_s)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return best


def _last_reply(replies: Connection, kill_s: float) -> Reply:
    best = Reply("timeout", np.empty((0, 3)), np.inf)
    error = "killed when the time was over"
    while replies.poll(max(kill_s - time.monotonic(), 0.0)):
        try:
            reply: Reply = replies.recv()
        except EOFError:
            error = "the planner crashed"
            break
        if reply.is_last:
            return reply
        best = reply
    return replace(best, steps=(*best.steps, error), error=error)


def _run(base: Base, query: Query, replies: Connection) -> None:
    """What a fork does; it never returns."""
    try:
        from ompl import util  # noqa: PLC0415

        from hybridnav.refine.ompl.answer import Answering  # noqa: PLC0415

        util.RNG.setSeed(base.setup.settings.seed)
        replies.send(Answering(base, query, replies.send).run())
    except BaseException:  # noqa: BLE001 - whatever it is, it ends here
        text = traceback.format_exc().strip().splitlines()
        replies.send(
            Reply("timeout", np.empty((0, 3)), np.inf, steps=(text[-1],), error="; ".join(text))
        )
    finally:
        os._exit(0)


if __name__ == "__main__":
    serve(Connection(int(sys.argv[1])))
    # The bindings complain at an orderly exit about instances that are left.
    os._exit(0)
