"""A clock of work: it stands still while kernels are compiled or loaded."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache


class _Spent(threading.local):
    """What one thread has spent in the compiler."""

    depth = 0
    began = 0.0
    seconds = 0.0


_SPENT = _Spent()


def clock() -> float:
    """Return the seconds of `time.perf_counter` without those in which this thread compiled.

    Differences count. They hold neither compilations nor waiting for those of other threads, by
    this package or by any other code that uses numba.
    """
    if "numba.core.event" in sys.modules:  # help can do without, and commands with kept kernels
        listen()
    return time.perf_counter() - _SPENT.seconds


def _stop(_event: object = None) -> None:
    if _SPENT.depth == 0:
        _SPENT.began = time.perf_counter()
    _SPENT.depth += 1


def _go_on(_event: object = None) -> None:
    _SPENT.depth -= 1
    if _SPENT.depth == 0:
        _SPENT.seconds += time.perf_counter() - _SPENT.began


@contextmanager
def stopped() -> Iterator[None]:
    """Stop the clock of this thread."""
    _stop()
    try:
        yield
    finally:
        _go_on()


@cache
def listen() -> None:
    """Have numba stop the clock, once."""
    from numba.core import event  # noqa: PLC0415

    class Compiling(event.Listener):
        on_start, on_end = staticmethod(_stop), staticmethod(_go_on)

    # numba holds this lock while it compiles, and while it looks for kept code.
    event.register("numba:compiler_lock", Compiling())  # type: ignore[no-untyped-call]
