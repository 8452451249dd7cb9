from .classes import HomotopyClasses as HomotopyClasses
from .search import (
    AlternativeSearch as AlternativeSearch,
    ClassPath as ClassPath,
    ClassPaths as ClassPaths,
    alternative_search as alternative_search,
)

__all__: list[str]
