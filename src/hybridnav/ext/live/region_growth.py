"""Regions that grow out of places beside regions that stay whole."""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.ext.live.kernels import rings as _ring_kernels
from hybridnav.ext.live.tiles import Box

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from hybridnav._base.typing import LongArray
    from hybridnav.ext.live.state import State


class Touched(NamedTuple):
    """How many changed cells were in one place and are in another."""

    old: LongArray
    """int64 (n,), places before, -1 for none."""
    new: LongArray
    """int64 (n,), places now, -1 for none."""
    cells: LongArray
    """int64 (n,), cells of each pair."""


def touched_between(before: State, after: State) -> Touched:
    """Return the places of the cells that differ between two versions, in place or in class.

    Tiles that the versions share are not looked at.
    """
    keys, count = np.empty(0, np.int64), 0
    for one, other in after.tiles.differing_tiles(before.tiles):
        if count + one.place.size > len(keys):
            keys = np.concatenate([keys[:count], np.empty(count + 8 * one.place.size, np.int64)])
        count = _ring_kernels.touched_cells(one[:2], other[:2], keys, count)
    keys, cells = np.unique(keys[:count], return_counts=True)
    return Touched((keys >> 32) - 1, (keys & 0xFFFFFFFF) - 1, cells)


def lengths_between(state: State, places: Sequence[int]) -> dict[tuple[int, int], int]:
    """Return the length of what places have in common with each other and with those beside them.

    Parameters
    ----------
    state
        The version.
    places
        Places, ascending.

    Returns
    -------
    dict
        Cracks by pair of places, of one class, the lesser number first.
    """
    numbers = np.asarray(places, np.int64)
    boxes = state.places.read(numbers)["box"].astype(np.int64)
    group_of = _ring_kernels.box_groups(boxes)
    found: dict[tuple[int, int], int] = {}
    for group in np.unique(group_of).tolist():
        box = Box(*boxes[group].tolist()).widened(1)
        place, of_class = state.tiles.planes(box)
        is_one = _ring_kernels.index_in(place, numbers[group_of == group])
        keys, cracks = np.unique(
            _ring_kernels.cracks_of(place, of_class, is_one), return_counts=True
        )
        pairs = zip((keys >> 32).tolist(), (keys & 0xFFFFFFFF).tolist(), strict=True)
        found.update(zip(pairs, cracks.tolist(), strict=True))
    return found


def held_together(
    areas: Mapping[int, int],
    lengths: Mapping[tuple[int, int], int],
    region_of: Mapping[int, int],
    most_cells: int,
) -> dict[int, int]:
    """Return the vertex of each place: those of an old region are one as far as they still may be.

    They are if they connect to each other, without other places, and are not too large.

    Parameters
    ----------
    areas
        Cells of each place.
    lengths
        Pairs of places of one class with cracks in common.
    region_of
        The old region of places; new ones have none.
    most_cells
        Most cells of a region of several places.

    Returns
    -------
    dict
        The least place of the vertex of each place.
    """
    inside: dict[int, list[int]] = {place: [] for place in areas}
    for one, other in lengths:
        if one in inside and other in inside and region_of.get(one, -1) == region_of.get(other, -2):
            inside[one].append(other)
            inside[other].append(one)
    vertex_of: dict[int, int] = {}
    for start in sorted(areas):
        if start in vertex_of:
            continue
        found, waiting = {start}, [start]
        while waiting:
            more = set(inside[waiting.pop()]) - found
            found |= more
            waiting += more
        is_one = sum(areas[place] for place in found) <= most_cells
        vertex_of.update((place, start if is_one else place) for place in found)
    return vertex_of


def grown(
    areas: Mapping[int, int], lengths: Mapping[tuple[int, int], int], most_cells: int
) -> list[list[int]]:
    """Merge vertices, the pair with the greatest expansion rating first, while it is not too large.

    The rating is the squared length of what two vertices have in common, over the product of their
    areas; see `Expansion`. Equal ones are taken in the order of numbers.

    Parameters
    ----------
    areas
        Cells of each vertex.
    lengths
        Cracks between two vertices.
    most_cells
        Most cells of two that merge.

    Returns
    -------
    list of list
        The vertices that are one now, each list ascending, by their first.
    """
    area, merged = dict(areas), {vertex: [vertex] for vertex in areas}
    beside: dict[int, dict[int, int]] = {vertex: {} for vertex in areas}
    for (one, other), length in lengths.items():
        beside[one][other] = beside[other][one] = length
    heap = _rated(area, beside, sorted(lengths), most_cells)
    heapq.heapify(heap)
    while heap:
        _, one, other, area_of_both, length = heapq.heappop(heap)
        is_now = one in merged and other in merged and beside[one].get(other) == length
        if not is_now or area[one] + area[other] != area_of_both:
            continue
        merged[one] += merged.pop(other)
        area[one] = area_of_both
        for third, more in beside.pop(other).items():
            del beside[third][other]
            if third != one:
                beside[one][third] = beside[third][one] = beside[one].get(third, 0) + more
        pairs = ((min(one, third), max(one, third)) for third in beside[one])
        for rated in _rated(area, beside, pairs, most_cells):
            heapq.heappush(heap, rated)
    return sorted(sorted(vertices) for vertices in merged.values())


def _rated(
    area: Mapping[int, int],
    beside: Mapping[int, Mapping[int, int]],
    pairs: Iterable[tuple[int, int]],
    most_cells: int,
) -> list[tuple[float, int, int, int, int]]:
    """Return pairs that may merge with what they are sorted by, their area and their length."""
    return [
        (-(length**2) / (area[one] * area[other]), one, other, area[one] + area[other], length)
        for one, other in pairs
        if area[one] + area[other] <= most_cells
        for length in (beside[one][other],)
    ]
