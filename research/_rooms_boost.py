"""Gradient boosting of small complete trees, for the judge of rooms."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.rooms.merging import Forest

_BINS = 48
_NONE = 255


@dataclass(frozen=True)
class Boosting:
    """Settings of the training."""

    trees: int = 60
    depth: int = 3
    rate: float = 0.1
    ridge: float = 10.0
    least: int = 100
    """Fewest examples on either side of a threshold."""
    columns: float = 0.4
    """Share of the evidence that each tree looks at."""
    rows: float = 0.7
    """Share of the examples that each tree looks at."""


@njit(cache=True)
def _grow(bins, same, weights, signs, shape, numbers, chosen):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, C901, PLR0912, PLR0913, PLR0915, PLR0917
    """Features, bins and leaves of trees; a sign makes the odds rise or fall with a feature."""
    trees, depth, least = shape
    rate, ridge = numbers
    rows, columns = chosen
    n = len(bins)
    inner, n_leaves = 2**depth - 1, 2**depth
    features = np.zeros((trees, inner), np.int64)
    cuts = np.full((trees, inner), _NONE, np.int64)
    leaves = np.zeros((trees, n_leaves))
    base = math.log((weights * same).sum() / (weights * (1 - same)).sum())
    odds = np.full(n, base)
    slope, bend = np.empty(n), np.empty(n)
    node = np.empty(n, np.int64)
    for tree in range(trees):
        for i in range(n):
            p = 1 / (1 + math.exp(-odds[i]))
            w = weights[i] * rows[tree, i]
            slope[i], bend[i] = w * (same[i] - p), w * p * (1 - p)
        low, high = np.full(2 * n_leaves, -1e9), np.full(2 * n_leaves, 1e9)
        node[:] = 0
        for level in range(depth):
            first, m = 2**level - 1, 2**level
            best, middle = np.zeros(m), np.zeros(m)
            for c in columns[tree]:
                g, h, k = np.zeros((m, _BINS)), np.zeros((m, _BINS)), np.zeros((m, _BINS))
                for i in range(n):
                    at, b = node[i] - first, bins[i, c]
                    g[at, b] += slope[i]
                    h[at, b] += bend[i]
                    k[at, b] += 1
                for at in range(m):
                    all_g, all_h, all_k = g[at].sum(), h[at].sum(), k[at].sum()
                    left_g = left_h = left_k = 0.0
                    q = first + at
                    for b in range(_BINS - 1):
                        left_g += g[at, b]
                        left_h += h[at, b]
                        left_k += k[at, b]
                        if left_k < least or all_k - left_k < least:
                            continue
                        right_g, right_h = all_g - left_g, all_h - left_h
                        left = min(max(left_g / (left_h + ridge), low[q]), high[q])
                        right = min(max(right_g / (right_h + ridge), low[q]), high[q])
                        if signs[c] * (right - left) < 0:
                            continue
                        gain = 2 * left_g * left - (left_h + ridge) * left * left
                        gain += 2 * right_g * right - (right_h + ridge) * right * right
                        gain -= all_g * all_g / (all_h + ridge)
                        if gain > best[at] + 1e-9:
                            best[at], middle[at] = gain, (left + right) / 2
                            features[tree, q], cuts[tree, q] = c, b
            for at in range(m):
                q = first + at
                a = 2 * q + 1
                low[a], high[a], low[a + 1], high[a + 1] = low[q], high[q], low[q], high[q]
                sign = signs[features[tree, q]] if cuts[tree, q] < _NONE else 0
                if sign > 0:
                    high[a] = low[a + 1] = middle[at]
                elif sign < 0:
                    low[a] = high[a + 1] = middle[at]
            for i in range(n):
                q = node[i]
                node[i] = 2 * q + 1 + (bins[i, features[tree, q]] > cuts[tree, q])
        g, h = np.zeros((1, n_leaves)), np.zeros((1, n_leaves))
        for i in range(n):
            g[0, node[i] - inner] += slope[i]
            h[0, node[i] - inner] += bend[i]
        for at in range(n_leaves):
            value = min(max(g[0, at] / (h[0, at] + ridge), low[inner + at]), high[inner + at])
            leaves[tree, at] = rate * value
        for i in range(n):
            odds[i] += leaves[tree, node[i] - inner]
    return features, cuts, leaves, base


class Examples(NamedTuple):
    """Pairs of segments to learn from."""

    evidence: FloatArray
    """float64 (n, m)."""
    same: FloatArray
    """float64 (n,), 1 for two segments of one room, 0 for others."""
    weights: FloatArray
    """float64 (n,), positive."""


def boost(examples: Examples, signs: LongArray, *, settings: Boosting, seed: int) -> Forest:
    """Train a forest on pairs of segments.

    Parameters
    ----------
    examples
        The pairs.
    signs
        int64 (m,), 1 where the odds may only rise with the evidence, -1 where they may only fall.
    settings
        Sizes and rates.
    seed
        Of the samples of rows and columns.
    """
    evidence, same, weights = examples
    steps = np.linspace(0, 1, _BINS)[1:-1]
    edges = [np.unique(np.quantile(column, steps)) for column in evidence.T]
    bins = np.stack(
        [np.searchsorted(e, column) for e, column in zip(edges, evidence.T, strict=True)], axis=1
    )
    random = np.random.default_rng(seed)
    n_columns = max(1, int(settings.columns * evidence.shape[1]))
    each = np.tile(np.arange(evidence.shape[1]), (settings.trees, 1))
    chosen = (
        random.random((settings.trees, len(same))) < settings.rows,
        random.permuted(each, axis=1)[:, :n_columns].copy(),
    )
    features, cuts, leaves, base = _grow(
        bins.astype(np.uint8),
        same,
        weights,
        signs,
        (settings.trees, settings.depth, settings.least),
        (settings.rate, settings.ridge),
        chosen,
    )
    thresholds = np.full(features.shape, np.inf)
    for at in np.argwhere(cuts < _NONE):
        tree, node = at
        thresholds[tree, node] = edges[features[tree, node]][cuts[tree, node]]
    return Forest(features, thresholds, leaves, float(base))


def averaged(forests: list[Forest]) -> Forest:
    """Return one forest whose log odds are the mean of those of several."""
    return Forest(
        np.concatenate([forest.features for forest in forests]),
        np.concatenate([forest.thresholds for forest in forests]),
        np.concatenate([forest.leaves for forest in forests]) / len(forests),
        float(np.mean([forest.base for forest in forests])),
    )
