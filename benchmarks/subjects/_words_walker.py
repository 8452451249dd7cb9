"""A walker who knows a way from its sentences alone: it reads, looks round, and walks.

It is a judge of words, written apart from their writer. It shares with it the rooms and doors of
the map, which a person sees too, and nothing of the path. Doors bear no numbers; a room bears its
name on its doors only if people gave it one. Whatever fits the words first is taken: nearer doors
are looked at first, hands are taken broadly, and nobody knows how long his steps are.
"""

from __future__ import annotations

import heapq
import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import ndimage

import hybridnav as hn
from hybridnav._base.typing import BoolArray, FloatArray, IntArray
from hybridnav.rooms import Door, Rooms

# Reading: from a sentence to what it asks for.

_NUMBERS = {
    "en": ("first", "second", "third", "fourth", "fifth"),
    "de": ("erste", "zweit", "dritt", "vierte", "fünfte"),
}
_NEAREST = {
    "en": ("nearest", "second", "third", "fourth", "fifth"),
    "de": ("nächst", "zweitnächste", "drittnächste", "vierte", "fünfte"),
}
_COMPASS = {
    "en": (
        *("east", "north-east", "north", "north-west"),
        *("west", "south-west", "south", "south-east"),
    ),
    "de": (
        *("Osten", "Nordosten", "Norden", "Nordwesten"),
        *("Westen", "Südwesten", "Süden", "Südosten"),
    ),
}
_KINDS = {
    "en": {"corridor": "corridor", "hall": "hall", "room": "room", "passage": "passage"},
    "de": {"Flur": "corridor", "Halle": "hall", "Raum": "room", "Durchgang": "passage"},
}
_LEFT = {"left": 1.0, "links": 1.0, "linken": 1.0, "right": -1.0, "rechts": -1.0, "rechten": -1.0}
_COUNTS = {"the": 1, "der": 1, "two": 2, "zwei": 2, "three": 3, "drei": 3}
_ROUND = math.pi
_TURNS = {
    "en": (
        (r"turn sharply (left|right)", 135),
        (r"(?:turn|face|then|go) (left|right)", 90),
        (r"bear (left|right)", 45),
        (r"turn (round)", 180),
    ),
    "de": (
        (r"scharf (links|rechts) abbiegen", 135),
        (r"halb (links|rechts) halten", 45),
        (r"(links|rechts) abbiegen", 90),
        (r"nach (links|rechts)", 90),
        (r"(umkehren|umdrehen)", 180),
    ),
}
_SIDES = {
    "en": (
        (r"ahead on the (left|right)", 45),
        (r"behind you on the (left|right)", 135),
        (r"on the (left|right)", 90),
        (r"(behind you)", 180),
        (r"(\bahead\b|straight on|towards)", 0),
    ),
    "de": (
        (r"(links|rechts) voraus|(?:voraus|vorn) (links|rechts)", 45),
        (r"(links|rechts) hinten|hinten (links|rechts)", 135),
        (r"\b(links|rechts)\b", 90),
        (r"(im Rücken|hinter Ihnen)", 180),
        (r"(voraus|geradeaus| zu$)", 0),
    ),
}
_TEXTS = {
    "en": {
        "start": r"^start ",
        "after": r"after (?:about )?(\d+) m",
        "cross": r"^(?P<head>.*?)\b(?:into|onto) (?:the |this )?(?P<into>.+?)"
        r"(?P<tail>,? then .*|(?:,| and) (?:turn|bear) .*|, and you are there)?$",
        "mark": r"^(?P<head>.*?door|.*?opening)(?: \d+)? to (?:the )?(?P<into>.+?)"
        r"(?P<tail> on the .*| ahead.*| behind.*)?$",
        "opening": "opening",
        "door": "door",
        "wall": r"wall on the (left|right)",
        "across": r"go straight across to the opposite wall, turn (left|right) along it",
        "via": r"^(.*) to the (\w+(?: nearest)?) door, and with your back to it ",
        "far": r"for about (\d+) m",
        "past": r"past (the|two|three) openings?, and behind",
        "last": r"\blast\b",
        "end": r"to (?:its|the) (?:end|corner)|at (?:its|the) end",
    },
    "de": {
        "start": r"^Start ",
        "after": r"nach (?:etwa )?(\d+) m",
        "cross": r"^(?P<head>.*)\b(?:in|auf) (?:den |die |das |diese )?(?P<into>.+?)"
        r" gehen(?P<tail>.*)$",
        "mark": r"^(?P<head>.*?Tür|.*?Öffnung)(?: \d+)? (?:in|auf) (?:den |die )?(?P<into>.+?)"
        r"(?P<tail> links.*| rechts.*| voraus.*| im Rücken| zu)?$",
        "opening": "Öffnung",
        "door": "Tür",
        "wall": r"an der (linken|rechten) Wand",
        "across": r"geradeaus zur Wand gegenüber, dort nach (links|rechts) an ihr entlang",
        "via": r"^(.*?)(?: ?bis)? ?zur (\w+)n Tür(?: gehen)?, dann mit ihr im Rücken ",
        "far": r", etwa (\d+) m weit,",
        "past": r"an (der|zwei|drei) Öffnung(?:en)? vorbei",
        "last": r"\bletzte\b",
        "end": r"bis (?:zum|ans|zu seinem) Ende|am Ende",
    },
}


@dataclass(frozen=True)
class Step:
    """What a sentence asks for."""

    kind: str
    """start, turn, cross, or arrive."""
    metres: float | None = None
    is_to_end: bool = False
    """Whether one goes to the end of the space first."""
    turn_rad: float | None = None
    """A turn, of a door that before it; radians, counter-clockwise."""
    is_opening: bool | None = None
    side_rad: float | None = None
    """Where the door lies for one who looks ahead."""
    ordinal: int | None = None
    """The first, second, ...; -1 for the last."""
    into: str | None = None
    """Name of the space behind the door."""
    into_kind: str | None = None
    out_rad: float | None = None
    """The turn behind the door."""
    wall: float | None = None
    """Where the wall lies that one follows: 1 at the left hand, -1 at the right."""
    across: float | None = None
    """To which hand one turns at the wall opposite, likewise."""
    far_m: float | None = None
    """How far one follows it, in metres."""
    past: int = 0
    """How many openings one passes at it."""
    via: Step | None = None
    """The walk to another door that one turns one's back to."""
    compass_rad: float | None = None
    text: str = ""


def read(sentence: str, language: str) -> Step:
    """Return what a sentence asks for."""
    texts = _TEXTS[language]
    metres = re.search(texts["after"], sentence)
    found: dict[str, Any] = {
        "metres": None if metres is None else float(metres[1]),
        "is_to_end": re.search(texts["end"], sentence) is not None,
        "text": sentence,
    }
    if re.search(texts["start"], sentence):
        for number, word in sorted(enumerate(_COMPASS[language]), key=lambda one: -len(one[1])):
            if sentence.endswith(word):
                return Step("start", compass_rad=number * math.pi / 4, text=sentence)
        mark = re.search(texts["mark"], sentence)
        return Step("start", **found | _door(mark, language)) if mark else Step("start", **found)
    via = re.search(texts["via"], sentence)
    if via is not None:
        cross = re.search(texts["cross"], sentence[via.end() :])
        assert cross is not None, sentence  # noqa: S101
        ordinal = next(
            n
            for n, words in enumerate(zip(_NUMBERS[language], _NEAREST[language], strict=False), 1)
            if via[2].startswith(words)
        )
        before = _at_the_wall(via[1], language) | {"ordinal": ordinal, "is_opening": False}
        found |= _door(cross, language) | {"via": Step("cross", **before)}
        return Step("cross", **found)
    cross = re.search(texts["cross"], sentence)
    if cross is not None:
        return Step("cross", **found | _door(cross, language))
    turn_rad = _angle(_TURNS[language], sentence)
    return Step("arrive" if turn_rad is None else "turn", **found | {"turn_rad": turn_rad})


def _door(cross: re.Match[str], language: str) -> dict[str, Any]:
    """Return what a sentence says of a door: before it, of it, behind it."""
    texts, head, tail = _TEXTS[language], cross["head"], cross["tail"] or ""
    into, kind = _space(cross["into"], language)
    at_the_wall = _at_the_wall(head, language)
    head = re.sub(rf"{texts['wall']}|{texts['across']}|{texts['past']}", "", head)
    turn_rad = _angle(_TURNS[language], head)
    for pattern, _ in _TURNS[language]:
        head = re.sub(pattern, "", head)
    is_mark = cross.re.pattern == texts["mark"]
    side_rad = _angle(_SIDES[language], cross.string if is_mark else head)
    is_opening = None
    if re.search(texts["door"], head) or texts["opening"] in head:
        is_opening = texts["opening"] in head
    ordinal = next(
        (n for n, word in enumerate(_NUMBERS[language], 1) if re.search(rf"\b(?:{word})", head)),
        -1 if re.search(texts["last"], head) else None,
    )
    return {
        "turn_rad": turn_rad,
        "side_rad": side_rad,
        "is_opening": is_opening,
        "ordinal": ordinal,
        **at_the_wall,
        "into": into,
        "into_kind": kind,
        "out_rad": None if is_mark else _angle(_TURNS[language], tail),
    }


def _at_the_wall(text: str, language: str) -> dict[str, Any]:
    """Return what words say of a wall that one follows."""
    texts = _TEXTS[language]
    names = ("wall", "across", "past", "far")
    wall, across, past, far = (re.search(texts[name], text) for name in names)
    return {
        "far_m": None if far is None else float(far[1]),
        "wall": None if wall is None else _LEFT[wall[1]],
        "across": None if across is None else _LEFT[across[1]],
        "past": 0 if past is None else _COUNTS[past[1]],
    }


def _space(text: str, language: str) -> tuple[str | None, str | None]:
    """Return the name of a space and its kind, as far as the words say them."""
    text = text.strip("„“ ")
    kinds = _KINDS[language]
    for word, kind in kinds.items():
        if text == word:
            return None, kind
        if re.fullmatch(rf"{word} „?room-\d+“?", text):
            return None, kind
    return text, None


def _angle(patterns: Sequence[tuple[str, int]], text: str) -> float | None:
    """Return the angle of the first pattern that a text holds."""
    for pattern, degrees in patterns:
        match = re.search(pattern, text)
        if match is not None:
            word = next(group for group in match.groups() if group)
            return _LEFT.get(word, 1.0) * math.radians(degrees)
    return None


# Looking: what a person sees of a map.

_GAP_M = 2.0
"""How far apart the outlines of rooms may be where people see one door."""
_LEAST_M = 0.4
"""Width from which a person takes a gap for a door."""
_STEP_M = 0.25
_SAMPLE_M = 0.1
_SIGHT_M = 30.0
_AWAY_M = 0.6
"""How far off a door one stands who looks back or on."""
_ROOM_NAME = re.compile(r"room-\d+")
_BROAD_RAD = math.radians(32.0)
"""How far a door may lie off the direction that the words name."""


@dataclass(frozen=True, eq=False)
class Seen:
    """A door as a person in one of its two rooms sees it."""

    number: int
    point: FloatArray
    """Its middle, metres."""
    span: FloatArray
    """Points from end to end, (n, 2)."""
    out_rad: float
    """The direction out of the room through it."""
    is_opening: bool | None
    """None for one before a gap between two outlines: it may be either."""
    beyond: int
    """Label of the room behind it."""


class Place:
    """A map as people see it: walls, rooms, doors, and signs with names that people gave."""

    def __init__(self, topology: hn.TopologicalMap, *, has_signs: bool = True) -> None:
        rooms = topology.rooms
        self.grid, self.has_signs = rooms.grid, has_signs
        self.names = rooms.names
        self.kinds = [None if kind is None else kind.name for kind in rooms.kinds]
        self.is_free: BoolArray = self.grid.measured == hn.CellClass.FREE
        self.is_body: BoolArray = self.grid.classes == hn.CellClass.FREE
        self.label_of: IntArray = rooms.labels.label_of
        self.doors_of: dict[int, list[Seen]] = {}
        self.cells_of: dict[int, list[tuple[int, int]]] = {}
        labels = {name: number for number, name in enumerate(rooms.names)} | {None: -1}
        listed = {door.number for door in rooms.listed_doors}
        for door in rooms.doors:
            if door.number not in listed and not (door.passable and None in door.rooms):
                continue
            if door.passage_m < _LEAST_M or (door.width_m < _LEAST_M and not door.passable):
                continue
            cells = np.column_stack(np.divmod(rooms.cells_beside(door.number), self.grid.shape[1]))
            points = self.grid.frame.points_of(cells)
            owner = self.label_of[tuple(cells.T)]
            self.cells_of[door.number] = [(row, col) for row, col in cells.tolist()]
            ends = [labels[name] for name in door.rooms]
            if ends[0] == ends[1] or any((owner == end).sum() == 0 for end in ends):
                continue
            means = [points[owner == end].mean(axis=0) for end in ends]
            (x, y), (to_x, to_y) = rooms.door_ends(door.number)
            across = np.array([y - to_y, to_x - x])
            across *= np.sign(across @ (means[1] - means[0]))
            if not across.any():
                across = means[1] - means[0]
            for (own, other), (dx, dy) in zip((ends, ends[::-1]), (across, -across), strict=True):
                out_rad = math.atan2(dy, dx)
                behind: list[tuple[int, bool | None]] = [(other, door.is_opening)]
                if own >= 0 > other:
                    behind = list(self._behind_a_gap(rooms, door, out_rad))
                for beyond, is_opening in behind if own >= 0 else ():
                    if beyond in (own, -1) and door.number not in listed:
                        continue
                    self.doors_of.setdefault(own, []).append(
                        Seen(
                            door.number,
                            np.array(door.position),
                            points[:: max(1, len(points) // 6)],
                            out_rad,
                            is_opening,
                            beyond,
                        )
                    )

    def _behind_a_gap(
        self, rooms: Rooms, door: Door, out_rad: float
    ) -> Iterator[tuple[int, bool | None]]:
        """Yield the rooms behind a gap between two outlines, and whether an opening leads there.

        People see no outlines: they see the door of each room there, or the opening; None where the
        outlines differ. A room of none is -1.
        """
        far = [
            other
            for other in rooms.doors
            if None in other.rooms and not set(other.rooms) & set(door.rooms) - {None}
            if other.passage_m >= _LEAST_M and (other.width_m >= _LEAST_M or other.passable)
            if math.dist(other.position, door.position) < _GAP_M
        ]
        labels = {name: number for number, name in enumerate(rooms.names)}
        for other in far:
            name = other.rooms[0] or other.rooms[1]
            is_opening = door.is_opening if door.is_opening == other.is_opening else None
            if name is not None:
                yield labels[name], is_opening
        if not far:
            yield self._straight_behind(np.array(door.position), out_rad), None

    def _straight_behind(self, point: FloatArray, out_rad: float) -> int:
        """Return the room straight behind a gap between two outlines, -1 for none."""
        way = np.array([math.cos(out_rad), math.sin(out_rad)])
        for away_m in np.arange(0.1, 1.6, 0.1):
            row, col = self.cell(point + away_m * way)
            if not self.is_free[row, col]:
                return -1
            if away_m > 0.15 and self.label_of[row, col] >= 0:
                return int(self.label_of[row, col])
        return -1

    def sign(self, label: int) -> str | None:
        """Return what stands on the doors of a room, None for nothing."""
        if label < 0 or not self.has_signs or _ROOM_NAME.fullmatch(self.names[label]):
            return None
        return self.names[label]

    def cell(self, point: FloatArray) -> tuple[int, int]:
        """Return the cell of a point, the nearest of the map."""
        row, col = self.grid.frame.cells_of(np.array([point]))[0].tolist()
        rows, cols = self.grid.shape
        return min(max(row, 0), rows - 1), min(max(col, 0), cols - 1)

    def ray_m(self, point: FloatArray, angle_rad: float, label: int) -> float:
        """Return how far one can walk straight on inside a room."""
        along = np.arange(_SAMPLE_M, _SIGHT_M, _SAMPLE_M)
        way = np.array([math.cos(angle_rad), math.sin(angle_rad)])
        good = self._is_open(point + along[:, None] * way, label)
        return float(along[-1] if good.all() else along[int(np.argmin(good))] - _SAMPLE_M)

    def _is_open(self, points: FloatArray, label: int) -> BoolArray:
        cells = self.grid.frame.cells_of(points)
        inside: BoolArray = np.all((cells >= 0) & (cells < self.grid.shape), axis=1)
        row, col = np.where(inside[:, np.newaxis], cells, 0).T
        found: BoolArray = inside & self.is_body[row, col] & (self.label_of[row, col] == label)
        return found

    def sees(self, point: FloatArray, door: Seen, label: int) -> bool:
        """Tell whether some part of a door is in sight from inside a room."""
        return any(self._sees_point(point, end, label) for end in (door.point, *door.span))

    def _sees_point(self, point: FloatArray, end: FloatArray, label: int) -> bool:
        away_m = float(np.hypot(*(end - point)))
        if away_m > _SIGHT_M:
            return False
        along = np.arange(0.0, away_m - 0.35, _SAMPLE_M)[:, None]
        cells = self.grid.frame.cells_of(point + along * (end - point) / max(away_m, 1e-9))
        row, col = np.clip(cells, 0, np.array(self.grid.shape) - 1).T
        return bool((self.is_free[row, col] & (self.label_of[row, col] == label)).all())

    def reached(self, point: FloatArray, label: int, most_m: float) -> dict[tuple[int, int], float]:
        """Return how far it is to the cells of a room near a point, by at most so many metres."""
        side = self.grid.resolution_m
        begin = self.cell(point)
        found, queue = {begin: 0.0}, [(0.0, begin)]
        while queue:
            done_m, (row, col) = heapq.heappop(queue)
            if done_m > found[row, col] or done_m > most_m:
                continue
            for down, right in (
                (0, 1),
                (1, 0),
                (0, -1),
                (-1, 0),
                (1, 1),
                (1, -1),
                (-1, 1),
                (-1, -1),
            ):
                cell = row + down, col + right
                if not (0 <= cell[0] < self.grid.shape[0] and 0 <= cell[1] < self.grid.shape[1]):
                    continue
                if not self.is_body[cell] or self.label_of[cell] != label:
                    continue
                further_m = done_m + side * math.hypot(down, right)
                if further_m < found.get(cell, math.inf):
                    found[cell] = further_m
                    heapq.heappush(queue, (further_m, cell))
        return found

    @cached_property
    def is_thing(self) -> BoolArray:
        """What stands free and is small, so that people walk round it: bool (rows, cols)."""
        number, _ = ndimage.label(~self.is_free, structure=np.ones((3, 3)))
        areas_m2 = np.bincount(number.ravel()) * self.grid.cell_area_m2
        found: BoolArray = (areas_m2 < 1.0)[number] & ~self.is_free
        return found

    @cached_property
    def axis_rad(self) -> float:
        """The direction of most walls, radians in [0, pi / 2)."""
        wall = ndimage.gaussian_filter((~self.is_free).astype(np.float32), 2.0)
        up, right = np.gradient(wall)
        turned = np.exp(4j * np.arctan2(up, right)) * np.hypot(up, right) ** 2
        return float(np.angle(turned.sum()) / 4 + self.grid.frame.yaw_rad)

    def squared(self, angle_rad: float) -> float:
        """Return a direction, or that of the walls if it differs by less than 32 degrees."""
        off = math.remainder(angle_rad - self.axis_rad, math.pi / 2)
        return angle_rad - off if abs(off) < math.radians(32) else angle_rad


# Walking.


class Lost(Exception):  # noqa: N818 - no error of the program
    """The words fit nothing that is in sight."""


class Walker:
    """Somebody who follows sentences.

    `point`: where one begins, metres; `stride`: how much longer one's metre is than a metre.
    """

    def __init__(self, place: Place, point: FloatArray, stride: float = 1.0) -> None:
        self.place, self.point, self.stride = place, np.array(point, dtype=float), stride
        self.heading_rad = math.nan
        self.came_by: int | None = None
        """The door behind one's back."""
        self.label = int(place.label_of[place.cell(self.point)])
        self.trail: list[FloatArray] = [self.point.copy()]

    def follow(self, sentences: Sequence[str], language: str) -> str | None:
        """Follow sentences to the end; return the name of the room that one has come to."""
        for sentence in sentences:
            step = read(sentence, language)
            if language == "en" and step.into is None and self._is_readable(step.into_kind):
                step = replace(step, into=step.into_kind)  # "the hall", and a sign says "hall"
            if step.kind == "start":
                self._start(step)
            elif step.kind == "turn":
                self._turn(step)
            elif step.kind == "cross":
                self._cross(step)
        return self.place.names[self.label] if self.label >= 0 else None

    # How one begins.

    def _start(self, step: Step) -> None:
        if step.compass_rad is not None:
            self.heading_rad = step.compass_rad
        elif step.into is not None or step.into_kind is not None:
            near = [door for door in self._in_sight(step) if self._is_meant(door, step)]
            if not near:
                raise Lost("no such door at the start: " + step.text)
            bearing = self._bearing(near[0].point)
            self.heading_rad = bearing - (step.side_rad or 0.0)

    # Turns inside a room.

    def _turn(self, step: Step) -> None:
        if math.isnan(self.heading_rad) or step.turn_rad is None:
            raise Lost("turn from nowhere: " + step.text)
        begun_rad = self.heading_rad
        if step.is_to_end:
            self._ahead(math.inf)
        elif step.metres is not None:
            near_m, far_m = self._window(step.metres)
            self._ahead(near_m)
            self._until_open(step.turn_rad, far_m - near_m, begun_rad)
        done_rad = wrapped(self.heading_rad - begun_rad)
        if done_rad * step.turn_rad > 0 and abs(done_rad) >= 0.6 * abs(step.turn_rad):
            return  # a corner left no other way
        self.heading_rad = self._aligned(self.heading_rad + step.turn_rad)

    def _until_open(self, turn_rad: float, most_m: float, begun_rad: float) -> None:
        """Walk on until one can turn off, or has turned."""
        walked, begun, heading = 0.0, self.point.copy(), self.heading_rad
        while walked < most_m:
            done_rad = wrapped(self.heading_rad - begun_rad)
            is_done = done_rad * turn_rad > 0 and abs(done_rad) >= 0.6 * abs(turn_rad)
            if is_done or self._rays(np.array([turn_rad]))[0] >= 3.0:
                return
            if not self._one_step():
                return
            walked += _STEP_M
        self.point, self.heading_rad = (begun + self.point) / 2, heading
        self._settle()

    def _aligned(self, heading_rad: float) -> float:
        """Return a direction near one in which one can walk far: walls lead."""
        offsets = np.radians(np.arange(-30, 31, 5))
        lengths = [
            min(self.place.ray_m(self.point, heading_rad + off, self.label), 12.0)
            for off in offsets
        ]
        scores = np.array(lengths) - 4.0 * np.abs(offsets)
        return float(heading_rad + offsets[int(np.argmax(scores))])

    # Doors.

    def _cross(self, step: Step) -> None:
        if step.via is not None:
            self._turn_back_to(self._before(step.via))
        if step.wall is not None:
            door = self._along_a_wall(step, step.wall)
        elif step.across is not None:
            door = self._along_a_wall(step, -step.across, is_across=True)
        elif step.is_opening is None:
            door = self._next_border(step)
        elif math.isnan(self.heading_rad) or (step.metres is None and not step.is_to_end):
            door = self._at_a_glance(step)
        else:
            door = self._on_the_way(step)
        self._pass(door)
        if step.out_rad is not None:
            inside_m = min(1.5, self._rays(np.zeros(1))[0] / 2)
            ahead = np.array([math.cos(self.heading_rad), math.sin(self.heading_rad)])
            self.point = self.point + inside_m * ahead
            self.heading_rad = self._aligned(self.heading_rad + step.out_rad)

    def _at_a_glance(self, step: Step) -> Seen:
        """Return the door that fits first, looking round from where one stands."""
        for is_hidden in (False, True) if step.side_rad is None else (False,):
            near = self._in_sight(step, is_hidden=is_hidden)
            if step.ordinal is not None and not self._is_readable(step.into):
                near = near[step.ordinal - 1 :] if step.ordinal > 0 else near[:-2:-1]
            for door in near:
                if self._is_meant(door, step):
                    return door
        raise Lost("no such door in sight: " + step.text)

    def _in_sight(self, step: Step, *, is_hidden: bool = False) -> list[Seen]:
        """Return the doors in sight that fit the words, or those for which one walks round the
        room, the nearest first."""
        side_rad = step.side_rad if step.kind == "cross" else None
        if side_rad is None and step.kind == "cross":
            side_rad = step.turn_rad
        found = []
        for door in self.place.doors_of.get(self.label, ()):
            if {step.is_opening, door.is_opening} == {True, False}:
                continue
            if not is_hidden and not self.place.sees(self.point, door, self.label):
                continue
            if door.number == self.came_by:
                continue
            if side_rad is not None and not math.isnan(self.heading_rad):
                off = wrapped(self._bearing(door.point) - self.heading_rad - side_rad)
                if abs(off) > _BROAD_RAD + (
                    math.radians(20) if abs(side_rad) == math.pi / 2 else 0
                ):
                    continue
            found.append((float(np.hypot(*(door.point - self.point))), door.number, door))
        return [door for *_, door in sorted(found, key=lambda one: one[:2])]

    def _is_meant(self, door: Seen, step: Step) -> bool:
        """Tell whether the room behind a door may be the one that the words name."""
        if self._is_readable(step.into):
            return self.place.sign(door.beyond) == step.into
        kind = self.place.kinds[door.beyond] if door.beyond >= 0 else None
        return step.into_kind not in ("corridor", "hall") or kind == step.into_kind

    def _is_readable(self, name: str | None) -> bool:
        place = self.place
        return name is not None and any(
            place.sign(label) == name for label in range(len(place.names))
        )

    def _along_a_wall(  # noqa: C901, PLR0912, PLR0915 - one walk, all that may end it
        self, step: Step, hand: float, *, is_across: bool = False
    ) -> Seen:
        """Walk with a hand on the wall, from the door behind or straight on to the wall opposite,
        and return the door that is meant.

        A wall that an opening interrupts leads out of the space, unless the words have it passed,
        or one looks for a name at a door.
        """
        doors, passed, past = self._doors_beside(), 0, 0
        trail: list[FloatArray] = []
        is_read = self._is_readable(step.into)
        cell = begin = self.place.cell(self.point)
        ways = ((0, 1), (1, 0), (0, -1), (-1, 0))
        if is_across:
            came_by, away = None, np.array([math.cos(self.heading_rad), math.sin(self.heading_rad)])
            for away_m in np.arange(0.0, _SIGHT_M, self.place.grid.resolution_m / 4):
                there = self.place.cell(self.point + away_m * away)
                if self._is_inside(there):
                    cell = there
                elif not self.place.is_thing[there]:
                    break
        else:
            behind = [cell for cell, each in doors.items() if each[0].number == self.came_by]
            cell = min(behind or doors, key=lambda one: math.dist(one, begin))
            came_by = doors[cell][0].number
        outs = [n for n, way in enumerate(ways) if not self._is_inside(_next(cell, way))]
        if not outs:
            raise Lost("no wall: " + step.text)
        look = outs[0]
        if is_across:
            toward = self.heading_rad - self.place.grid.frame.yaw_rad
            look = max(outs, key=lambda n: math.cos(n * math.pi / 2 - toward))
        way, last = (look + int(hand > 0) * 2 + 1) % 4, came_by
        most = round(300 / self.place.grid.resolution_m)
        for _ in range(most):
            side = (way + int(hand)) % 4  # the hand on the wall
            trail.append(self.place.grid.frame.points_of(np.array([cell]))[0])
            beside, ahead = _next(cell, ways[side]), _next(cell, ways[way])
            if self._is_inside(beside):
                cell, way = beside, side
                continue
            here = doors.get(cell, []) if self._is_free(beside) else []
            if here and here[0].number not in (last, came_by):
                last = here[0].number
                is_alike = any({step.is_opening, one.is_opening} != {True, False} for one in here)
                passed += is_alike
                is_there = past == step.past and passed == step.ordinal
                if step.far_m is not None:
                    # Nobody comes to the wall opposite a door within half a metre.
                    near_m, far_m = self._window(step.far_m)[0], self._window(step.far_m, 0.5)[1]
                    is_there = near_m <= self._walked_m(trail) <= far_m
                for door in here:
                    is_meant = is_there and is_alike and self._is_meant(door, step)
                    if is_meant and (step.into is None or self._can_reach(door)):
                        return door
                if not is_alike and here[0].is_opening:
                    passed, past = 0, past + 1
                is_unclear = any(one.is_opening is None for one in here)
                if (past > step.past or is_unclear) and not is_read:
                    break
            if self._is_inside(ahead):
                cell = ahead
            else:
                way = (way - int(hand)) % 4
        raise Lost("no such door in the wall: " + step.text)

    def _before(self, step: Step) -> Seen:
        """Return the door that one goes to, but not through."""
        if step.wall is None and step.across is None:
            return self._at_a_glance(step)
        if step.across is None:
            return self._along_a_wall(step, step.wall or 1.0)
        return self._along_a_wall(step, -step.across, is_across=True)

    @staticmethod
    def _walked_m(trail: Sequence[FloatArray]) -> float:
        """Return how far one has walked who cuts the corners of what is less than a stride."""
        kept = [trail[0]]
        for point in trail[1:]:
            if math.dist(point, kept[-1]) >= 2 * _STEP_M:
                kept.append(point)
        return math.dist(kept[-1], trail[-1]) + sum(
            math.dist(one, other) for one, other in itertools.pairwise(kept)
        )

    def _turn_back_to(self, door: Seen) -> None:
        """Go to a door and look from it into the room."""
        self.came_by, self.heading_rad = door.number, self.place.squared(door.out_rad + math.pi)
        away = np.array([math.cos(door.out_rad), math.sin(door.out_rad)])
        self.point = door.point - _AWAY_M * away
        self._settle()

    def _is_inside(self, cell: tuple[int, int]) -> bool:
        return self._is_free(cell) and int(self.place.label_of[cell]) == self.label

    def _is_free(self, cell: tuple[int, int]) -> bool:
        shape = self.place.grid.shape
        is_on_map = 0 <= cell[0] < shape[0] and 0 <= cell[1] < shape[1]
        return is_on_map and bool(self.place.is_free[cell])

    def _doors_beside(self) -> dict[tuple[int, int], list[Seen]]:
        """Return the doors of the room by the cells of it beside them."""
        of, labels = self.place.cells_of, self.place.label_of
        doors = self.place.doors_of.get(self.label, ())
        found: dict[tuple[int, int], list[Seen]] = {}
        for door in doors:
            for cell in of[door.number]:
                if labels[cell] == self.label:
                    found.setdefault(cell, []).append(door)
        return found

    def _next_border(self, step: Step) -> Seen:
        """Return what lies ahead where the words name no door."""
        return self._on_the_way(Step("cross", is_opening=None, side_rad=0.0, into=step.into))

    def _on_the_way(self, step: Step) -> Seen:  # noqa: C901 - one walk, all that may end it
        """Walk ahead and return the door at which the words are fulfilled."""
        hand_rad = step.side_rad if step.side_rad is not None else step.turn_rad
        near_m, far_m = 0.0, math.inf
        if step.metres is not None and step.ordinal is None and not step.is_to_end:
            near_m, far_m = self._window(step.metres)
        walked, passed, last_of_side = 0.0, 0, None
        doors = self.place.doors_of.get(self.label, ())
        known: set[int] = {self.came_by} if self.came_by is not None else set()
        for walked in self._steps():
            for door in self._reached(doors, hand_rad, known):
                known.add(door.number)
                if {step.is_opening, door.is_opening} == {True, False}:
                    continue
                passed += 1
                if not self._is_meant(door, step):
                    continue
                last_of_side = door
                if step.is_to_end or step.ordinal == -1:
                    continue
                if step.ordinal is None and walked < near_m:
                    continue
                if step.ordinal in (None, passed) or self._is_readable(step.into):
                    return door
            if walked > far_m:
                break
        if (step.is_to_end or step.ordinal == -1) and last_of_side is not None:
            return last_of_side
        if step.is_to_end or hand_rad is None:
            return self._at_a_glance(Step("cross", is_opening=step.is_opening, into=step.into))
        raise Lost("no such door on the way: " + step.text)

    def _steps(self) -> Iterator[float]:
        """Walk ahead until the end of the space; yield the metres walked."""
        walked = 0.0
        yield walked
        for _ in range(1000):
            if not self._one_step():
                return
            walked += _STEP_M
            yield walked

    def _reached(
        self, doors: Sequence[Seen], hand_rad: float | None, known: set[int]
    ) -> Iterator[Seen]:
        """Yield the doors that one comes beside now, or before."""
        is_free = self._rays(np.zeros(1))[0] > 1.0
        for door in doors:
            away = door.point - self.point
            if door.number in known or np.hypot(*away) > 6.0:
                continue
            way = np.array([math.cos(self.heading_rad), math.sin(self.heading_rad)])
            ahead_m, left_m = float(away @ way), float(way[0] * away[1] - way[1] * away[0])
            off = wrapped(door.out_rad - self.heading_rad)
            is_side = abs(math.sin(off)) >= math.sin(math.radians(40))
            if not hand_rad:
                is_here = abs(off) < math.radians(50) and np.hypot(*away) < 2.0 and ahead_m > -0.3
            else:
                is_left = hand_rad > 0
                reach_m = 0.25 if is_free else 1.6
                is_here = is_side and (off > 0) == is_left and -0.5 <= ahead_m <= reach_m
                is_here = is_here and (left_m > 0) == is_left and abs(left_m) < 5.0
            if is_here and self.place.sees(self.point, door, self.label):
                yield door

    def _pass(self, door: Seen) -> None:
        """Go to a door that one has seen, and through it."""
        if not self._can_reach(door):
            raise Lost("the door cannot be reached")
        self.label, self.came_by = door.beyond, door.number
        self.heading_rad = self.place.squared(door.out_rad)
        way = np.array([math.cos(door.out_rad), math.sin(door.out_rad)])
        self.point = door.point + _AWAY_M * way
        self._settle()

    def _can_reach(self, door: Seen) -> bool:
        parts = self.place.label_of == self.label
        parts &= self.place.is_body
        number, _ = ndimage.label(parts)
        own = number[self.place.cell(self.point)]
        rows, cols = np.array([self.place.cell(end) for end in door.span]).T
        low, high = np.maximum([rows.min() - 12, cols.min() - 12], 0), (rows.max(), cols.max())
        near = number[low[0] : high[0] + 13, low[1] : high[1] + 13]
        return bool(own == 0 or (near == own).any())

    # Steps.

    def _window(self, metres: float, slack_m: float = 1.0) -> tuple[float, float]:
        """Return from where to where a distance may lie for one who guesses it."""
        near_m, far_m = 0.8 * metres - slack_m, 1.2 * metres + 1.5 * slack_m
        return max(0.0, near_m) * self.stride, far_m * self.stride

    def _ahead(self, metres: float) -> None:
        for walked in self._steps():
            if walked >= metres:
                return

    def _one_step(self) -> bool:
        """Walk a step where the space leads, in its middle; return whether one could.

        At a corner one follows the only way on; where there are two, one stops.
        """
        offsets = np.radians(np.arange(-50, 51, 10))
        lengths = np.minimum(self._rays(offsets), 2.5)
        if lengths.max() < 1.0:
            return self._round_an_obstacle() or self._round_a_corner()
        best = int(np.argmax(lengths - 3.0 * np.abs(offsets)))
        turn_rad = float(np.clip(offsets[best], -math.radians(15), math.radians(15)))
        if self._rays(np.array([turn_rad]))[0] < _STEP_M:
            turn_rad = float(offsets[best])
        self.heading_rad += turn_rad
        ahead = np.array([math.cos(self.heading_rad), math.sin(self.heading_rad)])
        self.point = self.point + _STEP_M * ahead
        left_m, right_m = np.minimum(self._rays(np.array([math.pi / 2, -math.pi / 2])), 1.5)
        aside = np.clip((left_m - right_m) / 4, -0.1, 0.1) * np.array([-ahead[1], ahead[0]])
        if self.place.ray_m(self.point, math.atan2(aside[1], aside[0]), self.label) > 0.2:
            self.point = self.point + aside
        self.trail.append(self.point.copy())
        return True

    def _rays(self, offsets: FloatArray) -> FloatArray:
        """Return how far one can walk at angles to where one looks."""
        return np.array(
            [self.place.ray_m(self.point, self.heading_rad + off, self.label) for off in offsets]
        )

    def _round_a_corner(self) -> bool:
        offsets = np.radians(np.arange(30, 121, 10))
        ways = []
        for hand in (1, -1):
            open_to = offsets[self._rays(hand * offsets) > 2.5]
            if len(open_to):
                ways.append(hand * float(np.median(open_to)))
        if len(ways) == 1:
            self.heading_rad += ways[0]
        return len(ways) == 1

    def _round_an_obstacle(self) -> bool:
        """Walk round a thing in the way, to where one sees the floor again behind it."""
        place, ahead = (
            self.place,
            np.array([math.cos(self.heading_rad), math.sin(self.heading_rad)]),
        )
        part = place.reached(self.point, self.label, 4.0)
        for away_m in np.arange(1.0, 3.1, 0.25):
            cell = place.cell(self.point + away_m * ahead)
            if part.get(cell, math.inf) <= 1.6 * away_m + 0.5:
                self.point = place.grid.frame.points_of(np.array([cell]))[0]
                self.trail.append(self.point.copy())
                return True
        return False

    def _settle(self) -> None:
        """Stand on the nearest cell of the room on which one can."""
        place, (row, col) = self.place, self.place.cell(self.point)
        reach = round(2.0 / place.grid.resolution_m)
        low = max(row - reach, 0), max(col - reach, 0)
        window = np.s_[low[0] : row + reach + 1, low[1] : col + reach + 1]
        cells = np.argwhere(place.is_body[window] & (place.label_of[window] == self.label)) + low
        if len(cells):
            nearest = cells[int(np.argmin(((cells - (row, col)) ** 2).sum(axis=1)))]
            self.point = place.grid.frame.points_of(nearest[None])[0]
        self.trail.append(self.point.copy())

    def _bearing(self, point: FloatArray) -> float:
        dx, dy = point - self.point
        return math.atan2(dy, dx)


def _next(cell: tuple[int, int], way: tuple[int, int]) -> tuple[int, int]:
    return cell[0] + way[0], cell[1] + way[1]


def wrapped(angle_rad: float) -> float:
    """Return an angle in [-pi, pi]."""
    return math.remainder(angle_rad, math.tau)
