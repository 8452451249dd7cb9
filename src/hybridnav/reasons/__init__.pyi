from .why import Explanation as Explanation
from .why_words import BlockedEnd as BlockedEnd, Closure as Closure, TightPlace as TightPlace

__all__: list[str]
