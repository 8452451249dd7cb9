"""Runs of consecutive numbers, and distinct rows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridnav.maps.islands import in_runs, unique_rows

runs = st.lists(st.tuples(st.integers(0, 10**12), st.integers(0, 9)), max_size=8)


@given(runs)
def test_the_numbers_of_runs_follow_one_another(drawn: list[tuple[int, int]]) -> None:
    start, length = np.array(drawn, dtype=np.int64).reshape(-1, 2).T
    expected = [number for first, n in drawn for number in range(first, first + n)]
    found = in_runs(start, length)
    assert found.dtype == np.int64
    assert found.tolist() == expected


@pytest.mark.parametrize("kind", [np.int32, np.int64, np.float64])
@given(st.integers(1, 3), st.lists(st.integers(-2, 2), max_size=60))
def test_distinct_rows_are_those_of_numpy(kind: type, width: int, drawn: list[int]) -> None:
    rows: Any = np.array(drawn[: len(drawn) // width * width], dtype=kind).reshape(-1, width)
    found = unique_rows(rows)
    if not len(rows):
        assert [len(part) for part in found] == [0, 0, 0, 0]
        return
    expected = np.unique(rows, axis=0, return_index=True, return_inverse=True, return_counts=True)
    for one, other in zip(found, expected, strict=True):
        assert one.tolist() == other.reshape(one.shape).tolist()
    assert found.rows.dtype == kind
