"""Inclusion from walks between cells alone: what a set of cells keeps from the outside.

A set of cells *encloses* another when no walk of 8-neighbour steps that avoids the first joins the
second to a ring of cells round the map. Nothing here knows a graph, a face or a self-loop.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st
from scipy import ndimage

from hybridnav.maps import CellClass
from tests.oracle.pyramid import EAST, EIGHT, NORTH, SOUTH, WEST, AnyArray, Cell
from tests.strategies import Scene, class_grids, seeds

TURN = (EAST, NORTH, WEST, SOUTH)
_SHARE_OF_PAIRS = 0.25
_SIDE_OF_PAIRS = 7


def sets_of(mask: AnyArray, *, diagonal: bool) -> AnyArray:
    """Label connected sets in the order of their first cells, -1 off the mask, by flooding."""
    steps = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)]
    steps = [step for step in steps if diagonal or 0 in step]
    label = np.where(mask, -2, -1)
    count = 0
    for start in zip(*np.nonzero(mask), strict=True):
        if label[start] != -2:
            continue
        label[start] = count
        todo = [start]
        while todo:
            row, col = todo.pop()
            for down, right in steps:
                cell = (row + down, col + right)
                inside = 0 <= cell[0] < mask.shape[0] and 0 <= cell[1] < mask.shape[1]
                if inside and label[cell] == -2:
                    label[cell] = count
                    todo.append(cell)
        count += 1
    return label


def kept_inside(own: AnyArray) -> AnyArray:
    """Cells that a set encloses: no 8-walk outside the set joins them to the outside."""
    around, _ = ndimage.label(np.pad(~own, 1, constant_values=True), EIGHT)
    inner: AnyArray = around[1:-1, 1:-1]
    result: AnyArray = ~own & (inner != around[0, 0])
    return result


def filled_area(own: AnyArray) -> int:
    """Cells of a set and of all that it walls off for 4-neighbour steps."""
    around, _ = ndimage.label(np.pad(~own, 1, constant_values=True))
    return int((around[1:-1, 1:-1] != around[0, 0]).sum())


def grown(own: AnyArray) -> AnyArray:
    """A set and its 8-neighbours."""
    result: AnyArray = ndimage.binary_dilation(own, EIGHT)
    return result


@dataclass(frozen=True)
class Surroundings:
    """A map of classes and the places its cells are in, to ask what goes round a thing."""

    classes: AnyArray
    field_of: AnyArray

    def with_obstacles(self, thing: AnyArray) -> tuple[AnyArray, bool]:
        """Return a thing with the obstacles it touches, and whether one of them is the rim."""
        occupied = np.pad(self.classes == CellClass.OCCUPIED, 1, constant_values=True)
        obstacle, _ = ndimage.label(occupied, EIGHT)
        padded = np.pad(thing, 1)
        touched = np.unique(obstacle[grown(padded) & occupied])
        both = padded | np.isin(obstacle, touched)
        return both[1:-1, 1:-1], bool(both[0, 0])

    def ring(self, thing: AnyArray) -> tuple[int, ...]:
        """Places met on a tour round a connected thing and the obstacles that it touches.

        The tour goes counter-clockwise by steps between 4-neighbours and keeps to the cells next
        to the thing, corners included; a place is named once for each time it is entered. Empty
        where the thing touches the rim.
        """
        whole, at_rim = self.with_obstacles(thing)
        if at_rim:
            return ()
        row, col = np.argwhere(whole)[0]
        tour = list(self._tour(whole, (int(row), int(col) - 1)))
        assert signed_area(tour) < 0, "with the thing on the right a tour goes clockwise"
        places = [int(self.field_of[cell]) for cell in reversed(tour)]
        entered = [p for at, p in enumerate(places) if p != places[at - 1]]
        return tuple(entered or places[:1])

    def _tour(self, whole: AnyArray, start: Cell) -> Iterator[Cell]:
        """Cells from the one west of the thing's first cell on, the thing on the right hand."""
        first = (start, self._step(whole, start, 1))
        cell, heading = first
        while True:
            yield cell
            cell = _ahead(cell, heading)
            heading = self._step(whole, cell, heading + 3)
            if (cell, heading) == first:
                return

    def _step(self, whole: AnyArray, cell: Cell, heading: int) -> int:
        """Find the first heading that is open, turning left from the one given."""
        for turn in range(heading, heading + 4):
            ahead = _ahead(cell, turn % 4)
            inside = min(ahead) >= 0 and ahead[0] < whole.shape[0] and ahead[1] < whole.shape[1]
            if inside and self.field_of[ahead] >= 0 and not whole[ahead]:
                return turn % 4
        raise AssertionError(f"a tour round a thing is stuck at {cell}")


def _ahead(cell: Cell, heading: int) -> Cell:
    return cell[0] + TURN[heading][0], cell[1] + TURN[heading][1]


def signed_area(walk: list[Cell]) -> float:
    """Area that a closed walk of cells goes round, positive counter-clockwise (y up)."""
    row, col = np.array(walk, dtype=float).T
    return float((col * np.roll(row, -1) - np.roll(col, -1) * row).sum() / 2)


def rotations(ring: tuple[int, ...]) -> set[tuple[int, ...]]:
    """All ways to write a cycle."""
    return {ring[at:] + ring[:at] for at in range(max(1, len(ring)))}


@st.composite
def nested_maps(draw: st.DrawFn, max_side: int) -> AnyArray:
    """Draw maps of rings in rings, up to four deep and side by side, some of them broken."""
    sides = st.integers(3, max_side)
    classes = np.full((draw(sides), draw(sides)), draw(st.sampled_from([1, 1, 2])), np.uint8)
    rng = np.random.default_rng(draw(seeds))
    _fill(classes, rng, draw(st.integers(1, 4)))
    for _ in range(draw(st.sampled_from([0, 0, 2, 5]))):
        classes[rng.integers(len(classes)), rng.integers(classes.shape[1])] = rng.integers(3)
    return classes


def _fill(area: AnyArray, rng: np.random.Generator, depth: int) -> None:
    """Paint a ring of one class with something of another inside, or two such side by side."""
    if not depth or min(area.shape) < len(EIGHT):
        return
    if rng.random() < _SHARE_OF_PAIRS and max(area.shape) >= _SIDE_OF_PAIRS:
        long = area if area.shape[0] >= area.shape[1] else area.T
        cut = int(rng.integers(3, len(long) - 3))
        _fill(long[:cut], rng, depth)
        _fill(long[cut + int(rng.integers(2)) :], rng, depth)
        return
    if rng.integers(2):
        area = area[1:-1, 1:-1]
    area[:] = rng.choice(3, p=[0.4, 0.4, 0.2])
    width = int(rng.integers(1, 3))
    inner = area[width:-width, width:-width]
    if inner.size:
        inner[:] = rng.choice(3, p=[0.2, 0.5, 0.3])
        if rng.integers(2):
            inner[:, : rng.integers(inner.shape[1] + 1)] = rng.choice(3)
        _fill(inner, rng, depth - 1)


@st.composite
def nested_scenes(draw: st.DrawFn, max_side: int) -> Scene:
    """Draw maps, most of them of rings in rings, and merge distances from less than a cell on."""
    classes = draw(st.one_of(nested_maps(max_side), nested_maps(max_side), class_grids(max_side)))
    merge_distance_m = draw(st.sampled_from([80.0, 3.0, 1.5, 5.0, 9.0, 0.5]))
    return Scene(classes, 1.0, merge_distance_m, draw(st.integers(0, 1000)))
