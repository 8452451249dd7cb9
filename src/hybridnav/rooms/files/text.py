"""A file of rooms that exists, written again: its comments, and the outlines that still hold."""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hybridnav._base.files import printable
from hybridnav._base.yaml_file import marked_of, read_marked
from hybridnav.errors import HybridNavError, RoomsError
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.rooms.files.entries import LIMITS, SHAPE_KEYS, read_entries
from hybridnav.rooms.files.measures import measures_of
from hybridnav.rooms.files.read import rooms_of

HEADER = (
    "# Rooms of {}: outlines in metres, map frame, [x, y].",
    "# Rename a room, move its corners, give two rooms one name to make them one, or draw a room",
    "# over others: what you draw takes their cells. `seed: [x, y]` finds a room round a point.",
)
NOTES = ("# their numbers; a point of each", "# the room of each cell; hybridnav's own")
"""Comments beside `doors` and `cells`."""
_OWN = {*HEADER, *NOTES, "# which the outlines miss; hybridnav's own"}
_TITLE = re.compile(r"# Rooms of .*: outlines in metres, map frame, \[x, y\]\.")
_NUMBERED = re.compile(r"room-[0-9]+")
"""Names that nobody has given."""
_SIGN = re.compile("#.*")
_ENTRIES = re.compile(r"^rooms:.*\n(?:\s*#.*\n|\s*\n)*( *)- ", re.MULTILINE)
_WIDEST = 2**20
"""Characters of a line at most: lines of a person are not broken."""


class Draft(NamedTuple):
    """The text of a file, where there is none yet."""

    entries: list[str]
    """That of each room."""
    rest: str
    """That behind them."""
    prints: list[list[int]]
    """The fingerprints of the outlines of each room."""

    def text(self, rooms: Iterable[int]) -> str:
        """Return the text with some of the rooms."""
        entries = "".join(self.entries[room] for room in rooms)
        return f"rooms:{'' if entries else ' []'}\n{entries}{self.rest}"


def written(
    path: Path, draft: Draft, title: str, rooms: RoomLabels, grid: OccupancyGrid
) -> tuple[str, list[list[int]]]:
    """Return the text of a file, and the fingerprints of the outlines of each room in it.

    If it exists and can be read, entries whose rooms have the cells that they had keep their
    outlines, and comments stay; those whose places are gone stand at the top.
    """
    fresh = "\n".join([HEADER[0].format(title), *HEADER[1:], draft.text(range(len(rooms.names)))])
    where = f"rooms {printable(path)}"
    try:
        marked = read_marked(path, what="rooms", error=RoomsError, limits=LIMITS)
    except HybridNavError:
        return fresh, draft.prints
    # Takes a tenth of a second to load.
    from ruamel.yaml.error import YAMLError  # noqa: PLC0415

    old, text, prints = "\n".join(marked.text.splitlines()), fresh, draft.prints
    gone: list[str] = []
    try:
        read = read_entries(marked, where, grid)
        read.folder = path.resolve().parent
        before = rooms_of(read, grid)
        heirs, same = _heirs(before, rooms)
        gone = _gone(heirs, before, rooms, grid)
        at = [before.names.index(entry["name"]) for entry in marked.values["rooms"]]
        holds = {
            room for room in same - {*read.seeds} if _is_alike(before, room, rooms, heirs[room])
        }
        merged = _merged(old, draft, [heirs[room] for room in at], {heirs[room] for room in holds})
        anew = marked_of(merged, where, RoomsError, LIMITS)
        merged = old if anew.values == marked.values else merged
        again = read_entries(anew, where, grid)
        if (again.names, again.points) == ([*rooms.names], {**rooms.points}):
            text, prints = merged, [[] for _ in rooms.names]
            for outline in again.outlines:
                prints[outline.room].append(outline.fingerprint)
    except (HybridNavError, KeyError, YAMLError):
        pass  # an outline outside the map, or what one library reads and the other does not
    lines = "".join(f"{line}\n" for line in [*_lost(old, text, gone), *text.splitlines()])
    return lines.replace("\n", "\r\n") if "\r\n" in marked.text else lines, prints


def _merged(old: str, draft: Draft, heirs: list[int], holds: set[int]) -> str:
    """Return the text of a file with what a draft has.

    `heirs`: the room of each entry, -1 for none; `holds`: rooms whose outlines are kept.
    """
    from ruamel.yaml import YAML  # noqa: PLC0415 - see above

    yaml, stream = YAML(), io.StringIO()
    yaml.preserve_quotes, yaml.width = True, _WIDEST
    if entries := _ENTRIES.search(old):
        yaml.indent(sequence=2 + len(entries[1]), offset=len(entries[1]))
    document, new = yaml.load(old), yaml.load(draft.text(range(len(draft.entries))))
    _update_entries(document["rooms"], new["rooms"], heirs, holds)
    for key in ("points", "doors", "one_way", "cells"):
        if key not in new:
            document.pop(key, None)
        elif document.get(key) != new[key]:
            document[key] = new[key]
            if key in new.ca.items:
                document.ca.items[key] = new.ca.items[key]
    yaml.dump(document, stream)
    return stream.getvalue()


def _lost(old: str, text: str, gone: list[str]) -> list[str]:
    """Return a person's comments in one text, and some more, that another text lacks."""
    signs = Counter(_SIGN.findall(old)) - Counter(_SIGN.findall(text))
    were = _comments(old) if signs.keys() - _OWN else []
    lost = Counter([*were, *gone]) - Counter(_comments(text) if were or gone else [])
    return [each for each in lost.elements() if each not in _OWN and not _TITLE.fullmatch(each)]


def _comments(text: str) -> list[str]:
    """Return the comments of a text."""
    from ruamel.yaml import YAML  # noqa: PLC0415 - see above

    found = []
    for token in YAML().scan(text):
        waiting: list[Any] = [token.comment]
        while waiting:
            each = waiting.pop()
            if isinstance(each, list):
                waiting.extend(each)
            elif each is not None:
                found += [line.lstrip() for line in each.value.splitlines()]
    return [line for line in found if line]


def _heirs(before: RoomLabels, rooms: RoomLabels) -> tuple[list[int], set[int]]:
    """Return the room that each old one is now, -1 for none, and the old ones with equal cells.

    A room is the one that has its cells, whatever its name, else the one that has its name.
    """
    width = len(rooms.names) + 1  # one number a pair: rows would be compared as records
    pairs = np.unique(
        (before.label_of.ravel() + 1).astype(np.int64) * width + rooms.label_of.ravel() + 1
    )
    one, other = pairs // width - 1, pairs % width - 1
    counts = [np.bincount(side + 1, minlength=2) for side in (one, other)]
    same = (one >= 0) & (other >= 0)
    same &= (counts[0][one + 1] == 1) & (counts[1][other + 1] == 1)
    equal = dict(zip(one[same].tolist(), other[same].tolist(), strict=True))
    taken = set(equal.values())
    named = {name: at for at, name in enumerate(rooms.names) if at not in taken}
    return [equal.get(at, named.get(name, -1)) for at, name in enumerate(before.names)], set(equal)


def _is_alike(before: RoomLabels, old: int, rooms: RoomLabels, new: int) -> bool:
    """Return whether a room has the point and the use that it had."""
    was, now = before.names[old], rooms.names[new]
    is_point = before.points.get(was) == rooms.points.get(now)
    return is_point and before.uses.get(was) == rooms.uses.get(now)


def _gone(
    heirs: list[int], before: RoomLabels, rooms: RoomLabels, grid: OccupancyGrid
) -> list[str]:
    """Return a comment for each name that a person gave to a room that is none any more."""
    found = []
    for room, name in enumerate(before.names):
        if heirs[room] < 0 and name not in rooms.names and not _NUMBERED.fullmatch(name):
            middle = measures_of(before, grid)[room].centre_m
            found.append("# Formerly {!r}, round [{:.2f}, {:.2f}].".format(name, *middle))
    return found


def _update_entries(entries: Any, new: Any, heirs: list[int], holds: set[int]) -> None:
    """Write new entries over those of the same rooms, unless their outlines are kept."""
    places: list[list[int]] = [[] for _ in new]
    for place, room in enumerate(heirs):
        if room >= 0 and (room in holds or not places[room]):
            places[room].append(place)
    kept: list[tuple[int, Any]] = []
    for room, fresh in enumerate(new):
        kept += [(place, entries[place]) for place in places[room]] or [(-1, fresh)]
        for place in places[room]:
            if room not in holds:
                _set_shape(entries[place], fresh)
            elif entries[place]["name"] != fresh["name"]:
                entries[place]["name"] = fresh["name"]
    comments = entries.ca.items.copy()
    entries[:] = [entry for _, entry in kept]
    entries.ca.items.clear()
    moved = {at: comments[place] for at, (place, _) in enumerate(kept) if place in comments}
    entries.ca.items.update(moved)


def _set_shape(entry: Any, fresh: Any) -> None:
    """Give an entry the values of another, in the place of its own outline."""
    (was,), (now,) = ([key for key in SHAPE_KEYS if key in each] for each in (entry, fresh))
    if was != now:
        entry.insert(list(entry).index(was), now, fresh[now])
        if was in entry.ca.items:
            entry.ca.items[now] = entry.ca.items.pop(was)
    for key in [key for key in entry if key not in fresh]:
        del entry[key]
    entry.update(fresh)
