from .carrying import Carried as Carried, CarriedNames as CarriedNames, carry_names as carry_names
from .find import find_rooms as find_rooms
from .listing import RoomKind as RoomKind
from .level import Door as Door, Rooms as Rooms
from .registering import Transform as Transform

__all__: list[str]
