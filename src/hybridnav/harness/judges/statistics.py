"""Losses summarised, bucketed by distance and compared, with bootstrap intervals; the agreement of
found rooms with true ones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats
from scipy.optimize import linear_sum_assignment

from hybridnav.errors import InvalidValueError
from hybridnav.maps.cells import TOLERANCE

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray


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
    """Pairs compared."""
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
    known = np.isfinite(lengths)
    if edges is None:
        longest = float(lengths[known].max(initial=1.0))
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
    return Buckets(labels, np.where(known, indices, -1).astype(np.int64))


def thrun_count(n_nodes: float, mean_plan_length: float) -> float:
    """Return the cost of planning in value-iteration backups: nodes times mean plan length.

    Parameters
    ----------
    n_nodes
        Nodes of the layer: cells or places.
    mean_plan_length
        Mean number of steps of a plan in it.

    Returns
    -------
    float
        The product.

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
    found = stats.bootstrap(
        (values,), np.mean, n_resamples=resamples, batch=batch, method="percentile", rng=rng
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


@dataclass(frozen=True, eq=False)
class RoomAgreement:
    """Agreement of found rooms with true ones, each with at most one partner."""

    true_labels: LongArray
    """Labels of the true rooms that were compared, ascending."""
    partners: LongArray
    """The found label that is the partner of each true room, -1 for none."""
    precision: FloatArray
    """Share of the partner's cells that lie in the true room; 0 without a partner."""
    recall: FloatArray
    """Share of the true room's cells that lie in the partner; 0 without one."""
    mcc: float
    """Matthews correlation over all cells and rooms, from -1 to 1; NaN if either side is one single
    room."""
    mcc_per_zone: float
    """Mean of the binary Matthews correlations of single rooms, from -1 to 1, as MAORIS measures
    it."""
    iou: FloatArray
    """Greatest intersection over union of each true room with any found one."""
    n_found: int
    """Number of found rooms with compared cells."""

    def recall_at(self, iou: float) -> float:
        """Return the share of true rooms that a found room meets with at least this intersection
        over union, in [0, 1]."""
        return float((self.iou >= iou).mean())


def compare_rooms(true: AnyArray, found: AnyArray) -> RoomAgreement:
    """Compare found rooms with true ones, cell by cell.

    Partners are chosen one to one so that most cells agree; a split room counts with its largest
    part alone, and the other parts are classes of their own. For the coefficient for many classes
    see J. Gorodkin: Comparing two K-category assignments by a K-category correlation coefficient,
    2004. For the one of single rooms see `mcc_per_zone`.

    Parameters
    ----------
    true, found
        Integer labels of the same cells, shape (n,), n >= 1; -1 in `found` for no room.

    Returns
    -------
    RoomAgreement
        Precision and recall of each true room, and the coefficient.

    Raises
    ------
    InvalidValueError
        When the shapes differ or there are no cells.

    Examples
    --------
    >>> from hybridnav.harness.judges import compare_rooms
    >>> compare_rooms(np.array([0, 0, 0, 1]), np.array([5, 5, 6, 6])).partners
    array([5, 6])
    """
    if true.shape != found.shape or true.ndim != 1 or len(true) == 0:
        raise InvalidValueError(
            f"expected labels of the same cells, got shapes {true.shape} and {found.shape}"
        )
    true_labels, row = np.unique(true, return_inverse=True)
    found_labels, col = np.unique(found, return_inverse=True)
    cells = np.zeros((len(true_labels), len(found_labels)))
    np.add.at(cells, (row, col), 1)
    # "No room" is never a partner.
    wanted = np.where(found_labels[None, :] < 0, -1.0, cells)
    rows, cols = linear_sum_assignment(-wanted)
    real = wanted[rows, cols] > 0
    rows, cols = rows[real], cols[real]
    of_true, of_found = cells.sum(axis=1), cells.sum(axis=0)
    agree = cells[rows, cols]
    partners = np.full(len(true_labels), -1, dtype=np.int64)
    partners[rows] = found_labels[cols]
    precision, recall = np.zeros(len(true_labels)), np.zeros(len(true_labels))
    precision[rows] = agree / of_found[cols]
    recall[rows] = agree / of_true[rows]
    n = float(len(true))
    covariance = agree.sum() * n - (of_true[rows] * of_found[cols]).sum()
    spread = math.sqrt(n * n - (of_true**2).sum()) * math.sqrt(n * n - (of_found**2).sum())
    return RoomAgreement(
        true_labels.astype(np.int64),
        partners,
        precision,
        recall,
        float(covariance / spread) if spread > 0 else math.nan,
        mcc_per_zone(cells[:, found_labels >= 0]),
        _best_iou(cells, found_labels >= 0),
        int((found_labels >= 0).sum()),
    )


def mcc_per_zone(cells: FloatArray) -> float:
    """Return the mean of the binary Matthews correlations of single rooms.

    Found rooms choose partners greedily, the one with the largest overlap first, each the free true
    room that it overlaps most. A room of either side without a partner counts 0. See M. Mielle, M.
    Magnusson, A. J. Lilienthal: A method to segment maps from different modalities using free space
    layout: MAORIS, ICRA 2018. Their published program differs in three points, which are mended
    here: it counts the true negatives as n - fp + tp + fn instead of n - tp - fp - fn, it lets a
    found room whose true rooms are all taken share the last of them, and it counts a true room
    without a partner once for each found room that touches it.

    `cells`: float64 (n_true, n_found), number of cells in each pair of rooms, n_true >= 1. Result:
    from -1 to 1; 0 when no room was found.
    """
    left = cells.copy()
    total, n_partners, n = 0.0, 0, cells.sum()
    of_true, of_found = cells.sum(axis=1), cells.sum(axis=0)
    for col in np.argsort(-cells.max(axis=0), kind="stable").tolist():
        row = int(left[:, col].argmax())
        tp = left[row, col]
        if tp == 0:
            continue
        left[row] = 0
        n_partners += 1
        fp, fn = of_found[col] - tp, of_true[row] - tp
        tn = n - tp - fp - fn
        spread = math.sqrt((tp + fp) * (tp + fn) * (tn + fp) * (tn + fn))
        total += (tp * tn - fp * fn) / spread if spread > 0 else float(fp == fn == 0)
    return float(total / (sum(cells.shape) - n_partners))


def _best_iou(cells: FloatArray, is_room: BoolArray) -> FloatArray:
    """Return the greatest intersection over union of each row with any column that is a room."""
    union = cells.sum(axis=1)[:, None] + cells.sum(axis=0) - cells
    return np.where(is_room, cells / union, 0.0).max(axis=1)
