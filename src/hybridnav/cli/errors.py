"""Exit codes, and the errors that only a command line has."""

from __future__ import annotations

from hybridnav.errors import HybridNavError, MapError, PresetError

EXIT_SOLVED = 0
EXIT_NOT_SOLVED = 1
EXIT_USAGE = 2
EXIT_UNREADABLE = 3


class UsageError(HybridNavError):
    """The command line itself asks for something impossible."""


def exit_code(error: HybridNavError) -> int:
    """Return the exit code of a command that ended in this error."""
    return EXIT_UNREADABLE if isinstance(error, (MapError, PresetError)) else EXIT_USAGE
