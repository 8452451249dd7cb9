"""Interrupts at chosen moments: before any line of the package, or by a timer."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import hybridnav

_PACKAGE = str(Path(hybridnav.__file__).parent)


class Struck(BaseException):
    """An interrupt of these tests, which nothing may catch but they."""


def lines_of(
    call: Callable[[], object], *, strike_at: int | None = None, within: str = _PACKAGE
) -> int:
    """Run a call and count the lines of a folder that it runs, those of the package unless told
    otherwise; raise `Struck` before one."""
    count = 0

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal count
        name = frame.f_code.co_filename
        # Kernels are no lines where they are compiled.
        if not name.startswith(within) or name.endswith("kernels.py"):
            return None
        if event == "line":
            count += 1
            if count == strike_at:
                raise Struck
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    finally:
        sys.settrace(before)
    return count


@contextmanager
def timer(delay_s: float) -> Iterator[None]:
    """Raise `Struck` in the main thread after a while, wherever it is by then."""

    def strike(*_: object) -> None:
        raise Struck

    before = signal.signal(signal.SIGALRM, strike)
    try:
        signal.setitimer(signal.ITIMER_REAL, delay_s)
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
