"""Inclusion: what lies inside a place, and which places lie round a thing.

A self-loop of the graph is a bridge of its dual: it cuts the faces in two, and its place encloses
the part that does not hold the outside. Faces joined by the dual edges of other arcs make a block.
Blocks and self-loops make a tree for each component. Obstacles hang the trees of walled-off
components below the face of the component that surrounds them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from hybridnav._base.rows import connected_parts
from hybridnav._base.typing import BoolArray, LongArray
from hybridnav.pyramid import Level
from hybridnav.pyramid.graphs import FaceKind
from hybridnav.pyramid.islands import Islands

_EAST = 0


@dataclass(frozen=True, eq=False)
class Enclosed:
    """What lies inside the self-loops of a place, at any depth."""

    places: LongArray
    """Dense indices of places."""
    obstacles: LongArray
    """Indices of obstacles."""
    components: LongArray
    """Indices of components walled off by those obstacles."""
    ignored: int
    """Obstacles left out, with all inside them, because their area is below the least one."""


class Inclusion:
    """Inclusion on one level of a pyramid.

    `level`: the level whose vertices are the places; `islands`: obstacles and components of its
    grid.
    """

    def __init__(self, level: Level, islands: Islands) -> None:
        self._level = level
        self._islands = islands
        self._origin = level.arcs.ravel().astype(np.int64)
        self._n_obstacles = len(islands.obstacle_cell)
        self._component_of_place = islands.component_of[tuple(level.cells.T)].astype(np.int64)
        self._obstacle_component = islands.component_round_obstacle
        self._loop_above, self._block_of_face = _loop_tree(level)
        self.face_of_obstacle = self._find_obstacle_faces()
        """int64 (n_obstacles,), face that holds each obstacle, -1 for the rim."""

    def _find_obstacle_faces(self) -> LongArray:
        """Return the face that holds each obstacle, -1 for the rim."""
        face = np.full(self._n_obstacles, -1, dtype=np.int64)
        darts = self._level.face_darts(self._islands.obstacle_cell[1:], _EAST)
        face[1:] = self._level.dual.face_of[darts]
        return face

    @cached_property
    def _depth_of_block(self) -> LongArray:
        """Self-loops round each block, within its component."""
        depth = np.zeros(len(self._loop_above), dtype=np.int64)
        parent = self._parent_block
        at = np.arange(len(depth))
        while (inside := self._loop_above[at] >= 0).any():
            depth += inside
            at = np.where(inside, parent[at], at)
        return depth

    @property
    def _parent_block(self) -> LongArray:
        """The block on the outer side of the self-loop above each block, itself for a root."""
        loop = self._loop_above
        both_blocks = self._block_of_face[self._level.dual.edges[loop]]
        blocks = np.arange(len(loop))
        outer = np.where(both_blocks[:, 0] == blocks, both_blocks[:, 1], both_blocks[:, 0])
        return np.where(loop >= 0, outer, blocks)

    @cached_property
    def _block_of_place(self) -> LongArray:
        """The outermost block that each place bounds, -1 for a place without an arc."""
        block = self._block_of_face[self._level.dual.face_of]
        order = np.lexsort((self._depth_of_block[block], self._origin))
        places, first = np.unique(self._origin[order], return_index=True)
        outermost = np.full(self._level.n_vertices, -1, dtype=np.int64)
        outermost[places] = block[order][first]
        return outermost

    @cached_property
    def _place_round_block(self) -> LongArray:
        """The place whose self-loop is the one above each block, -1 for a root."""
        loop = self._loop_above
        return np.where(loop >= 0, self._level.arcs[loop, 0], -1)

    @cached_property
    def place_round_component(self) -> LongArray:
        """int64 (n_components,), the place inside whose self-loop each component lies, -1: none."""
        face = self.face_of_obstacle[self._islands.surrounding_obstacle]
        own = _value_at(self._place_round_block, _value_at(self._block_of_face, face))
        at = self._component_above
        while (further := (own < 0) & (at >= 0)).any():
            own = np.where(further, own[at], own)
            at = np.where(further, self._component_above[at], -1)
        return own

    @cached_property
    def place_round_obstacle(self) -> LongArray:
        """int64 (n_obstacles,), the place inside whose self-loop each obstacle lies, -1: none."""
        face = self.face_of_obstacle
        own = _value_at(self._place_round_block, _value_at(self._block_of_face, face))
        outer = _value_at(self.place_round_component, self._obstacle_component)
        return np.where((own < 0) & (face >= 0), outer, own)

    @cached_property
    def place_round_place(self) -> LongArray:
        """int64 (n_places,), the place inside whose self-loop each place lies, -1: none."""
        block = self._block_of_place
        own = _value_at(self._place_round_block, block)
        return np.where(own < 0, self.place_round_component[self._component_of_place], own)

    @cached_property
    def obstacle_cells(self) -> LongArray:
        """int64 (n_obstacles,), cells of each obstacle and of all that it surrounds."""
        return self._islands.filled_cells()

    def encloses(self, place: int, *, least_area_cells: float = 0.0) -> Enclosed:
        """Find what lies inside the self-loops of a place.

        `place`: dense index; `least_area_cells`: obstacles smaller than this, with all they
        surround, are left out and counted.
        """
        islands = self._islands
        inside = np.zeros(self._level.n_vertices, dtype=np.bool_)
        inside[place] = True
        inside = _inherited(inside, self.place_round_place)
        obstacles = _at(inside, self.place_round_obstacle)
        small = obstacles & (self.obstacle_cells < least_area_cells)
        ignored = _inherited(small[islands.surrounding_obstacle], self._component_above)
        obstacles &= ~_at(ignored, self._obstacle_component)
        components = _at(inside, self.place_round_component) & ~ignored
        inside[place] = False
        return Enclosed(
            np.flatnonzero(inside & ~ignored[self._component_of_place]),
            np.flatnonzero(obstacles & ~small),
            np.flatnonzero(components),
            int((obstacles & small).sum()),
        )

    @cached_property
    def _component_above(self) -> LongArray:
        """The component round the obstacle round each component, -1 where that is the rim."""
        obstacle = self._islands.surrounding_obstacle
        return self._obstacle_component[obstacle]

    def ring_round_places(self, places: LongArray) -> LongArray:
        """Return the cycle of places round a connected set of places, counter-clockwise.

        `places`: dense indices of places that arcs connect. Result: places, the smallest index
        first; empty where the set touches the rim. Obstacles that the set touches count as part of
        it; where one of them surrounds its component, these are the places round that obstacle.
        """
        level, dual = self._level, self._level.dual
        inside = np.zeros(level.n_vertices, dtype=np.bool_)
        inside[places] = True
        component = self._component_of_place[places[0]]
        if inside[self._component_of_place == component].all():
            return self.ring_round_component(int(component))
        gone: BoolArray = np.asarray(inside[level.arcs].any(axis=1))
        opened = np.unique(dual.edges[gone])
        if (dual.kinds[opened] == FaceKind.OUTSIDE).any():
            return self.ring_round_component(int(component))
        left = np.flatnonzero(~gone)
        outer = np.flatnonzero(dual.kinds == FaceKind.OUTSIDE)
        group = connected_parts(level.arcs[left], level.n_vertices)
        on_outside = self._origin[np.isin(dual.face_of, outer)]
        mine = on_outside[self._component_of_place[on_outside] == component][0]
        darts = np.flatnonzero(np.isin(dual.face_of, opened) & ~np.repeat(gone, 2))
        start = darts[group[self._origin[darts]] == group[mine]][0]
        return self._walk(int(start), gone)

    def ring_round_obstacle(self, obstacle: int) -> LongArray:
        """Return the cycle of places round an obstacle, counter-clockwise; empty for the rim."""
        face = self.face_of_obstacle[obstacle]
        if face < 0:
            return np.empty(0, dtype=np.int64)
        start = np.flatnonzero(self._level.dual.face_of == face)[0]
        return self._walk(int(start), np.zeros(self._level.n_arcs, dtype=np.bool_))

    def ring_round_component(self, component: int) -> LongArray:
        """Return the cycle of places round a walled-off component; empty if only the rim surrounds
        it."""
        return self.ring_round_obstacle(int(self._islands.surrounding_obstacle[component]))

    def _walk(self, start: int, gone: BoolArray) -> LongArray:
        """Return the places along the face on the right of a dart, in a map without some arcs."""
        sigma = self._level.sigma
        places: list[int] = []
        dart = start
        while True:
            place = int(self._origin[dart])
            if not places or places[-1] != place:
                places.append(place)
            dart = int(sigma[dart ^ 1])
            while gone[dart >> 1]:
                dart = int(sigma[dart])
            if dart == start:
                break
        if len(places) > 1 and places[0] == places[-1]:
            places.pop()
        places.reverse()  # a face on the right is walked clockwise
        at = places.index(min(places))
        return np.array(places[at:] + places[:at], dtype=np.int64)


def _inherited(flag: BoolArray, parent: LongArray) -> BoolArray:
    """Hand the flags of a forest down from every parent to all below it; return them."""
    while True:
        more = flag | _at(flag, parent)
        if (more == flag).all():
            return flag
        flag = more


def _at(flag: BoolArray, index: LongArray) -> BoolArray:
    """Return the flag at each index, False at -1."""
    return np.append(flag, False)[index]


def _value_at(values: LongArray, index: LongArray) -> LongArray:
    """Return the value at each index, -1 at -1."""
    return np.append(values, -1)[index]


def _loop_tree(level: Level) -> tuple[LongArray, LongArray]:
    """Return the self-loop above each block of faces (-1: a root), and the block of each face."""
    dual = level.dual
    loops = np.flatnonzero(level.is_self_loop)
    block_of_face = connected_parts(dual.edges[~level.is_self_loop], dual.n_faces)
    n_blocks = int(block_of_face.max(initial=-1)) + 1
    both_blocks = block_of_face[dual.edges[loops]]
    roots = np.unique(block_of_face[dual.kinds == FaceKind.OUTSIDE])
    top = np.full(len(roots), n_blocks)
    tail = np.concatenate([both_blocks[:, 0], top])
    head = np.concatenate([both_blocks[:, 1], roots])
    tree = coo_array(
        (np.ones(len(tail), dtype=np.int8), (tail, head)), shape=(n_blocks + 1, n_blocks + 1)
    )
    _, above = breadth_first_order(tree.tocsr(), n_blocks, directed=False)
    loop_above = np.full(n_blocks, -1, dtype=np.int64)
    first_is_inside = above[both_blocks[:, 0]] == both_blocks[:, 1]
    loop_above[np.where(first_is_inside, both_blocks[:, 0], both_blocks[:, 1])] = loops
    return loop_above, block_of_face
