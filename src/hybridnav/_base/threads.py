"""What threads share: work arrays that no two use at a time, and turns at a structure; and
processes of our own."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any, Generic, TypeVar

from hybridnav.errors import CacheWarning

T = TypeVar("T")

SHARES = 4
"""Shares of work for each core, so that a core which others use does not hold up the rest."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


_PACKAGES = Path(__file__).parents[2]
_RUN = """import sys
if sys.path[:1] == [""]:
    del sys.path[0]
import runpy
runpy.run_module(sys.argv.pop(1), run_name="__main__", alter_sys=True)"""


def keep_last(kept: dict[Any, Any], key: Any, value: T, most: int) -> T:
    """Keep a value, return it, and drop all but the `most` last ones; threads may meet here."""
    kept[key] = value
    for old in list(kept)[:-most]:
        kept.pop(old, None)
    return value


def behind(begun: threading.Lock, work: Callable[[], object]) -> None:
    """Do work in a thread that nothing waits for, the first time that it is asked for.

    A process may end before it; if memory does not suffice, it stays undone.

    `begun`: a lock that is held from now on; a copy, which has a lock of its own, begins anew.
    """

    def alone() -> None:
        with suppress(MemoryError):
            work()

    if begun.acquire(blocking=False):
        threading.Thread(target=alone, name="hybridnav-behind", daemon=True).start()


def start_module(module: str, *arguments: str, **pipes: Any) -> subprocess.Popen[bytes]:
    """Start a module of this package by this interpreter, in a session of its own.

    An interrupt from the keyboard does not reach it, and it finds no modules in the working
    directory, whose files may have their names: Python 3.10 has no `-P`.

    `pipes`: options of `subprocess.Popen`. Returns the process. It does not warn where no compiled
    code can be kept: this one does.
    """
    paths = [str(_PACKAGES), os.environ.get("PYTHONPATH", "")]
    return subprocess.Popen(  # noqa: S603 - this interpreter and a module of our own
        [sys.executable, "-W", f"ignore:{CacheWarning.opening}", "-c", _RUN, module, *arguments],
        stdout=subprocess.DEVNULL,
        start_new_session=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
        **pipes,
    )


class Pool(Generic[T]):
    """Work arrays for as many queries as run at the same time.

    A query that ends in an exception, as when the user interrupts it, does not return its arrays:
    they may be half written.

    `make`: function that makes the arrays of one query.
    """

    def __init__(self, make: Callable[[], T]) -> None:
        self._make = make
        self._idle: list[T] = []

    def take(self) -> T:
        """Return the arrays of one query: those returned last, which caches may still hold."""
        # One call, so that no two threads take the same arrays.
        try:
            return self._idle.pop()
        except IndexError:
            return self._make()

    def give(self, work: T) -> None:
        """Take back the arrays of a query that has ended well."""
        self._idle.append(work)

    @contextmanager
    def lent(self) -> Iterator[T]:
        """Lend the arrays of one query, in a microsecond more than `take` and `give`."""
        work = self.take()
        yield work
        self.give(work)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the constructor, so that a copy makes arrays of its own."""
        return type(self), (self._make,)


_N_SLOTS = 17
"""Locks of queries; a prime number, so that threads spread over them."""


class Turns:
    """Locks that let queries of threads run side by side, and a change alone.

    A query holds one of several locks, by its thread, and a change all of them. A change waits for
    the queries that run, and later queries wait for the change, so that a stream of queries cannot
    delay it; two threads with the same lock wait for each other. There is nothing to count, so an
    interrupt leaves no lock held. A thread that holds a turn must not ask for another one.
    """

    def __init__(self) -> None:
        self._door = threading.RLock()
        self._slots = tuple(threading.RLock() for _ in range(_N_SLOTS))

    def shared(self) -> AbstractContextManager[bool]:
        """Wait for a change that runs or waits, and return the lock to hold during a query."""
        with self._door:
            pass
        return self._slots[(threading.get_ident() >> 12) % _N_SLOTS]

    def alone(self, change: Callable[[], object]) -> None:
        """Call a function while no query runs."""
        with self._door:
            self._hold(0, change)

    def _hold(self, at: int, change: Callable[[], object]) -> None:
        if at == _N_SLOTS:
            change()
            return
        with self._slots[at]:
            self._hold(at + 1, change)

    def __reduce__(self) -> tuple[type[Turns], tuple[()]]:
        """Return the constructor, so that a copy has locks of its own."""
        return type(self), ()
