"""Which places of a new version are those of the old one."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from hybridnav.ext.live.tiles import NO_PLACE, Box

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hybridnav.ext.live.cellwise import CellDraft


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
    moved: list[list[int]] = draft.tiles.moved(draft.before.tiles).tolist()
    areas = draft.before.places.areas(
        sorted({place for overlap in moved for place in overlap[:2] if NO_PLACE < place < first})
    )
    stay = dict(areas)
    found: list[Overlap] = []
    for old, went_to, cells in moved:
        if old != NO_PLACE:
            found.append((old, went_to, cells))
            stay[old] -= cells
    found += [(old, old, cells) for old, cells in stay.items() if cells > 0]
    heirs = heirs_of(found, areas)
    name = dict(heirs.name)
    new = {place for _, place, _ in found} | set(draft.places.numbers(first))
    for place in sorted(new - name.keys() - {NO_PLACE}):
        name[place] = place
        if place < first:
            name[place] = draft.next_place
            draft.next_place += 1
    _renumber(draft, {place: final for place, final in name.items() if place != final})
    now = draft.places.areas([*name.values()])
    areas_now = {place: now[final] for place, final in name.items()}
    return events_of(found, Heirs(heirs.of, name), areas_now, first)


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


def _renumber(draft: CellDraft, name: dict[int, int]) -> None:
    """Write other numbers of places in place of some."""
    if not name:
        return
    tiles, rows = draft.tiles, draft.places.read([*name])
    boxes = [Box(*around) for around in rows["box"].tolist()]
    # A final number may be that of another place until now: all cells are found first.
    masks = [tiles.planes(box)[0] == number for number, box in zip(name, boxes, strict=True)]
    for final, box, mask in zip(name.values(), boxes, masks, strict=True):
        planes = tiles.planes(box)
        planes[0][mask] = final
        tiles.put(box, planes)
    draft.places.drop(name)
    draft.places.write([*name.values()], rows)
