"""Turns of the threads of one planner: queries together, changes alone."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


class Turns:
    """A lock that many queries hold together, and a change alone.

    A change waits for the queries that run, and later queries wait for the change, so that a stream
    of queries cannot hold it up. A thread that holds a turn must not ask for another one.
    """

    def __init__(self) -> None:
        self._door = threading.Lock()
        self._counting = threading.Lock()
        self._in_use = threading.Lock()
        self._n_queries = 0

    @contextmanager
    def shared(self) -> Iterator[None]:
        """Wait until no change runs or waits, and keep changes away."""
        with self._door:
            pass
        with self._counting:
            self._n_queries += 1
            if self._n_queries == 1:
                self._in_use.acquire()
        try:
            yield
        finally:
            with self._counting:
                self._n_queries -= 1
                if self._n_queries == 0:
                    self._in_use.release()

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Wait until no query runs, and keep all others away."""
        with self._door, self._in_use:
            yield

    def __reduce__(self) -> tuple[type[Turns], tuple[()]]:
        """Return the constructor, so that a copy has locks of its own."""
        return type(self), ()
