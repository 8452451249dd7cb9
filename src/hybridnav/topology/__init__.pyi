from .map import Component as Component, Obstacle as Obstacle, TopologicalMap as TopologicalMap

__all__: list[str]
