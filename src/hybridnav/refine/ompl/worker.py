"""The planner's side of the worker process."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import weakref
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from hybridnav.errors import OmplError
from hybridnav.refine.ompl.messages import SEARCH_S, ended, without_answer

if TYPE_CHECKING:
    from hybridnav.refine.ompl.messages import Query, Reply, Setup

_GRACE = 0.08
"""Part of a query's time after its end at which the worker is no longer waited for. It has killed
its fork before that, unless the machine is busy."""
_PATIENCE_S = 5.0
"""How long the worker may owe an answer before it is given up."""
_LATE = 0.3
"""Part of a query's time before its end at which its reply is late."""
_START_S = 120.0
_END_S = 1.0
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
        When OMPL is not installed or refuses the settings, or the process does not start.
    """

    def __init__(self, setup: Setup) -> None:
        require_ompl()
        self._setup = setup
        self._until = self._late = 0.0
        self._number = self._answered = 0
        self._best = without_answer()
        self._starting: threading.Thread | None = None
        self._problem: str | None = None
        self._start()
        self._raise_problem()

    def send(self, query: Query) -> None:
        """Give the process a query; `reply` waits for what comes of it.

        Where the process died, or owes an answer for long, a new one is started, and the query
        waits for it no longer than for a reply.

        Raises
        ------
        OmplError
            When the new process does not start.
        """
        left_s = query.deadline_s - time.monotonic()
        owes = not self._has_ended(0.0)
        given_up = owes and time.monotonic() > self._until + _PATIENCE_S
        self._until = query.deadline_s + _GRACE * max(left_s, 0.0)
        if query.tells_search:
            self._until += SEARCH_S
        self._late = query.deadline_s - _LATE * max(left_s, 0.0)
        if self._starting is None and (given_up or self._is_dead()):
            self.close()
            self._answered = self._number
            self._starting = threading.Thread(target=self._start, daemon=True)
            self._starting.start()
        self._number += 1
        self._best = without_answer()
        if self._is_up():
            with contextlib.suppress(OSError):
                self._connection.send((self._number, query))

    def is_late(self) -> bool:
        """Wait for the reply until most of the time is over; whether it still has not come."""
        return not self._has_ended(self._late)

    def reply(self) -> Reply:
        """The last reply to the query that was sent, or at most a tenth of its time too late the
        best so far, which says that no other came."""
        if self._has_ended(self._until):
            return self._best
        return ended(self._best, "the worker did not answer in time")

    def close(self) -> None:
        """End the process and what it forked."""
        self._finalizer()

    def _has_ended(self, until_s: float) -> bool:
        """Wait for the last reply to the last query; what comes of earlier ones is dropped."""
        try:
            while self._answered < self._number:
                left_s = max(until_s - time.monotonic(), 0.0)
                if self._starting is not None or not self._connection.poll(left_s):
                    return False
                number, reply = self._connection.recv()
                if number == self._number:
                    self._best = reply
                if reply.is_last:
                    self._answered = number
        except (EOFError, OSError):
            self.close()
            return False
        return True

    def _is_dead(self) -> bool:
        return not self._finalizer.alive or self._process.poll() is not None

    def _is_up(self) -> bool:
        """Wait for a process that is being started until a reply would be late."""
        if self._starting is not None:
            self._starting.join(max(self._late - time.monotonic(), 0.0))
            if self._starting.is_alive():
                return False
            self._starting = None
            self._raise_problem()
        return True

    def _start(self) -> None:
        """Start a process and wait until it is ready; `_problem` says why it is not."""
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = _launch(theirs.fileno())
        self._connection = Connection(ours.detach())
        self._finalizer = weakref.finalize(self, _end, self._process, self._connection)
        self._problem = (
            "the process that runs OMPL does not start; "
            "`python -c 'import ompl.geometric'` may say why"
        )
        with contextlib.suppress(EOFError, OSError):
            self._connection.send(self._setup)
            if self._connection.poll(_START_S):
                refusal = self._connection.recv()
                self._problem = None if refusal is None else refusal.reason

    def _raise_problem(self) -> None:
        if self._problem is not None:
            self.close()
            raise OmplError(self._problem)


def _launch(descriptor: int) -> subprocess.Popen[bytes]:
    # By its own command: a spawned process of multiprocessing would run the caller's main module.
    paths = [str(_PACKAGES), os.environ.get("PYTHONPATH", "")]
    return subprocess.Popen(  # noqa: S603 - this interpreter and a module of our own
        [sys.executable, "-m", "hybridnav.refine.ompl.server", str(descriptor)],
        pass_fds=[descriptor],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        start_new_session=True,  # an interrupt from the keyboard is the planner's alone
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
    )


def _end(process: subprocess.Popen[bytes], connection: Connection) -> None:
    with contextlib.suppress(OSError):
        connection.close()
    with contextlib.suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)  # its session, so what it forked too
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(_END_S)
