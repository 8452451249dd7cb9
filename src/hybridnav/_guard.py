"""A guard for kernels that return several values, among them arrays."""

from __future__ import annotations

from typing import Any, TypeVar

from numba.core.registry import CPUDispatcher

Kernel = TypeVar("Kernel")


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
