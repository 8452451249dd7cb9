"""The one place where kernels are compiled, and where it is decided what becomes of the result."""

from __future__ import annotations

import multiprocessing
import warnings
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

import numba
from numba.core.registry import CPUDispatcher

from hybridnav.errors import CacheWarning

if TYPE_CHECKING:
    from collections.abc import Callable

Kernel = TypeVar("Kernel")


def njit(**options: Any) -> Callable[[Any], Any]:
    """Compile a function as `numba.njit` does, without a cache where none can be written.

    numba keeps what it compiled beside the module or in the user's home, and refuses the function
    where it can write to neither: an installation that is read-only, for a user without a home.

    Parameters
    ----------
    options
        Those of `numba.njit`.

    Returns
    -------
    Callable
        The decorator.

    Warns
    -----
    CacheWarning
        Once in a program, when a cache was asked for and there is no folder for it.
    """

    def decorate(function: Any) -> Any:
        try:
            return numba.njit(**options)(function)
        except RuntimeError as error:
            if "no locator available" not in str(error):
                raise
        _tell()
        return numba.njit(**{**options, "cache": False})(function)

    return decorate


@cache
def _tell() -> None:
    """Warn, once and not in each process of a pool."""
    if multiprocessing.parent_process() is None:
        warnings.warn(
            f"{CacheWarning.opening} in which numba could keep compiled code, so every start "
            "compiles anew, for up to some minutes; to keep it set the environment variable "
            "NUMBA_CACHE_DIR to a folder that can be written",
            CacheWarning,
            stacklevel=4,
        )


class _Guarded(CPUDispatcher):
    """A kernel that raises what was raised while its results became objects of Python."""

    def __call__(self, *arguments: Any) -> Any:
        try:
            return super().__call__(*arguments)
        except SystemError as error:
            raised: BaseException = error
            while isinstance(raised, SystemError) and raised.__cause__ is not None:
                raised = raised.__cause__
            if raised is error:
                raise
        raise raised


def guarded(kernel: Kernel) -> Kernel:
    """Let a kernel raise what the handler of a signal raises.

    A handler runs as soon as Python does. That is when numba makes arrays of the results, and for
    several results numba goes on to the next one: it returns a broken tuple with the exception set,
    which Python turns into a SystemError whose cause is the exception.
    """
    if isinstance(kernel, CPUDispatcher):  # with the compiler off it is a plain function
        kernel.__class__ = _Guarded  # type: ignore[assignment]
    return kernel
