"""Turns of threads that share a structure: queries together, changes alone."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

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
