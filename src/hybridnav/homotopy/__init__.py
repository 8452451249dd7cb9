"""Homotopy classes of routes and of paths, and shortest paths of different classes."""

from hybridnav.homotopy.classes import HomotopyClasses
from hybridnav.homotopy.search import AlternativeSearch, ClassPath, ClassPaths, alternative_search

__all__ = [
    "AlternativeSearch",
    "ClassPath",
    "ClassPaths",
    "HomotopyClasses",
    "alternative_search",
]
