"""Which places of a new version are those of the old one."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.online import _tile_kernels
from hybridnav.online.tiles import NO_PLACE, Box

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from hybridnav._typing import LongArray
    from hybridnav.online.cellwise import CellDraft


Overlap = tuple[int, int, int]
"""An old place, a new one or -1 for none, and the cells that they have in common."""


class Events(NamedTuple):
    """What became of places; see `Update`."""

    born: tuple[int, ...]
    """New ones."""
    died: tuple[int, ...]
    """Old ones that are no more."""
    merged: dict[int, int]
    """Old ones and the heirs that bear another number."""
    split: dict[int, tuple[int, ...]]
    """Old ones, and several new ones that mostly consist of them."""
    changed: tuple[int, ...]
    """Old ones that bear their number still."""


class Heirs(NamedTuple):
    """The heirs of old places."""

    of: dict[int, int]
    """The heir of each old place that has one, by the number that it has in the draft."""
    name: dict[int, int]
    """The final number of each heir."""


def settle(draft: CellDraft) -> Events:
    """Give the places of a draft the numbers of old ones as far as these have heirs.

    The heir of an old place is the new one that holds more than half of its cells. An heir of
    several bears the number of the one with which it shares the most cells; the least number breaks
    ties. Most places bear their final numbers already.
    """
    first = draft.before.next_place
    moved = _moved(draft)
    seen = {place for overlap in moved for place in overlap[:2]} - {NO_PLACE}
    stay = areas = _areas_before(draft, {place for place in seen if place < first})
    lost: Counter[int] = Counter()
    for old, _, cells in moved:
        lost[old] += cells
    found = [overlap for overlap in moved if overlap[0] != NO_PLACE]
    found += [(old, old, area - lost[old]) for old, area in stay.items() if area > lost[old]]
    heirs = heirs_of(found, areas)
    name = dict(heirs.name)
    new = {place for _, place, _ in found} | set(draft.places.numbers(first))
    for place in sorted(new - name.keys() - {NO_PLACE}):
        name[place] = place
        if place < first:
            name[place] = draft.next_place
            draft.next_place += 1
    _renumber(draft, {place: final for place, final in name.items() if place != final})
    return events_of(found, Heirs(heirs.of, name), _areas_now(draft, name), first)


def _moved(draft: CellDraft) -> list[Overlap]:
    """Return the cells in common of places that differ; old places are -1 where there was none."""
    keys, count = np.empty(0, np.int64), 0
    for before, after in draft.tiles.changed(draft.before.tiles):
        if count + before.size > len(keys):
            keys = np.concatenate([keys[:count], np.empty(count + 8 * before.size, np.int64)])
        count = _tile_kernels.moved_cells(before, after, keys, count)
    keys, counts = np.unique(keys[:count], return_counts=True)
    old, new = (keys >> 32) - 1, (keys & 0xFFFFFFFF) - 1
    return [*zip(old.tolist(), new.tolist(), counts.tolist(), strict=True)]


def _areas_before(draft: CellDraft, places: Iterable[int]) -> dict[int, int]:
    """Return the cells that old places had."""
    numbers = sorted(places)
    areas = draft.before.places.read(numbers)["area"].tolist()
    return dict(zip(numbers, areas, strict=True))


def heirs_of(found: list[Overlap], areas: dict[int, int]) -> Heirs:
    """Return the heirs of old places, of which the cells that they had are given."""
    of, shared = {}, {}
    for old, new, cells in found:
        if 2 * cells > areas[old] and new != NO_PLACE:
            of[old], shared[old] = new, cells
    name: dict[int, int] = {}
    for old in sorted(of, key=lambda place: (-shared[place], place)):
        name.setdefault(of[old], old)
    return Heirs(of, name)


def events_of(
    found: list[Overlap], heirs: Heirs, areas_now: Mapping[int, int], first: int
) -> Events:
    """Return what became of places whose final numbers are known.

    Parameters
    ----------
    found
        What old places and new ones have in common.
    heirs
        The heirs, with the final numbers of all new places.
    areas_now
        The cells of each new place.
    first
        The least number that no old place has.
    """
    kept = set(heirs.name.values())
    old = sorted({place for place, _, _ in found})
    died = [place for place in old if place not in kept]
    split: dict[int, list[int]] = {}
    for place, new, cells in found:
        if new != NO_PLACE and 2 * cells > areas_now[new]:
            split.setdefault(place, []).append(heirs.name[new])
    return Events(
        tuple(sorted(place for place in kept if place >= first)),
        tuple(died),
        {place: heirs.name[heirs.of[place]] for place in died if place in heirs.of},
        {place: tuple(sorted(parts)) for place, parts in split.items() if len(parts) > 1},
        tuple(place for place in old if place in kept),
    )


def _areas_now(draft: CellDraft, name: Mapping[int, int]) -> dict[int, int]:
    """Return the cells of new places, by the numbers before they had final ones."""
    areas = draft.places.read([*name.values()])["area"].tolist()
    return dict(zip(name, areas, strict=True))


def _renumber(draft: CellDraft, name: dict[int, int]) -> None:
    """Write other numbers of places in place of some."""
    if not name:
        return
    rows = draft.places.read([*name])
    cells = []
    for number, final, box in zip(name, name.values(), rows["box"].tolist(), strict=True):
        place, of_class = draft.tiles.planes(Box(*box))
        row, col = at = (place == number).nonzero()
        finals: LongArray = np.full(len(row), final, np.int32)
        cells.append((row + box[0], col + box[1], finals, of_class[at]))
    draft.places.drop(name)
    draft.places.write([*name.values()], rows)
    draft.tiles.put(*(np.concatenate(values) for values in zip(*cells, strict=True)))
