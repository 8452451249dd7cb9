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

from hybridnav.refine.motions import MotionCheck
from hybridnav.refine.ompl.corridor import boxes_of
from hybridnav.refine.ompl.messages import Reply

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.refine.ompl.messages import Query, Setup

GRACE = 0.03
"""Part of the budget after its end at which a fork is killed."""


def serve(connection: Connection) -> None:
    """Answer queries until the other side closes the connection."""
    setup: Setup = connection.recv()
    from ompl import util  # noqa: PLC0415 - after the map, which the other side is waiting to send

    util.setLogLevel(util.LOG_NONE)
    boxes = None if setup.field_of is None else boxes_of(setup.field_of)
    _warm_up(setup)
    gc.freeze()
    connection.send(None)
    while True:
        try:
            query: Query = connection.recv()
        except EOFError:
            return
        connection.send(_answer(setup, boxes, query))


def _warm_up(setup: Setup) -> None:
    """Load modules and kernels, so that forks need not."""
    import hybridnav.refine.ompl.answer  # noqa: F401, PLC0415

    check = MotionCheck(setup.grid, allow_unexplored=setup.allow_unexplored)
    check.state_valid(0.0, 0.0)
    check.motion_valid(0.0, 0.0, 1.0, 1.0)


def _answer(setup: Setup, boxes: LongArray | None, query: Query) -> Reply:
    """Fork, wait, kill where it takes too long; the best reply that came."""
    left_s = query.deadline_s - time.monotonic()
    kill_s = query.deadline_s + GRACE * max(left_s, 0.0)
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _run(setup, boxes, query, Connection(writing, readable=False))
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


def _run(setup: Setup, boxes: LongArray | None, query: Query, replies: Connection) -> None:
    """What a fork does; it never returns."""
    try:
        from ompl import util  # noqa: PLC0415

        from hybridnav.refine.ompl.answer import Answering  # noqa: PLC0415

        util.RNG.setSeed(setup.settings.seed)
        replies.send(Answering(setup, boxes, query, replies.send).run())
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
