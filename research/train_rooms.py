"""Train the judge of rooms on the reference data, and write its table.

The table `src/hybridnav/rooms/room_judge.npz` is made from all buildings; the figures of
the documentation are of forests that never saw the building's site (`without`). With `--generated`
it is made from generated floors alone.
"""

import copy
import math
from argparse import Namespace
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy import ndimage

import hybridnav as hn
from benchmarks.options import DATA, Refused, option
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.rooms import merging
from hybridnav.rooms.cutting import Ground, fine_segments, least_cells
from hybridnav.rooms.find import KINDS, LEAST_LIKELY, SPECK_M2, outside_of
from hybridnav.rooms.merging import (
    EVIDENCE,
    Forest,
    JudgedSegments,
    Likely,
    Small,
    merge,
)
from research._rooms_boost import Boosting, Examples, averaged, boost
from research._rooms_buildings import SITES, Building
from research._rooms_generated import generated

VIEWS = ((0.0, 1.0), (17.0, 1.15), (0.0, 0.85))
"""Each building is seen turned by these degrees and scaled by these factors."""
SEEDS = (0, 1, 2)
RISING = (
    *("open_share", "open_of_small_rim", "open_of_large_rim", "solid_both", "solid_gain"),
    *("passage_of_lower", "passage_of_higher", "open_of_small_breadth", "open_of_large_breadth"),
    *("covered", "flush_low"),
)
"""Evidence that may only speak for one room."""
FALLING = ("jamb_low", "jamb_high", "walled")
"""Evidence that may only speak against it."""
_LEAST_LABELLED = 0.3
_LEAST_WEIGHT = 0.3
"""Weight of pairs of which a segment lies half in another room, against pairs without a doubt."""
_BY_SIZE = 1.5


@dataclass(eq=False)
class View:
    """Segments of a building, as it is seen once."""

    segments: JudgedSegments
    cells: FloatArray
    """float64 (n_segments, n_rooms), cells of each segment in each true room."""
    resolution_m: float


@dataclass
class Records:
    """Pairs that were met while segments merged, an array for each time that some were judged."""

    evidence: list[FloatArray]
    same: list[FloatArray]
    weights: list[FloatArray]


def view_of(building: Building, degrees: float, scale: float) -> View:
    """Cut a building that is turned and scaled."""
    grid = building.grid
    true = np.where(building.compared, building.true, -1)
    if degrees:
        levels = {hn.CellClass.FREE: 0.0, hn.CellClass.OCCUPIED: 1.0}
        plain = np.full(grid.shape, 0.5, dtype=np.float32)
        for level, probability in levels.items():
            plain[grid.measured == level] = probability
        plain = ndimage.rotate(plain, degrees, order=0, cval=0.5, prefilter=False)
        true = ndimage.rotate(true, degrees, order=0, cval=-1, prefilter=False)
        grid = hn.OccupancyGrid(plain, hn.Frame(grid.resolution_m), robot_radius_m=0)
    free = (grid.measured == hn.CellClass.FREE) & ~outside_of(grid)
    ground = Ground.of(KINDS[grid.measured] + free, grid.resolution_m)
    ground = replace(ground, resolution_m=ground.resolution_m * scale)
    label_of = fine_segments(ground)
    segments = JudgedSegments(label_of, ground)
    dense = segments.label_of
    known = (dense >= 0) & (true >= 0)
    n_rooms = int(true.max()) + 1
    cells = np.bincount(
        dense[known].astype(np.int64) * n_rooms + true[known],
        minlength=segments.n_segments * n_rooms,
    ).reshape(-1, n_rooms)
    return View(segments, cells.astype(np.float64), ground.resolution_m)


def met(view: View, forest: Forest | None) -> Records:
    """Record the pairs that a forest meets, or one who knows the rooms."""
    segments = copy.deepcopy(view.segments)
    records = Records([], [], [])

    def judge(pairs: LongArray, evidence: FloatArray) -> FloatArray:
        same, weights = _true_labels(view, segments, pairs)
        known = weights > 0
        records.evidence.append(evidence[known])
        records.same.append(same[known])
        records.weights.append(weights[known])
        if forest is not None:
            return forest.judge(pairs, evidence)
        opened = np.minimum(1.0, segments.state.open_sides[pairs] / 100)
        return np.where(known, same * (0.6 + 0.4 * opened), 0.0)

    specks = Small(least_cells(SPECK_M2, view.resolution_m**2))
    merge(segments, [specks, Likely(judge, LEAST_LIKELY)])
    return records


def _true_labels(
    view: View, segments: JudgedSegments, pairs: LongArray
) -> tuple[FloatArray, FloatArray]:
    """Whether both segments of each pair lie in one room, and the weight, 0 where people drew
    none."""
    cells = np.zeros_like(view.cells)
    np.add.at(cells, segments.owner_of, view.cells)
    ends = segments.state.endpoints[pairs]
    sizes, known = segments.state.free[ends], np.maximum(cells[ends].sum(axis=2), 1e-9)
    rooms, purest = cells[ends].argmax(axis=2), (cells[ends].max(axis=2) / known).min(axis=1)
    weights = np.maximum(_LEAST_WEIGHT, 2 * purest - 1) * np.sqrt(sizes.min(axis=1))
    drawn = (known >= _LEAST_LABELLED * sizes).all(axis=1)
    same = (rooms[:, 0] == rooms[:, 1]).astype(np.float64)
    return same, np.where(drawn, weights * view.resolution_m, 0.0)


def fitted(records: dict[str, list[Records]], site_of: dict[str, str]) -> Forest:
    """Train on the records of some buildings; each site counts by the root of its weight."""
    totals: dict[str, float] = {}
    for name, found in records.items():
        total = sum(float(weights.sum()) for record in found for weights in record.weights)
        totals[site_of[name]] = totals.get(site_of[name], 0.0) + total
    every = [record for found in records.values() for record in found]
    weight = np.concatenate(
        [
            weights**_BY_SIZE / math.sqrt(totals[site_of[name]])
            for name, found in records.items()
            for record in found
            for weights in record.weights
        ]
    )
    signs = np.array([(name in RISING) - (name in FALLING) for name in EVIDENCE])
    evidence = np.concatenate([rows for record in every for rows in record.evidence])
    same = np.concatenate([each for record in every for each in record.same])
    examples = Examples(evidence, same, weight / weight.mean())
    return averaged([boost(examples, signs, settings=Boosting(), seed=seed) for seed in SEEDS])


class Training:
    """Views of all buildings, and what was met in them."""

    def __init__(
        self, buildings: list[Building], views: tuple[tuple[float, float], ...] = VIEWS
    ) -> None:
        self._views = {b.name: [view_of(b, *view) for view in views] for b in buildings}
        self._site_of = {b.name: b.site for b in buildings}
        self._known = {
            name: [met(view, None) for view in views] for name, views in self._views.items()
        }

    @cache  # noqa: B019 - one object, for the run of a script
    def without(self, site: str | None) -> Forest:
        """Train a forest on the buildings of other sites: on pairs met by one who knows the rooms,
        then also on those that the forest itself meets."""
        records = {n: list(r) for n, r in self._known.items() if self._site_of[n] != site}
        first = fitted(records, self._site_of)
        for name, found in records.items():
            found.extend(met(view, first) for view in self._views[name])
        return fitted(records, self._site_of)


def of_generated(count: int) -> Training:
    """Return the training on generated floors, the seeds from 0 on, as they are."""
    return Training([generated(seed) for seed in range(count)], VIEWS[:1])


OPTIONS = [
    DATA,
    option("--generated", type=int, default=0, metavar="N", help="N generated floors, no data"),
    option("-o", "--out", default=Path(merging.__file__).with_name(merging.TABLE), type=Path),
]


def main(given: Namespace) -> None:
    """Read the command line, train and write the table."""
    if given.data is None and not given.generated:
        raise Refused("train_rooms needs the reference data, or --generated N")
    if given.generated:
        training = of_generated(given.generated)
    else:
        training = Training([Building.read(given.data, name) for name in SITES])
    forest = training.without(None)
    np.savez_compressed(
        given.out,
        features=forest.features.astype(np.int16),
        thresholds=forest.thresholds,
        leaves=forest.leaves,
        base=forest.base,
    )
    print(f"{len(forest.features)} trees in {given.out}")
