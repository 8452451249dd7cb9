"""Compilation of kernels, and the only place that decides about their cache."""

from __future__ import annotations

import logging
import multiprocessing
import time
import warnings
from functools import cache, cached_property
from types import FunctionType
from typing import TYPE_CHECKING, Any, TypeVar

import numba
from numba.core import types
from numba.core.registry import CPUDispatcher
from numba.extending import register_jitable

from hybridnav._base.trig import IN_KERNELS
from hybridnav.errors import CacheWarning

if TYPE_CHECKING:
    from collections.abc import Callable

Kernel = TypeVar("Kernel")

_LOG = logging.getLogger("hybridnav.kernels")

for _function in IN_KERNELS:
    register_jitable(_function)


def njit(**options: Any) -> Callable[[Any], Any]:
    """Compile a function like `numba.njit`, without a cache if none can be written.

    numba keeps compiled code beside the module or in the user's home, and refuses the function if
    it can write to neither: in a read-only installation, for a user without a home.

    Parameters
    ----------
    options
        Options of `numba.njit`.

    Returns
    -------
    Callable
        The decorator.

    Warns
    -----
    CacheWarning
        Once in a program, when a cache was requested and there is no folder for it.
    """

    def decorate(function: Any) -> Any:
        try:
            return _kernel(function, options)
        except RuntimeError as error:
            if "no locator available" not in str(error):
                raise
        _tell()
        return _kernel(function, {**options, "cache": False})

    return decorate


def _kernel(function: Any, options: dict[str, Any]) -> Any:
    """Compile a function for Python and for other kernels; leave it as it is with the compiler
    off."""
    kernel = numba.njit(**{**options, "no_cfunc_wrapper": True})(function)  # never called from C
    if isinstance(kernel, CPUDispatcher):
        kernel.__class__ = _Kernel
    return kernel


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


class _Renewed(CPUDispatcher):
    """A kernel whose kept code is dropped if it cannot be read.

    An index of the cache names the types of arguments by their modules. One that another version of
    this package wrote may name a module that is gone, and numba reads it before it compares dates.
    """

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or load it from the cache."""
        try:
            return super().compile(sig)
        except (AttributeError, ImportError):
            self._cache.flush()  # type: ignore[attr-defined]
            return super().compile(sig)


class _Inner(_Renewed):
    """The twin of a kernel that other kernels call.

    A first plan spends most of its time in the compiler. A quarter of that went into wrappers for
    Python of kernels that Python never calls, and into one version of each for every integer
    literal.
    """

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile for the types of the arguments, not for their values."""
        return super().get_call_template(tuple(map(_type_of, args)), kws)

    def add_overload(self, cres: Any) -> None:
        """Hide compiled code from Python, which cannot call it."""
        self.overloads[tuple(cres.signature.args)] = cres


def _type_of(argument: Any) -> Any:
    """Return the type of an argument whose value may be known."""
    return types.unliteral(argument)  # type: ignore[no-untyped-call]


class _Kernel(_Renewed):
    """A kernel that Python calls; other kernels call its twin. Slow compilations are logged."""

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or load it from the cache."""
        began, n_missed = time.perf_counter(), self._n_missed()
        entry = super().compile(sig)
        if self._n_missed() > n_missed:
            seconds, name = time.perf_counter() - began, self.py_func.__name__
            about = {"seconds": seconds, "is_kept": self.stats.cache_path is not None}
            _LOG.info("compiled %s in %.1f s", name, seconds, extra=about)
        return entry

    def _n_missed(self) -> int:
        """Return the number of cache misses."""
        return sum(self.stats.cache_misses.values())

    @cached_property
    def inner(self) -> _Inner:
        """The twin, under another name in the cache."""
        code = self.py_func
        twin = FunctionType(code.__code__, code.__globals__, code.__name__, code.__defaults__)
        twin.__qualname__ = f"{code.__qualname__}_inner"
        is_kept = self.stats.cache_path is not None
        options = {**self.targetoptions, "no_cpython_wrapper": True, "cache": is_kept}
        kernel: Any = numba.jit(**options)(twin)
        kernel.__class__ = _Inner
        inner: _Inner = kernel
        return inner

    @property
    def _numba_type_(self) -> Any:
        return types.Dispatcher(self.inner)


class _Guarded(_Kernel):
    """A kernel that re-raises an exception from the conversion of its results to Python objects."""

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
    """Make a kernel raise the exception of a signal handler.

    A handler runs as soon as Python does, which is when numba makes arrays of the results. With
    several results numba continues with the next one: it returns a broken tuple with the exception
    set, which Python turns into a SystemError with the exception as its cause.
    """
    if isinstance(kernel, CPUDispatcher):
        kernel.__class__ = _Guarded  # type: ignore[assignment]
    return kernel
