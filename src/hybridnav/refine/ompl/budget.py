"""Budgets: the time, or the iterations, that a query has left."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class Budget:
    """The budget of a query, counted in seconds, or in iterations if these are given.

    Only a budget in iterations is repeatable from a seed.

    Parameters
    ----------
    began_s, deadline_s
        Times of `time.monotonic`.
    iterations
        None to count seconds.
    """

    def __init__(self, began_s: float, deadline_s: float, iterations: int | None) -> None:
        self.began_s = began_s
        self.iterations = 0
        self._most = iterations
        self._deadline_s = deadline_s
        self._whole_s = max(deadline_s - began_s, 1e-6)

    def left(self) -> float:
        """Return the share that is left, 1 at the beginning, 0 at the end."""
        if self._most is not None:
            return max(1 - self.iterations / self._most, 0.0)
        return max((self._deadline_s - time.monotonic()) / self._whole_s, 0.0)

    def seconds(self) -> float:
        """Return the seconds since the beginning."""
        return time.monotonic() - self.began_s

    def spend(self, iterations: int) -> None:
        """Count iterations that no stopper saw."""
        self.iterations += iterations

    def stopper(self, part: float, *, most: int | None = None) -> Callable[[], bool]:
        """Return a function for planners that states whether a share of the rest is spent.

        Planners call it once an iteration.

        Parameters
        ----------
        part
            Share of the budget left now, in (0, 1].
        most
            Most iterations; None for no limit.
        """
        until = sys.maxsize if most is None else self.iterations + most
        if self._most is not None:
            until = min(until, self.iterations + max(int(part * (self._most - self.iterations)), 1))

            def is_spent() -> bool:
                self.iterations += 1
                return self.iterations > until

        else:
            now = time.monotonic()
            end = now + part * (self._deadline_s - now)
            clock = time.monotonic

            def is_spent() -> bool:
                self.iterations += 1
                return clock() >= end or self.iterations > until

        return is_spent
