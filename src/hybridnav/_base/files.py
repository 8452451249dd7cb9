"""Files that are old or new and never half, their names in messages, and the endings that formats
demand.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hybridnav.errors import MapError

if TYPE_CHECKING:
    from typing_extensions import Self

    from hybridnav._base.typing import PathLike

MODEL_SUFFIX = ".hnm"
"""Suffix of the name of a model."""

_MOST_SHOWN_OF_PATH, _MOST_SHOWN_OF_NAME = 255, 80
"""Characters of a path in a message, and of a name in it; of more, 80 are shown."""

_unfinished: set[Path] = set()


def replace_file(path: Path, content: bytes | Iterable[bytes | memoryview]) -> os.stat_result:
    """Write a file whole or not at all: the old content survives an interrupt and a full disc.

    `path`: the file; an existing one is replaced and keeps its mode, a link stays a link;
    `content`: the whole content, at once or in parts. Returns the state of what was written, even
    if another program replaces it at once. Raises `OSError` when the file cannot be written.
    """
    if _is_no_file(path):
        _write(path, content)
        return path.stat()
    path = path.resolve()
    with _beside(path) as beside:
        _write(beside, content)
        if path.exists():
            shutil.copymode(path, beside)
        state = beside.stat()
        beside.replace(path)
    return state


def _write(path: Path, content: bytes | Iterable[bytes | memoryview]) -> None:
    if isinstance(content, bytes):
        path.write_bytes(content)
        return
    with path.open("wb") as file:
        for part in content:
            file.write(part)
        if file.seekable():  # a pipe has no disc to reach
            file.flush()
            os.fsync(file.fileno())


def check_replaceable(path: Path) -> None:
    """Test whether `replace_file` could write a file, without any change.

    `path`: the file. A pipe is not tested: its reader would take the test for the content. Raises
    `OSError` when the file could not be written.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if _is_no_file(path):
        return
    with _beside(path.resolve()) as beside:
        beside.touch(exist_ok=False)


def _is_no_file(path: Path) -> bool:
    """Return whether a path is a pipe, a terminal or a folder, which cannot be replaced."""
    return path.exists() and not path.is_file()


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    """Yield a short temporary path beside a file for one thread, and remove it afterwards."""
    beside = path.with_name(f".hybridnav.{os.getpid()}.{threading.get_ident()}")
    _unfinished.add(beside)
    try:
        yield beside
    finally:
        beside.unlink(missing_ok=True)
        _unfinished.discard(beside)


def remove_unfinished() -> None:
    """Remove the temporary files of this process, before it ends."""
    for path in list(_unfinished):
        with suppress(OSError):
            path.unlink()


_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def without_controls(text: str) -> str:
    """Return a text with its control characters written out, but line ends and tabs: texts of
    others may hold sequences that a terminal obeys.

    Returns what a terminal shows as it is.
    """
    return _CONTROLS.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


def printable(path: str | os.PathLike[str]) -> str:
    """Return the text of a path for a message.

    It is escaped if it would break the line, and cut if it is longer than file systems and people
    use.

    Returns one line.
    """
    text = str(path)
    longest = max(map(len, text.split("/")))
    if len(text) > _MOST_SHOWN_OF_PATH or longest > _MOST_SHOWN_OF_NAME:
        text = f"{text[:38]}...{text[-39:]}"
    return text if text.isprintable() else repr(text)


@dataclass(frozen=True)
class NewFile:
    """A file that is written whole, or not at all; one that exists is replaced."""

    path: Path
    where: str
    """What messages begin with."""

    @classmethod
    def named(cls, path: PathLike, what: str, kind: str, endings: tuple[str, ...]) -> Self:
        """Return the file of a name.

        `what`: what the file is, before its name in messages; `kind`: the same with its article and
        format, such as "a layout"; `endings`: how its name may end, such as ".json". Raises
        `MapError` when it ends otherwise.
        """
        file = Path(path)
        where = f"{what} {printable(file)}"
        if file.suffix.lower() not in endings:
            raise MapError(f"{where}: {kind} must be named {' or '.join(endings)}")
        return cls(file, where)

    def write(self, content: bytes) -> None:
        """Write it.

        Raises `MapError` when it cannot be written.
        """
        try:
            replace_file(self.path, content)
        except OSError as error:
            raise MapError(f"{self.where}: cannot write: {error.strerror}") from None
