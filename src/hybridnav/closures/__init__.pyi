from .blocked import Blocked as Blocked
from .journal import Journal as Journal, OutOfOrder as OutOfOrder
from .load import load_blocked as load_blocked

__all__: list[str]
