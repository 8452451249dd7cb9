"""Which places of a new version are those of the old one."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.online.tiles import NO_PLACE

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.online.draft import Draft


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


class _Overlaps(NamedTuple):
    """Cells that an old place and a new one have in common, by pairs in ascending order."""

    old: LongArray
    """The old place."""
    new: LongArray
    """The new place, -1 for none."""
    cells: LongArray
    """Cells in common."""


def settle(draft: Draft) -> Events:
    """Give the places of a draft the numbers of old ones as far as these have heirs.

    The heir of an old place is the new one that holds more than half of its cells. An heir of
    several bears the number of the one with which it shares the most cells; the least number breaks
    ties.
    """
    first = draft.before.next_place
    found = _overlaps(draft)
    gone = np.unique(found.old)
    areas = draft.before.places.read(gone.tolist())["area"]
    most = 2 * found.cells > areas[np.searchsorted(gone, found.old)]
    most &= found.new != NO_PLACE
    heir_of = dict(zip(found.old[most].tolist(), found.new[most].tolist(), strict=True))
    shared = dict(zip(found.old[most].tolist(), found.cells[most].tolist(), strict=True))
    name: dict[int, int] = {}
    for old in sorted(heir_of, key=lambda place: (-shared[place], place)):
        name.setdefault(heir_of[old], old)
    new = [place for place in draft.places.numbers(first) if place not in name]
    born = {place: first + at for at, place in enumerate(new)}
    name |= born
    _rename(draft, first, name)
    draft.next_place = first + len(born)
    kept = set(name.values())
    died = [place for place in gone.tolist() if place not in kept]
    return Events(
        tuple(sorted(born.values())),
        tuple(died),
        {place: name[heir_of[place]] for place in died if place in heir_of},
        _split(draft, found, name),
        tuple(place for place in gone.tolist() if place in kept),
    )


def _overlaps(draft: Draft) -> _Overlaps:
    """Count the cells of each pair of an old place and a new one that differ."""
    pairs = []
    for before, after in draft.tiles.changed(draft.before.tiles):
        old, new = before["place"], after["place"]
        differs = (old != new) & (old != NO_PLACE)
        pairs.append(np.stack([old[differs], new[differs]], axis=1))
    both = np.concatenate([*pairs, np.empty((0, 2), np.int32)]).astype(np.int64)
    keys, counts = np.unique((both[:, 0] << 32) + both[:, 1] + 1, return_counts=True)
    return _Overlaps(keys >> 32, (keys & 0xFFFFFFFF) - 1, counts.astype(np.int64))


def _split(draft: Draft, found: _Overlaps, name: dict[int, int]) -> dict[int, tuple[int, ...]]:
    """Return the places of which several new ones mostly consist."""
    split: dict[int, list[int]] = {}
    for old, new, cells in zip(*(values.tolist() for values in found), strict=True):
        if new != NO_PLACE:
            area = int(draft.places.read([name[new]])[0]["area"])
            if 2 * cells > area:
                split.setdefault(old, []).append(name[new])
    return {old: tuple(sorted(parts)) for old, parts in split.items() if len(parts) > 1}


def _rename(draft: Draft, first: int, name: dict[int, int]) -> None:
    """Write the final numbers of places in place of the numbers of the draft."""
    table = np.full(draft.next_place - first, NO_PLACE, np.int32)
    for number, final in name.items():
        table[number - first] = final
    for _, cells in draft.tiles.changed(draft.before.tiles):
        place = cells["place"]
        drafted = place >= first
        place[drafted] = table[place[drafted] - first]
    rows = draft.places.read(name)
    draft.places.drop(name)
    draft.places.write(name.values(), rows)
