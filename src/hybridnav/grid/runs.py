"""Runs of consecutive numbers, such as those of the cells side by side in a row."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._typing import LongArray


def in_runs(start: LongArray, length: LongArray) -> LongArray:
    """Return the numbers in runs, one run after the other.

    Parameters
    ----------
    start
        int64 (n,), the first number of each run.
    length
        int64 (n,), >= 0.

    Returns
    -------
    LongArray
        int64, as many numbers as the runs have in all.
    """
    end = np.cumsum(length)
    numbers: LongArray = np.repeat(start - end + length, length)
    numbers += np.arange(len(numbers))
    return numbers
