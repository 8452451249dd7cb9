"""Errors and warnings; each message states the given value, the expected one, and the place."""

import reprlib
import warnings
from typing import Any

_MOST_SHOWN = 80
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = _MOST_SHOWN


def brief(value: Any) -> str:
    """Return the text of a given value for a message: one line of at most 80 characters.

    Every message quotes what it was given by this, or by a format that cuts it, such as `!r:.80`.
    """
    try:
        text = " ".join(_SHORT.repr(value).split())
    except ValueError:  # Python writes no integer of more than 4300 digits
        return f"a huge {type(value).__name__}"
    return text if len(text) <= _MOST_SHOWN else f"{text[:38]}...{text[-39:]}"


def renamed(old: str, new: str) -> None:
    """Warn the caller of a function's caller that it has another name now."""
    warnings.warn(f"{old} is now {new}: write that", FutureWarning, stacklevel=3)


class HybridNavError(Exception):
    """Base of every error that hybridnav raises on purpose; its text is one line."""


class InvalidValueError(HybridNavError, ValueError):
    """An argument has a value that the function cannot work with."""


class UnsuitableMapError(InvalidValueError):
    """A method cannot take a map, by a limit of its own: the harness does not ask it there."""


class MapError(HybridNavError, ValueError):
    """A map file, or its image, cannot be read as an occupancy grid; or a file of closed areas
    cannot be read or does not fit the map."""


class MapNotFoundError(MapError, FileNotFoundError):
    """A map file, the image that it names, or a file of closed areas does not exist."""


class ModelError(MapError):
    """A file cannot be read as a model: it is none, not whole, altered, or of another version."""


class RoomsError(MapError):
    """A file of rooms cannot be read, or does not fit its map; the text names the room."""


class RoomsNotFoundError(RoomsError, FileNotFoundError):
    """A file of rooms, or the image that it names, does not exist."""


class PresetError(HybridNavError, ValueError):
    """A preset, or a setting given beside it, is not valid; the text names the key."""


class PresetNotFoundError(PresetError, FileNotFoundError):
    """No preset has this name and no file this path."""


class OmplError(HybridNavError, RuntimeError):
    """OMPL is needed and not installed, or its process does not start."""


class PlanError(HybridNavError, RuntimeError):
    """A plan ended without a path and the caller asked for one (`raise_for_status`)."""


class MapWarning(UserWarning):
    """A map loads, but its file probably means something else."""


class CacheWarning(UserWarning):
    """Compiled code cannot be cached, so that every start compiles it again."""

    opening = "no folder can be written"
    """First words of the text, by which other processes of a program filter the warning."""
