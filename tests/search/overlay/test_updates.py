"""Costs that change between queries: every answer is exact, and every bound holds."""

import threading
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from hybridnav.errors import InvalidValueError
from hybridnav.search.overlay import OverlaySearch, build_overlay
from tests.search.overlay.judge import WeightedJudge
from tests.search.overlay.test_overlay import SIZES, nested, world
from tests.strategies import examples

SHAPE = (17, 22)
boxes = st.tuples(*(st.integers(0, side) for side in (SHAPE[0], SHAPE[0], SHAPE[1], SHAPE[1]))).map(
    lambda sides: (*sorted(sides[:2]), *sorted(sides[2:]))
)
"""First row, last row + 1, first column, last column + 1."""


class Changing(RuleBasedStateMachine):
    """A map whose costs rise and fall, whose cells close and open, between queries."""

    @initialize(
        seed=st.integers(0, 10**6),
        sizes=st.sampled_from(SIZES),
        share=st.sampled_from([0.0, 0.2, 0.4]),
        top_bytes=st.sampled_from([None, 0.0, 1e9]),
    )
    def build(self, seed, sizes, share, top_bytes):
        """Build the overlay of a random map."""
        self.rng = np.random.default_rng(seed)
        self.free, self.factor = world(seed, SHAPE, share)
        self.closed = np.zeros(SHAPE, dtype=np.bool_)
        labels = nested(self.free, sizes)
        self.overlay = build_overlay(self.free, labels, self.factor, top_bytes=top_bytes)
        self.search = OverlaySearch(self.overlay, near_cells=[0, 30, 0, 1000][seed % 4])

    def change(self, box, factor, closed):
        """Change the costs in a box."""
        self.factor, self.closed = factor, closed
        self.overlay.update(factor, closed=closed, changed=box)

    def in_box(self, box, value, array):
        """Return an array with the values in a box changed."""
        changed = array.copy()
        rows, cols = slice(*box[:2]), slice(*box[2:])
        changed[rows, cols] = value(changed[rows, cols])
        return changed

    @rule(box=boxes, by=st.floats(1.0, 9.0))
    def raise_costs(self, box, by):
        """Raise all costs in a box."""
        self.change(
            box, self.in_box(box, lambda old: np.minimum(old * by, 50), self.factor), self.closed
        )

    @rule(box=boxes, share=st.floats(0.0, 1.0))
    def lower_costs(self, box, share):
        """Lower all costs in a box."""
        lower = self.in_box(box, lambda old: 1 + (old - 1) * share, self.factor)
        self.change(box, lower, self.closed)

    @rule(box=boxes)
    def mix_costs(self, box):
        """Raise some costs and lower others."""
        mixed = self.in_box(box, lambda old: 1 + 5 * self.rng.random(old.shape), self.factor)
        self.change(box, mixed, self.closed)

    @rule(box=boxes)
    def close(self, box):
        """Close all cells in a box."""
        self.change(box, self.factor, self.in_box(box, np.ones_like, self.closed))

    @rule(box=boxes)
    def free_again(self, box):
        """Open all cells in a box again."""
        self.change(box, self.factor, self.in_box(box, np.zeros_like, self.closed))

    @rule(box=boxes, share=st.sampled_from([0.0, 0.5, 1.0]))
    def rebuild(self, box, share):
        """Free cells in a box that were walls, and make walls of free ones."""
        self.free = self.in_box(box, lambda old: self.rng.random(old.shape) < share, self.free)
        self.overlay.update(self.factor, enterable=self.free, closed=self.closed, changed=box)

    @rule()
    def renew(self):
        """Bring all tables up to date."""
        self.overlay.renew()
        assert self.overlay.is_current

    @rule(epsilon=st.sampled_from([0.0, 0.0, 0.1]))
    def ask(self, epsilon):
        """Ask for paths, and judge them."""
        cells = np.argwhere(self.free)
        if len(cells) == 0:
            return
        judge = WeightedJudge(self.free & ~self.closed, self.factor)
        for start, goal in cells[self.rng.integers(len(cells), size=(4, 2))].tolist():
            found = self.search.path(start, goal, epsilon=epsilon)
            if self.closed[tuple(start)] or self.closed[tuple(goal)]:
                assert found.cells is None
            else:
                judge.check(found, start, goal, epsilon=epsilon)


Changing.TestCase.settings = settings(
    max_examples=examples(40), stateful_step_count=20, deadline=None
)
TestChanging = Changing.TestCase


@pytest.mark.full
def test_ten_thousand_changes():
    """10,000 random changes and questions, on 50 maps in turn."""
    rng = np.random.default_rng(7)
    for at in range(50):
        machine = Changing()
        top_bytes = [None, 0.0, 1e9][at % 3]
        machine.build(at, SIZES[at % len(SIZES)], [0.0, 0.2, 0.4][at % 3], top_bytes)
        for _ in range(200):
            rows, cols = (np.sort(rng.integers(0, side + 1, 2)).tolist() for side in SHAPE)
            box, kind = (*rows, *cols), rng.integers(9)
            if kind == 0:
                machine.raise_costs(box, 1 + 2 * rng.random())
            elif kind == 1:
                machine.lower_costs(box, rng.random())
            elif kind == 2:
                machine.mix_costs(box)
            elif kind == 3:
                machine.close(
                    box if rng.random() < 0.3 else (rows[0], rows[0] + (rows[0] < SHAPE[0]), *cols)
                )
            elif kind == 4:
                machine.free_again(box)
            elif kind == 5:
                machine.renew()
            elif kind == 6:
                machine.rebuild(box, rng.choice([0.3, 0.8, 1.0]))
            else:
                machine.ask([0.0, 0.0, 0.1][rng.integers(3)])


def test_threads_ask_while_another_one_changes_costs():
    """Each answer is exact for one of the two states between which the costs change."""
    free = np.ones((30, 30), dtype=np.bool_)
    low, high = np.ones((30, 30)), np.ones((30, 30))
    high[10:20, 3:27] = 7.0
    overlay = build_overlay(free, nested(free, [5, 15]), low)
    search, wrong = OverlaySearch(overlay, near_cells=0), []
    costs = {WeightedJudge(free, factor).least((0, 12))[1][29, 15] for factor in (low, high)}

    def ask():
        for _ in range(60):
            found = search.path((0, 12), (29, 15))
            if found.lower_bound_cells not in costs:
                wrong.append(found.lower_bound_cells)

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for at in range(20):
        overlay.update([high, low][at % 2], changed=(10, 20, 3, 27))
    for thread in threads:
        thread.join()
    assert not wrong
    assert len(costs) == 2


@pytest.mark.parametrize(("before", "after"), [(9.0, 1.0), (1.0, 9.0)])
def test_tables_guide_searches_only_while_they_are_lower_bounds(before, after):
    """A wall of high costs falls, or rises, inside a field that has a table."""
    free = np.ones((18, 36), dtype=np.bool_)
    factor = np.full((18, 36), 2.0)
    factor[:, 12:15] = before
    overlay = build_overlay(free, nested(free, [3, 9, 18]), factor, top_bytes=1e9)
    search = OverlaySearch(overlay, near_cells=0)
    factor[4:8, 12:15] = after
    overlay.update(factor, changed=(4, 8, 12, 15))
    levels = overlay.levels
    assert levels.is_stale[levels.level_at[2] :].any()
    assert levels.is_lowered[levels.is_stale].all() == (after < before)
    judge = WeightedJudge(free, factor)
    for start, goal in [((6, 0), (6, 35)), ((17, 3), (0, 20)), ((5, 10), (6, 16))]:
        judge.check(search.path(start, goal), start, goal)
        judge.check(search.path(goal, start), goal, start)


SMALLER: Any = np.zeros((5, 6), dtype=np.bool_)
BOXES: list[Any] = [(0, 7, 0, 3), (2, 1, 0, 3), (0, 1, 2), (0.0, 1, 0, 1), (-1, 1, 0, 1), 3, "all"]


@pytest.mark.parametrize(
    ("given", "match"),
    [
        *(({"changed": box}, "give first row, last row") for box in BOXES),
        *(({name: SMALLER}, "give one bool for each") for name in ("closed", "enterable")),
    ],
)
def test_boxes_outside_the_map_and_cells_of_another_shape_are_refused(given, match):
    free = np.ones((6, 6), dtype=np.bool_)
    overlay = build_overlay(free, nested(free, [3]))
    with pytest.raises(InvalidValueError, match=match):
        overlay.update(np.ones((6, 6)), **given)


@pytest.mark.parametrize("sizes", [(4,), (4, 8), (4, 12, 24), (60,)])
def test_a_wall_that_falls_opens_a_way_and_rooms_behind_it(sizes):
    """A corridor in the middle; a door above it leads to a room as large as all fields were."""
    free = np.zeros((40, 60), dtype=np.bool_)
    free[20:23] = True
    factor = 1 + np.random.default_rng(0).random((40, 60))
    overlay = build_overlay(free, nested(free, sizes), factor, top_bytes=1e9)
    search = OverlaySearch(overlay, near_cells=0)
    assert search.path((5, 50), (21, 3)).cells is None
    known = free.copy()
    free[3:18, 5:55] = True
    free[18:20, 9:11] = True
    overlay.update(factor, enterable=free, changed=(3, 20, 5, 55))
    for _ in range(2):
        judge = WeightedJudge(free, factor)
        for start, goal in [((5, 50), (21, 3)), ((21, 58), (17, 5)), ((3, 5), (4, 54))]:
            judge.check(search.path(start, goal), start, goal)
        overlay.renew()
        assert overlay.is_current
    overlay.update(factor, enterable=known, changed=(18, 20, 9, 11))
    assert search.path((5, 50), (21, 3)).cells is None
    overlay.update(factor, changed=(18, 20, 9, 11))
    assert search.path((5, 50), (21, 3)).cells is None


def test_an_overlay_without_a_field_cannot_grow():
    walls = np.zeros((6, 6), dtype=np.bool_)
    overlay = build_overlay(walls, nested(walls, [3]))
    with pytest.raises(InvalidValueError, match="built without a free cell: build another one"):
        overlay.update(np.ones((6, 6)), enterable=~walls)


def test_a_change_of_nothing_leaves_the_tables_as_they_are():
    free = np.ones((6, 6), dtype=np.bool_)
    overlay = build_overlay(free, nested(free, [3, 6]))
    overlay.update(np.ones((6, 6)))
    assert overlay.is_current
    assert overlay.version == 0
