"""Two runs side by side: what changed for each method on each map, and whether by chance."""

import math
from typing import NamedTuple

import numpy as np

from hybridnav._base.typing import FloatArray, PathLike
from hybridnav.errors import InvalidValueError
from hybridnav.harness.analysis import Study, load_study
from hybridnav.harness.judges import paired_difference
from hybridnav.harness.names import REFERENCE
from hybridnav.harness.outcome import Outcome, loss_of, nanmean
from hybridnav.harness.records import query_key
from hybridnav.harness.tables import Row
from hybridnav.harness.yardstick import OPTIMA, Optimum, Yardstick


class _Sample(NamedTuple):
    """Pairs that two methods were asked, on one map or all."""

    losses: FloatArray
    others: FloatArray
    """Losses of the second method."""
    seconds: FloatArray
    other_seconds: FloatArray


def compare_runs(first: PathLike, second: PathLike, *, metric: Yardstick = "both") -> list[Row]:
    """Compare the methods that two runs have in common, on the maps and pairs that they share.

    Parameters
    ----------
    first, second
        Folders of two runs. Where each has a single method beside the reference, those two are
        compared even under different names.
    metric
        Reference of losses; see `load_study`. With "both", two methods of different metrics are
        compared with the shorter optimum of each pair, the any-angle one.

    Returns
    -------
    list of dict
        One row for each method and map, and one for all maps; "loss over" names the optimum, by
        which rows belong into different tables. Differences are second minus first. Those of the
        loss are percentage points with a 95 % bootstrap interval and the p-value of Wilcoxon's
        signed-rank test. The time has the median ratio, with the same test.

    Raises
    ------
    InvalidValueError
        When a run has no records, the two share no method, map and pair, or there is no such
        metric.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import compare_runs
    >>> rows = compare_runs(Path("run"), Path("run"))  # of the example of `write_records`
    >>> rows[0]["pairs"], rows[0]["difference, points"]
    (5, 0.0)
    """
    studies = _loaded(first, metric), _loaded(second, metric)
    rows: list[Row] = []
    for labels in _methods(*studies):
        samples: list[tuple[Optimum, _Sample]] = []
        for one in studies[0].of_method(labels[0]):
            for other in studies[1].of_method(labels[1]):
                if one.preparation["map_sha"] == other.preparation["map_sha"]:
                    sample = _paired(one, other)
                    if len(sample.losses):
                        over = _optimum(one, other)
                        rows.append(_row(labels, one.map_name, over, sample))
                        samples.append((over, sample))
        overs = {over for over, _ in samples}
        if len(samples) > 1 and len(overs) == 1:
            parts = zip(*(one for _, one in samples), strict=True)
            pooled = _Sample(*map(np.concatenate, parts))
            rows.append(_row(labels, "all maps", overs.pop(), pooled))
    if not rows:
        raise InvalidValueError(f"runs {first} and {second} share no method, map and pair")
    return rows


def _loaded(folder: PathLike, metric: Yardstick) -> Study:
    study = load_study(folder, metric=metric)
    if not study.outcomes:
        raise InvalidValueError(f"run {folder}: no records there")
    return study


def _methods(first: Study, second: Study) -> list[tuple[str, str]]:
    common = [label for label in first.labels if label in second.labels and label != REFERENCE]
    alone = [[label for label in study.labels if label != REFERENCE] for study in (first, second)]
    if not common and all(len(labels) == 1 for labels in alone):
        return [(alone[0][0], alone[1][0])]
    return [(label, label) for label in common]


def _paired(first: Outcome, second: Outcome) -> _Sample:
    """Return losses and seconds of the common pairs."""
    places = [
        {query_key(record): at for at, record in enumerate(outcome.references)}
        for outcome in (first, second)
    ]
    shared = [key for key in places[0] if key in places[1]]
    one, other = (np.array([place[key] for key in shared], dtype=np.int64) for place in places)
    best = np.minimum(first.best_m[one], second.best_m[other])
    losses = loss_of(first.judged_m[one], best), loss_of(second.judged_m[other], best)
    return _Sample(*losses, first.seconds[one], second.seconds[other])


def _optimum(first: Outcome, second: Outcome) -> Optimum:
    """Return what the losses of two outcomes refer to."""
    if first.yardstick != "both":
        return first.yardstick
    return "any-angle" if first.is_any_angle or second.is_any_angle else "octile"


def _row(labels: tuple[str, str], map_name: str, over: Optimum, sample: _Sample) -> Row:
    losses, others, seconds, other_seconds = sample
    loss = paired_difference(100 * others, 100 * losses)
    time = paired_difference(1e3 * other_seconds, 1e3 * seconds)
    solved = np.isfinite(losses), np.isfinite(others)
    ratio = other_seconds / seconds
    ratio = ratio[np.isfinite(ratio)]
    return {
        "method": labels[0] if labels[0] == labels[1] else f"{labels[1]} against {labels[0]}",
        "map": map_name,
        "loss over": OPTIMA[over],
        "pairs": len(losses),
        "solved by the first only": int((solved[0] & ~solved[1]).sum()),
        "solved by the second only": int((solved[1] & ~solved[0]).sum()),
        "loss of the first %": 100 * nanmean(losses),
        "loss of the second %": 100 * nanmean(others),
        "difference, points": loss.mean,
        "95 % interval": f"{loss.interval[0]:+.3f} to {loss.interval[1]:+.3f}",
        "p of the loss": loss.p_value,
        "time, second / first": float(np.median(ratio)) if ratio.size else math.nan,
        "p of the time": time.p_value,
    }
