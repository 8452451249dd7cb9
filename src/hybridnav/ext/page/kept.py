"""What a page keeps in files: rooms with unsaved changes, what is out of order, favourites."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

from hybridnav._base.files import printable, replace_file
from hybridnav.closures import Journal, OutOfOrder
from hybridnav.errors import InvalidValueError, RoomsError
from hybridnav.ext.page.requests import ClosingChange, Favour, Find
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.maps.names import folded, matching
from hybridnav.planning import Profile
from hybridnav.rooms.files import save_rooms
from hybridnav.rooms.files.cells import cells_file

# The profiles, and what is out of order until it is opened again.


@dataclass(frozen=True)
class Closings:
    """The profiles that queries may name, and the journal of things closed for all.

    Examples
    --------
    >>> from hybridnav.ext.page.kept import Closings
    >>> Closings((), hn.Journal("hospital.yaml"), lambda item: None).describe()["closed"]
    []
    """

    profiles: Sequence[Profile]
    journal: Journal | None
    """None where no file keeps closures."""
    check: Callable[[OutOfOrder], None]
    """Refuses to close missing things."""

    def describe(self, change: ClosingChange | None = None) -> dict[str, Any]:
        """Return the profiles with their demands, and things that are out of order, after a change.

        Raise `HybridNavError` when what is to be closed or opened is not there, or the journal
        cannot be read or written, or there is none.
        """
        journal = self.journal
        if change is not None:
            if journal is None or journal.path.resolve().parent != journal.path.parent.resolve():
                raise InvalidValueError("no journal keeps closures here, in the folder of a map")
            if change.closed:
                self.check(OutOfOrder(change.what))
                journal.close(change.what, why=change.why, by=change.by)
            else:
                journal.open(change.what)
        return {
            "profiles": [asdict(one) for one in self.profiles],
            "closed": [] if journal is None else [asdict(item) for item in journal.items()],
            "can_close": journal is not None,
        }


# The file of rooms, and the journal that keeps changes until they are saved.

_MOST_BYTES = 10_000_000
"""Size of a journal that is read."""


class RoomsFile:
    """A file of rooms inside one folder, and its journal `.NAME.edits` beside it.

    `folder`: the only folder that is written to; `name`: name of the file in it. Raises
    `RoomsError` when the file is a link that leads out of the folder.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.folder = folder.resolve()
        self.path = self.folder / name
        self.journal = self.folder / f".{name}.edits"
        self._check_inside(self.path)
        self._seen = self._digest()
        self._told = self._seen

    def _check_inside(self, path: Path) -> None:
        if path.resolve().parent != self.folder:
            raise RoomsError(
                f"rooms {printable(path)}: a link that leads out of {printable(self.folder)}; "
                "the page writes nothing outside the folder of the map"
            )

    def _digest(self) -> str:
        """Return a digest of the file as it is, empty if there is none."""
        try:
            return hashlib.sha256(self.path.read_bytes()).hexdigest()
        except OSError:
            return ""

    def is_changed(self, *, since_told: bool = False) -> bool:
        """Return whether somebody else has changed the file since it was read or written here.

        `since_told`: whether to overlook the change that the last call returned.
        """
        now = self._digest()
        digests = {self._seen, self._told} if since_told else {self._seen}
        self._told = now
        return now not in digests

    def save(self, rooms: RoomLabels, grid: OccupancyGrid) -> None:
        """Write rooms whole or not at all, and end the journal.

        Raises `RoomsError` when the file cannot be written; the old one and the journal stay.
        """
        self._check_inside(self.path)
        self._check_inside(cells_file(self.path))
        save_rooms(self.path, rooms, grid)
        self._seen = self._digest()
        with suppress(OSError):
            self.journal.unlink(missing_ok=True)

    def keep(self, changes: Sequence[dict[str, Any]]) -> str | None:
        """Write changes into the journal; return why it could not be written, None if it was."""
        self._check_inside(self.journal)
        try:
            if not changes:
                self.journal.unlink(missing_ok=True)
            else:
                text = json.dumps({"rooms": self._seen, "changes": list(changes)})
                if len(text) > _MOST_BYTES:
                    return f"more than {_MOST_BYTES} bytes are not read again"
                replace_file(self.journal, [text.encode()])
        except OSError as error:
            return str(error.strerror)
        return None

    def kept(self) -> list[Any]:
        """Return the changes of a journal, none where there is none that can be read."""
        with suppress(OSError, ValueError, RecursionError, RoomsError):
            self._check_inside(self.journal)
            if self.journal.stat().st_size > _MOST_BYTES:
                return []
            content = json.loads(self.journal.read_text(encoding="utf-8"))
            changes = content.get("changes") if isinstance(content, dict) else None
            return changes if isinstance(changes, list) else []
        return []


# Rooms by name on a page: found as people type them, and the favourites that are kept.

_FILE = ".hybridnav-favourites.json"
_MOST_OF_FAVOURITES = 1_000_000
_MOST_FOUND = 200


class Named(NamedTuple):
    """A site by its `name`, those of its `floors`, and of the `places` that robots go to."""

    name: str
    floors: tuple[str, ...]
    places: list[tuple[int, str]]


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
            if not self._file.is_symlink() and self._file.stat().st_size <= _MOST_OF_FAVOURITES:
                content = json.loads(self._file.read_text(encoding="utf-8"))
                self._kept = {name: _pairs(pairs) for name, pairs in content.items()}

    def find(self, site: Named, asked: Find) -> dict[str, Any]:
        """Return the rooms and points that a text may mean, the best first: `FLOOR:NAME`, or a name
        of any floor, as `hybridnav.maps.names.matching` has it. All of them for an empty text."""
        floor, text = None, asked.text
        before, colon, after = text.partition(":")
        for number, name in enumerate(site.floors):
            if colon and folded(before) == folded(name):
                floor, text = number, after
        places = [named for named in site.places if floor in {None, named[0]}]
        kept = self._kept.get(site.name, [])
        matches = [
            {
                "floor": places[at][0],
                "name": places[at][1],
                "same": folded(places[at][1]) == folded(text),
                "favourite": [site.floors[places[at][0]], places[at][1]] in kept,
            }
            for at in matching(text, [name for _, name in places])
        ]
        matches.sort(key=lambda each: (not each["same"], not each["favourite"]))
        return {"found": matches[:_MOST_FOUND]}

    def favour(self, site: Named, asked: Favour) -> dict[str, Any]:
        """Keep a room or point as a favourite, or no longer.

        Raises `InvalidValueError` when there is none of this name, `OSError` when the file cannot
        be written: the favourite then lasts as long as the page.
        """
        if (asked.floor, asked.name) not in set(site.places):
            raise InvalidValueError(f"no room or point is called {asked.name!r:.80}")
        named = [site.floors[asked.floor], asked.name]
        with self._lock:
            others = [each for each in self._kept.get(site.name, []) if each != named]
            kept = {**self._kept, site.name: [*others, named] if asked.kept else others}
            content = json.dumps(kept, ensure_ascii=False).encode()
            if asked.kept and len(content) > _MOST_OF_FAVOURITES:
                raise InvalidValueError(f"{_FILE} is full: remove favourites that nobody needs")
            self._kept = kept
            if self._file.is_symlink():
                raise InvalidValueError(f"{_FILE} is a link: the page writes through none")
            replace_file(self._file, content)
        return {}


def _pairs(value: Any) -> list[list[str]]:
    """Return pairs of a floor and a name of a file, without what is none."""
    return [
        each
        for each in value
        if isinstance(each, list) and len(each) == 2 and all(isinstance(part, str) for part in each)  # noqa: PLR2004
    ]
