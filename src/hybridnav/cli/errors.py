"""Exit codes, and the errors that only a command line has."""

from __future__ import annotations

from hybridnav.errors import HybridNavError, MapError, PresetError, PresetNotFoundError

EXIT_SOLVED = 0
EXIT_NOT_SOLVED = 1
EXIT_USAGE = 2
EXIT_UNREADABLE = 3


class UsageError(HybridNavError):
    """The command line itself asks for something that cannot be."""


def exit_code(error: HybridNavError) -> int:
    """Exit code of a command that ended in this error."""
    if isinstance(error, PresetNotFoundError) and "no preset is called" in str(error):
        return EXIT_USAGE
    return EXIT_UNREADABLE if isinstance(error, (MapError, PresetError)) else EXIT_USAGE
