from .read import load_rooms as load_rooms
from .write import save_rooms as save_rooms

__all__: list[str]
