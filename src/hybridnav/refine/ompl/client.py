"""Messages between the planner's process and the worker. Public: `Setup`, `OmplQuery`, `Search`,
`Reply`, `require_ompl` and `start_ahead`.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import signal
import socket
import subprocess
import threading
import time
import weakref
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.threads import start_module
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import OmplError
from hybridnav.maps import OccupancyGrid
from hybridnav.refine.ompl import OmplSettings

ReplyStatus = Literal["solved", "approximate", "timeout"]


SEARCH_S = 60.0
"""Seconds beyond its time that a query with the trees of the search may take."""


@dataclass(frozen=True, eq=False)
class Setup:
    """Setup of a worker, sent once."""

    grid: OccupancyGrid
    field_of: NDArray[np.int16 | np.int32] | None
    """int16 or int32 (rows, cols), the field of each cell, -1 for none; None if the whole map is
    the corridor."""
    settings: OmplSettings
    allow_unexplored: bool


@dataclass(frozen=True, eq=False)
class OmplQuery:
    """One problem."""

    start: FloatArray
    """float64 (3,), x and y in metres, heading in radians; map frame."""
    goal: FloatArray
    cells: LongArray
    """int64 (n, 2), a legal path of cells from the cell of the start to that of the goal."""
    deadline_s: float
    """Time of `time.monotonic`, which all processes share, at which the query ends."""
    corridors: tuple[tuple[str, BoolArray | None], ...]
    """Names of the corridors to try, one after the other, and the fields of each, bool (n_fields,);
    None for the whole map."""
    closed: LongArray | None = None
    """int64 (m,), flat cells that may not be entered."""
    solid: LongArray | None = None
    """int64 (k,), flat cells that no part of a footprint may meet."""
    tells_search: bool = False
    """Whether to return states and trees of the search too."""


@dataclass(eq=False)
class Search:
    """States and motions of a search, for pictures."""

    states: list[tuple[float, float]] = field(default_factory=list)
    """States that were found valid, map frame."""
    edges: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Motions of the trees or roadmaps."""


@dataclass(frozen=True, eq=False)
class Reply:
    """Result of a query; a worker may send several for one query, each better than the last."""

    outcome: ReplyStatus
    points: FloatArray
    """float64 (n, 3), states of the path in order; an approximate path does not end at the goal.
    Shape (0, 3) if there is no path."""
    cost: float
    """Length of the path in metres."""
    steps: tuple[str, ...] = ()
    """Attempts and their outcomes, in order."""
    trace: tuple[tuple[float, float], ...] = ()
    """Seconds since the query arrived and cost, of each better path."""
    iterations: int = 0
    """Iterations of planners and simplification."""
    is_last: bool = True
    search: Search | None = None


@dataclass(frozen=True, eq=False)
class Failure:
    """Reason for a search that broke off; its earlier replies count."""

    reason: str
    """One line."""


def without_answer() -> Reply:
    """Return the reply for a worker that sent none."""
    return Reply("timeout", np.empty((0, 3)), np.inf)


def ended(best: Reply, reason: str) -> Reply:
    """Return the best reply of a search that was ended for a reason."""
    return replace(best, steps=(*best.steps, reason), is_last=True)


# The planner's side of the worker process.

_GRACE = 0.08
"""Share of a query's time after its end at which the wait for the worker ends. By then it has
killed its fork, unless the machine is busy."""
_PATIENCE_S = 5.0
"""Seconds that the worker may owe an answer before it is given up."""
_LATE = 0.3
"""Share of a query's time before its end from which its reply is late."""
_START_S = 120.0
_END_S = 1.0


def require_ompl() -> None:
    """Refuse to continue without OMPL.

    Raises
    ------
    OmplError
        When OMPL is not installed; the message states what to install.
    """
    if importlib.util.find_spec("ompl") is None:
        raise OmplError(
            "this preset needs OMPL, which is not installed: pip install 'ompl>=2.0.1' (there are "
            "wheels for Python 3.10 to 3.13 on Linux and on macOS 15); all other presets do without"
        )


class Worker:
    """A process that answers queries on one map, one after the other.

    It is restarted after it died, owed an answer for long or was closed, in a fork of the process
    that it belongs to, and for a copy.

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
        self.__setstate__(setup)
        self._start_and_wait()
        if self._running is None:
            raise OmplError(self._problem)

    def __getstate__(self) -> Setup:
        """Return the setup, without the process: a copy starts its own."""
        return self._setup

    def __setstate__(self, setup: Setup) -> None:
        self._setup = setup
        self._until = self._late = 0.0
        self._number = self._answered = 0
        self._best = without_answer()
        self._running: _Running | None = None
        self._starting: _Start | None = None
        self._problem = ""

    def ensure(self) -> None:
        """Start a process if needed, before the time of a query runs.

        If the process was closed, or belongs to the process that this one was forked from, wait for
        a new one. If it died, a new one starts beside the next query, which has its own time.
        """
        running = self._running
        if running is not None and running.owner != os.getpid():
            self._answered = self._number
            self._running = self._starting = None
            self._start_and_wait()
            return
        owes = not self._has_ended(0.0) and time.monotonic() > self._until + _PATIENCE_S
        if running is not None and (owes or running.has_ended()):
            self.close()
            self._start_beside()
        elif running is None and self._starting is None:
            if self._problem:
                self._start_beside()
            else:
                self._start_and_wait()

    def send(self, query: OmplQuery) -> None:
        """Send the process a query; `reply` waits for the result."""
        left_s = query.deadline_s - time.monotonic()
        self._until = query.deadline_s + _GRACE * max(left_s, 0.0)
        if query.tells_search:
            self._until += SEARCH_S
        self._late = query.deadline_s - _LATE * max(left_s, 0.0)
        self._number += 1
        self._best = without_answer()
        if self._starting is not None:
            self._starting.join(max(self._late - time.monotonic(), 0.0))
            if not self._starting.is_alive():
                self._take(self._starting)
        if self._running is not None:
            try:
                self._running.connection.send((self._number, query))
            except OSError:
                pass  # it died: `reply` reports that
            except BaseException:
                # Half a message was written, as when the user interrupts: the rest never follows.
                self.close()
                raise

    def is_late(self) -> bool:
        """Wait for the reply until most of the time is up; return whether it is still missing."""
        return not self._has_ended(self._late)

    def reply(self) -> Reply:
        """Return the last reply to the query that was sent, or the best so far.

        The best so far is returned at most a tenth of the query's time too late, and reports that
        no other reply arrived.
        """
        if self._has_ended(self._until):
            return self._best
        return ended(self._best, self._problem or "the worker did not answer in time")

    def close(self) -> None:
        """End the process and its forks."""
        if self._starting is not None:
            self._starting.give_up()
        if self._running is not None:
            self._running.end()
        self._running = self._starting = None
        self._answered, self._problem = self._number, ""

    def _has_ended(self, until_s: float) -> bool:
        """Wait for the last reply to the last query; replies to earlier ones are dropped."""
        running = self._running
        if running is None:
            return self._answered == self._number
        try:
            while self._answered < self._number:
                if not running.connection.poll(max(until_s - time.monotonic(), 0.0)):
                    return False
                number, reply = running.connection.recv()
                if number == self._number:
                    self._best = reply
                if reply.is_last:
                    self._answered = number
        except (EOFError, OSError):
            running.end()
            return False
        except BaseException:
            # Half a message was read, as when the user interrupts: the rest is meaningless.
            self.close()
            raise
        return True

    def _start_and_wait(self) -> None:
        starting = _Start(self._setup)
        try:
            starting.run()
        except BaseException:
            starting.give_up()
            raise
        self._take(starting)

    def _start_beside(self) -> None:
        self._starting = _Start(self._setup)
        self._starting.start()

    def _take(self, starting: _Start) -> None:
        self._starting, self._problem = None, starting.problem
        if starting.process is not None and not starting.problem:
            self._running = _Running(self, starting.process, starting.connection)


_NO_START = "the process of OMPL does not start; `python -c 'import ompl.geometric'` may show why"
_SLOW = f"the process of OMPL is not ready after {_START_S:g} s: is the machine busy?"


class _Start(threading.Thread):
    """A start of the process, which takes seconds; `problem` is the reason for a failure."""

    def __init__(self, setup: Setup) -> None:
        super().__init__(daemon=True)
        self._setup = setup
        self._is_given_up = False
        self.problem = ""
        self.process: subprocess.Popen[bytes] | None = None

    def run(self) -> None:
        """Start the process and wait until it is ready."""
        try:
            self.process, self.connection = _taken() or _launch()
            self.connection.send(self._setup)
            refusal = self.connection.recv() if self.connection.poll(_START_S) else Failure(_SLOW)
            self.problem = "" if refusal is None else getattr(refusal, "reason", _NO_START)
        except Exception as error:  # noqa: BLE001 - no process or thread, too many files, at exit
            self.problem = f"{_NO_START} ({error})" if str(error) else _NO_START
        if self.process is not None and (self.problem or self._is_given_up):
            _end(self.process, self.connection, os.getpid())

    def give_up(self) -> None:
        """End the started process, now or when it is ready."""
        self._is_given_up = True
        if not self.is_alive() and self.process is not None:
            _end(self.process, self.connection, os.getpid())


class _Running:
    """A running process; it ends with the worker, and with the process that started it."""

    def __init__(
        self, worker: Worker, process: subprocess.Popen[bytes], connection: Connection
    ) -> None:
        self.connection = connection
        self.owner = os.getpid()
        self.process = process
        self.end = weakref.finalize(worker, _end, process, connection, self.owner)

    def has_ended(self) -> bool:
        """Return whether it was ended, or died."""
        return not self.end.alive or self.process.poll() is not None


_Launched = tuple[subprocess.Popen[bytes], Connection]
_ahead: list[_Launched] = []
"""A process that waits for its map."""


def start_ahead() -> None:
    """Start the process of the next `Worker`, which loads OMPL until its map is known.

    For commands, which plan once: a process that no worker takes ends with this one. Where none
    starts, nothing happens, and the worker says why.
    """
    if importlib.util.find_spec("ompl") is not None and not _ahead:
        with contextlib.suppress(OSError):
            _ahead.append(_launch())


def _taken() -> _Launched | None:
    """Return the process that was started ahead, if it runs and no fork has it from its parent."""
    launched = _ahead.pop() if _ahead else None
    return None if launched is None or launched[0].poll() is not None else launched


def _launch() -> _Launched:
    # With its own command: a spawned process of multiprocessing would run the caller's main module.
    server, pipes = "hybridnav.refine.ompl.server", {"stdin": subprocess.DEVNULL}
    ours, theirs = socket.socketpair()
    connection, descriptor = Connection(ours.detach()), theirs.fileno()
    with theirs:
        return start_module(server, str(descriptor), pass_fds=[descriptor], **pipes), connection


def _end(process: subprocess.Popen[bytes], connection: Connection, owner: int) -> None:
    with contextlib.suppress(OSError):
        connection.close()
    if os.getpid() != owner:
        return  # forked, as by multiprocessing: the process belongs to the parent
    with contextlib.suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)  # its session, so its forks too
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(_END_S)
