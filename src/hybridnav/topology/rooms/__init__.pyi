from .find import find_rooms as find_rooms
from .level import Door as Door, Rooms as Rooms

__all__: list[str]
