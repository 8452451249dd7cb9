"""Check a proof about a path: `python check_proof.py MAP PROOF`. Needs Python and numpy only.

The robot is a disc, or a point. Its centre moves over the *free* cells of a map: they were measured
as free, the proof does not close them, and no occupied cell is within the radius, from centre to
centre. All others, and the outside, are *walls*: it may touch them, but not enter them, nor pass
between two that meet at a corner. Accepted means: the path of the proof is free, it costs what is
stated, and none costs less than the stated bound, to 1 part in 10^9 (or 10^-7 of a cell, to which
the ends of lines are rounded). All else is decided in whole numbers, or rounded so that it rejects.
MAP is a YAML file of ROS beside a PGM image, or a MovingAI map; the proof must be about that map.
"""

import base64
import cmath
import hashlib
import itertools
import json
import math
import re
import sys
import zlib
from pathlib import Path

import numpy as np

MOVES = np.array([(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)])
STRAIGHT, DIAGONAL = 195025, 275807  # the ratio is below sqrt(2), by 7 parts in 10^12
ONE = 2**14  # the factor 1: a metre costs a metre
UNIT = 2 * ONE * STRAIGHT
MOST = 1000  # cells that a radius has, lest a file takes hours


class Rejected(Exception):
    """The proof does not prove what it states; the text says why."""


def need(is_true, why):
    """Reject a proof unless a condition holds."""
    if not is_true:
        raise Rejected(why)


def read_map(path, thresholds):
    """Return cells, 0 occupied, 1 free, 2 other, row 0 lowest, and side, x, y, yaw of the map."""
    if path.suffix == ".map":
        rows = path.read_text().partition("\nmap")[2].split()[::-1]
        return np.array([[c in ".GS" for c in row] for row in rows], np.uint8), [1.0, 0.0, 0.0, 0.0]
    text = re.sub(r"#.*", "", path.read_text())
    value = dict(re.findall(r"(\w+)\s*:\s*([^,{}\[\]\n]*)", text))
    pose = re.findall(r"-?[\d.]+(?:e[-+]?\d+)?", text.lower().partition("origin")[2])[:3]
    data = (path.parent / value["image"].strip(" \"'")).read_bytes()
    gap = rb"(?:\s|#[^\n]*\n)+"
    head = re.match(rb"P([25])" + 2 * (gap + rb"(\d+)") + gap + rb"255\s", data)
    need(head and "raw" not in value.get("mode", ""), "no PGM of 8 bits: write the map as one")
    kind, cols, rows = map(int, head.groups())
    pixels = np.frombuffer(data, np.uint8, offset=head.end())
    pixels = np.array(data[head.end() :].split(), int) if kind == 2 else pixels
    level = np.arange(256)
    level = level if value["negate"].strip().lower() in {"1", "true", "yes", "on"} else level[::-1]
    occupancy, (low, high) = (level / 255).astype(np.float32), np.float32(thresholds)
    kinds = np.where(occupancy >= high, 0, np.where(occupancy <= low, 1, 2)).astype(np.uint8)
    return kinds[pixels[: rows * cols].reshape(rows, cols)[::-1]], [
        *map(float, [value["resolution"], *pose])
    ]


def squares(occupied, reach):
    """Return the squared distance of each cell to the nearest occupied one, up to reach^2."""
    cols, far = np.arange(occupied.shape[1]), occupied.shape[1] + reach
    left = np.maximum.accumulate(np.where(occupied, cols, -far), axis=1)
    right = np.minimum.accumulate(np.where(occupied, cols, 2 * far)[:, ::-1], axis=1)[:, ::-1]
    in_row = np.minimum(np.minimum(cols - left, right - cols), reach + 1).astype(np.int32) ** 2
    nearest = in_row.copy()
    for n in range(1, min(reach + 1, len(nearest))):
        np.minimum(nearest[n:], in_row[:-n] + n * n, out=nearest[n:])
        np.minimum(nearest[:-n], in_row[n:] + n * n, out=nearest[:-n])
    return nearest


def walls_of(measured, proof, side):
    """Return the walls, bool, with a rim round the map."""
    free = (measured == 1) | (measured == 2) & (proof["allow_unexplored"] is True)
    if (radius := proof["radius_m"] / side) >= 1:
        need(radius < MOST, "a radius of too many cells")
        most = math.floor(radius * radius * (1 + 1e-9))
        free &= squares(measured == 0, math.isqrt(most)) > most
    for first, end in proof["closed"]:
        need(0 <= first < end <= free.size, "a closed cell is outside the map")
        free.ravel()[first:end] = False
    digest = hashlib.sha256(np.packbits(free).tobytes()).hexdigest()
    need(digest == proof["free_sha256"], "map, radius and closed cells leave other cells free")
    return np.pad(~free, 1, constant_values=True)


def factors_of(measured, costs, side):
    """Return the factor of each cell in units: that of Nav2's inflation by clearance, or 1."""
    if costs is None:
        return np.full(np.add(measured.shape, 2), ONE)
    reach = math.ceil(costs["inflation_radius_m"] / side)
    need(0 <= reach < MOST, "costs that reach too far")
    cost = np.zeros(reach * reach + 2 * reach + 2)
    for n in range(reach * reach + 1):
        off = math.sqrt(n) * side - costs["inscribed_radius_m"]
        cost[n] = 253 if off <= 0 else math.floor(252 * math.exp(-costs["scaling"] * off))
    cost[0] = 254
    factors = np.floor((1 + costs["multiplier"] / 252 * cost) * ONE).astype(np.int64)
    need((factors >= ONE).all() and (factors < 1000 * ONE).all(), "a factor is not from 1 to 1000")
    return np.pad(factors[squares(measured == 0, reach)], 1, constant_values=ONE)


def walk(start, digits):
    """Return the cells of a walk, whose moves are digits from 0 to 7."""
    steps = MOVES[np.frombuffer(digits.encode(), np.uint8) - ord("0")]
    return np.cumsum(np.concatenate([[start], steps]), axis=0) + 1


# NO PATH. A closed chain of walls, each beside the next by a side or a corner, goes round one end
# and not round the other. Draw a line through the centres of its cells. A robot that goes from a
# free cell to the next one crosses a side between them, and the line from centre to centre meets no
# line between two walls; between two that meet at a corner it may not pass. So it never crosses the
# line. But a ray from one end crosses the line an odd number of times, and from the other an even
# one: one lies inside and one outside, and no path joins them.


def check_no_path(walls, factors, proof, ends):
    """Check that a chain of walls parts the ends."""
    chain = walk(*proof["chain"])
    need((chain >= 0).all() and (chain < walls.shape).all(), "the chain leaves the rim of the map")
    need(walls[tuple(chain.T)].all() and (chain[0] == chain[-1]).all(), "no closed chain of walls")
    lower = np.where(chain[:-1, :1] < chain[1:, :1], chain[:-1], chain[1:])
    lower = lower[chain[:-1, 0] != chain[1:, 0]]
    right = [
        ((lower[:, 0] == row) & (lower[:, 1] > col)).sum() for row, col in ends // proof["grain"]
    ]
    need(sum(right) % 2 == 1, "the chain does not part start and goal")
    return math.inf


# A POTENTIAL is a number p for each node of a graph, so that no move raises p by more than it
# costs. The moves of a path raise p by p(goal) - p(start) in all, so every path costs at least
# that. Any such numbers prove. Here p is the cost of a walk back to the start, one move after the
# other as the proof states them for some nodes, its tree. All others have p = bound - (the least
# cost from there to the goal on an empty map), which no move raises by more than it costs: so only
# moves from or to the tree are to be looked at, and all of them are. Costs are whole numbers, UNIT
# a cell.


def check_potential(costs_of, walls, factors, proof, ends, bound):
    """Check a potential on a grid, from the costs of four of the MOVES, 0 where there is none;
    return it, and where it begins."""
    top, left, rows, cols = proof["box"]
    part = np.s_[top : top + rows + 2, left : left + cols + 2]
    costs = costs_of(walls[part], factors[part])
    raw = zlib.decompressobj().decompress(base64.b85decode(proof["tree"]), rows * cols + 1)
    tree = np.pad(np.frombuffer(raw, np.uint8).reshape(rows, cols), 1, constant_values=9)
    need(
        min(top, left) >= 0 and tree.shape == costs.shape[1:] and (tree < 10).all(), "a wrong tree"
    )
    (start, goal) = ends = ends - (top, left)
    need(((ends > 0) & (ends <= (rows, cols))).all(), "an end is not in the box of the tree")
    inside, before = np.flatnonzero(tree < 8), np.arange(tree.size)
    move = tree.ravel()[inside]
    before[inside] += MOVES[move] @ [tree.shape[1], 1]
    back = np.zeros(tree.size, np.int64)
    back[inside] = costs.reshape(4, -1)[move % 4, np.where(move < 4, inside, before[inside])]
    need((back[inside] > 0).all(), "a move of the tree meets a wall")
    while len(inside) and (tree.ravel()[before[inside]] < 8).any():  # twice as far with each turn
        need(back.max() < 2**61, "the tree has a cycle")
        back, before = back + back[before], before[before]
    need((tree.ravel()[before[inside]] == 8).all(), "a branch of the tree does not end at a root")
    down, across = (abs(np.arange(n) - at) for n, at in zip(tree.shape, goal, strict=True))
    ahead = np.maximum(down[:, None], across) * STRAIGHT
    ahead += np.minimum(down[:, None], across) * (DIAGONAL - STRAIGHT)
    p = np.where(tree == 9, bound - 2 * ONE * ahead, back.reshape(tree.shape))
    for cost, step in zip(costs, MOVES, strict=False):
        there = np.roll(p, -step, (0, 1))
        looked_at = ((tree < 9) | np.roll(tree < 9, -step, (0, 1))) & (cost > 0)
        need((abs(p - there) <= cost)[looked_at].all(), "a move raises p by more than it costs")
    need(p[tuple(start)] <= 0 and p[tuple(goal)] >= bound, "p does not rise by the bound")
    return p, tree, (top, left)


def check_cells(walls, factors, proof, ends):
    """Check a path of cells, whose nodes are the cells: diagonals need both cells beside them."""
    path, ends = walk(*proof["path"]), ends // proof["grain"]
    need((path[[0, -1]] == ends).all(), "the path has other ends")
    beside = [path[1:] * (0, 1) + path[:-1] * (1, 0), path[1:] * (1, 0) + path[:-1] * (0, 1)]
    need(not any(walls[tuple(cells.T)].any() for cells in (path, *beside)), "the path meets a wall")
    bound = math.floor(proof["bound"] / proof["side_m"] * (1 - 1e-9) * UNIT)
    check_potential(costs_of_cells, walls, factors, proof, ends, bound)
    weights = factors[tuple(path.T)]
    return (np.hypot(*np.diff(path, axis=0).T) * (weights[1:] + weights[:-1])).sum() / (2 * ONE)


def costs_of_cells(walls, factors):
    """Return the costs of moves between cells, the mean of their factors times the length."""
    costs = np.zeros((4, *walls.shape), np.int64)
    for n, (down, across) in enumerate(MOVES[:4]):
        by = [(0, 0), (down, across), (down, 0), (0, across)]
        shut = np.any([np.roll(walls, (-row, -col), (0, 1)) for row, col in by], axis=0)
        weight = factors + np.roll(factors, (-down, -across), (0, 1))
        costs[n] = np.where(shut, 0, weight * (DIAGONAL if down * across else STRAIGHT))
    return costs


# A LINE BY COSTS. Let a line cost K. Cut it where it enters another cell, and measure each part as
# a king would walk it, along sides and diagonals: at most 1.0824 times as far. Slide the cuts along
# their sides: the sum of these measures is linear but where two cuts lie opposite each other, so it
# is least with all cuts at corners. Then it is the cost of moves along sides, by the cheaper of the
# two cells, and across cells. So K is at least the least cost of such moves, over 1.0824, between
# two corners near the ends, less the cost from the ends to these corners.


def costs_of_corners(walls, factors):
    """Return the costs of moves between corners of cells; corner (r, c) is below cell (r, c)."""
    price = np.where(walls, 2**62, 2 * factors)
    east, north = np.minimum(price, np.roll(price, 1, 0)), np.minimum(price, np.roll(price, 1, 1))
    costs = np.stack([east, price, north, np.roll(price, 1, 1)])
    return np.where(costs == 2**62, 0, costs) * np.array([STRAIGHT, DIAGONAL] * 2)[:, None, None]


def check_line_by_costs(walls, factors, proof, ends):
    """Check a line, its cost, and a potential of corners that bounds all others."""
    line = free_line(walls, proof, ends).astype(float) / proof["grain"]
    cost = 0.0
    for first, last in itertools.pairwise(line):
        cuts = [
            np.arange(math.ceil(min(pair)), max(pair)) for pair in zip(first, last, strict=True)
        ]
        parts = [(cut - a) / (b - a) for cut, a, b in zip(cuts, first, last, strict=True) if a != b]
        parts = np.sort(np.concatenate([[0.0, 1.0], *parts]))
        middle = first + (last - first) * (parts[1:, None] + parts[:-1, None]) / 2
        cost += np.hypot(*(last - first)) * (dearest(factors, middle) * np.diff(parts)).sum() / ONE
    ends, corners = line[[0, -1]], np.floor(line[[0, -1]] + 0.5).astype(int)
    joins = (np.hypot(*(corners - ends).T) * dearest(factors, ends)).sum() / ONE
    least = (proof["bound"] / proof["side_m"] * (1 - 1e-9) + joins) * math.sqrt(4 - math.sqrt(8))
    wider = [np.pad(array, (0, 1), constant_values=1) for array in (walls, factors)]  # for the rim
    if proof["bound"] > math.dist(*ends) * proof["side_m"]:  # as no factor is below 1
        check_potential(costs_of_corners, *wider, proof, corners, math.floor(least * UNIT))
    return cost


def dearest(factors, points):
    """Return the largest factor of the cells that points lie in, or between."""
    near = [np.floor(points + off).astype(int).T for off in 1e-7 * MOVES[1::2]]
    return np.max([factors[tuple(cells)] for cells in near], axis=0)


# A LINE. A shortest path is a chain of straight lines, like a taut string. It bends at *corners*
# only, where one of four cells is a wall, and round that wall. Again p is a number, for start, goal
# and each corner where a path that is shorter than the bound can be. If no line of such a chain
# raises p by more than its length, no path is shorter than p(goal) - p(start). The proof states p
# for some corners; elsewhere p = bound - (the distance to the goal), which rises by at most the
# distance. So wherever two corners differ by more than their distance, and a string along the line
# between them could bend at both, a wall must cut that line. That is decided in whole numbers.


def are_cut(walls, first, last, grain):
    """Return which lines between points, whole numbers of 1 / grain of a cell, meet a wall."""
    cut, left = np.zeros(len(first), np.bool_), np.arange(len(first))
    for part in np.array([16, 8, 24, 4, 12, 20, 28, *range(2, 32, 4)]) / 32:
        at = (first[left] * (1 - part) + last[left] * part).astype(float) / grain
        inside = (abs(at % 1 - 0.5) < 0.499).all(axis=1)  # surely, as numbers are rounded
        cut[left] = inside & walls[tuple(at.astype(int).T)]
        left = left[~cut[left]]
    down, across = abs(last - first)[left].T
    is_steep = (across != 0) & (across < down) | (down == 0)
    for grid, which, turn in ((walls, left[~is_steep], 1), (walls.T, left[is_steep], -1)):
        cut[which] = cut_by_rows(grid, first[which][:, ::turn], last[which][:, ::turn], grain)
    return cut


def cut_by_rows(walls, first, last, grain):
    """Return the same from the columns that each line passes in each row of cells."""
    is_up = (first[:, 0] < last[:, 0])[:, None]
    first, last = np.where(is_up, first, last), np.where(is_up, last, first)
    begin = (first[:, 0] // grain).astype(int)
    count = (-(-last[:, 0] // grain)).astype(int) - begin
    of = np.repeat(np.arange(len(first)), count)
    row = np.arange(len(of)) - np.repeat(np.cumsum(count) - count - begin, count)
    (low, col), (high, _), (rise, run) = first[of].T, last[of].T, (last - first)[of].T
    ends = [np.maximum(low, row * grain), np.minimum(high, (row + 1) * grain)]
    at = [col * rise + (end - low) * run for end in ends]
    left = (np.minimum(*at) // (grain * rise)).astype(int)
    right = (-(-np.maximum(*at) // (grain * rise))).astype(int)
    before = np.pad(np.cumsum(walls, axis=1, dtype=np.int32), ((0, 0), (1, 0)))
    on_side = walls[row, left - 1] & walls[row, left]  # a line between two columns
    cut = np.where(left < right, before[row, right] > before[row, left], on_side)
    corner = np.flatnonzero((ends[1] < high) & (at[1] % (grain * rise) == 0))
    row, col, run = row[corner], (at[1] // (grain * rise))[corner].astype(int), run[corner]
    cut[corner] |= (run >= 0) & walls[row, col] & walls[row + 1, col - 1]
    cut[corner] |= (run <= 0) & walls[row, col - 1] & walls[row + 1, col]
    return np.bincount(of[cut], minlength=len(first)) > 0


def free_line(walls, proof, ends):
    """Return the points of a line in whole numbers, after a check that it is free."""
    line = np.array(proof["line"], ends.dtype) + proof["grain"]
    need((line[[0, -1]] == ends).all(), "the line has other ends")
    is_cut = len(line) > 1 and are_cut(walls, line[:-1], line[1:], proof["grain"]).any()
    need(not is_cut, "the line meets a wall")
    return line


def check_line(walls, factors, proof, ends):
    """Check a line, and the potential at the corners that bounds all others."""
    grain, bound = proof["grain"], proof["bound"] / proof["side_m"]
    line = free_line(walls, proof, ends)
    cost = np.hypot(*np.diff(line.astype(float), axis=0).T).sum() / grain

    four = [walls[i : i - 1 or None, j : j - 1 or None] for i in (0, 1) for j in (0, 1)]
    corners = np.argwhere(np.sum(four, axis=0) == 1) + 1
    start, goal = ends.astype(float) / grain
    to_goal = np.hypot(*(corners - goal).T)
    near = np.hypot(*(corners - start).T) + to_goal < bound * (1 + 1e-9)
    corners, p = corners[near], np.concatenate([[0, bound], bound - to_goal[near]])
    nodes = np.concatenate([ends, corners.astype(ends.dtype) * grain])
    bend = np.where(walls[tuple((corners - 1).T)] | walls[tuple(corners.T)], 1, -1)
    bend = np.concatenate([[0, 0], bend])
    numbers = {corner: n for n, corner in enumerate(map(tuple, corners.tolist()), start=2)}
    stated = [0, *(numbers.get((row + 1, col + 1), 0) for row, col, _ in proof["corners"])]
    p[stated[1:]] = [number for *_, number in proof["corners"]]
    p[0] = 0.0
    places = nodes.astype(float) / grain
    for part in np.array_split(stated, 1 + len(stated) * len(nodes) // 10**6):
        rows, cols = (places[part, None, axis] - places[:, axis] for axis in (0, 1))
        turn = np.sign(rows * cols)
        is_bend = (turn * bend <= 0) & (turn * bend[part, None] <= 0)
        is_flat = abs(p[part, None] - p) <= np.hypot(rows, cols) * (1 + 1e-10) + 1e-7 * (bend == 0)
        here, there = np.nonzero(is_bend & ~is_flat)
        need(
            are_cut(walls, nodes[part[here]], nodes[there], grain).all(),
            "p rises too much in sight",
        )
    return cost


CHECKS = {
    "no path": check_no_path,
    "cells": check_cells,
    "line": check_line,
    "line by costs": check_line_by_costs,
}


def check(measured, frame, proof):
    """Check a proof about a map, as `read_map` returns it; return its statement in words."""
    try:
        need(frame == [proof["side_m"], *proof["origin"]], "another side of a cell, or origin")
        side, x, y, yaw = frame
        digest = hashlib.sha256(np.ascontiguousarray(measured).tobytes()).hexdigest()
        need(digest == proof["map_sha256"], "another map, or other thresholds")
        walls, grain = walls_of(measured, proof, side), proof["grain"]
        need(grain in {2, 2**24}, "a wrong grain")
        ends = np.array(proof["ends"], np.int64)
        need(
            (ends >= 0).all() and (ends <= np.multiply(measured.shape, grain)).all(), "ends outside"
        )
        within = (
            1e-6 if proof["kind"].startswith("line") else 0.5 + 1e-6
        )  # or somewhere in the cell
        for end, (to_x, to_y) in zip(ends / grain, (proof["start"], proof["goal"]), strict=True):
            at = complex(to_x - x, to_y - y) * cmath.exp(-1j * yaw) / side
            need((abs(end - (at.imag, at.real)) <= within).all(), "the ends are not start and goal")
        exact = np.int64 if grain * max(walls.shape) < 2**30 else object  # for products of two
        factors = factors_of(measured, proof["costs"], side)
        cost = CHECKS[proof["kind"]](walls, factors, proof, ends.astype(exact) + grain) * side
        if cost < math.inf:
            near = 1e-9 * cost + 1e-7 * side
            need(abs(cost - proof["cost"]) <= near, f"the path costs {cost:.9f} m")
            need(0 <= proof["bound"] <= cost + near, "the bound is above the cost")
    except Rejected:
        raise
    except Exception as error:  # whatever else a file may hold
        raise Rejected(f"this is no proof: {type(error).__name__}: {error}") from None
    ends = "from {start} to {goal}, radius {radius_m} m".format(**proof)
    closed = sum(end - first for first, end in proof["closed"])
    ends += f", {closed} cells closed" * (closed > 0) + f", {proof['costs']}" * bool(proof["costs"])
    ends += ", unexplored cells too" * proof["allow_unexplored"]
    if proof["kind"] == "no path":
        return f"no path {ends}"
    return f"path {ends}: costs {cost:.6f} m, none less than {proof['bound']:.6f} m"


def main(arguments):
    """Check the proof of a file; return 0 if it is accepted, 1 if not."""
    try:
        proof = json.loads(Path(arguments[1]).read_bytes())
        print("accepted:", check(*read_map(Path(arguments[0]), proof["thresholds"]), proof))
    except Rejected as error:
        print("rejected:", error)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
