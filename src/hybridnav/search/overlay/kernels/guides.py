"""Kernels of lower bounds on the distances from nodes to a goal, by which searches are guided."""

import numpy as np

from hybridnav._base.jit import njit
from hybridnav.search.overlay.kernels.costs import clique_place, least_cost
from hybridnav.search.overlay.kernels.exits import beyond_exits, exit_landmarks
from hybridnav.search.overlay.kernels.gates import gates_near
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH


@njit(cache=True, nogil=True)
def _over_top(top, gate, gates, tail):
    """Return the least sum of a stored distance from a gate to others and a bound beyond these."""
    least = np.int64(NO_PATH)
    for j in range(gates.size):
        stored = np.int64(top.distance[clique_place(gate, np.int64(gates[j]))])
        if stored < FAR:
            least = min(least, stored + tail[j])
    return least


@njit(cache=True, nogil=True)
def aim(levels, ground, top, goal, field, reach):
    """Return what `ahead_of` needs of a goal.

    Parameters
    ----------
    levels, ground, top
        See `Levels`, `CellCosts` and `Top`.
    goal
        Flat cell.
    field
        Its field on the last level.
    reach
        Two int64 (n,), the distances from the nodes of that field as `least_reach` and `climb`
        computed them: not above the distances of now, and not below those before the changes.

    Returns
    -------
    tuple
        `goal`, `field`; the first of `reach`, or bounds where that is none; the second one; places
        of the gates in and beside the field, int64 (m,) bounds on their distances to the goal;
        int64 (k,), bounds from the gates `top.lowered`, over stored distances.

    Notes
    -----
    Stored distances bound every path over costs that were not lowered. A path over lowered costs
    enters a field with lowered costs over a gate p in or beside it, and leaves the last one over a
    gate q: what lies between costs at least the distance without obstacles.
    """
    cols, least_units = ground.cols, ground.least_units
    first, last = levels.node_at[field], levels.node_at[field + 1]
    tail = np.empty(last - first, np.int64)
    for node in range(first, last):
        tail[node - first] = reach[0][node - first]
        if levels.is_stale[field] and levels.is_lowered[field]:
            tail[node - first] = least_cost(levels.cell_of[node], goal, cols, least_units)
    beyond = np.full(top.lowered.size, NO_PATH, np.int64)
    if top.distance.size == 0:
        return goal, field, tail, reach[1], np.empty(0, np.int64), tail[:0], beyond
    gates, gate_tail, _ = gates_near(levels, top, field, tail)
    direct = np.empty(top.lowered.size, np.int64)
    for j in range(top.lowered.size):
        direct[j] = _over_top(top, np.int64(top.lowered[j]), gates, gate_tail)
    for i in range(top.lowered.size):
        cell = levels.cell_of[top.gates[top.lowered[i]]]
        for j in range(top.lowered.size):
            other = levels.cell_of[top.gates[top.lowered[j]]]
            beyond[i] = min(beyond[i], direct[j] + least_cost(cell, other, cols, least_units))
    return goal, field, tail, reach[1], gates, gate_tail, beyond


@njit(cache=True, nogil=True)
def _note(node, bound, work):
    """Keep the bound of a node for the rest of the search, and return it."""
    work.ahead[node] = bound
    work.seen[work.counts[0]] = node
    work.counts[0] += 1
    return np.int64(bound)


@njit(cache=True, nogil=True)
def _from_gate(levels, ground, top, target, gate, work):
    """Return the bound of a gate."""
    node = top.gates[gate]
    if work.ahead[node] >= 0:
        return work.ahead[node]
    goal, _, _, _, gates, gate_tail, beyond = target
    bound = _over_top(top, gate, gates, gate_tail)
    bound = min(bound, _over_top(top, gate, top.lowered, beyond))
    without = least_cost(levels.cell_of[node], goal, ground.cols, ground.least_units)
    return _note(node, max(bound, without), work)


@njit(cache=True, nogil=True)
def _from_last_level(levels, ground, top, target, node, work):
    """Return the bound of a node of the last level.

    A path from a node that is no gate leads inside its field to the goal, to a gate, or to a node
    with a move to a gate.
    """
    if work.ahead[node] >= 0:
        return work.ahead[node]
    origin = levels.node_at[levels.level_at[len(levels.level_at) - 2]]
    if top.gate_of[node - origin] >= 0:
        return _from_gate(levels, ground, top, target, np.int64(top.gate_of[node - origin]), work)
    cols, least_units, field = ground.cols, ground.least_units, levels.field_of[node]
    is_bare = levels.is_stale[field] and levels.is_lowered[field]
    first, clique = levels.node_at[field], levels.clique_at[field]
    bound = target[2][node - first] if field == target[1] else np.int64(NO_PATH)
    for other in range(first, levels.node_at[field + 1]):
        if is_bare:
            cells = levels.cell_of[node], levels.cell_of[other]
            inside = least_cost(cells[0], cells[1], cols, least_units)
        else:
            inside = np.int64(levels.clique[clique + clique_place(node - first, other - first)])
        if inside >= min(bound, np.int64(FAR)):
            continue
        is_gate = top.gate_of[other - origin] >= 0
        moves = levels.move_at[other], levels.move_at[other + 1]
        for at in range(moves[1] - 1 if is_gate else moves[0], moves[1]):
            gate_node = np.int64(other if is_gate else levels.move_to[at])
            cost = np.int64(0 if is_gate else levels.move_cost[at])
            if cost >= FAR:
                continue
            # A call that passes all these arrays costs a hundred times as much as a look.
            rest = work.ahead[gate_node]
            if rest < 0:
                gate = np.int64(top.gate_of[gate_node - origin])
                rest = _from_gate(levels, ground, top, target, gate, work)
            bound = min(bound, inside + cost + rest)
    without = least_cost(levels.cell_of[node], target[0], cols, least_units)
    return _note(node, max(bound, without), work)


@njit(cache=True, nogil=True)
def _inside_stale(levels, ground, top, target, child, work):
    """Note the bounds of the nodes of a field in a stale one of the last level, by its table.

    Parameters
    ----------
    levels, ground, top, target, work
        See `ahead_of`.
    child
        The field; costs in the one around it were not lowered.

    Notes
    -----
    A path leaves the field around it at one of its nodes, or the goal lies inside. Then the
    distance is not less than the difference of those from a landmark.
    """
    goal, field = target[0], target[1]
    around = np.int64(levels.parent[child])
    begin, first = levels.node_at[child], levels.node_at[around]
    count = levels.node_at[child + 1] - begin
    rests = np.empty(levels.node_at[around + 1] - first, np.int64)
    for i in range(rests.size):
        rests[i] = work.ahead[first + i]
        if rests[i] < 0:
            rests[i] = _from_last_level(levels, ground, top, target, first + i, work)
    least = _across_child(levels, ground, child, beyond_exits(levels, child, rests))
    inside = np.zeros(count, np.int64)
    if around == field:
        _apart(levels, child, target[3], False, inside)
    for i in range(count):
        cell = levels.cell_of[begin + i]
        without = least_cost(cell, goal, ground.cols, ground.least_units)
        bound = max(least[i], without)
        if around == field:
            bound = min(bound, max(inside[i], without))
        _note(begin + i, bound, work)


@njit(cache=True, nogil=True)
def _across_child(levels, ground, child, beyond):
    """Return the least sums, at the nodes of a field, of a distance inside to an exit and what is
    beyond.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    child
        The field. Where its clique is of later costs than the exits, distances are those without
        obstacles.
    beyond
        int64 (n,), see `beyond_exits`.
    """
    begin, clique = levels.node_at[child], levels.clique_at[child]
    least = np.full(beyond.size, NO_PATH, np.int64)
    for j in np.argsort(beyond):
        rest = beyond[j]
        # Exits from which another one is on the way are passed by: most of them.
        if rest >= least[j]:
            continue
        if levels.is_newer[child]:
            cell = levels.cell_of[begin + j]
            for i in range(least.size):
                other = levels.cell_of[begin + i]
                apart = least_cost(cell, other, ground.cols, ground.least_units)
                least[i] = min(least[i], rest + apart)
            continue
        row = clique + clique_place(j, 0)
        for i in range(j + 1):
            least[i] = min(least[i], rest + levels.clique[row + i])
        place = clique + clique_place(j + 1, j)
        for i in range(j + 1, least.size):
            least[i] = min(least[i], rest + levels.clique[place])
            place += i + 1
    return least


@njit(cache=True, nogil=True)
def _apart(levels, child, tail, is_both, bounds):
    """Raise bounds at the nodes of a field to differences of the distances from landmarks.

    Parameters
    ----------
    levels
        See `Levels`.
    child
        The field; the one around it has landmarks.
    tail
        int64 (n,), the distances from the nodes of the field around it to the goal.
    is_both
        Whether the goal may be further from a landmark than the node: not with upper bounds in
        `tail`.
    bounds
        int64 (m,), changed.
    """
    around = np.int64(levels.parent[child])
    marks, at = exit_landmarks(levels, around)
    inner = levels.node_at[levels.inner_at[around]]
    width = levels.node_at[levels.inner_at[around + 1]] - inner
    for k in range(marks.size):
        to_goal = tail[marks[k]]
        begin = at + k * width + levels.node_at[child] - inner
        for i in range(bounds.size if to_goal < NO_PATH else 0):
            apart = np.int64(levels.table[begin + i]) - to_goal
            apart = abs(apart) if is_both else apart
            bounds[i] = max(bounds[i], apart)


@njit(cache=True, nogil=True)
def _beside_goal(levels, ground, target, child, work):
    """Note the bounds of the nodes of a field beside the goal, in one field of the last level.

    Paths stay inside that field, whose table has the distances from landmarks, and is not stale.

    Parameters
    ----------
    levels, ground, target, work
        See `ahead_of`.
    child
        A field of the level below the last.
    """
    begin = levels.node_at[child]
    most = np.empty(levels.node_at[child + 1] - begin, np.int64)
    for i in range(most.size):
        cell = levels.cell_of[begin + i]
        most[i] = least_cost(cell, target[0], ground.cols, ground.least_units)
    _apart(levels, child, target[3], True, most)
    for i in range(most.size):
        _note(begin + i, most[i], work)


@njit(cache=True, nogil=True)
def ahead_of(levels, ground, top, target, is_guided, node, work):
    """Return a lower bound on the distance from a node to the goal; see `aim`.

    Parameters
    ----------
    levels, ground, top
        See `Levels`, `CellCosts` and `Top`.
    target
        What `aim` returned.
    is_guided
        Whether to look into stored distances.
    node
        Node of any level.
    work
        See `NodeWork`; its bounds are changed.
    """
    if work.ahead[node] >= 0:
        return work.ahead[node]
    around = levels.parent[levels.field_of[node]]
    has_table = around == target[1] and levels.table_at[around] < levels.table_at[around + 1]
    if not is_guided and has_table and not levels.is_stale[around]:
        _beside_goal(levels, ground, target, levels.field_of[node], work)
        return work.ahead[node]
    if is_guided and top.distance.size > 0:
        if around < 0:
            return _from_last_level(levels, ground, top, target, node, work)
        if not levels.is_lowered[around] and levels.parent[around] < 0:
            _inside_stale(levels, ground, top, target, levels.field_of[node], work)
            return work.ahead[node]
    cell = levels.cell_of[node]
    return _note(node, least_cost(cell, target[0], ground.cols, ground.least_units), work)
