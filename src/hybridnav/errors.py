"""Errors and warnings: every one says what was given, what was expected, and where."""


class HybridNavError(Exception):
    """Base of every error that hybridnav raises on purpose; its text is one line."""


class InvalidValueError(HybridNavError, ValueError):
    """An argument has a value that the function cannot work with."""


class MapError(HybridNavError, ValueError):
    """A map file, or the image it names, cannot be read as an occupancy grid; or a file of what is
    closed on a map cannot be read, or does not fit the map."""


class MapNotFoundError(MapError, FileNotFoundError):
    """A map file, the image it names, or a file of what is closed, is not there."""


class ModelError(MapError):
    """A model cannot be read: it is none, not whole, altered, or of another version."""


class RoomsError(MapError):
    """A file of rooms cannot be read, or does not fit its map; the text names the room."""


class RoomsNotFoundError(RoomsError, FileNotFoundError):
    """A file of rooms, or the image that it names, is not there."""


class PresetError(HybridNavError, ValueError):
    """A preset, or a setting given beside it, is not valid; the text names the key."""


class PresetNotFoundError(PresetError, FileNotFoundError):
    """No preset has this name and no file this path."""


class OmplError(HybridNavError, RuntimeError):
    """OMPL is needed and not installed, or its process does not start."""


class PlanError(HybridNavError, RuntimeError):
    """A plan ended without a path and the caller asked for one (`raise_for_status`)."""


class MapWarning(UserWarning):
    """A map loads, but probably does not mean what its file says."""


class CacheWarning(UserWarning):
    """Compiled code cannot be kept, so that every start compiles it anew."""

    opening = "no folder can be written"
    """First words of the text, by which processes of a program that has warned are kept quiet."""
