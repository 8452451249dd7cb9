"""The record of a decimation, from which every level is rebuilt."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from hybridnav.pyramid._size_kernels import level_sizes

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray, IntArray

Linkage = Literal["survivor", "radius", "diameter"]

SURVIVES = 255
"""End of a vertex or edge that still exists at the apex."""

MAX_LEVELS = 126
"""Levels that one byte per edge can distinguish; real maps have 10 to 15."""


@dataclass(frozen=True, eq=False)
class Record:
    """Level and kind of the end of each vertex and edge of the base: 7 bytes a cell.

    All arrays are flat, in the order of cells (row-major) and of base edges (two a cell).
    """

    vertex_end: ByteArray
    """0: no vertex; SURVIVES; else the level at which the cell stops being a surviving cell."""
    vertex_parent: IntArray
    """The surviving cell that a contracted vertex went into."""
    edge_end: ByteArray
    """0: no edge; SURVIVES; else 2 * level, plus 1 where the edge is removed, not contracted."""

    def up_to(self, level: int) -> Record:
        """Return a copy with which all that is left at a level survives."""
        vertex_end, edge_end = self.vertex_end.copy(), self.edge_end.copy()
        vertex_end[vertex_end > level] = SURVIVES
        edge_end[edge_end >= min(2 * level + 2, SURVIVES)] = SURVIVES
        return Record(vertex_end, self.vertex_parent.copy(), edge_end)

    def sizes(self, cols: int, n_levels: int) -> list[LevelSize]:
        """Count what each level has, without making the levels; `cols` are those of the grid."""
        ends = self.vertex_end, self.vertex_parent, self.edge_end
        return [LevelSize(*size) for size in level_sizes(*ends, cols, n_levels).tolist()]


@dataclass(frozen=True)
class LevelSize:
    """Size of one level."""

    vertices: int
    arcs: int
    self_loops: int


@dataclass
class BuildStats:
    """Statistics of a build: sizes from the base to the apex, seconds of processor-bound stages."""

    sizes: list[LevelSize] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    tops: list[int] = field(default_factory=list)
    """Levels at which contraction ended: the places; then, as far as there are any, the regions and
    the rooms; and the apex, where contraction went on above the places."""
