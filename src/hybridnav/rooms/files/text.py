"""The text of a file of rooms that exists: what of it holds when the file is written again."""

from __future__ import annotations

import itertools
import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hybridnav._base.files import printable
from hybridnav._base.typing import PathLike
from hybridnav._base.yaml_file import Marked, read_marked
from hybridnav.errors import HybridNavError, RoomsError
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.rooms.files.entries import LIMITS, Outline, Read, read_entries, unpacked
from hybridnav.rooms.files.measures import measures_of
from hybridnav.rooms.files.read import rooms_of

HEADER = (
    "# Rooms of {}: outlines in metres, map frame, [x, y].",
    "# Rename a room, move its corners, give two rooms one name to make them one, or draw a room",
    "# over others: what you draw takes their cells. `seed: [x, y]` finds a room round a point.",
)
NOTES = ("# their numbers; a point of each", "# which the outlines miss; hybridnav's own")
"""Comments beside `doors` and `cells`."""
_TITLE = re.compile(r"# Rooms of .*: outlines in metres, map frame, \[x, y\]\.")
_COMMENT = re.compile(r"#[^\r\n\x85\u2028\u2029]*")
_NUMBERED = re.compile(r"room-[0-9]+")
"""Names that nobody has given."""
_WRITTEN = ("points", "doors", "one_way", "cells")
"""Keys that are written anew."""


@dataclass(frozen=True)
class Block:
    """The lines of an entry, with the comments before it."""

    room: int
    """The room among those that are written, -1 if it is none of them."""
    name: str
    lines: list[str]
    comments: list[str]
    holds: bool
    """Whether it is read as that room is."""


@dataclass(frozen=True)
class OldText:
    """What an existing file has that a new one keeps."""

    comments: list[str]
    """All comments of a person, for a file that is not kept."""
    newline: str = "\n"
    """How its lines end."""
    head: list[str] = field(default_factory=list)
    """Lines up to the first entry."""
    blocks: list[Block] = field(default_factory=list)
    """The entries; none where the file cannot be kept as it is."""
    rest: list[str] = field(default_factory=list)
    """Lines behind the entries, without what is written anew."""
    outlines: list[Outline] = field(default_factory=list)
    """Outlines of the blocks that hold."""
    written: set[int] = field(default_factory=set)
    """Fingerprints of outlines that nobody has changed."""
    has_points: bool = False
    """Whether the named points are among the lines that are kept."""
    gone: dict[str, str] = field(default_factory=dict)
    """A comment for each name that a person gave and that is no room's any more."""

    @classmethod
    def of(cls, path: PathLike, rooms: RoomLabels, grid: OccupancyGrid) -> OldText | None:
        """Read the file that is to be written again; None if there is none that can be read."""
        if not Path(path).is_file():
            return None
        try:
            marked = read_marked(path, what="rooms", error=RoomsError, limits=LIMITS)
        except HybridNavError:
            return None
        text = _Text(marked)
        try:
            read = read_entries(marked, f"rooms {printable(path)}", grid)
            before = rooms_of(read, grid)
        except (HybridNavError, KeyError):
            return cls(text.comments_in(0, None), text.newline)
        return _kept(text, read, before, rooms, grid)

    def with_entries(self, entries: Mapping[int, list[str]], points: list[str]) -> list[str]:
        """Return the lines of the file with other entries for rooms that it does not hold, in the
        order of the rooms."""
        held = {outline.room for outline in self.outlines}
        pieces = [(room, lines) for room, lines in entries.items() if room not in held]
        last = -1
        found = []
        for block in self.blocks:
            last = block.room if block.room >= 0 else last
            gone = [self.gone[block.name]] if block.name in self.gone and block.room < 0 else []
            found.append((last, block.lines if block.holds else [*block.comments, *gone]))
        ordered = sorted([*found, *pieces], key=lambda piece: piece[0])  # comments come first
        lines = [line for _, piece in ordered for line in piece]
        return [*self.head, *lines, *([] if self.has_points else points), *self.rest]


def scalar(name: str) -> str:
    """Return a name as YAML, for any place in a file."""
    found = yaml.safe_dump([name], allow_unicode=True, width=9999, default_flow_style=True)
    return str(found).strip()[1:-1]


class _Text:
    """The lines of a file, and the comment of each that has one."""

    def __init__(self, marked: Marked) -> None:
        self.marked = marked
        self.lines = marked.text.splitlines()
        self.newline = "\r\n" if "\r\n" in marked.text else "\n"
        starts = list(itertools.accumulate(map(len, marked.text.splitlines(keepends=True))))
        # Outside of values nothing but a comment has this sign.
        gaps, at = [], 0
        for node in _scalars(marked.root):
            gaps.append((at, node.start_mark.index))
            at = node.end_mark.index
            if node.style in ("|", ">"):
                gaps.append((node.start_mark.index, min(starts[node.start_mark.line], at)))
        self.comment_of = {
            bisect_right(starts, found.start()): found[0]
            for begin, end in [*gaps, (at, len(marked.text))]
            for found in _COMMENT.finditer(marked.text, begin, end)
        }

    def comments_in(self, first: int, last: int | None) -> list[str]:
        """Return a person's comments in some lines, each in a line of its own."""
        own = {*HEADER, *NOTES}
        return [
            comment
            for line, comment in self.comment_of.items()
            if first <= line < (len(self.lines) if last is None else last)
            and comment not in own
            and not _TITLE.fullmatch(comment)
        ]

    def rename(self, entry: int, name: str) -> bool:
        """Write another name into an entry; return whether nothing else had to change."""
        node: Any = self.marked.node("rooms", entry, "name")
        begin, end = node.start_mark, node.end_mark
        if begin.line != end.line:
            return False
        line = self.lines[begin.line]
        self.lines[begin.line] = line[: begin.column] + scalar(name) + line[end.column :]
        return True

    def sections(self) -> dict[str, tuple[int, int]] | None:
        """Return the first line and the line after the last of each key, in their order, the
        comments in front with them; None where keys share lines."""
        root: Any = self.marked.root
        firsts = [self.with_comments(key.start_mark.line) for key, _ in root.value]
        if root.flow_style or len(set(firsts)) < len(firsts) or self.lines[-1].startswith("..."):
            return None
        ends = [*firsts[1:], len(self.lines)]
        return {
            key.value: span
            for (key, _), span in zip(root.value, zip(firsts, ends, strict=True), strict=True)
        }

    def entries(self) -> list[int] | None:
        """Return the first line of each entry, the comments in front with it; None where entries
        share lines."""
        rooms: Any = self.marked.node("rooms")
        starts = [entry.start_mark.line for entry in rooms.value]
        key = next(key for key, _ in self.marked.root.value if key.value == "rooms")
        apart = len(set(starts)) == len(starts) and starts and starts[0] > key.start_mark.line
        dashes = all(self.lines[start].lstrip().startswith("- ") for start in starts)
        if rooms.flow_style or not apart or not dashes:
            return None
        return [self.with_comments(start) for start in starts]

    def with_comments(self, line: int) -> int:
        """Return the first of the comment lines directly in front of a line."""
        while line > 0 and self.lines[line - 1].lstrip().startswith("#"):
            line -= 1
        return line


def _scalars(node: Any) -> Iterator[Any]:
    """Return the values of a document that are no lists or mappings, in the order of the text."""
    if isinstance(node, yaml.ScalarNode):
        yield node
    else:
        for value in node.value:
            for part in value if isinstance(value, tuple) else (value,):
                yield from _scalars(part)


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
    heirs = [equal.get(at, named.get(name, -1)) for at, name in enumerate(before.names)]
    return heirs, set(equal)


def _kept(
    text: _Text, read: Read, before: RoomLabels, rooms: RoomLabels, grid: OccupancyGrid
) -> OldText:
    """Return what of a text is kept."""
    heirs, equal = _heirs(before, rooms)
    comments = text.comments_in(0, None)
    gone = _gone(heirs, before, rooms, grid)
    gone = {name: comment for name, comment in gone.items() if comment not in comments}
    plain = OldText([*comments, *gone.values()], text.newline)
    sections = text.sections()
    if sections is None or not rooms.names:
        return plain
    held = _held(text, before, rooms, {old: heirs[old] for old in equal})
    each = [(heirs[before.names.index(name)], name) for name, _ in held]
    broken = {room for (room, _), (_, holds) in zip(each, held, strict=True) if not holds}
    starts = text.entries()
    if starts is None:
        # A list in brackets holds as a whole or not at all.
        if broken or set(heirs) != set(range(len(rooms.names))) or heirs != sorted(heirs):
            return plain
        starts, each = [sections["rooms"][0]], each[:1]
    spans = itertools.pairwise([*starts, sections["rooms"][1]])
    others = [{n: at for n, at in r.points.items() if n not in r.names} for r in (before, rooms)]
    has_points = list(others[0].items()) == list(others[1].items()) and "points" in sections
    head, rest = _around(text, sections, starts[0], has_points=has_points)
    return OldText(
        plain.comments,
        text.newline,
        head,
        [
            Block(room, name, text.lines[low:high], text.comments_in(low, high), room not in broken)
            for (low, high), (room, name) in zip(spans, each, strict=True)
        ],
        rest,
        [
            Outline(heirs[outline.room], outline.rings, outline.fingerprint, outline.line)
            for outline in read.outlines
            if heirs[outline.room] not in broken
        ],
        set(unpacked(read.cells, read.where, grid).runs_of),
        has_points,
        gone,
    )


def _held(
    text: _Text, before: RoomLabels, rooms: RoomLabels, heir_of: Mapping[int, int]
) -> list[tuple[str, bool]]:
    """Return the old name of each entry, and whether it is read as its room is now, once that
    room's name is written into it."""
    held = []
    for at, entry in enumerate(text.marked.values["rooms"]):
        name = entry["name"]
        old = before.names.index(name)
        holds = old in heir_of and "seed" not in entry
        if holds:
            now = rooms.names[heir_of[old]]
            holds = before.points.get(name) == rooms.points.get(now)
            holds = holds and before.uses.get(name) == rooms.uses.get(now)
            holds = holds and (now == name or text.rename(at, now))
        held.append((name, holds))
    return held


def _around(
    text: _Text, sections: Mapping[str, tuple[int, int]], start: int, *, has_points: bool
) -> tuple[list[str], list[str]]:
    """Return the lines in front of the first entry, which begins at `start`, and those behind the
    last one: of what is written anew the comments alone."""
    first = sections["rooms"][0]
    head = text.lines[: next(iter(sections.values()))[0]]
    rest: list[str] = []
    for key, (low, high) in sections.items():
        anew = key in _WRITTEN and not (key == "points" and has_points)
        lines = text.comments_in(low, high) if anew else text.lines[low:high]
        if key != "rooms":
            (rest if low > first else head).extend(lines)
    return [*head, *text.lines[first:start]], rest


def _gone(
    heirs: list[int], before: RoomLabels, rooms: RoomLabels, grid: OccupancyGrid
) -> dict[str, str]:
    """Return a comment for each name that a person gave to a room that is none any more."""
    found = {}
    for room, name in enumerate(before.names):
        if heirs[room] < 0 and name not in rooms.names and not _NUMBERED.fullmatch(name):
            middle = measures_of(before, grid)[room].centre_m
            found[name] = "# Formerly {!r}, round [{:.2f}, {:.2f}].".format(name, *middle)
    return found


# Where the rooms of a map lie, and how large they are.
