"""A clock of work: it stands still while kernels are compiled or loaded."""

import threading
import time
from functools import cache
from typing import Any


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
    _listen()
    return time.perf_counter() - _SPENT.seconds


@cache
def _listen() -> None:
    """Have numba stop the clock, once and not at the import, which help can do without."""
    from numba.core import event  # noqa: PLC0415

    class Compiling(event.Listener):
        def on_start(self, _event: Any) -> None:
            if _SPENT.depth == 0:
                _SPENT.began = time.perf_counter()
            _SPENT.depth += 1

        def on_end(self, _event: Any) -> None:
            _SPENT.depth -= 1
            if _SPENT.depth == 0:
                _SPENT.seconds += time.perf_counter() - _SPENT.began

    # numba holds this lock while it compiles, and while it looks for kept code.
    event.register("numba:compiler_lock", Compiling())  # type: ignore[no-untyped-call]
