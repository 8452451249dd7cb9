"""Measures of rooms that can be set beside published ones."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from research._rooms_agreement import compare_rooms
from tests.strategies import seeds


@given(true=st.lists(st.integers(0, 3), min_size=1, max_size=60), seed=seeds)
def test_agreement_is_full_for_equal_rooms_under_any_names(true, seed):
    labels = np.array(true)
    names = np.random.default_rng(seed).permutation(4) + 10
    agreed = compare_rooms(labels, names[labels])
    assert agreed.precision.tolist() == agreed.recall.tolist() == [1.0] * len(set(true))
    if len(set(true)) > 1:
        assert agreed.mcc == pytest.approx(1.0)
    else:
        assert math.isnan(agreed.mcc)


def test_agreement_of_two_rooms_is_the_binary_coefficient():
    true = np.array([0] * 50 + [1] * 30)
    found = np.array([5] * 40 + [7] * 10 + [7] * 25 + [5] * 5)
    tp, fn, tn, fp = 40, 10, 25, 5
    expected = (tp * tn - fp * fn) / math.sqrt((tp + fp) * (tp + fn) * (tn + fp) * (tn + fn))
    agreed = compare_rooms(true, found)
    assert agreed.mcc == pytest.approx(expected)
    assert agreed.precision.tolist() == pytest.approx([40 / 45, 25 / 35])
    assert agreed.recall.tolist() == pytest.approx([0.8, 25 / 30])


def test_no_room_is_nobodys_partner():
    agreed = compare_rooms(np.array([0, 0, 1, 1]), np.array([-1, -1, 4, 4]))
    assert agreed.partners.tolist() == [-1, 4]
    assert agreed.recall.tolist() == [0.0, 1.0]
    assert agreed.iou.tolist() == [0.0, 1.0]
    assert agreed.n_found == 1


def test_rooms_are_found_at_the_overlap_that_is_asked_for():
    true = np.array([0] * 60 + [1] * 40)
    agreed = compare_rooms(true, np.array([5] * 36 + [6] * 24 + [6] * 40))
    assert agreed.iou.tolist() == pytest.approx([0.6, 40 / 64])
    assert (agreed.recall_at(0.5), agreed.recall_at(0.61), agreed.recall_at(0.7)) == (1.0, 0.5, 0.0)


def test_the_measure_of_single_rooms_punishes_every_part_without_a_partner():
    true = np.array([0] * 60 + [1] * 40)
    assert compare_rooms(true, true).mcc_per_zone == pytest.approx(1.0)
    # The right room falls into two: the larger part is its partner, the other counts 0.
    found = np.array([5] * 60 + [6] * 30 + [7] * 10)
    tp, fp, fn, tn = 30, 0, 10, 60
    part = (tp * tn - fp * fn) / math.sqrt((tp + fp) * (tp + fn) * (tn + fp) * (tn + fn))
    assert compare_rooms(true, found).mcc_per_zone == pytest.approx((1 + part + 0) / 3)
    # One room for both: the smaller true room has no partner, and nothing correlates.
    assert compare_rooms(true, np.zeros(100, dtype=int)).mcc_per_zone == 0.0
    assert compare_rooms(true, np.full(100, -1)).mcc_per_zone == 0.0
