from .map import Component as Component, Obstacle as Obstacle, TopologicalMap as TopologicalMap
from .room_level import Door as Door, Rooms as Rooms
from .segmentation import find_rooms as find_rooms

__all__: list[str]
