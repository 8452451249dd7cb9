"""The definitions of a level, computed from class arrays and receptive fields alone.

Nothing here knows how a pyramid is built: the inputs are the classes of the cells and the field
of each cell; the outputs are counts, cell pairs, face walks and distances that any correct level
must show. Cells are `(row, col)` with row 0 at the lowest y; a *base dart* is a step from a cell
to a 4-neighbour, written as the pair of cells.
"""

import itertools
import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph
from scipy.spatial import distance

from hybridnav.maps import CellClass

AnyArray = NDArray[Any]
Cell = tuple[int, int]
Dart = tuple[Cell, Cell]
Walk = tuple[Dart, ...]
Sequence = tuple[tuple[int, int], ...]
"""A face of a level: `(boundary, field left)` of its arcs in turn, self-loops left out."""

EAST, NORTH, WEST, SOUTH = (0, 1), (1, 0), (0, -1), (-1, 0)
EIGHT = np.ones((3, 3), dtype=bool)
_SMALLEST_RING_CELLS = 8
_ROUNDING = 1e-9


def alpha(dart: Dart) -> Dart:
    """Return the other half of a base dart's edge."""
    return dart[1], dart[0]


def base_sigma(classes: AnyArray) -> dict[Dart, Dart]:
    """Next base dart counter-clockwise (y up): east, north, west, south."""
    vertices = {(int(row), int(col)) for row, col in np.argwhere(classes != CellClass.OCCUPIED)}
    sigma: dict[Dart, Dart] = {}
    for row, col in sorted(vertices):
        heads = [(row + dr, col + dc) for dr, dc in (EAST, NORTH, WEST, SOUTH)]
        around = [((row, col), head) for head in heads if head in vertices]
        sigma.update(zip(around, around[1:] + around[:1], strict=True))
    return sigma


def orbits(permutation: dict[Any, Any]) -> list[tuple[Any, ...]]:
    """Cycles of a permutation, each walked from its first member."""
    left = dict(permutation)
    cycles = []
    for start in permutation:
        cycle = []
        member = start
        while member in left:
            cycle.append(member)
            member = left.pop(member)
        if cycle:
            cycles.append(tuple(cycle))
    return cycles


def is_ordinary(walk: Walk) -> bool:
    """Whether a base face is a full 2x2 block: east, south, west, north as seen with y up."""
    steps = [(head[0] - tail[0], head[1] - tail[1]) for tail, head in walk]
    block = [EAST, SOUTH, WEST, NORTH]
    return len(steps) == 4 and any(steps[turn:] + steps[:turn] == block for turn in range(4))


@dataclass(frozen=True)
class Base:
    """What is fixed for all levels: the classes, the base map and its counts."""

    classes: AnyArray
    sigma: dict[Dart, Dart]
    ordinary: list[Walk]
    protected: list[Walk]
    n_components: int
    n_obstacle_sets: int

    @classmethod
    def of(cls, classes: AnyArray) -> "Base":
        vertices = classes != CellClass.OCCUPIED
        sigma = base_sigma(classes)
        faces = orbits({dart: sigma[alpha(dart)] for dart in sigma})
        return cls(
            classes=classes,
            sigma=sigma,
            ordinary=[walk for walk in faces if is_ordinary(walk)],
            protected=[walk for walk in faces if not is_ordinary(walk)],
            n_components=int(ndimage.label(vertices)[1]),
            n_obstacle_sets=int(
                ndimage.label(np.pad(~vertices, 1, constant_values=True), EIGHT)[1]
            ),
        )

    def n_protected(self, n_isolated: int) -> int:
        """Protected faces of a level with so many isolated vertices: (B - 1) + (C - K0)."""
        return self.n_obstacle_sets - 1 + self.n_components - n_isolated


def full_blocks(field_of: AnyArray) -> int:
    """Count the 2x2 blocks whose four cells are vertices."""
    inside = field_of >= 0
    return int((inside[:-1, :-1] & inside[:-1, 1:] & inside[1:, :-1] & inside[1:, 1:]).sum())


@dataclass(frozen=True)
class Boundaries:
    """The crack oracle: cracks joined through full 2x2 blocks that hold exactly two of them."""

    pairs: AnyArray
    """`(n_cracks, 2, 2)` cell pairs."""
    label: AnyArray
    """`(n_cracks,)` boundary of each crack."""
    ring: AnyArray
    """`(n_boundaries,)` whether the boundary closes into a ring."""
    meetings: list[Cell]
    """Lowest cells of the full 2x2 blocks with three or more cracks."""
    label_of: dict[Dart, int]
    """Boundary of each crack, in both directions."""

    @property
    def n_boundaries(self) -> int:
        """How many boundaries, that is arcs that are no self-loops."""
        return len(self.ring)

    @property
    def n_ordinary_faces(self) -> int:
        """How many ordinary faces: meeting points and rings."""
        return len(self.meetings) + int(self.ring.sum())


def boundaries(field_of: AnyArray) -> Boundaries:
    rows, cols = field_of.shape
    east = _differ(field_of[:, :-1], field_of[:, 1:])
    north = _differ(field_of[:-1], field_of[1:])
    n_cracks = int(east.sum() + north.sum())
    index = [np.full(side.shape, -1) for side in (east, north)]
    index[0][east] = np.arange(east.sum())
    index[1][north] = np.arange(east.sum(), n_cracks)
    tails = np.concatenate([np.argwhere(east), np.argwhere(north)]).reshape(-1, 2)
    steps = np.repeat([EAST, NORTH], [int(east.sum()), int(north.sum())], axis=0)
    pairs = np.stack([tails, tails + steps], axis=1)
    links, meetings = [], []
    for row in range(rows - 1):
        for col in range(cols - 1):
            if field_of[row : row + 2, col : col + 2].min() < 0:
                continue
            sides = (index[0][row : row + 2, col], index[1][row, col : col + 2])
            present = [int(crack) for crack in np.concatenate(sides) if crack >= 0]
            if len(present) == 2:
                links.append(present)
            elif present:
                meetings.append((row, col))
    n_boundaries, label = csgraph.connected_components(_graph(links, n_cracks), directed=False)
    endpoints = np.bincount(np.array(links, dtype=int).ravel(), minlength=n_cracks)
    ring = np.ones(n_boundaries, dtype=bool)
    ring[label[endpoints < 2]] = False
    label_of: dict[Dart, int] = {}
    for (tail, head), boundary in zip(pairs.tolist(), label.tolist(), strict=True):
        dart = (tuple(tail), tuple(head))
        label_of[dart] = label_of[alpha(dart)] = boundary
    return Boundaries(pairs, label, ring, meetings, label_of)


def _differ(one: AnyArray, other: AnyArray) -> AnyArray:
    different: AnyArray = (one >= 0) & (other >= 0) & (one != other)
    return different


def _graph(links: list[list[int]], n_nodes: int) -> sparse.csr_array:
    endpoints = np.array(links, dtype=int).reshape(-1, 2)
    weights = np.ones(len(endpoints))
    return sparse.csr_array((weights, (endpoints[:, 0], endpoints[:, 1])), shape=(n_nodes, n_nodes))


def n_field_pieces(field_of: AnyArray) -> int:
    """4-connected components that all fields have together; one each when all are connected."""
    inside = field_of >= 0
    flat = np.arange(field_of.size).reshape(field_of.shape)
    links = []
    for low, high in (np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:]):
        same = inside[low] & (field_of[low] == field_of[high])
        links += np.stack([flat[low][same], flat[high][same]], axis=-1).tolist()
    pieces = csgraph.connected_components(_graph(links, field_of.size), directed=False)[0]
    return int(pieces - (~inside).sum())


def holes(field_of: AnyArray) -> AnyArray:
    """Holes of each field: 8-connected sets of other cells that it keeps from the outside.

    A place has one self-loop per hole. This is no definition of docs/pyramid.md but follows from
    its rules: the loops of a vertex cut the sphere into one region more than there are loops, and a
    region that held no part of the outside of the field would be a face of rule 1 or 4.
    """
    found = np.zeros(int(field_of.max(initial=-1)) + 1, dtype=int)
    for field, box in enumerate(ndimage.find_objects(field_of + 1)):
        own = field_of[box] == field
        if own.sum() >= _SMALLEST_RING_CELLS:
            found[field] = ndimage.label(np.pad(~own, 1, constant_values=True), EIGHT)[1] - 1
    return found


def face_sequences(base: Base, field_of: AnyArray, found: Boundaries) -> Counter[Any]:
    """Every face that a level must have, as `(protected, sequence)` with multiplicity.

    A protected face keeps the cracks of its base walk; a meeting point gives the ordinary face
    that its block walks; a ring gives the ordinary face on both sides of its one arc. A component
    that is one field without holes has no arc left, hence no face.
    """
    lonely = holes(field_of) == 0
    faces: Counter[Any] = Counter()
    for walk in base.protected:
        sequence = _sequence(walk, field_of, found)
        if sequence or not lonely[field_of[walk[0][0]]]:
            faces[True, canonical(sequence)] += 1
    for row, col in found.meetings:
        block = [(row + 1, col), (row + 1, col + 1), (row, col + 1), (row, col)]
        walk = tuple(zip(block, block[1:] + block[:1], strict=True))
        faces[False, canonical(_sequence(walk, field_of, found))] += 1
    for ring in np.flatnonzero(found.ring):
        tail, head = found.pairs[np.flatnonzero(found.label == ring)[0]]
        both = ((int(ring), int(field_of[tuple(tail)])), (int(ring), int(field_of[tuple(head)])))
        faces[False, canonical(both)] += 1
    return faces


def _sequence(walk: Walk, field_of: AnyArray, found: Boundaries) -> Sequence:
    return tuple(
        (found.label_of[dart], int(field_of[dart[0]]))
        for dart in walk
        if field_of[dart[0]] != field_of[dart[1]]
    )


def canonical(sequence: Sequence) -> Sequence:
    """Return the rotation of a cyclic sequence that all its rotations share."""
    return min((sequence[turn:] + sequence[:turn] for turn in range(len(sequence))), default=())


def cells_of(field_of: AnyArray) -> list[AnyArray]:
    """Cells `(n, 2)` of each field."""
    cells = np.argwhere(field_of >= 0)
    fields = field_of[field_of >= 0]
    order = np.argsort(fields, kind="stable")
    cuts = np.searchsorted(fields[order], np.arange(int(field_of.max(initial=-1)) + 2))
    return [cells[order[low:high]] for low, high in itertools.pairwise(cuts)]


def farthest_squared(cells: AnyArray, others: AnyArray) -> float:
    """Largest squared centre distance in cells between two sets of cells; exact."""
    return float(distance.cdist(cells, others, "sqeuclidean").max())


def below(squared_cells: AnyArray | float, *, limit_m: float, resolution_m: float) -> Any:
    """Whether distances lie strictly below a limit; equal up to rounding is not below."""
    return squared_cells < (limit_m / resolution_m) ** 2 * (1 - _ROUNDING)


def distances_in_fields(classes: AnyArray, field_of: AnyArray, cells: AnyArray) -> AnyArray:
    """Shortest 8-neighbour path in cells from each cell to its field's surviving cell.

    Only cells of the field are stood on; a diagonal needs both its side cells enterable on the
    whole grid, by the class of the field: free cells for a free one, also unexplored cells for
    an unexplored one.
    """
    if not len(cells):
        return np.full(field_of.shape, np.inf)
    rows, cols = field_of.shape
    flat = np.arange(field_of.size).reshape(field_of.shape)
    tails, heads, lengths = [], [], []
    for row, col in np.argwhere(field_of >= 0).tolist():
        enterable = {CellClass.FREE, int(classes[row, col])}
        for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
            head = (row + dr, col + dc)
            if not (head[0] < rows and 0 <= head[1] < cols):
                continue
            sides = {int(classes[row, head[1]]), int(classes[head[0], col])}
            if field_of[head] == field_of[row, col] and (not dr or not dc or sides <= enterable):
                tails.append(flat[row, col])
                heads.append(flat[head])
                lengths.append(math.hypot(dr, dc))
    size = field_of.size
    graph = sparse.csr_array((lengths, (tails, heads)), shape=(size, size))
    sources = flat[cells[:, 0], cells[:, 1]]
    found: AnyArray = csgraph.dijkstra(graph, directed=False, indices=sources, min_only=True)
    return found.reshape(field_of.shape)


def through_cells(found: Boundaries, from_survivor: AnyArray) -> AnyArray:
    """In-field length in cells, surviving cell to surviving cell, through each boundary."""
    endpoints = found.pairs
    lengths = (
        from_survivor[endpoints[:, 0, 0], endpoints[:, 0, 1]]
        + 1
        + from_survivor[endpoints[:, 1, 0], endpoints[:, 1, 1]]
    )
    shortest = np.full(found.n_boundaries, np.inf)
    np.minimum.at(shortest, found.label, lengths)
    return shortest
