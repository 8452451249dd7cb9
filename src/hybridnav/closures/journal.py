"""What is out of order until it is opened again: a journal beside the file of a map or building."""

import json
import os
import re
import time
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from hybridnav._base.files import printable, replace_file
from hybridnav._base.yaml_file import Limits, read_marked
from hybridnav.closures.blocked import Blocked
from hybridnav.closures.one_way import OneWay, directions_on
from hybridnav.errors import InvalidValueError, MapError, brief
from hybridnav.maps import OneWayRule
from hybridnav.topology import TopologicalMap

try:
    import fcntl
except ImportError:  # on Windows two that write at once are not kept apart
    fcntl = None  # type: ignore[assignment]

from collections.abc import Iterator, Sequence

from hybridnav._base.typing import PathLike

_ENDING = ".closed.yaml"
_WHAT = re.compile(
    r"(?:one-way:)?link:(?P<link>.+)|(?:(?P<floor>.+?):)?"
    r"(?:door:(?P<door>[0-9]{1,9})|room:(?P<room>.+)|one-way:(?P<one_way>(?:door|line):.+))"
)
_MOST_ITEMS, _MOST_TEXT = 1000, 200
_LIMITS = Limits(max_bytes=2**22, max_values=10_000)
"""More than is ever written: 4 bytes for each character, 9 values for each item."""
_KEYS = ("what", "since", "why", "by")
_WAIT_S, _STEP_S = 10.0, 0.02
_HEADER = "# Out of order until it is opened again; hybridnav closed writes it, without comments.\n"


@dataclass(frozen=True)
class OutOfOrder:
    """One thing that is closed until it is opened again.

    Raises
    ------
    InvalidValueError
        When it is no link, door or room, or a text is not one line of at most 200 characters.

    Examples
    --------
    >>> hn.OutOfOrder("2:door:7", why="repair").floor
    '2'
    """

    what: str
    """`link:NAME`, `door:N`, `room:NAME`, or `one-way:` and a `OneWayRule`; with `FLOOR:` before
    the last three in a building. `link:NAME@FLOOR` is closed there, `link:NAME=up` leads up."""
    since: str = ""
    """When it was closed, UTC."""
    why: str = ""
    by: str = ""

    def __post_init__(self) -> None:
        """Refuse what names nothing."""
        for name, text in asdict(self).items():
            if not isinstance(text, str) or len(text) > _MOST_TEXT or not text.isprintable():
                raise InvalidValueError(
                    f"{name} must be one line of at most {_MOST_TEXT} characters, got {brief(text)}"
                )
        if not _WHAT.fullmatch(self.what):
            raise InvalidValueError(
                "a closed thing must be link:NAME, door:N, room:NAME or one-way:RULE, in a "
                f"building with FLOOR: before all but links, got {brief(self.what)}"
            )
        _ = self.blocked

    @property
    def _parts(self) -> dict[str, str | None]:
        match = _WHAT.fullmatch(self.what)
        assert match is not None  # noqa: S101 - it was checked
        return match.groupdict()

    @property
    def link(self) -> str | None:
        """The name of the link, with `@FLOOR` or `=up` as `what` has it; None for no link."""
        return self._parts["link"]

    @property
    def floor(self) -> str | None:
        """The floor of a door or a room; None for links, and on a map without floors."""
        return self._parts["floor"]

    @property
    def blocked(self) -> Blocked:
        """The closure of the door or the room, or the direction."""
        door, room, rule = (self._parts[name] for name in ("door", "room", "one_way"))
        one_way = OneWay.of([OneWayRule.of(rule)]) if rule else None
        return Blocked(
            doors=[int(door)] if door else [], rooms=[room] if room else [], one_way=one_way
        )

    def check_on(self, topology: TopologicalMap) -> None:
        """Refuse things that are not on a map without floors.

        Raises
        ------
        InvalidValueError
            When there is no such door or room, or it is of a building.
        """
        if self.link is not None or self.floor is not None:
            raise InvalidValueError(f"{self.what} is of a building, and this is one map")
        self.check_in(topology)

    def check_in(self, topology: TopologicalMap) -> None:
        """Refuse a door, a room or a direction that is not on a map, or on a floor."""
        self.blocked.cells_of(topology)
        directions_on(topology, self.blocked.directions)


def _mark(state: os.stat_result) -> tuple[int, int, int]:
    return state.st_ino, state.st_mtime_ns, state.st_size


class Journal:
    """Things out of order in a building or on a map, in `NAME.closed.yaml` beside its file.

    Programs and threads may share it: each change reads the file anew under a lock and writes it
    whole. Two that change different things lose nothing. If two change one thing, the last one
    wins.

    Parameters
    ----------
    path
        The file of the building or the map; the journal need not exist.

    Examples
    --------
    >>> journal = hn.Journal("hospital.yaml")
    >>> journal.close("link:north lift", why="repair")
    >>> [item.what for item in hn.Journal("hospital.yaml").items()]
    ['link:north lift']
    >>> journal.open("link:north lift")
    True
    """

    def __init__(self, path: PathLike) -> None:
        file = Path(path)
        self.path = file.with_name(f"{file.stem}{_ENDING}")
        """The file of the journal."""
        self._read: tuple[tuple[int, int, int] | None, tuple[OutOfOrder, ...]] = (None, ())

    def __repr__(self) -> str:
        return f"Journal({str(self.path)!r})"

    def items(self) -> tuple[OutOfOrder, ...]:
        """Return the things that are out of order now; the file is read when it has changed.

        Raises
        ------
        MapError
            When it cannot be read, one line.
        """
        try:
            state = self.path.stat()
        except FileNotFoundError:
            return ()
        except OSError as error:
            raise MapError(f"closed {printable(self.path)}: {error.strerror}") from None
        if self._read[0] != _mark(state):
            self._read = _mark(state), self._entries() if state.st_size else ()
        return self._read[1]

    def closures(self, floor: str | None = None) -> Blocked:
        """Return the closed doors and rooms of a floor, or of a map without floors.

        Parameters
        ----------
        floor
            Name of the floor.

        Raises
        ------
        MapError
            When the journal cannot be read.
        """
        closed = Blocked()
        for item in self.items():
            if item.link is None and item.floor == floor:
                closed |= item.blocked
        return closed

    def close(self, what: str, *, why: str = "", by: str = "") -> None:
        """Close something until it is opened again; who closes it again states the reason anew.

        Parameters
        ----------
        what
            As in `OutOfOrder`. Whether there is such a thing is seen when routes are planned.
        why, by
            The reason, and who closes it, one line each.

        Raises
        ------
        InvalidValueError
            When it is no link, door or room, or there are too many.
        MapError
            When the journal cannot be read or written.
        """
        since = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S")
        made = OutOfOrder(what, since, why, by)
        with self._alone() as items:
            others = [item for item in items if item.what != what]
            if len(others) >= _MOST_ITEMS:
                raise InvalidValueError(f"at most {_MOST_ITEMS} things are closed at once")
            self._write([*others, made])

    def open(self, what: str) -> bool:
        """Open something again, and return whether it was closed.

        Raises
        ------
        MapError
            When the journal cannot be read or written.
        """
        with self._alone() as items:
            others = [item for item in items if item.what != what]
            if len(others) < len(items):
                self._write(others)
            return len(others) < len(items)

    def _entries(self) -> tuple[OutOfOrder, ...]:
        where = f"closed {printable(self.path)}"
        marked = read_marked(self.path, what="closed", error=MapError, limits=_LIMITS)
        entries: Any = marked.values.get("closed")
        if set(marked.values) != {"closed"} or not isinstance(entries, list):
            raise MapError(f"{where}: expected the key closed with a list, and no other key")
        if len(entries) > _MOST_ITEMS:
            raise MapError(f"{where}: {len(entries)} items, at most {_MOST_ITEMS} are read")
        items: dict[str, OutOfOrder] = {}
        for number, entry in enumerate(entries):
            at = f"{where}, line {marked.line('closed', number)}"
            if not isinstance(entry, dict) or not {"what"} <= entry.keys() <= set(_KEYS):
                raise MapError(f"{at}: expected what, since, why and by, got {brief(entry)}")
            try:
                item = OutOfOrder(**entry)
            except InvalidValueError as error:
                raise MapError(f"{at}: {error}") from None
            items[item.what] = item
        return tuple(items.values())

    def _write(self, items: Sequence[OutOfOrder]) -> None:
        lines = ["closed:" if items else "closed: []"]
        for item in items:
            pairs = [
                f"{key}: {json.dumps(text, ensure_ascii=False)}"
                for key, text in asdict(item).items()
            ]
            lines.append(f"- {{{', '.join(pairs)}}}")
        content = (_HEADER + "\n".join(lines) + "\n").encode()
        self._read = _mark(replace_file(self.path, [content])), tuple(items)

    @contextmanager
    def _alone(self) -> Iterator[tuple[OutOfOrder, ...]]:
        """Yield what is closed now, while nobody else changes it; a kill ends the lock too."""
        where = f"closed {printable(self.path)}"
        until = time.monotonic() + _WAIT_S
        try:
            while True:
                with self.path.open("ab") as stream:
                    if self._has_locked(stream.fileno()):
                        yield self.items()
                        return
                if time.monotonic() > until:
                    raise MapError(f"{where}: another program holds its lock, try again")
                time.sleep(_STEP_S)
        except OSError as error:
            raise MapError(f"{where}: cannot write: {error.strerror}") from None

    def _has_locked(self, opened: int) -> bool:
        """Return whether the lock of the file is ours, and the file is still the one of the name:
        who writes puts another in its place."""
        if fcntl is None:
            return True
        try:
            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return os.fstat(opened).st_ino == self.path.stat().st_ino
        except (BlockingIOError, FileNotFoundError):
            return False
