"""The project's own maps, generated: `python -m benchmarks worlds maps` writes their files."""

from benchmarks.worlds.figure1 import figure1_world
from benchmarks.worlds.office import office_world
from benchmarks.worlds.world import World, tiled, write_world

__all__ = ["World", "figure1_world", "office_world", "tiled", "write_world"]
