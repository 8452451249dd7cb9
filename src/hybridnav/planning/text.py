"""A bound in words, for results and for the command line."""

from __future__ import annotations

import math

_OPTIMAL = 1e-9
"""Gap of a path that equals its bound, lengths being sums of rounded numbers."""


def rounded_bound(bound: float, cost: float) -> tuple[str, str]:
    """Return a bound, and how far a path is at most from the optimum, rounded to the safe side.

    The bound of an optimal path is its length, and rounded like that.
    """
    if cost <= bound * (1 + _OPTIMAL):
        return f"{cost:.2f}", "optimal"
    if bound <= 0:
        return "0.00", "not proved to be near the optimum"
    low = math.floor(bound * 100) / 100
    return f"{low:.2f}", f"at most {math.ceil((cost / bound - 1) * 1000) / 10:.1f} % too long"
