"""Blocks by their definition: which squares of cells are contracted along a quadtree."""

from typing import Any, NamedTuple

import numpy as np


class Block(NamedTuple):
    """An aligned square, by its least row and column and its side in cells."""

    row: int
    col: int
    side: int

    @property
    def window(self) -> tuple[slice, slice]:
        rows = slice(self.row, self.row + self.side)
        return rows, slice(self.col, self.col + self.side)

    @property
    def whole_at(self) -> int:
        """The level from which it is one vertex."""
        return 2 * (self.side.bit_length() - 1)


def blocks(classes: Any, merge_distance_cells: float) -> list[Block]:
    """The largest block over every cell that has one; sides of 2, 4 and 8 cells, at most half the
    merge distance, and from 4 cells on amid half a side more of the same class."""
    found: list[Block] = []
    taken = np.zeros(classes.shape, dtype=bool)
    for side in (8, 4, 2):
        if side > merge_distance_cells / 2 + 1e-6:
            continue
        margin = side // 2 if side > 2 else 0
        for row in range(0, classes.shape[0] - side + 1, side):
            for col in range(0, classes.shape[1] - side + 1, side):
                block = Block(row, col, side)
                low, left = row - margin, col - margin
                high, right = row + side + margin, col + side + margin
                if taken[block.window].any() or min(low, left) < 0:
                    continue
                around = classes[low:high, left:right]
                whole = around.shape == (side + 2 * margin, side + 2 * margin)
                if whole and around[0, 0] != 0 and (around == around[0, 0]).all():
                    found.append(block)
                    taken[block.window] = True
    return found


def in_pieces(classes: Any, merge_distance_cells: float, level: int) -> Any:
    mask = np.zeros(classes.shape, dtype=bool)
    for block in blocks(classes, merge_distance_cells):
        mask[block.window] = block.whole_at > level
    return mask


def piece_of(block: Block, level: int) -> Any:
    """Number of the piece of a block that each of its cells is in at a level, (side, side)."""
    index = np.arange(block.side)
    rows, cols = index >> level // 2, index >> (level + 1) // 2
    return rows[:, None] * block.side + cols
