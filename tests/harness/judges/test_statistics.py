"""Summaries of losses."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import distance_buckets, paired_difference, summarise, thrun_count

losses = st.lists(st.one_of(st.just(0.0), st.floats(0, 2)), min_size=1, max_size=60)


@given(losses)
def test_summary_is_what_its_words_say(values: list[float]) -> None:
    summary = summarise(values, resamples=50)
    assert summary.n == len(values)
    assert summary.mean == pytest.approx(math.fsum(values) / len(values))
    assert summary.median == pytest.approx(np.quantile(values, 0.5))
    assert summary.p95 == pytest.approx(np.quantile(values, 0.95))
    assert summary.p99 == pytest.approx(np.quantile(values, 0.99))
    assert summary.max == max(values)
    assert summary.share_without_loss == sum(v <= 1e-9 for v in values) / len(values)
    low, high = summary.mean_interval
    assert min(values) - 1e-12 <= low <= high <= max(values) + 1e-12
    low, high = summary.share_interval
    assert 0 <= low <= high <= 1


def test_equal_seeds_give_equal_intervals() -> None:
    values = np.random.default_rng(1).exponential(size=300)
    assert summarise(values, seed=3) == summarise(values, seed=3)
    assert summarise(values, seed=3) != summarise(values, seed=4)


def test_intervals_are_those_of_the_normal_law_on_a_large_sample() -> None:
    rng = np.random.default_rng(2)
    values = np.where(rng.random(4000) < 0.3, 0.0, rng.exponential(size=4000))
    summary = summarise(values)
    for interval, sample in (
        (summary.mean_interval, values),
        (summary.share_interval, values <= 1e-9),
    ):
        error = sample.std() / math.sqrt(4000)
        expected = sample.mean() - 1.96 * error, sample.mean() + 1.96 * error
        np.testing.assert_allclose(interval, expected, atol=0.2 * error)


def test_intervals_do_not_depend_on_how_many_resamples_fit_into_memory() -> None:
    values = np.random.default_rng(3).random(1_500_000)
    low, high = summarise(values, resamples=40).mean_interval
    assert high - low < 8 * values.std() / math.sqrt(len(values))
    assert low < values.mean() < high


def test_a_sample_without_loss_and_an_empty_one() -> None:
    perfect = summarise([0.0, 1e-12, -1e-12, 0.0])
    assert perfect.share_without_loss == 1
    assert perfect.share_interval == (1, 1)
    assert summarise([0.25] * 7).mean_interval == (0.25, 0.25)
    empty = summarise([])
    assert empty.n == 0
    assert math.isnan(empty.mean)
    assert math.isnan(empty.share_interval[0])


@pytest.mark.parametrize("values", [[math.nan], [0.1, math.inf]])
def test_losses_of_pairs_without_a_path_are_refused(values: list[float]) -> None:
    with pytest.raises(InvalidValueError, match="finite"):
        summarise(values)


def test_a_bootstrap_wants_resamples() -> None:
    with pytest.raises(InvalidValueError, match="at least one resample, got 0"):
        summarise([0.1], resamples=0)
    with pytest.raises(InvalidValueError, match="at least one resample, got 0"):
        paired_difference([0.1], [0.2], resamples=0)


def test_buckets_by_powers_of_two() -> None:
    buckets = distance_buckets([0.0, 0.99, 1.0, 3.9, 4.0, 20.0, math.inf, math.nan])
    assert buckets.labels == (
        "below 1 m", "1 to 2 m", "2 to 4 m", "4 to 8 m", "8 to 16 m", "16 m and more",
    )  # fmt: skip
    assert buckets.indices.tolist() == [0, 0, 1, 2, 3, 5, -1, -1]
    assert distance_buckets([]).labels == ("below 1 m", "1 m and more")
    assert distance_buckets([8.0]).indices.tolist() == [3]


def test_buckets_by_given_edges() -> None:
    buckets = distance_buckets([1.0, 2.5, 30.0], edges=[2.5, 10])
    assert buckets.labels == ("below 2.5 m", "2.5 to 10 m", "10 m and more")
    assert buckets.indices.tolist() == [0, 1, 2]


@pytest.mark.parametrize("edges", [[], [1, 1], [2, 1], [1, math.nan]])
def test_edges_must_increase(edges: Any) -> None:
    with pytest.raises(InvalidValueError, match="increasing"):
        distance_buckets([1.0], edges=edges)


@given(st.lists(st.floats(0.0, 1e9), min_size=1, max_size=30))
def test_every_known_distance_is_in_the_bucket_that_its_label_names(values: list[float]) -> None:
    buckets = distance_buckets(values)
    for value, index in zip(values, buckets.indices, strict=True):
        low = 0.0 if index == 0 else 2.0 ** (index - 1)
        high = math.inf if index == len(buckets.labels) - 1 else 2.0**index
        assert low <= value < high


def test_a_shift_is_found_and_its_sign_is_first_minus_second() -> None:
    rng = np.random.default_rng(5)
    base = rng.exponential(size=200)
    found = paired_difference(base + 0.1 + rng.normal(0, 0.05, 200), base)
    low, high = found.interval
    assert found.n == 200
    assert 0.08 < low < found.mean < high < 0.12
    assert found.p_value < 1e-12


def test_p_value_is_the_signed_rank_test_of_the_pairs_that_differ() -> None:
    rng = np.random.default_rng(6)
    first, second = rng.random((2, 80))
    second[:30] = first[:30] + 1e-12
    found = paired_difference(first, second)
    expected = stats.wilcoxon(first[30:], second[30:]).pvalue
    assert found.p_value == pytest.approx(float(expected), rel=1e-9)
    assert found.n == 80


def test_pairs_without_numbers_are_dropped_and_counted() -> None:
    found = paired_difference([1.0, math.nan, 3.0, math.inf], [1.0, 2.0, math.nan, math.inf])
    assert (found.n, found.dropped) == (1, 3)
    assert (found.mean, found.interval, found.p_value) == (0.0, (0.0, 0.0), 1.0)
    nothing = paired_difference([math.nan], [1.0])
    assert (nothing.n, nothing.dropped) == (0, 1)
    assert math.isnan(nothing.mean)
    assert math.isnan(nothing.p_value)


@pytest.mark.parametrize("n", [1, 2, 3, 14, 60])
def test_few_and_tied_differences_give_a_p_value_without_warnings(n: int) -> None:
    found = paired_difference(np.ones(n), np.zeros(n))
    assert found.mean == 1
    assert 0 < found.p_value <= 1


def test_unequal_shapes_are_refused() -> None:
    with pytest.raises(InvalidValueError, match=r"one shape \(n,\), got \(2,\) and \(1,\)"):
        paired_difference([1.0, 2.0], [1.0])


def test_thruns_count_is_a_product() -> None:
    assert thrun_count(67, 8.5) == 569.5
