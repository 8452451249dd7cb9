"""Kernels of gates: nodes of the last level between which distances are kept.

Each move between fields of the last level leads from or to a gate. They are mostly the nodes of one
side of each border: half of them, with a quarter of the distances.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.search.overlay.kernels.costs import clique_place
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH
from hybridnav.search.overlay.kernels.paths import append
from hybridnav.search.overlay.kernels.tables import distances_among


@guarded
@njit(cache=True, nogil=True)
def gates_among(move_at, move_to, first, last):
    """Return nodes such that one end of each move between nodes is among them, ascending.

    The other end of a node that has one move left is taken; where there is none, the node with
    the most moves.

    Parameters
    ----------
    move_at, move_to
        See `Levels`.
    first, last
        The first of the nodes, and the one after the last.
    """
    n = last - first
    is_gate, left = np.zeros(n, np.bool_), np.zeros(n, np.int64)
    single, size = np.empty(move_at[last] - move_at[first] + n, np.int64), 0
    for i in range(n):
        left[i] = move_at[first + i + 1] - move_at[first + i]
        if left[i] == 1:
            single[size] = i
            size += 1
    while True:
        taken = -1
        if size > 0:
            size -= 1
            i = single[size]
            if left[i] != 1 or is_gate[i]:
                continue
            for at in range(move_at[first + i], move_at[first + i + 1]):
                if not is_gate[move_to[at] - first]:
                    taken = move_to[at] - first
        else:
            taken = np.argmax(left) if n > 0 else -1
            if taken < 0 or left[taken] == 0:
                break
        is_gate[taken], left[taken] = True, 0
        for at in range(move_at[first + taken], move_at[first + taken + 1]):
            other = move_to[at] - first
            left[other] -= 0 if is_gate[other] else 1
            if left[other] == 1 and not is_gate[other]:
                single[size] = other
                size += 1
    return (first + np.flatnonzero(is_gate)).astype(np.int32)


@njit(cache=True, nogil=True)
def gates_near(levels, top, field, reach):
    """Return the gates in a field, and beside its other nodes, with the distances to them.

    Parameters
    ----------
    levels, top
        See `Levels` and `Top`.
    field
        One of the last level.
    reach
        int64 (n,), the distances to its nodes.

    Returns
    -------
    tuple
        int64 (k,) each: places of gates in `Top.gates`, the least distances, and the nodes of the
        field over which they lead.
    """
    origin = levels.node_at[levels.level_at[len(levels.level_at) - 2]]
    first, last = levels.node_at[field], levels.node_at[field + 1]
    room = last - first + levels.move_at[last] - levels.move_at[first]
    gates, costs, over = (
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
    )
    place, n = np.full(top.gates.size, -1, np.int32), 0
    for node in range(first, last):
        value = reach[node - first]
        if value >= NO_PATH:
            continue
        own = top.gate_of[node - origin]
        moves = (levels.move_at[node], levels.move_at[node + 1]) if own < 0 else (-1, 0)
        for at in range(moves[0], moves[1]):
            gate, total = own, value
            if at >= 0:
                if levels.move_cost[at] >= FAR:
                    continue
                gate, total = top.gate_of[levels.move_to[at] - origin], value + levels.move_cost[at]
            if place[gate] < 0:
                place[gate], gates[n], costs[n] = n, gate, NO_PATH
                n += 1
            if total < costs[place[gate]]:
                costs[place[gate]], over[place[gate]] = total, node
    return gates[:n], costs[:n], over[:n]


@guarded
@njit(cache=True, nogil=True)
def gates_of(levels, top, fields):
    """Return the places of the gates in and beside some fields of the last level, ascending."""
    is_near = np.zeros(top.gates.size, np.bool_)
    for field in fields:
        zero = np.zeros(levels.node_at[field + 1] - levels.node_at[field], np.int64)
        is_near[gates_near(levels, top, np.int64(field), zero)[0]] = True
    return np.flatnonzero(is_near).astype(np.int32)


# Kernels of the distances over the last level, kept between gates.


@njit(cache=True, nogil=True)
def fill_top(levels, fields, gates, part, distance):
    """Compute the distances between some gates and those before them.

    Parameters
    ----------
    levels
        See `Levels`.
    fields
        The first field of the last level and the one after the last.
    gates
        int32 (n,), the nodes.
    part
        int32 (k,), places in a row of those from which they are computed.
    distance
        int32 (n * (n + 1) / 2,), changed; see `clique_place`.

    Returns
    -------
    int
        The largest distance that was reached.
    """
    first = levels.node_at[fields[0]]
    rows = np.empty((part.size, levels.node_at[fields[1]] - first), np.int32)
    most = distances_among(levels, fields, gates[part], rows, np.empty((0, 0), np.uint16))
    for k in range(part.size):
        for other in range(part[k] + 1):
            distance[clique_place(np.int64(part[k]), other)] = rows[k, gates[other] - first]
    return most


@njit(cache=True, nogil=True)
def join(levels, top, fields, reaches, limit):
    """Return the least distance over the top, and the nodes of the last level on the way.

    Parameters
    ----------
    levels, top
        See `Levels` and `Top`.
    fields
        The fields of start and goal on the last level.
    reaches
        Two int64 (n,), the distances inside them, from the start and to the goal.
    limit
        Only less is looked for.

    Returns
    -------
    tuple
        The distance; int64 (n,) nodes, none when there is nothing below the limit, or when no path
        is as long as the distances state.
    """
    starts, from_start, over_start = gates_near(levels, top, fields[0], reaches[0])
    goals, to_goal, over_goal = gates_near(levels, top, fields[1], reaches[1])
    # Rows of the later gates have the distances to earlier ones side by side.
    if fields[0] > fields[1]:
        best, i, j = _least_sum(top, starts, from_start, goals, to_goal, limit)
    else:
        best, j, i = _least_sum(top, goals, to_goal, starts, from_start, limit)
    nodes, n = np.empty(64, np.int64), 0
    if i < 0:
        return best, nodes[:0]
    gate, last = starts[i], goals[j]
    row = np.empty(top.gates.size, np.int32)
    for other in range(row.size):
        row[other] = top.distance[clique_place(other, last)]
    if over_start[i] != top.gates[gate]:
        nodes[0], n = over_start[i], 1
    nodes[n] = top.gates[gate]
    n += 1
    nodes, n = _walk_over_gates(levels, top, gate, row, nodes, n)
    if n < 0 or nodes[n - 1] != top.gates[last]:
        return best, nodes[:0]
    if over_goal[j] != top.gates[last]:
        nodes = append(nodes, n, over_goal[j])
        n += 1
    return best, nodes[:n]


@njit(cache=True, nogil=True)
def _least_sum(top, gates, costs, others, other_costs, limit):
    """Return the least sum of a cost of a gate, one of another, and the distance between, and the
    places of both, -1 where none is below the limit.

    A gate's rest, the least of the last two, is not less than another one's without the distance
    between the two. So few gates are looked at, those first that can lead to the least.
    """
    best, pair, bounds = np.int64(limit), (-1, -1), costs.copy()
    sums, apart = np.empty(others.size, np.int64), np.empty(gates.size, np.int64)
    while gates.size > 0 and others.size > 0:
        i = np.argmin(bounds)
        if bounds[i] >= best:
            break
        _distances_to(top, gates[i], others, sums)
        for j in range(others.size):
            sums[j] += other_costs[j]
        j = np.argmin(sums)
        rest = min(sums[j], np.int64(NO_PATH))
        if costs[i] + rest < best:
            best, pair = costs[i] + rest, (i, j)
        _distances_to(top, gates[i], gates, apart)
        for k in range(gates.size):
            bounds[k] = max(bounds[k], costs[k] + rest - apart[k])
        bounds[i] = NO_PATH
    return best, pair[0], pair[1]


@njit(cache=True, nogil=True)
def _distances_to(top, gate, others, found):
    """Put the distances between a gate and some others into an array, NO_PATH for none."""
    distance, row = top.distance, gate * (gate + 1) >> 1
    for j in range(others.size):
        other = others[j]
        at = row + other if other <= gate else (other * (other + 1) >> 1) + gate
        # No sign of places and no branch: these become vector instructions.
        stored = np.int64(distance[np.uint64(at)])
        found[j] = stored if stored < FAR else np.int64(NO_PATH)


@njit(cache=True, nogil=True)
def _walk_over_gates(levels, top, gate, row, nodes, n):
    """Append the nodes of the last level after a gate on a shortest path to another one.

    The next gate is in the field of a gate, in a field beside it, or behind a move out of these.

    Parameters
    ----------
    levels, top
        See `Levels` and `Top`.
    gate
        Its place.
    row
        int32 (gates,), the distances of all gates to the other one.
    nodes, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `nodes`, in a new array if there was no room, and their number, -1 if no path is as long as
        the distances state.
    """
    origin = levels.node_at[levels.level_at[len(levels.level_at) - 2]]
    gate = np.int64(gate)
    for _ in range(row.size):
        if row[gate] <= 0:
            break
        start, found, way = np.int64(top.gates[gate]), np.int64(-1), (-1, -1, -1)
        for entry_at in range(levels.move_at[start] - 1, levels.move_at[start + 1]):
            is_own = entry_at < levels.move_at[start]
            entry = np.int64(start if is_own else levels.move_to[entry_at])
            rest = np.int64(row[gate]) - np.int64(0 if is_own else levels.move_cost[entry_at])
            field = levels.field_of[entry]
            first, clique = levels.node_at[field], levels.clique_at[field]
            for node in range(first, levels.node_at[field + 1] if rest >= 0 else first):
                left = rest - levels.clique[clique + clique_place(entry - first, node - first)]
                if left < 0:
                    continue
                other = np.int64(top.gate_of[node - origin])
                if other >= 0:
                    if other != gate and row[other] == left:
                        found, way = other, (entry, node, node)
                        break
                    continue
                for at in range(levels.move_at[node], levels.move_at[node + 1]):
                    other = np.int64(top.gate_of[levels.move_to[at] - origin])
                    if other != gate and row[other] + levels.move_cost[at] == left:
                        found, way = other, (entry, node, levels.move_to[at])
                        break
                if found >= 0:
                    break
            if found >= 0:
                break
        if found < 0:
            break
        for node in way:
            if node != nodes[n - 1]:
                nodes = append(nodes, n, node)
                n += 1
        gate = found
    return nodes, (n if row[gate] <= 0 else -1)
