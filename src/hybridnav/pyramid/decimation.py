"""Decimation of a combinatorial map by maximal independent edge sets, from the base to the apex, of
the whole map or inside a window.

Y. Haxhimusa, R. Glantz, M. Saib, G. Langs, W. G. Kropatsch: Logarithmic tapering graph pyramid,
DAGM 2002 (MIES); contraction and removal kernels after L. Brun, W. Kropatsch: Introduction to
combinatorial pyramids, 2001.

The ends of the edges inside a field, and of those between two fields, depend on the cells of these
fields alone: arcs are classes of cracks that blocks of two fields join, and self-loops are holes of
one field. So the record stays valid outside a set of fields that are dissolved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray
from hybridnav.pyramid import CombinatorialMap
from hybridnav.pyramid.contraction import NO_LIMIT, Decimation, Window
from hybridnav.pyramid.darts import Darts, Resists
from hybridnav.pyramid.kernels import decimation as _kernels
from hybridnav.pyramid.kernels import fields as _field_kernels
from hybridnav.pyramid.kernels.decimation import ATTRIBUTE_MAX, Vertices
from hybridnav.pyramid.level import Level
from hybridnav.pyramid.record import MAX_LEVELS, BuildStats, Linkage, Record
from hybridnav.pyramid.start import Start, kinds_of, parts_of, start_at_base, start_at_level

KERNEL = _kernels.select_stars
"""The kernel whose compiled form shows that a pyramid was built before."""

_LINKAGES: dict[Linkage, int] = {
    "throats": _kernels.RADIUS,
    "survivor": _kernels.SURVIVOR,
    "radius": _kernels.RADIUS,
    "diameter": _kernels.DIAMETER,
}

_ROUNDING = 1e-9


def squared_limit(merge_distance_m: float, resolution_m: float) -> int:
    """Return the least squared distance in cells that is not strictly below the merge distance."""
    ratio = merge_distance_m / resolution_m
    return math.ceil(min(ratio * ratio * (1 - _ROUNDING), NO_LIMIT))


def decimate(  # noqa: PLR0913 - each criterion of merging is an argument of its own
    classes: ByteArray,
    *,
    linkage: Linkage,
    limit: int,
    seed: int,
    rooms: IntArray | None = None,
    resistance: Resists | None = None,
) -> tuple[Record, BuildStats, CombinatorialMap]:
    """Contract stars level by level until no edge may be contracted.

    With the linkage "throats" the places are made in two rounds, first inside the fine parts of the
    map, then inside its parts (see `start.parts_of`).

    With rooms there are no parts, and three rounds: below the limit and inside rooms, which makes
    the places; inside rooms without a limit, which makes the rooms; and without rooms. With a
    resistance there are none either, and the last round ends when every arc resists; the labels
    that it keeps apart, if any, stand for rooms.

    `classes`: uint8 `CellClass`, shape `(rows, cols)`; `linkage`: the distance that stays below the
    limit; `limit`: see `squared_limit`; `seed`: breaks ties between edges of equal attribute;
    `rooms`: int32, label of each cell's room, -1 for none; same shape; `resistance`: the rule by
    which arcs resist above the places. Returns all levels, and their sizes. The darts of the
    places: from the record they take longer than a build.
    """
    labels = rooms if resistance is None else resistance.kept_apart
    began = clock()
    parts = None
    if linkage == "throats" and rooms is None and resistance is None:
        parts = parts_of(classes, limit)
    parted = clock()
    if parts is not None:
        start, part_of = start_at_base(parts.kinds, limit), parts.part_of
    else:
        start = start_at_base(classes if labels is None else kinds_of(classes, labels), limit)
    run = Decimation(start, seed, _LINKAGES[linkage], limit)
    run.stats.seconds |= {"parts": parted - began, "base": clock() - parted}
    if parts is not None:
        del parts  # three bytes a cell
        run.contract_all()
        run.rename_rooms(part_of)
    run.exhaust()
    places = run.plane_map()
    if labels is not None:
        run.lift_limit()
        run.exhaust()
        run.forget_rooms()
    if resistance is not None:
        run.lift_limit()
        run.steer(resistance.steering(run.field_of(), run.n_vertices))
    if labels is not None or resistance is not None:
        run.exhaust()
    run.finish()
    return run.record, run.stats, places


def go_on_above(  # noqa: PLR0913 - what a pyramid is made of
    places: Level,
    record: Record,
    stats: BuildStats,
    *,
    most_cells: int,
    seed: int,
    rooms: IntArray | None = None,
) -> tuple[Record, BuildStats]:
    """Contract the arcs of the place level in the order of the expansion rating, up to the apex.

    There are two rounds: up to a number of cells a field, which makes the regions, and without such
    a limit. With rooms the first two stay inside them, and a third one forgets them.

    `places`: the level to start at; `record`, `stats`: those of its pyramid, which stay as they
    are; `most_cells`: most cells of a region; `seed`: breaks ties between arcs of equal rating;
    `rooms`: int32, label of each cell's room, -1 for none. Up to the level of the places
    they describe the same levels.
    """
    classes = places.grid.classes
    kinds = classes if rooms is None else kinds_of(classes, rooms)
    run = Decimation(start_at_level(places, record, kinds), seed)
    run.recall(stats)
    expansion = Expansion(places, most_cells)
    run.steer(expansion)
    run.exhaust()
    expansion.lift_limit()
    run.exhaust()
    if rooms is not None:
        run.forget_rooms()
        run.exhaust()
    run.finish()
    return run.record, run.stats


# The expansion rating: the steering by which regions grow out of places.
#
# M. Holtgrewe, P. Sanders, C. Schulz: Engineering a scalable high quality graph partitioner, IPDPS
# 2010, where the rating of an edge is its squared weight over the product of the weights of its
# endpoints.

_PATIENCE = 32
"""Levels of a round at which arcs wait for better ones; real maps need 10."""
_ANY_SIZE = 2**62


class Expansion:
    """A steering by the expansion rating; see `Steering`.

    The rating of an arc is the squared length of what two fields have in common, over the product
    of their areas. The length is that of all arcs between the two, in cracks: merging two fields
    takes all of them away. An arc waits while another one at either of its endpoints is rated more
    than twice as high, so that the order is nearly that of one contraction at a time.

    `places`: the level to start from, whose arcs and fields are measured; `most_cells`: most cells
    of a field.
    """

    def __init__(self, places: Level, most_cells: int) -> None:
        plain = ~places.is_self_loop
        self._areas = places.areas
        self._most_cells = most_cells
        self._levels = 0
        self._keys, self._lengths = self._joined(places.arcs[plain], places.n_cracks[plain])
        self._ratings = np.empty(0)

    def lift_limit(self) -> None:
        """Let fields grow to any size."""
        self._most_cells = _ANY_SIZE
        self._levels = 0

    def candidates(
        self, _field_of: Callable[[], IntArray], darts: Darts, vertices: Vertices
    ) -> tuple[LongArray, LongArray]:
        """Return the arcs that no better one keeps waiting, the greatest rating first."""
        endpoints = darts.origin.reshape(-1, 2)
        u, v = endpoints.T
        kinds, areas = vertices.classes, self._areas
        may = (u != v) & (kinds[u] == kinds[v]) & (areas[u] + areas[v] <= self._most_cells)
        ratings = self._ratings = np.zeros(len(endpoints))
        ratings[may] = self._rated(endpoints[may])
        best = np.zeros(len(areas))
        np.maximum.at(best, endpoints, ratings[:, None])
        self._levels += 1
        share = 0.5 if self._levels <= _PATIENCE else 0.0
        arcs = np.flatnonzero(may & (ratings >= share * best[endpoints].max(axis=1, initial=0.0)))
        _, rank = np.unique(-ratings[arcs], return_inverse=True)
        return arcs, rank * ATTRIBUTE_MAX // max(int(rank.max(initial=0)), ATTRIBUTE_MAX)

    def refuse_leaves(self, parent: IntArray, kernel_dart: IntArray) -> None:
        """Undo the joins of stars that would make a field too large."""
        leaves = np.flatnonzero(kernel_dart >= 0)
        leaves = leaves[np.argsort(-self._ratings[kernel_dart[leaves] >> 1], kind="stable")]
        _kernels.refuse_large_leaves(leaves, parent, kernel_dart, self._areas, self._most_cells)

    def merge(self, merged_into: IntArray, n_vertices: int) -> None:
        """Add up the areas of the fields, and the boundaries between them."""
        endpoints = merged_into[np.stack(np.divmod(self._keys, len(self._areas)), axis=1)]
        apart = endpoints[:, 0] != endpoints[:, 1]
        areas = np.zeros(n_vertices, dtype=np.int64)
        np.add.at(areas, merged_into, self._areas)
        self._areas = areas
        self._keys, self._lengths = self._joined(endpoints[apart], self._lengths[apart])

    def _rated(self, endpoints: IntArray) -> FloatArray:
        """Return the rating of arcs, int32 (n, 2), between different fields."""
        at = np.searchsorted(self._keys, self._keys_of(endpoints))
        area = self._areas[endpoints].astype(np.float64)
        return self._lengths[at] ** 2 / (area[:, 0] * area[:, 1])

    def _joined(self, endpoints: IntArray, lengths: LongArray) -> tuple[LongArray, LongArray]:
        """Return the pairs of fields that have boundaries, and the length of all of each pair."""
        keys, of_key = np.unique(self._keys_of(endpoints), return_inverse=True)
        total = np.zeros(len(keys), dtype=np.int64)
        np.add.at(total, of_key, lengths)
        return keys, total

    def _keys_of(self, endpoints: IntArray) -> LongArray:
        """Return one number for each pair of vertices, in either order."""
        low, high = np.sort(endpoints.astype(np.int64), axis=1).T
        return low * len(self._areas) + high


class Criterion(NamedTuple):
    """What decides whether two fields merge."""

    linkage: Linkage
    """The distance that stays below the limit."""
    limit: int
    """See `decimation.squared_limit`."""
    seed: int
    """Breaks ties."""


class Fields(NamedTuple):
    """The fields of a window after its decimation."""

    field_of: IntArray
    """int32 (rows, cols), the field of each cell, -1 for none."""
    survivors: LongArray
    """int64 (n,), flat surviving cell of each field, ascending."""
    areas: LongArray
    """int64 (n,), cells of each field."""
    boxes: IntArray
    """int32 (n, 4), as `Level.boxes`."""


def contract_places(
    places: IntArray, survivors: BoolArray, criterion: Criterion, *, window: Window | None = None
) -> Record:
    """Contract each of some places to its surviving cell, and return all levels, flat.

    `places`: int32 (rows, cols), the place of each cell that starts as a vertex of the base, from
    1; 0 elsewhere; `survivors`: bool (rows, cols), the cell of each place that survives. The
    linkage is "radius", and no cell is too far from that of its place. `criterion`: when two fields
    merge; `window`: where on a larger map they lie, to be contracted as there; None for the whole.
    """
    in_blocks = np.where(survivors, np.int32(0), places)
    places.flags.writeable = in_blocks.flags.writeable = False
    start = start_at_base(places, criterion.limit, in_blocks=in_blocks)
    return _contract_within(start, criterion, survivors.ravel(), window)


def contract_alone(classes: ByteArray, criterion: Criterion) -> Fields:
    """Contract cells until no edge between two of them may be contracted.

    `classes`: uint8 (rows, cols), `CellClass`; what is 0 counts as no vertex; `criterion`: when two
    fields merge.
    """
    classes.flags.writeable = False  # as the classes of a grid are: another type compiles anew
    record = _contract_within(start_at_base(classes, criterion.limit), criterion, None)
    field_of, survivors, areas, boxes = _fields(record, classes.shape[1])
    return Fields(field_of.reshape(classes.shape), survivors, areas, boxes)


def _contract_within(
    start: Start, criterion: Criterion, survivors: BoolArray | None, window: Window | None = None
) -> Record:
    """Contract stars from a start until no edge may be contracted, and return its record.

    `survivors`: bool by flat cell, cells that survive whatever they merge with; at most one of each
    kind.
    """
    linkage, limit, seed = criterion
    run = Decimation(start, seed, _LINKAGES[linkage], limit, window)
    run.survivors = survivors
    run.exhaust()
    return start.record


def _fields(record: Record, cols: int) -> tuple[IntArray, LongArray, LongArray, IntArray]:
    field_of, survivors = _field_kernels.label_fields(
        record.vertex_end, record.vertex_parent, MAX_LEVELS
    )
    areas, boxes = _field_kernels.field_extents(field_of, cols, len(survivors))
    return field_of, survivors, areas, boxes
