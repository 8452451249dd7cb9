"""Files that are old or new and never half, and their names in messages."""

from __future__ import annotations

import errno
import os
import shutil
import threading
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

MODEL_SUFFIX = ".hnm"
"""What the name of a model ends in."""

_unfinished: set[Path] = set()


def replace_file(path: Path, content: bytes | Iterable[bytes | memoryview]) -> None:
    """Write a file whole or not at all: what was there outlives an interrupt and a full disc.

    Parameters
    ----------
    path
        The file; an existing one is replaced and keeps its mode, a link stays a link.
    content
        All of it, at once or in pieces.

    Raises
    ------
    OSError
        When it cannot be written.
    """
    if _is_no_file(path):
        _write(path, content)
        return
    path = path.resolve()
    with _beside(path) as beside:
        _write(beside, content)
        if path.exists():
            shutil.copymode(path, beside)
        beside.replace(path)


def _write(path: Path, content: bytes | Iterable[bytes | memoryview]) -> None:
    if isinstance(content, bytes):
        path.write_bytes(content)
        return
    with path.open("wb") as file:
        for piece in content:
            file.write(piece)
        if file.seekable():  # a pipe has no disc to reach
            file.flush()
            os.fsync(file.fileno())


def check_replaceable(path: Path) -> None:
    """Try whether `replace_file` could write a file; nothing is left, nothing changed.

    Parameters
    ----------
    path
        The file. A pipe is left alone: whoever reads it would take the trial for all.

    Raises
    ------
    OSError
        When it could not.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if _is_no_file(path):
        return
    with _beside(path.resolve()) as beside:
        beside.touch(exist_ok=False)


def _is_no_file(path: Path) -> bool:
    """Return whether a pipe, a terminal or a folder is there, which nothing can replace."""
    return path.exists() and not path.is_file()


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    """Yield where a thread writes what becomes a file, however long its name is, and remove it."""
    beside = path.with_name(f".hybridnav.{os.getpid()}.{threading.get_ident()}")
    _unfinished.add(beside)
    try:
        yield beside
    finally:
        beside.unlink(missing_ok=True)
        _unfinished.discard(beside)


def remove_unfinished() -> None:
    """Remove what writing has left in folders so far, as this process is about to end."""
    for path in list(_unfinished):
        with suppress(OSError):
            path.unlink()


def printable(path: str | os.PathLike[str]) -> str:
    """Text of a path for a message: as it is, or escaped when it would break the line.

    Parameters
    ----------
    path
        Any path.

    Returns
    -------
    str
        One line.
    """
    text = str(path)
    return text if text.isprintable() else repr(text)
