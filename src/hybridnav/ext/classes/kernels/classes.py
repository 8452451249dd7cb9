"""Kernel of the search for shortest paths of different homotopy classes.

A* over pairs of a cell and a reduced word: S. Bhattacharya, M. Likhachev, V. Kumar: Topological
constraints in search-based robot path planning, 2012. Words are vertices of a tree, the Cayley
graph of the free group; each step of a path leads from one to another.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT
from hybridnav.ext.classes.kernels.trees import Letters, after, along, times

_STATE_BITS = 26
_STATE_MASK = (1 << _STATE_BITS) - 1
MOST_STATES = 1 << _STATE_BITS
"""More states have no numbers that fit into a key of the heap."""
_OPEN, _EXPANDED, _WINDING = 0, 1, 2

_STATES, _KEYS, GOALS = 0, 1, 2
"""Places of the counts of `Open.used`."""

FOUND, EXHAUSTED, LIMITED, PAUSED = 0, 1, 2, 3
"""Why a search ended: all classes asked for, no more classes, no more room; or it can go on."""


class States(NamedTuple):
    """Pairs of a flat `cell` and a `word` of the tree, in the order in which they were met.

    All fields are int32 (room,), but the integer `cost`, int64, and `status`, uint8. `before` is
    the state before, -1 at the start, `other` the next state of the same cell, -1 for none. States
    taken from the heap have a `depth`, the steps from the start, an earlier state to `jump` back
    to, and as `run` the first of the states with the same word at the end of the path.
    """

    cell: np.ndarray
    word: np.ndarray
    cost: np.ndarray
    before: np.ndarray
    depth: np.ndarray
    jump: np.ndarray
    run: np.ndarray
    status: np.ndarray
    other: np.ndarray

    @classmethod
    def of_room(cls, room: int) -> States:
        """Return room for some states."""
        kinds = {"cost": np.int64, "status": np.uint8}
        return cls(*(np.empty(room, kinds.get(name, np.int32)) for name in cls._fields))


@njit(cache=True, nogil=True)
def _leads_to(states, earlier, later):
    """Return whether the path to one expanded state passes another."""
    depth = states.depth[earlier]
    if depth > states.depth[later]:
        return False
    at = np.int64(later)
    while states.depth[states.run[at]] > depth:
        at = np.int64(states.before[states.run[at]])
    if states.word[at] != states.word[earlier]:
        return False
    while states.depth[at] > depth:
        jump = np.int64(states.jump[at])
        at = jump if states.depth[jump] >= depth else np.int64(states.before[at])
    return at == earlier


@njit(cache=True, nogil=True)
def _winds(states, tree, letters, of_edge, moves, head, state, apart, cols):
    """Return whether a path has come back: 1 or 0, -1 when there is no room.

    It has when it stands on a cell that it passed before it circled a hole, or sees one along a row
    or a column, at most `apart` cells off.

    Parameters
    ----------
    states, tree, letters, of_edge, moves, cols
        See `Plane`.
    head
        int32 (n_cells,), the last state at each cell, -1 for none.
    state
        The state at the end of the path.
    apart
        Cells to look at in each of four directions.
    """
    cell, word = np.int64(states.cell[state]), np.int64(states.word[state])
    other = np.int64(head[cell])
    while other >= 0:
        if (
            states.word[other] != word
            and states.status[other] == _EXPANDED
            and _leads_to(states, other, state)
        ):
            return 1
        other = np.int64(states.other[other])
    for direction in range(0, 8, 2):
        at, there = cell, word
        for _ in range(apart):
            if not moves[at] >> direction & 1:
                break
            there = times(tree, letters, there, along(of_edge, at, direction, cols))
            if there < 0:
                return -1
            at += ROW_STEP[direction] * cols + COL_STEP[direction]
            other = np.int64(head[at])
            while other >= 0:
                if (
                    states.word[other] != there
                    and states.status[other] == _EXPANDED
                    and _leads_to(states, other, state)
                ):
                    return 1
                other = np.int64(states.other[other])
    return 0


@njit(cache=True, nogil=True)
def _push(heap, n, key):
    """Put a key into a heap of n keys."""
    at = n
    while at > 0:
        above = (at - 1) >> 2
        if heap[above] <= key:
            break
        heap[at] = heap[above]
        at = above
    heap[at] = key


@njit(cache=True, nogil=True)
def _pop(heap, n):
    """Remove the least of n keys and return it."""
    least, key = heap[0], heap[n - 1]
    n -= 1
    at = 0
    while True:
        first = 4 * at + 1
        if first >= n:
            break
        best = first
        for child in range(first + 1, min(first + 4, n)):
            if heap[child] < heap[best]:
                best = child
        if heap[best] >= key:
            break
        heap[at] = heap[best]
        at = best
    heap[at] = key
    return least


class Plane(NamedTuple):
    """The map of a search, and its goal.

    `moves`, uint8 (n_cells,), are the legal moves of each flat cell, and `cols` the columns of the
    grid. `left` is the exact integer cost from each flat cell to the goal, -1 for no path: a
    consistent estimate, so that each state is taken at its least cost among paths that do not wind.
    `of_edge`, int32 (2 n_cells,), is the signed number of the word of each base edge: 2 c for the
    step from cell c to the east, 2 c + 1 to the north; `letters` are the numbered words.
    """

    moves: np.ndarray
    cols: int
    left: np.ndarray
    of_edge: np.ndarray
    letters: Letters
    goal: int
    apart: int
    """Cells within which a path that comes back to itself winds."""


class Open(NamedTuple):
    """What a search has met so far.

    `head`, int32 (n_cells,), is the last state at each cell, -1 for none; `heap`, int64, holds the
    keys of states that wait; `goals`, int64, the states at the goal in the order of cost. `used`,
    int64 (3,), counts states, keys and goals.
    """

    head: np.ndarray
    heap: np.ndarray
    goals: np.ndarray
    used: np.ndarray

    @classmethod
    def of_room(cls, n_cells: int, room: int, wanted: int) -> Open:
        """Return what a search needs that has met nothing."""
        head = np.full(n_cells, -1, np.int32)
        heap, goals = np.empty(2 * room, np.int64), np.empty(wanted, np.int64)
        return cls(head, heap, goals, np.zeros(3, np.int64))


@guarded
@njit(cache=True, nogil=True)
def begin(plane, states, waiting, start):
    """Put the state of the start into the heap, if a path leads from there to the goal."""
    if plane.left[start] < 0:
        return
    states.cell[0], states.word[0], states.cost[0], states.before[0] = start, 0, 0, -1
    states.status[0], states.other[0] = _OPEN, -1
    waiting.head[start] = 0
    waiting.heap[0] = _STATE_MASK
    waiting.used[_STATES] = waiting.used[_KEYS] = 1


@njit(cache=True, nogil=True)
def _place(states, state):
    """Fill in the depth, the jump and the run of a state that is taken from the heap."""
    before = np.int64(states.before[state])
    if before < 0:
        states.depth[state], states.jump[state], states.run[state] = 0, state, state
        return
    states.depth[state] = states.depth[before] + 1
    # Skew-binary jumps (E. W. Myers 1983): any earlier state in a logarithm of steps.
    jump = states.jump[before]
    further = states.jump[jump]
    even = states.depth[before] - states.depth[jump] == states.depth[jump] - states.depth[further]
    states.jump[state] = further if even else before
    same = states.word[before] == states.word[state]
    states.run[state] = states.run[before] if same else state


@njit(cache=True, nogil=True)
def _is_winding(plane, states, tree, head, state):
    """Return whether a path has come back, as `_winds` does; all along a path that is found."""
    letters, of_edge, moves, cols = plane.letters, plane.of_edge, plane.moves, plane.cols
    apart = plane.apart
    # Farther off than the cell itself only now and then.
    reach = apart if states.depth[state] % apart == 0 else 0
    winds = _winds(states, tree, letters, of_edge, moves, head, state, reach, cols)
    if winds == 0 and states.cell[state] == plane.goal:
        passed = np.int64(state)
        while winds == 0 and passed >= 0:
            winds = _winds(states, tree, letters, of_edge, moves, head, passed, apart, cols)
            passed = np.int64(states.before[passed])
    return winds


@njit(cache=True, nogil=True)
def _expand(plane, states, tree, waiting, state, origin):
    """Put the states one step behind a state into the heap; return whether there was room."""
    head, heap, used = waiting.head, waiting.heap, waiting.used
    moves, cols, left = plane.moves, plane.cols, plane.left
    letters, of_edge = plane.letters, plane.of_edge
    cell, word = np.int64(states.cell[state]), np.int64(states.word[state])
    if used[_STATES] + 8 > states.cell.size or used[_KEYS] + 8 > heap.size:
        return False
    for k in range(8):
        if not moves[cell] >> k & 1:
            continue
        there = after(tree, letters, of_edge, word, cell, k, cols)
        if there < 0:
            return False
        to = cell + ROW_STEP[k] * cols + COL_STEP[k]
        cost = states.cost[state] + (DIAGONAL if k & 1 else STRAIGHT)
        known = np.int64(head[to])
        while known >= 0 and states.word[known] != there:
            known = np.int64(states.other[known])
        if known < 0:
            known = used[_STATES]
            used[_STATES] += 1
            states.cell[known], states.word[known] = to, there
            states.status[known], states.other[known] = _OPEN, head[to]
            head[to] = known
        elif states.status[known] != _OPEN or states.cost[known] <= cost:
            continue
        states.cost[known], states.before[known] = cost, state
        _push(heap, used[_KEYS], cost + left[to] - origin << _STATE_BITS | _STATE_MASK - known)
        used[_KEYS] += 1
    return True


@guarded
@njit(cache=True, nogil=True)
def find_classes(plane, states, tree, waiting, limit):
    """Go on with a search for the shortest paths of the first classes that do not wind.

    Parameters
    ----------
    plane
        `Plane`.
    states, tree, waiting
        `States`, `Tree` and `Open` after `begin`, or after an earlier call that was `PAUSED`.
    limit
        States that are taken from the heap before the search pauses.

    Returns
    -------
    int
        `FOUND`, `EXHAUSTED`, `LIMITED` or `PAUSED`.
    """
    used, goals = waiting.used, waiting.goals
    origin = plane.left[states.cell[0]] if used[_STATES] > 0 else np.int64(0)
    while used[_KEYS] > 0:
        if limit == 0:
            return PAUSED
        limit -= 1
        # The newest state comes first among those of equal cost.
        state = _STATE_MASK - (_pop(waiting.heap, used[_KEYS]) & _STATE_MASK)
        used[_KEYS] -= 1
        if states.status[state] != _OPEN:
            continue
        _place(states, state)
        winds = _is_winding(plane, states, tree, waiting.head, state)
        if winds < 0:
            return LIMITED
        if winds > 0:
            states.status[state] = _WINDING
            continue
        states.status[state] = _EXPANDED
        if states.cell[state] == plane.goal:
            goals[used[GOALS]] = state
            used[GOALS] += 1
            if used[GOALS] == goals.size:
                return FOUND
        elif not _expand(plane, states, tree, waiting, state, origin):
            return LIMITED
    return EXHAUSTED


@njit(cache=True, nogil=True)
def path_to(states, state):
    """Return the flat cells of the path to a state, from the start."""
    cells = np.empty(states.depth[state] + 1, np.int64)
    for i in range(states.depth[state], -1, -1):
        cells[i] = states.cell[state]
        state = states.before[state]
    return cells


# Kernel that finds the parts of a graph behind passages.


@njit(cache=True, nogil=True)
def behind_passages(first, neighbour, is_passage, start, goal):
    """Return the nodes that the removal of some passage separates from start and goal; bool (n,).

    One depth-first search with low points (J. Hopcroft, R. E. Tarjan 1973) on the graph whose node
    n has the neighbours neighbour[first[n]:first[n + 1]], without parallel edges.
    """
    n_nodes = is_passage.size
    order = np.full(n_nodes, np.int64(-1), np.int64)
    low = np.empty(n_nodes, np.int64)
    parent = np.empty(n_nodes, np.int64)
    met = np.empty(n_nodes, np.int64)
    stack = np.empty(n_nodes, np.int64)
    following = first.copy()
    # By the order in which nodes are met a subtree is an interval: where one begins and ends.
    cuts = np.zeros(n_nodes + 1, np.int64)
    order[start] = low[start] = 0
    parent[start] = -1
    met[0] = stack[0] = start
    n_met = n_stack = 1
    while n_stack > 0:
        node = stack[n_stack - 1]
        if following[node] < first[node + 1]:
            other = neighbour[following[node]]
            following[node] += 1
            if order[other] < 0:
                order[other] = low[other] = n_met
                parent[other] = node
                met[n_met] = stack[n_stack] = other
                n_met += 1
                n_stack += 1
            elif other != parent[node]:
                low[node] = min(low[node], order[other])
            continue
        n_stack -= 1
        above = parent[node]
        if above < 0:
            continue
        low[above] = min(low[above], low[node])
        if is_passage[above] and low[node] >= order[above] and order[goal] < order[node]:
            cuts[order[node]] += 1
            cuts[n_met] -= 1
    behind = np.zeros(n_nodes, np.bool_)
    depth = 0
    for i in range(n_met):
        depth += cuts[i]
        behind[met[i]] = depth > 0
    return behind
