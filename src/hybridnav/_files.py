"""Files that are old or new and never half."""

from __future__ import annotations

import os
import shutil
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

_unfinished: set[Path] = set()


def replace_file(path: Path, content: bytes) -> None:
    """Write a file whole or not at all: what was there outlives an interrupt and a full disc.

    Parameters
    ----------
    path
        The file; an existing one is replaced and keeps its mode, a link stays a link.
    content
        All of it.

    Raises
    ------
    OSError
        When it cannot be written.
    """
    if path.exists() and not path.is_file():  # a pipe or a terminal has nothing to lose
        path.write_bytes(content)
        return
    path = path.resolve()
    beside = path.with_name(f".{path.name[:200]}.{os.getpid()}.{threading.get_ident()}")
    _unfinished.add(beside)
    try:
        beside.write_bytes(content)
        if path.exists():
            shutil.copymode(path, beside)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
        _unfinished.discard(beside)


def remove_unfinished() -> None:
    """Remove what writing has left in folders so far, as this process is about to end."""
    for path in list(_unfinished):
        with suppress(OSError):
            path.unlink()
