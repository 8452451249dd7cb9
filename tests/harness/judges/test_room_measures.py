"""Measures of found rooms that can be set beside published ones."""

import math

import numpy as np
import pytest

from hybridnav.harness.judges import compare_rooms


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
