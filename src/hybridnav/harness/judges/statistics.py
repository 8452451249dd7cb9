"""Losses summarised, bucketed by distance and compared, with bootstrap intervals. Public:
`PairedDifference`, `paired_difference` and `thrun_count`.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.cells import TOLERANCE

Interval = tuple[float, float]
_CHUNK = 2_000_000
"""Numbers drawn at a time."""


@dataclass(frozen=True)
class Summary:
    """Figures of a sample of losses; all but `n` are NaN for an empty one."""

    n: int
    mean: float
    median: float
    p95: float
    p99: float
    max: float
    share_without_loss: float
    """Share of losses <= 1e-9, in [0, 1]."""
    mean_interval: Interval
    """95 % bootstrap interval of the mean."""
    share_interval: Interval
    """95 % bootstrap interval of the share without loss."""


@dataclass(frozen=True)
class PairedDifference:
    """Difference of two methods on the same pairs."""

    n: int
    dropped: int
    """Pairs left out because one of the two values is not finite."""
    mean: float
    """Mean of first minus second; NaN without pairs."""
    interval: Interval
    """95 % bootstrap interval of the mean."""
    p_value: float
    """Two-sided Wilcoxon signed-rank test; 1 when no pair differs, NaN without pairs."""


@dataclass(frozen=True, eq=False)
class Buckets:
    """Pairs by distance."""

    labels: tuple[str, ...]
    """One label for each bucket, in increasing distance."""
    indices: LongArray
    """int64 (n,), the bucket of each pair, -1 where its distance is not finite."""


def summarise(losses: ArrayLike, *, seed: int = 0, resamples: int = 2000) -> Summary:
    """Summarise losses: centre, tail, share without loss, 95 % bootstrap intervals.

    Parameters
    ----------
    losses
        Finite numbers, any shape; path length / optimum - 1 for instance.
    seed
        Seed of the resampling: equal input has equal output.
    resamples
        Resamples of the bootstrap, >= 1. Time is proportional to resamples times losses.

    Returns
    -------
    Summary
        Percentiles interpolate linearly.

    Raises
    ------
    InvalidValueError
        When a loss is not finite or there are no resamples.

    Notes
    -----
    Percentile bootstrap: B. Efron: Bootstrap methods: another look at the jackknife, 1979.

    Examples
    --------
    >>> from hybridnav.harness.judges import summarise
    >>> summarise([0.0, 0.0, 0.04]).median
    0.0
    """
    values = np.asarray(losses, dtype=np.float64).ravel()
    if not np.isfinite(values).all():
        raise InvalidValueError("losses must be finite: leave out the pairs without a path")
    rng = np.random.default_rng(seed)
    _check_resamples(resamples)
    n = len(values)
    if not n:
        nan = math.nan
        return Summary(0, nan, nan, nan, nan, nan, nan, (nan, nan), (nan, nan))
    share = float((values <= TOLERANCE).mean())
    # The share of a resample is binomial, so it is drawn directly.
    shares = rng.binomial(n, share, size=resamples) / n
    return Summary(
        n=n,
        mean=float(values.mean()),
        median=float(np.median(values)),
        p95=float(np.percentile(values, 95)),
        p99=float(np.percentile(values, 99)),
        max=float(values.max()),
        share_without_loss=share,
        mean_interval=_interval_of_mean(values, rng, resamples),
        share_interval=_interval(shares),
    )


def paired_difference(
    first: ArrayLike, second: ArrayLike, *, seed: int = 0, resamples: int = 2000
) -> PairedDifference:
    """Compare two methods pair by pair.

    Parameters
    ----------
    first, second
        One number for each pair, shape (n,) each, in the same order. Pairs with a NaN or an
        infinite number are dropped and counted.
    seed
        Seed of the resampling: equal input has equal output.
    resamples
        Resamples of the bootstrap, >= 1.

    Returns
    -------
    PairedDifference
        First minus second. Differences up to 1e-9 are rounding: the test leaves them out like
        zeros.

    Raises
    ------
    InvalidValueError
        When the shapes differ or there are no resamples.

    Notes
    -----
    F. Wilcoxon: Individual comparisons by ranking methods, 1945.

    Examples
    --------
    >>> from hybridnav.harness.judges import paired_difference
    >>> paired_difference([1.0, 2.0, 3.0], [1.5, 2.5, 3.5]).mean
    -0.5
    """
    one, other = (np.asarray(values, dtype=np.float64) for values in (first, second))
    if one.shape != other.shape or one.ndim != 1:
        raise InvalidValueError(
            f"paired values must have one shape (n,), got {one.shape} and {other.shape}"
        )
    _check_resamples(resamples)
    usable = np.isfinite(one) & np.isfinite(other)
    difference = one[usable] - other[usable]
    n, dropped = len(difference), len(one) - len(difference)
    if not n:
        return PairedDifference(0, dropped, math.nan, (math.nan, math.nan), math.nan)
    changed = difference[np.abs(difference) > TOLERANCE]
    rng = np.random.default_rng(seed)
    return PairedDifference(
        n=n,
        dropped=dropped,
        mean=float(difference.mean()),
        interval=_interval_of_mean(difference, rng, resamples),
        p_value=float(stats.wilcoxon(changed).pvalue) if len(changed) else 1.0,
    )


def distance_buckets(optima_m: ArrayLike, *, edges: ArrayLike | None = None) -> Buckets:
    """Sort pairs into buckets by the length of their optimum.

    Parameters
    ----------
    optima_m
        Optimal lengths in metres, shape (n,); infinite or NaN for pairs without a path.
    edges
        Increasing finite distances in metres between the buckets. By default powers of two from 1 m
        to the last below the longest optimum. They are the same on every map, so that buckets can
        be compared.

    Returns
    -------
    Buckets
        One bucket more than edges: below the first, between two (the lower one included), from
        the last on. Some may be empty.

    Raises
    ------
    InvalidValueError
        When the edges are not increasing and finite, or there is none.

    Examples
    --------
    >>> from hybridnav.harness.judges import distance_buckets
    >>> distance_buckets([1.0, 2.0, 30.0], edges=[10.0]).indices
    array([0, 0, 1])
    """
    lengths = np.asarray(optima_m, dtype=np.float64).ravel()
    is_finite = np.isfinite(lengths)
    if edges is None:
        longest = float(lengths[is_finite].max(initial=1.0))
        mantissa, power = math.frexp(longest)
        cuts = np.ldexp(1.0, np.arange(max(power - (mantissa == 0.5), 1)))  # noqa: PLR2004
    else:
        cuts = np.asarray(edges, dtype=np.float64).ravel()
    if not len(cuts) or not np.isfinite(cuts).all() or (np.diff(cuts) <= 0).any():
        raise InvalidValueError(f"edges must be increasing finite distances, got {cuts.tolist()}")
    names = [f"{cut:g}" for cut in cuts]
    labels = (
        f"below {names[0]} m",
        *(f"{low} to {high} m" for low, high in pairwise(names)),
        f"{names[-1]} m and more",
    )
    indices = np.searchsorted(cuts, lengths, side="right")
    return Buckets(labels, np.where(is_finite, indices, -1).astype(np.int64))


def thrun_count(n_nodes: float, mean_plan_length: float) -> float:
    """Return the cost of planning in value-iteration backups: nodes times mean plan length.

    Parameters
    ----------
    n_nodes
        Nodes of the layer: cells or places.
    mean_plan_length
        Mean number of steps of a plan in it.

    Notes
    -----
    S. Thrun: Learning metric-topological maps for indoor mobile robot navigation, 1998.

    Examples
    --------
    >>> from hybridnav.harness.judges import thrun_count
    >>> thrun_count(200, 12.5)
    2500.0
    """
    return float(n_nodes) * float(mean_plan_length)


def _check_resamples(resamples: int) -> None:
    if resamples < 1:
        raise InvalidValueError(f"the bootstrap needs at least one resample, got {resamples}")


def _interval(values: FloatArray) -> Interval:
    low, high = np.percentile(values, [2.5, 97.5])
    return float(low), float(high)


def _interval_of_mean(values: FloatArray, rng: np.random.Generator, resamples: int) -> Interval:
    """Return the bootstrap interval of the mean, from a few resamples at a time to bound memory."""
    if np.ptp(values) == 0:
        return float(values[0]), float(values[0])
    batch = max(_CHUNK // len(values), 1)
    bootstrap = stats.bootstrap(
        (values,), np.mean, n_resamples=resamples, batch=batch, method="percentile", rng=rng
    )
    return float(bootstrap.confidence_interval.low), float(bootstrap.confidence_interval.high)
