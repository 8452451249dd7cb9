"""The table of places."""

from __future__ import annotations

import numpy as np

from hybridnav.ext.live.state import PLACE, PlaceTable


def test_the_table_forgets_places_that_are_no_more():
    table, first = PlaceTable(), 0
    row = np.zeros(10, PLACE)
    row["area"] = 1
    for _ in range(300):
        table = table.next_version()
        table.drop(table.numbers())
        numbers = table.append(first, row)
        first += 10
        table.close()
    assert table.numbers() == numbers.tolist()
    assert len(table.columns()[0]) < 600
