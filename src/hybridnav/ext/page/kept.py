"""What a page keeps in files: its rooms with unsaved changes, and what is out of order."""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from hybridnav._base.files import printable, replace_file
from hybridnav.errors import InvalidValueError, RoomsError
from hybridnav.planner import OutOfOrder
from hybridnav.topology.rooms.files import save_rooms

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from hybridnav.ext.page.requests import ClosingChange
    from hybridnav.maps import OccupancyGrid, RoomLabels
    from hybridnav.planner import Journal, Profile


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

        Parameters
        ----------
        change
            What to close or to open; None for nothing.

        Raises
        ------
        HybridNavError
            When it is not there, or the journal cannot be read or written, or there is none.
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
        known = {self._seen, self._told} if since_told else {self._seen}
        self._told = now
        return now not in known

    def save(self, rooms: RoomLabels, grid: OccupancyGrid) -> None:
        """Write rooms whole or not at all, and end the journal.

        Raises `RoomsError` when the file cannot be written; the old one and the journal stay.
        """
        self._check_inside(self.path)
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
            found = json.loads(self.journal.read_text(encoding="utf-8"))
            changes = found.get("changes") if isinstance(found, dict) else None
            return changes if isinstance(changes, list) else []
        return []
