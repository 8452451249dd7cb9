from .blocked import Blocked as Blocked
from .journal import Journal as Journal, OutOfOrder as OutOfOrder
from .load import load_blocked as load_blocked
from .one_way import OneWay as OneWay

__all__: list[str]
