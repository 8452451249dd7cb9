"""The planner's side of the worker process."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import socket
import subprocess
import sys
import threading
import time
import weakref
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import OmplError
from hybridnav.refine.ompl.messages import SEARCH_S, Reply

if TYPE_CHECKING:
    from hybridnav.refine.ompl.messages import Query, Setup

_GRACE = 0.08
"""Part of a query's time after its end at which the worker is no longer waited for. It has killed
its fork before that, unless the machine is busy."""
_PATIENCE_S = 5.0
"""How long the worker may owe an answer before it is given up."""
_LATE = 0.3
"""Part of a query's time before its end at which its reply is late."""
_START_S = 120.0
_PACKAGES = Path(__file__).parents[3]


def require_ompl() -> None:
    """Refuse to go on without OMPL.

    Raises
    ------
    OmplError
        When it is not installed; says what to install.
    """
    if importlib.util.find_spec("ompl") is None:
        raise OmplError(
            "this preset needs OMPL, which is not installed: pip install 'ompl>=2.0.1' (there are "
            "wheels for Python 3.10 to 3.13 on Linux and on macOS 15); all other presets do without"
        )


class Worker:
    """A process that answers queries on one map, started anew after it had to be given up.

    Parameters
    ----------
    setup
        Map and settings.

    Raises
    ------
    OmplError
        When OMPL is not installed, or the process does not start.
    """

    def __init__(self, setup: Setup) -> None:
        require_ompl()
        self._setup = setup
        self._until = self._late = 0.0
        self._number = self._answered = 0
        self._reply: Reply | None = None
        self._start()

    def send(self, query: Query) -> None:
        """Give the process a query; `reply` waits for what comes of it."""
        left_s = query.deadline_s - time.monotonic()
        self._until = query.deadline_s + _GRACE * max(left_s, 0.0)
        if query.tells_search:
            self._until += SEARCH_S
        self._late = query.deadline_s - _LATE * max(left_s, 0.0)
        self._number += 1
        with contextlib.suppress(OSError):
            self._connection.send((self._number, query))

    def is_late(self) -> bool:
        """Wait for the reply until most of the time is over; whether it still has not come."""
        return self._received(self._late) is None

    def reply(self) -> Reply:
        """The reply to the query that was sent, at most a tenth of its time too late; where none
        comes, one that says so."""
        reply = self._received(self._until)
        if reply is not None:
            return reply
        problem = "the worker did not answer in time"
        return Reply("timeout", np.empty((0, 3)), np.inf, steps=(problem,), error=problem)

    def _received(self, until_s: float) -> Reply | None:
        """The reply to the last query; those to earlier ones, which came too late, are dropped."""
        try:
            while self._answered < self._number:
                if not self._connection.poll(max(until_s - time.monotonic(), 0.0)):
                    return None
                self._answered, self._reply = self._connection.recv()
        except (EOFError, OSError):
            self.close()
            return None
        return self._reply

    def ensure(self) -> None:
        """Have a process that answers: a new one where it died, or owes an answer for long.

        Raises
        ------
        OmplError
            When it does not start.
        """
        dead = not self._finalizer.alive or self._process.poll() is not None
        self._received(0.0)
        owes = self._answered < self._number
        if dead or (owes and time.monotonic() > self._until + _PATIENCE_S):
            self.close()
            self._start()

    def close(self) -> None:
        """End the process."""
        self._finalizer()

    def _start(self) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = _launch(theirs.fileno())
        self._connection = Connection(ours.detach())
        self._answered, self._reply = self._number, None
        self._finalizer = weakref.finalize(self, _end, self._process, self._connection)
        try:
            self._connection.send(self._setup)
            if self._connection.poll(_START_S):
                self._connection.recv()
                return
        except (EOFError, OSError):
            pass
        self.close()
        raise OmplError(
            "the process that runs OMPL does not start; "
            "`python -c 'import ompl.geometric'` may say why"
        )


def _launch(descriptor: int) -> subprocess.Popen[bytes]:
    # By its own command: a spawned process of multiprocessing would run the caller's main module.
    paths = [str(_PACKAGES), os.environ.get("PYTHONPATH", "")]
    return subprocess.Popen(  # noqa: S603 - this interpreter and a module of our own
        [sys.executable, "-m", "hybridnav.refine.ompl.server", str(descriptor)],
        pass_fds=[descriptor],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
    )


def _end(process: subprocess.Popen[bytes], connection: Connection) -> None:
    with contextlib.suppress(OSError):
        connection.close()
    process.kill()
    threading.Thread(target=process.wait, daemon=True).start()
