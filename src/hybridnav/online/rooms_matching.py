"""Which of the rooms that were found anew are old ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.grid import NO_ROOM

if TYPE_CHECKING:
    from hybridnav._typing import IntArray, LongArray


class Matches(NamedTuple):
    """The numbers of rooms that were found anew, and what became of old ones."""

    number_of: LongArray
    """int64 (n_labels + 1,), the number of the room of each label, -1 for the last."""
    born: tuple[int, ...]
    """New numbers."""
    merged: dict[int, int]
    """Old rooms whose heir bears another number, with it."""
    split: dict[int, tuple[int, ...]]
    """Old rooms, and several new ones that mostly consist of them."""


def match(
    old: IntArray, labels: IntArray, first: tuple[int, int], areas_staying: LongArray
) -> Matches:
    """Return the numbers of rooms that were found anew: those of old ones that have heirs, or new.

    The heir of an old room is the one that now has more than half of its cells. An heir of several
    bears the number of the one with which it shares the most cells, the least number on a tie; a
    room that stayed bears its own.

    Parameters
    ----------
    old
        int32 (rows, cols), the old rooms that were given up, -1 elsewhere.
    labels
        int32 (rows, cols), the rooms now: the numbers of those that stay, and labels of those that
        were found anew; -1 elsewhere.
    first
        The least label of a room that was found anew, and the least number that no room has had.
    areas_staying
        int64 (n,), the free cells of each room that stayed by its number, where it was before.
    """
    first_label, first_number = first
    areas = np.bincount(labels[labels >= 0], minlength=first_label)
    areas[: len(areas_staying)] = np.maximum(areas[: len(areas_staying)], areas_staying)
    areas_before = np.bincount(old[old >= 0])
    both = (old >= 0) & (labels >= 0)
    keys, counts = np.unique(old[both] * np.int64(len(areas)) + labels[both], return_counts=True)
    shared = {
        (key // len(areas), key % len(areas)): cells
        for key, cells in zip(keys.tolist(), counts.tolist(), strict=True)
    }
    heirs = {pair: cells for pair, cells in shared.items() if 2 * cells > areas_before[pair[0]]}
    number_of = np.append(np.arange(len(areas)), NO_ROOM)
    number_of[first_label:-1] = NO_ROOM
    for was, label in sorted(heirs, key=lambda pair: (-heirs[pair], pair)):
        if number_of[label] == NO_ROOM:
            number_of[label] = was
    new = first_label + np.flatnonzero(number_of[first_label:-1] == NO_ROOM)
    number_of[new] = first_number + np.arange(len(new))
    merged = {was: int(number_of[label]) for was, label in heirs if number_of[label] != was}
    split: dict[int, list[int]] = {}
    for (was, label), cells in shared.items():
        if 2 * cells > areas[label]:
            split.setdefault(was, []).append(int(number_of[label]))
    return Matches(
        number_of,
        tuple(number_of[new].tolist()),
        merged,
        {was: tuple(sorted(parts)) for was, parts in split.items() if len(parts) > 1},
    )
