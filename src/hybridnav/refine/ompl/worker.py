"""The planner's side of the worker process."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import socket
import subprocess
import sys
import time
import weakref
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import OmplError
from hybridnav.refine.ompl.messages import Reply

if TYPE_CHECKING:
    from hybridnav.refine.ompl.messages import Query, Setup

_GRACE = 0.09
"""Part of a query's time after its end at which the worker itself is given up. It has killed its
fork before that, unless it is stopped or swapped out."""
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
        self._start()

    def ask(self, query: Query) -> Reply:
        """Have a query answered within its time, a tenth of it at most on top.

        Raises
        ------
        OmplError
            When the process is lost and cannot be started anew.
        """
        left_s = query.deadline_s - time.monotonic()
        until = query.deadline_s + _GRACE * max(left_s, 0.0)
        try:
            self._connection.send(query)
            if self._connection.poll(max(until - time.monotonic(), 0.0)):
                reply: Reply = self._connection.recv()
                return reply
            problem = "the worker did not answer and was given up"
        except (EOFError, OSError):
            problem = "the worker was lost"
        self.close()
        return Reply("timeout", np.empty((0, 3)), np.inf, steps=(problem,), error=problem)

    def ensure(self) -> None:
        """Start the process where there is none."""
        if not self._finalizer.alive or self._process.poll() is not None:
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
    process.wait()
