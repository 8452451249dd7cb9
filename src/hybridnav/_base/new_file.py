"""Files to be written: their names end as their format demands, and an error is one line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Self

from hybridnav._base.files import printable, replace_file
from hybridnav.errors import MapError

if TYPE_CHECKING:
    from hybridnav._base.typing import PathLike


@dataclass(frozen=True)
class NewFile:
    """A file that is written whole, or not at all; one that exists is replaced."""

    path: Path
    where: str
    """What messages begin with."""

    @classmethod
    def named(cls, path: PathLike, what: str, kind: str, endings: tuple[str, ...]) -> Self:
        """Return the file of a name.

        Parameters
        ----------
        path
            The name.
        what
            What the file is, before its name in messages.
        kind
            The same with its article and format, such as "a layout".
        endings
            How its name may end, such as ".json".

        Raises
        ------
        MapError
            When it ends otherwise.
        """
        file = Path(path)
        where = f"{what} {printable(file)}"
        if file.suffix.lower() not in endings:
            raise MapError(f"{where}: {kind} must be named {' or '.join(endings)}")
        return cls(file, where)

    def write(self, content: bytes) -> None:
        """Write it.

        Raises
        ------
        MapError
            When it cannot be written.
        """
        try:
            replace_file(self.path, content)
        except OSError as error:
            raise MapError(f"{self.where}: cannot write: {error.strerror}") from None
