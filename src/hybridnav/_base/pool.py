"""Work arrays that queries borrow, so that no two share them."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

T = TypeVar("T")


class Pool(Generic[T]):
    """Work arrays for as many queries as run at the same time.

    A query that ends in an exception, as when the user interrupts it, does not return its arrays:
    they may be half written.

    Parameters
    ----------
    make
        Function that makes the arrays of one query.
    """

    def __init__(self, make: Callable[[], T]) -> None:
        self._make = make
        self._idle: list[T] = []

    @contextmanager
    def lent(self) -> Iterator[T]:
        """Lend the arrays of one query: those returned last, which caches may still hold."""
        # One call, so that no two threads take the same arrays.
        try:
            work = self._idle.pop()
        except IndexError:
            work = self._make()
        yield work
        self._idle.append(work)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the constructor, so that a copy makes arrays of its own."""
        return type(self), (self._make,)
