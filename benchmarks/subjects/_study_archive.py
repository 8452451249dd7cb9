"""The archive of a study: its records and figures in one file, with equal bytes for equal files."""

from __future__ import annotations

import hashlib
import zipfile
from typing import TYPE_CHECKING

from hybridnav._base.files import replace_file

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

_OLDEST = (1980, 1, 1, 0, 0, 0)
"""A date that every archive can hold: dates of files are no part of their contents."""
_READABLE = 0o644 << 16


def write_archive(path: Path, root: Path, files: Iterable[Path]) -> str:
    """Write files into a zip archive, and its SHA-256 beside it.

    Parameters
    ----------
    path
        The archive; the checksum goes to a file of that name with `.sha256` added, as
        `sha256sum --check` reads it.
    root
        Files are named by their paths from here.
    files
        The files; their order does not matter.

    Returns
    -------
    str
        The checksum, hexadecimal.
    """
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for file in sorted(files):
            entry = zipfile.ZipInfo(file.relative_to(root).as_posix(), _OLDEST)
            entry.external_attr, entry.compress_type = _READABLE, zipfile.ZIP_DEFLATED
            archive.writestr(entry, file.read_bytes())
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    replace_file(path.with_name(f"{path.name}.sha256"), f"{digest}  {path.name}\n".encode())
    return digest
