"""The text of a file of rooms that exists: what of it holds when the file is written again."""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hybridnav._files import printable
from hybridnav.config.yaml_file import read_marked
from hybridnav.errors import HybridNavError, RoomsError
from hybridnav.io.room_measures import measures_of
from hybridnav.io.rooms_cells import unpacked
from hybridnav.io.rooms_entries import LIMITS, Outline, Read, read_entries
from hybridnav.io.rooms_in import rooms_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hybridnav._typing import PathLike
    from hybridnav.config.yaml_file import Marked
    from hybridnav.grid import OccupancyGrid, RoomLabels

HEADER = (
    "# Rooms of {}: outlines in metres, map frame, [x, y].",
    "# Rename a room, move its corners, give two rooms one name to make them one, or draw a room",
    "# over others: what you draw takes their cells. `seed: [x, y]` finds a room round a point.",
)
_OWN = ("# Rooms of ", *HEADER[1:], "# their numbers; a point of each", "# which the outlines miss")
"""Beginnings of comments that are written, not a person's."""
_QUOTED = re.compile(r"'(?:[^']|'')*'|\"(?:[^\"\\]|\\.)*\"")
_COMMENT = re.compile(r"(?:^|\s)(#.*)$")


@dataclass(frozen=True)
class Block:
    """The lines of an entry, with the comments before it."""

    room: int
    """The room among those that are written, -1 if it is none of them."""
    name: str
    lines: list[str]
    holds: bool
    """Whether it is read as that room is."""


@dataclass(frozen=True)
class OldText:
    """What an existing file has that a new one keeps."""

    head: list[str]
    """Lines up to the first entry."""
    blocks: list[Block]
    """The entries; none where the file cannot be kept as it is."""
    rest: list[str]
    """Lines behind the entries but for points, doors and cells."""
    outlines: list[Outline]
    """Outlines of the blocks that hold."""
    written: set[int]
    """Fingerprints of outlines that nobody has changed."""
    comments: list[str]
    """All comments of a person, for a file that is not kept."""
    gone: dict[str, str] = field(default_factory=dict)
    """A comment for each name that is no room's any more."""

    @classmethod
    def of(cls, path: PathLike, rooms: RoomLabels, grid: OccupancyGrid) -> OldText | None:
        """Read the file that is to be written again; None if there is none with comments."""
        if not Path(path).is_file():
            return None
        try:
            marked = read_marked(path, what="rooms", error=RoomsError, limits=LIMITS)
        except HybridNavError:
            return None
        comments = comments_in(marked.text.splitlines())
        try:
            read = read_entries(marked, f"rooms {printable(path)}", grid)
            before = rooms_of(read, grid)
        except (HybridNavError, KeyError):
            return cls([], [], [], [], set(), comments)
        gone = {name: _gone(name, before, grid) for name in before.names if name not in rooms.names}
        spans = _spans(marked)
        if spans is None or [name for name in before.names if name in rooms.names] != [
            name for name in rooms.names if name in before.names
        ]:
            return cls([], [], [], [], set(), [*comments, *gone.values()])
        kept = _kept(marked, spans, read, (before, rooms), grid)
        return replace(kept, gone=gone, comments=[*comments, *gone.values()])

    def with_entries(self, entries: Mapping[int, list[str]], points: list[str]) -> list[str]:
        """Return the lines of the file with other entries for rooms that it does not hold."""
        lines, done = list(self.head), set()
        for block in self.blocks:
            if block.holds:
                lines += block.lines
            else:
                lines += comments_in(block.lines)
                lines += [self.gone[block.name]] if block.name in self.gone else []
                if block.room >= 0 and block.room not in done:
                    lines += entries[block.room]
            done.add(block.room)
        lines += [line for room in entries if room not in done for line in entries[room]]
        return [*lines, *points, *self.rest]


def _gone(name: str, rooms: RoomLabels, grid: OccupancyGrid) -> str:
    """Return a comment with the name of a room that is none any more, and where it was."""
    middle = measures_of(rooms, grid)[rooms.index(name)].centre_m
    return "# Formerly {!r}, round [{:.2f}, {:.2f}].".format(name, *middle)


def comments_in(lines: list[str]) -> list[str]:
    """Return a person's comments, each in a line of its own."""
    found = (_COMMENT.search(_QUOTED.sub("", line)) for line in lines)
    comments = [match[1] for match in found if match is not None]
    return [comment for comment in comments if not comment.startswith(_OWN)]


def _spans(marked: Marked) -> dict[str, tuple[int, int]] | None:
    """Return the first line and the line after the last of each key; None where keys share
    lines."""
    root: Any = marked.root
    entries: Any = marked.node("rooms")
    if root.flow_style or entries.flow_style or not entries.value:
        return None
    firsts = [key.start_mark.line for key, _ in root.value]
    lines = marked.text.splitlines()
    ends = [*firsts[1:], len(lines)]
    spans = {
        key.value: (first, end)
        for (key, _), first, end in zip(root.value, firsts, ends, strict=True)
    }
    starts = [entry.start_mark.line for entry in entries.value]
    if any(not lines[start].lstrip().startswith("- ") for start in starts):
        return None
    return spans if len(set(starts)) == len(starts) and starts[0] > spans["rooms"][0] else None


def _kept(
    marked: Marked,
    spans: dict[str, tuple[int, int]],
    read: Read,
    versions: tuple[RoomLabels, RoomLabels],
    grid: OccupancyGrid,
) -> OldText:
    """Return the text in its parts."""
    before, rooms = versions
    lines = marked.text.splitlines()
    entries: Any = marked.node("rooms")
    starts = [_with_comments(lines, entry.start_mark.line) for entry in entries.value]
    end = spans["rooms"][1]
    # Comments in front of the next key are that key's.
    end = _with_comments(lines, end) if end < len(lines) else end
    blocks = []
    for (first, last), entry in zip(
        itertools.pairwise([*starts, end]), marked.values["rooms"], strict=True
    ):
        name = entry["name"]
        room = rooms.names.index(name) if name in rooms.names else -1
        holds = (
            room >= 0 and "seed" not in entry and before.points.get(name) == rooms.points.get(name)
        )
        if holds:
            same = (before.label_of == before.names.index(name)) == (rooms.label_of == room)
            holds = bool(same.all())
        blocks.append(Block(room, name, lines[first:last], holds))
    outlines = []
    for outline in read.outlines:
        room = next(
            (b.room for b in blocks if b.holds and rooms.names[b.room] == read.names[outline.room]),
            -1,
        )
        if room >= 0:
            outlines.append(Outline(room, outline.rings, outline.fingerprint, outline.line))
    behind = []
    for key, (first, last) in spans.items():
        if key == "rooms":
            behind += [] if spans["rooms"][1] == len(lines) else lines[end : spans["rooms"][1]]
        elif first > spans["rooms"][0]:
            part = lines[first:last]
            behind += comments_in(part) if key in ("points", "doors", "cells") else part
    written = set(unpacked(read.cells, read.where, grid).runs_of)
    return OldText(lines[: starts[0]], blocks, behind, outlines, written, [])


def _with_comments(lines: list[str], line: int) -> int:
    """Return the first of the comment lines directly in front of a line."""
    while line > 0 and lines[line - 1].lstrip().startswith("#"):
        line -= 1
    return line
