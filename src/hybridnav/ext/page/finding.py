"""Rooms by name on a page: found as people type them, and the favourites that are kept."""

from __future__ import annotations

import json
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from hybridnav._base.files import replace_file
from hybridnav.errors import InvalidValueError
from hybridnav.maps.names import folded, matching

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from hybridnav.ext.page.requests import Favour, Find
    from hybridnav.ext.page.site import Site

_FILE = ".hybridnav-favourites.json"
_MOST_BYTES = 1_000_000
_MOST_FOUND = 200


class Finder:
    """Finds rooms and named points of a site, its favourites first. Threads may share it.

    Favourites stand in one file of the folder, so that they outlive the page, whose address is
    another one each time.

    `folder`: the folder of the map or building.
    """

    def __init__(self, folder: Path) -> None:
        self._file = folder.resolve() / _FILE
        self._lock = threading.Lock()
        self._kept: dict[str, list[list[str]]] = {}
        with suppress(OSError, ValueError, TypeError, AttributeError, RecursionError):
            if not self._file.is_symlink() and self._file.stat().st_size <= _MOST_BYTES:
                found = json.loads(self._file.read_text(encoding="utf-8"))
                self._kept = {name: _pairs(pairs) for name, pairs in found.items()}

    def find(self, site: Site, asked: Find) -> dict[str, Any]:
        """Return the rooms and points that a text may mean, the best first: `FLOOR:NAME`, or a name
        of any floor, as `hybridnav.maps.names.matching` has it. All of them for an empty text."""
        floor, text = None, asked.text
        before, colon, after = text.partition(":")
        for number, name in enumerate(site.names):
            if colon and folded(before) == folded(name):
                floor, text = number, after
        known = [named for named in _all_of(site) if floor in {None, named[0]}]
        kept = self._kept.get(site.name, [])
        found = [
            {
                "floor": known[at][0],
                "name": known[at][1],
                "same": folded(known[at][1]) == folded(text),
                "favourite": [site.names[known[at][0]], known[at][1]] in kept,
            }
            for at in matching(text, [name for _, name in known])
        ]
        found.sort(key=lambda each: (not each["same"], not each["favourite"]))
        return {"found": found[:_MOST_FOUND]}

    def favour(self, site: Site, asked: Favour) -> dict[str, Any]:
        """Keep a room or point as a favourite, or no longer.

        Raises `InvalidValueError` when there is none of this name, `OSError` when the file cannot
        be written: the favourite then lasts as long as the page.
        """
        if (asked.floor, asked.name) not in set(_all_of(site)):
            raise InvalidValueError(f"no room or point is called {asked.name!r:.80}")
        named = [site.names[asked.floor], asked.name]
        with self._lock:
            others = [each for each in self._kept.get(site.name, []) if each != named]
            self._kept[site.name] = [*others, named] if asked.kept else others
            if self._file.is_symlink():
                raise InvalidValueError(f"{_FILE} is a link: the page writes through none")
            replace_file(self._file, json.dumps(self._kept, ensure_ascii=False).encode())
        return {}


def _all_of(site: Site) -> Iterator[tuple[int, str]]:
    """Yield the floor and the name of each room that the robot fits in, and of each point."""
    for number, session in enumerate(site.sessions):
        rooms = session.planning.topology.rooms
        for name, fits in zip(rooms.names, rooms.fits.tolist(), strict=True):
            if fits:
                yield number, name
        yield from ((number, name) for name in rooms.labels.points if name not in rooms.names)


def _pairs(value: Any) -> list[list[str]]:
    """Return pairs of a floor and a name of a file, without what is none."""
    return [
        each
        for each in value
        if isinstance(each, list) and len(each) == 2 and all(isinstance(part, str) for part in each)  # noqa: PLR2004
    ]
