"""Runs of consecutive numbers."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hybridnav.grid.runs import in_runs

runs = st.lists(st.tuples(st.integers(0, 10**12), st.integers(0, 9)), max_size=8)


@given(runs)
def test_the_numbers_of_runs_follow_one_another(drawn: list[tuple[int, int]]) -> None:
    start, length = np.array(drawn, dtype=np.int64).reshape(-1, 2).T
    expected = [number for first, n in drawn for number in range(first, first + n)]
    found = in_runs(start, length)
    assert found.dtype == np.int64
    assert found.tolist() == expected
