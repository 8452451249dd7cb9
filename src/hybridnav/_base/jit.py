"""Decorators of kernels, and the only place that decides about them.

numba itself is loaded where something is compiled: `compiler`. A command runs what is kept without.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from hybridnav._base.shipped import OVERLOADS

Compiled = TypeVar("Compiled")

_WITHOUT: list[bool] = []


def run_kept() -> None:
    """Run kept kernels without numba from here on, unless it is loaded or told anything.

    For processes that end soon. `kept.Kernel` takes microseconds longer to call than numba's.
    """
    told = {name for name in os.environ if name.startswith("NUMBA_")} - {"NUMBA_CACHE_DIR"}
    if "numba" not in sys.modules and not told and not Path(".numba_config.yaml").exists():
        _WITHOUT.append(True)


def njit(**options: Any) -> Callable[[Any], Any]:
    """Compile a function like `numba.njit`, or take the code that the wheel brought.

    numba keeps compiled code beside the module or in the user's home. Where it can write to neither
    (a read-only installation, a user without a home) it refuses the function; here nothing is kept.

    `options`: options of `numba.njit`. `_nrt=False`, for what neither makes nor returns an array,
    spares the atomic counts of references round branches: five sixths of the time of `simplify`.
    """

    def decorate(function: Any) -> Any:
        def compiled() -> Any:
            from hybridnav._base import compiler  # noqa: PLC0415 - loads numba

            return compiler.compiled(function, options)

        if not _WITHOUT:
            return compiled()
        from hybridnav._base.kept import Kernel  # noqa: PLC0415 - reads what is compiled

        return Kernel(function, compiled)

    return decorate


def overload(of: Any) -> Callable[[Any], Any]:
    """Have kernels call what a function returns in place of another, as `numba.extending` does."""

    def register(by: Any) -> Any:
        OVERLOADS.append((of, by))
        return by

    return register


def guarded(kernel: Compiled) -> Compiled:
    """Make a kernel raise the exception of a signal handler.

    A handler runs as soon as Python does, which is when numba makes arrays of the results. With
    several results numba continues with the next one: it returns a broken tuple with the exception
    set, which Python turns into a SystemError with the exception as its cause.
    """
    if not _WITHOUT:
        from hybridnav._base import compiler  # noqa: PLC0415 - loads numba

        compiler.guarded(kernel)
    return kernel  # a kept one is guarded anyway
