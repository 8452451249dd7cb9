"""Check a proof about a path: `python check_proof.py MAP PROOF`. Needs Python and numpy only.

The robot is a disc, or a point. Its centre moves over the *free* cells of a map: they were measured
as free, the proof does not close them, and no occupied cell is within the radius, from centre to
centre. All others, and the outside, are *walls*: it may touch them, but not enter them, nor pass
between two that meet at a corner. An end on a side is in the cell above, or to the right. Accepted
means: the path of the proof is free, it costs what is stated, and none costs less than the stated
bound, to 1 part in 10^9 (or 10^-6 of a cell, to which ends are rounded that are no centres). The
rest is decided in whole numbers.
MAP is a MovingAI map, or a YAML file of ROS that names a PGM image of 8 bits; the proof must be
about that map. It reads lines `KEY: VALUE # COMMENT` of YAML: VALUE is a plain text, a text in
quotes without backslashes, or a list [x, y, yaw], also below as lines `- x`. What stands below
other keys is skipped. Exits with 0 if the proof is accepted, 1 if not, 2 if a file is not read.
"""

import base64
import cmath
import hashlib
import json
import math
import re
import sys
import zlib
from pathlib import Path

import numpy as np

MOVES = np.array([(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)])
ONE = 2**14  # the factor 1: a metre costs a metre
# Costs of moves, straight and diagonal, and of a king with a tilt from 0 to 45 degrees.
PLAIN = 195025, 275807  # the ratio is below sqrt(2), by 7 parts in 10^12
UNIT = 2 * ONE * PLAIN[0]
COS, SIN = np.cos(np.arange(17) * math.pi / 64), np.sin(np.arange(17) * math.pi / 64)
TILTED = np.floor(PLAIN[0] * np.stack([COS, COS + SIN])).astype(int)
LEVEL = 8  # the tilt that is taken where none is stated
MOST = 1000  # cells that a radius has, lest a file takes hours
KEYS = "image", "resolution", "origin", "negate", "mode"
PLAIN_TEXT = r"""[^]\[\s"'{}?:,#&*!|>%@`](?:[^:#\t]|:(?! |$)|(?<! )#)*"""
VALUE = rf"""'(?:[^']|'')*'|"[^"\\]*"|\[[^]\["'{{}}#]*\]|{PLAIN_TEXT}"""
END = r"(?: +#.*)? *"
ENTRY = re.compile(rf"""(["']?)([\w.-]+)\1 *:(?: +({VALUE}))?{END}""")
NUMBER = r"[-+]?(?:\d+\.\d*|\.\d+|0|[1-9]\d*)(?:[eE][-+]?\d+)?"
ITEM = re.compile(rf" *- +({NUMBER}){END}")
NEGATE = {"0": 0, "1": 1, "false": 0, "true": 1, "no": 0, "yes": 1, "off": 0, "on": 1}


class Rejected(Exception):
    """The proof does not prove what it states; the text says why."""


def need(is_true, why, error=Rejected):
    """Reject a proof, or a file, unless a condition holds."""
    if not is_true:
        raise error(why)


def read_yaml(text):
    """Return the text of each value by its key; items of a list have commas between them."""
    values, key, is_open = {}, "", False
    for number, line in enumerate(text.splitlines(), 1):
        entry, item, where = ENTRY.fullmatch(line), ITEM.fullmatch(line), f"line {number}: "
        if entry:
            key, is_open, value = entry[2], not entry[3], (entry[3] or "").strip()
            need(key not in values, f"{where}{key} is given twice", ValueError)
            quoted = {"'": value[1:-1].replace("''", "'"), '"': value[1:-1]}
            values[key] = quoted.get(value[:1], value)
        elif line.strip() and not line.lstrip().startswith("#"):
            is_below = is_open and line[0] in " -" and (item or key not in KEYS)
            need(is_below, f"{where}expected KEY: VALUE, got {line[:60]!r}", ValueError)
            values[key] += f"{item[1]}," if item else ""
    return values


def read_map(path, thresholds):
    """Return cells, 0 occupied, 1 free, 2 other, row 0 lowest, and side, x, y, yaw of the map."""
    if path.suffix == ".map":
        rows = path.read_text().partition("\nmap")[2].split()[::-1]
        return np.array([[c in ".GS" for c in row] for row in rows], np.uint8), [1.0, 0.0, 0.0, 0.0]
    value = dict.fromkeys(KEYS, "") | read_yaml(path.read_text("utf-8-sig"))
    numbers = [value["resolution"], *value["origin"].strip("[], ").split(",")]
    is_read = len(numbers) == 4 and all(re.fullmatch(NUMBER, one.strip()) for one in numbers)
    is_read &= value["negate"].lower() in NEGATE
    need(is_read, "expected a resolution, origin [x, y, yaw] and negate 0 or 1", ValueError)
    data = (path.parent / value["image"]).read_bytes()
    gap = rb"\s(?:\s|#[^\r\n]*[\r\n])*"
    head = re.match(rb"P([25])" + 2 * (gap + rb"(\d+)") + gap + rb"255\s", data)
    is_pgm = head and value["mode"].lower() in ("", "trinary", "scale")
    need(is_pgm, "no PGM of 8 bits, trinary or scale: write the map as one", ValueError)
    kind, cols, rows = map(int, head.groups())
    greys = data[head.end() :]
    pixels = np.frombuffer(greys if kind == 5 else bytes(map(int, greys.split())), np.uint8)
    level, (low, high) = np.arange(256, dtype=np.float32) / np.float32(255), np.float32(thresholds)
    occupancy = level if NEGATE[value["negate"].lower()] else 1 - level
    kinds = np.where(occupancy <= low, 1, np.where(occupancy >= high, 0, 2)).astype(np.uint8)
    return kinds[pixels[: rows * cols].reshape(rows, cols)[::-1]], [float(n) for n in numbers]


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
    radius = proof["radius_m"] / side
    need(0 <= radius < MOST, "a radius of too many cells, or none")
    most = math.floor(radius * radius * (1 + 1e-9))
    free &= squares(measured == 0, math.isqrt(most)) > most
    last = -1
    for first, end in proof["closed"]:
        need(last < first < end <= free.size, "a closed cell is outside the map, or closed twice")
        free.ravel()[first:end], last = False, end
    digest = hashlib.sha256(np.packbits(free).tobytes()).hexdigest()
    need(digest == proof["free_sha256"], "map, radius and closed cells leave other cells free")
    return np.pad(~free, 1, constant_values=True)


def bars_of(shape, proof):
    """Return which of the MOVES out of each cell, bool (8, rows, cols), cross a one-way line from
    its right to its left, diagonal ones on both ways round their middle."""
    bars = np.zeros((8, *shape), bool)
    for first, last in np.array(proof.get("one_way", []), int).reshape(-1, 2, 2) + 1:
        step = np.sign(last - first)
        back = step[::-1] * (1, -1)
        right = first + np.arange(abs(last - first).sum())[:, None] * step + (step - back) // 2
        is_inside = (right > 0).all() and (right + 1 < shape).all()
        need(abs(step).sum() == 1 and is_inside, "a one-way line along no sides of the map")
        bars[(back == MOVES).all(axis=1), right[:, 0], right[:, 1]] = True
    for k in range(1, 8, 2) if bars.any() else ():
        turn = (k - 1, (k + 1) % 8), ((k + 1) % 8, k - 1)
        bars[k] = np.all([bars[a] | np.roll(bars[b], -MOVES[a], (0, 1)) for a, b in turn], axis=0)
    return bars


def factors_of(measured, costs, side):
    """Return the factor of each cell in units: that of Nav2's inflation by clearance, or 1."""
    if costs is None:
        return np.full(np.add(measured.shape, 2), ONE)
    reach = math.ceil(costs["inflation_radius_m"] / side)
    need(0 <= reach < MOST, "costs that reach too far")
    offs = [math.sqrt(n) * side - costs["inscribed_radius_m"] for n in range(reach * reach + 1)]
    cost = [math.floor(252 * math.exp(-costs["scaling"] * off)) if off > 0 else 253 for off in offs]
    cost = np.array([254, *cost[1:], *[0] * (2 * reach + 1)])
    factors = np.floor((1 + costs["multiplier"] / 252 * cost) * ONE).astype(np.int64)
    need((factors >= ONE).all() and (factors < 1000 * ONE).all(), "a factor is not from 1 to 1000")
    return np.pad(factors[squares(measured == 0, reach)], 1, constant_values=ONE)


def walk(start, digits):
    """Return the cells of a walk, whose moves are digits from 0 to 7."""
    steps = MOVES[np.frombuffer(digits.encode(), np.uint8) - ord("0")]
    return np.cumsum(np.concatenate([np.array([start], int), steps]), axis=0) + 1


def near(points):
    """Return the cells (4, n) that points lie in, or between."""
    return np.floor(points + 1e-7 * MOVES[1::2, None]).astype(int).transpose(2, 0, 1)


def between(first_keys, first, last_keys, last):
    """Return the numbers from the first key at each first to the last one at last, and of which."""
    low = np.searchsorted(first_keys, first, "left")
    count = np.maximum(np.searchsorted(last_keys, last, "right") - low, 0)
    of = np.repeat(np.arange(len(count)), count)
    return of, np.arange(len(of)) - np.repeat(np.cumsum(count) - count - low, count)


def cut(line):
    """Return a chain of lines with the points at which it enters other cells, and their middles."""
    number, whole = np.arange(len(line)), np.arange(line.max() + 1)
    shares = [number]
    for way in line.T:
        low, high = np.minimum(way[:-1], way[1:]), np.maximum(way[:-1], way[1:])
        of, cuts = between(whole, low, whole, np.ceil(high) - 1)
        shares.append(of + (cuts - way[of]) / (way[of + 1] - way[of]))
    shares = np.sort(np.concatenate(shares))
    points = np.stack([np.interp(shares, number, way) for way in line.T], axis=1)
    return points, (points[1:] + points[:-1]) / 2


def cost_of(factors, line):
    """Return the cost of a chain of lines; beside a side, the dearer cell counts."""
    points, middles = cut(line)
    lengths = np.hypot(*np.diff(points, axis=0).T)
    return (factors[tuple(near(middles))].max(axis=0) * lengths).sum() / ONE


def follows(walls, bars, line, cells):
    """Return whether a chain of lines leads from a cell to another. The cells that it may be in are
    followed from point to point: past walls, round corners, over one-way lines from their left."""
    points, middles = cut(line)
    places = near(np.insert(points, range(1, len(points)), middles, axis=0)).transpose(2, 1, 0)
    inside = here = {tuple(cells[0].tolist())}
    for at in [*places.tolist(), cells[1:].tolist()]:
        ahead = {cell for cell in set(map(tuple, at)) if not walls[cell]}
        for k in [0, 2, 4, 6] * (len(here) - 1):
            up, right = MOVES[k].tolist()
            after = {(row + up, col + right) for row, col in inside if not bars[k, row, col]}
            inside = inside | after & here
        inside, here = inside & ahead, ahead
    return len(inside) > 0


def check_region(walls, bars, proof, cells):
    """Check that a set of cells, bytes that are 1, has the start and not the goal, and no straight
    move leads out. Then no path does: they cross sides of cells, or go round their corners."""
    inside = np.pad(unpacked(proof["region"], np.subtract(walls.shape, 2)) == 1, 1) & ~walls
    start, goal = map(tuple, cells)
    need(inside[start] and not inside[goal], "the region has not the start, or has the goal")
    for k in range(0, 8, 2):
        beyond = np.roll(inside | walls, -MOVES[k], (0, 1))
        need((beyond | bars[k])[inside].all(), "a way leads out of the region")


# A POTENTIAL is a number p for each node of a graph, so that no move raises p by more than it
# costs. The moves of a path raise p by p(goal) - p(start) in all, so every path costs at least
# that. Any such numbers prove. Here p is the cost of a walk back to the start, one move after the
# other as the proof states them for some nodes, its tree. All others have p = bound - (the least
# cost from there to the goal on an empty map), and the same holds outside of the box of the tree.


def check_moves(costs, bars, ahead, proof, ends, bound):
    """Check a potential on the box of a tree with its rim, from the costs of four of the MOVES, 0
    where there is none, and the costs of moves on an empty map; return it, and the tree."""
    shape = costs.shape[1:]
    tree = np.pad(unpacked(proof["tree"], np.subtract(shape, 2)), 1, constant_values=9)
    start, goal = map(tuple, ends)
    need((tree < 10).all() and (ends > 0).all() and (ends < np.subtract(shape, 1)).all(), "no tree")
    inside, before = np.flatnonzero(tree < 8), np.arange(tree.size)
    move = tree.ravel()[inside]
    before[inside] += MOVES[move] @ [shape[1], 1]
    back = np.zeros(tree.size, np.int64)
    back[inside] = costs.reshape(4, -1)[move % 4, np.where(move < 4, inside, before[inside])]
    need((back[inside] > 0).all(), "a move of the tree meets a wall")
    while (tree.ravel()[before[inside]] < 8).any():  # twice as far with each turn
        need(back.max() < 2**61, "the tree has a cycle")
        back, before = back + back[before], before[before]
    need((tree.ravel()[before[inside]] == 8).all(), "a branch of the tree does not end at a root")
    costs[1:, -1] = costs[:2, :, -1] = costs[3, :, 0] = 0  # nodes beyond the rim
    down, across = (abs(np.arange(n) - at) for n, at in zip(shape, goal, strict=True))
    least = np.maximum(down[:, None], across) * ahead[0]
    least += np.minimum(down[:, None], across) * (ahead[1] - ahead[0])
    p = np.where(tree == 9, bound - 2 * ONE * least, back.reshape(shape))
    for k, cost in enumerate(costs):
        after, back = (np.roll(array, -MOVES[k], (0, 1)) for array in (p, bars[k + 4]))
        is_held = ((after - p <= cost) | bars[k]) & ((p - after <= cost) | back)
        need(is_held[cost > 0].all(), "a move raises p by more than it costs")
    need(p[start] <= 0 and p[goal] >= bound, "p does not rise by the bound")
    return p, tree


def unpacked(text, shape):
    """Return an array of bytes from its text."""
    size = math.prod(int(n) for n in shape)
    raw = zlib.decompressobj().decompress(base64.b85decode(text), size + 1)
    return np.frombuffer(raw, np.uint8).reshape(shape)


def boxed(array, proof):
    """Return the part of an array over nodes that the box of a tree has, with a rim."""
    top, left, rows, cols = proof["box"]
    need(min(proof["box"]) >= 0, "a wrong box")
    return array[..., top : top + rows + 2, left : left + cols + 2]


def costs_of_cells(walls, factors):
    """Return the costs of moves between cells, the mean of their factors times the length."""
    costs = np.zeros((4, *walls.shape), np.int64)
    for n, (down, across) in enumerate(MOVES[:4]):
        by = [(0, 0), (down, across), (down, 0), (0, across)]
        shut = np.any([np.roll(walls, (-row, -col), (0, 1)) for row, col in by], axis=0)
        weight = factors + np.roll(factors, (-down, -across), (0, 1))
        costs[n] = np.where(shut, 0, weight * PLAIN[abs(down * across)])
    return costs


def check_cells(walls, factors, proof, ends, bound, bars):
    """Check a potential that bounds all paths of cells; return it, and the tree."""
    costs = costs_of_cells(boxed(walls, proof), boxed(factors, proof))
    cells = np.floor(ends).astype(int) - proof["box"][:2]
    return check_moves(costs, boxed(bars, proof), PLAIN, proof, cells, math.floor(bound * UNIT))


# A KING. By costs, take numbers a, b in each cell, the cosine and sine of a tilt times its factor.
# Let a line cost K. Cut it where it enters another cell, and measure each part: a for the longer of
# its two sides, along rows and columns, and b for the shorter one. That is no more than its cost,
# as a^2 + b^2 is the square of the factor. Slide the cuts along the sides of cells: the sum of the
# measures is linear but where two cuts lie opposite each other, so it is least with all cuts at
# corners of cells. Then it is the cost of moves of a king over corners: along sides, by the cheaper
# of two cells, and across cells. So K is at least the least cost of such moves between a corner of
# the cell of each end, less the cost of straight lines from the ends to these corners.


def costs_of_corners(walls, factors, tilts):
    """Return the costs of moves between corners of cells; corner (r, c) is below cell (r, c)."""
    side, across = np.where(walls, 2**62, 2 * factors * TILTED[:, tilts])
    east, north = np.minimum(side, np.roll(side, 1, 0)), np.minimum(side, np.roll(side, 1, 1))
    return np.stack([east, across, north, np.roll(across, 1, 1)]) % 2**62


def joins_of(factors, ends, corners):
    """Return the cost from the ends of a line to corners of their cells."""
    return (np.hypot(*(corners - ends).T) * factors[tuple(near(ends))].max(axis=0)).sum() / ONE


def check_king(walls, factors, proof, ends, bound):
    """Check a potential of corners that bounds all lines by their costs."""
    corners = np.array(proof["corners"], int) + 1
    need(corners.shape == ends.shape and (abs(corners - ends) < 1).all(), "corners of other cells")
    bound = math.floor((bound + joins_of(factors, ends, corners)) * UNIT)
    more = (np.pad(array, (0, 1), constant_values=1) for array in (walls, factors))
    walls, factors = (boxed(array, proof) for array in more)
    tilts = np.pad(unpacked(proof["tilts"], np.subtract(walls.shape, 2)), 1, constant_values=LEVEL)
    costs, corners = costs_of_corners(walls, factors, tilts), corners - proof["box"][:2]
    check_moves(costs, np.zeros((8, 1, 1), bool), TILTED[:, LEVEL], proof, corners, bound)


# STRINGS. A shortest path is a taut string: it bends at *corners* only, where one of four cells is
# a wall, and round that, or beside a one-way line. So a potential at start, goal and corners is
# enough, one in each of the four cells at a corner: p must not rise by more than the distance to
# what one sees, nor on the way round a corner. The proof states p for some. Elsewhere, and where
# that is less, p = bound - (the distance to the goal), which rises by at most the distance. So only
# what the start and stated corners see is to be looked at. Light goes up and right, in four images
# of the map, mirrored, one above the other. Row by row it falls between two directions, through a
# run of free cells into the runs above. A row of no height lies over cells that may not be left
# upwards; where not to the right, a run ends. A shaft of light is a point, a row, its height above
# the point, and two directions (rows, columns), whole numbers. A line that grazes walls is seen in
# parts, from corner to corner.


def strings_in(walls, bars, ends, bound):
    """Return start, goal and the corners that a path below the bound may pass, p of them where none
    is stated, flat over (4, n), and what yields lit ones with what each of them sees."""
    marks = walls + np.uint8(8) * bars.any(axis=0)
    four = sum(marks[r : r - 1 or None, c : c - 1 or None] for r in (0, 1) for c in (0, 1))
    nodes = np.concatenate([ends, np.argwhere((four == 1) | (four > 7)) + 1])
    grain = 2 ** (30 - max(walls.shape).bit_length())  # products of two numbers fit into 62 bits
    flat, far = (nodes * grain).astype(np.int64), [np.hypot(*(nodes - p).T) for p in ends]
    cells = np.floor(ends + 1e-9) * grain  # ends on sides are moved into their cells
    flat[:2] = np.clip(np.rint(ends * grain), cells + 1, cells + grain - 1)
    kept = (far[0] + far[1] < bound) | (np.arange(len(nodes)) < 2)
    nodes, (y, x), plain = nodes[kept], flat[kept].T, np.tile(bound - far[1][kept], 4)
    size, q, (height, width) = len(nodes), np.arange(4)[:, None], np.multiply(walls.shape, grain)
    at = nodes[:, 0].astype(int) - q // 2, nodes[:, 1].astype(int) - q % 2  # the four cells
    free = ~walls[at]
    taut = free & (free[::-1] | (four[at[0][3], at[1][3]] > 7)) | (np.arange(size) == 0)
    # The rows of the images: 2 is mirrored up and down, 1 left and right. Ends cut rows.
    tops, rows, cuts = [], [], []
    for k in range(4):
        flip = np.s_[:: 1 - (k & 2), :: 1 - 2 * (k & 1)]
        wall, right, up = (one[flip] for one in (walls, bars[2 * (k & 1)], bars[1 + (k & 2)]))
        top = np.union1d(np.arange(grain, height + 1, grain), abs(height * (k // 2) - y[:2]))
        row, over = (top - 1) // grain, np.flatnonzero(up.any(axis=1))
        place = np.searchsorted(top, (over + 1) * grain, "right")
        tops.append(np.insert(top, place, (over + 1) * grain) + k * height)
        rows.append(np.insert(wall[row], place, (wall | up)[over], axis=0))
        cuts.append(np.insert(right[row], place, False, axis=0))
    tops, rows, cuts = map(np.concatenate, (tops, rows, cuts))
    cuts = np.flatnonzero(cuts & ~rows & ~np.roll(rows, -1, 1)) + 1
    edges = np.flatnonzero(np.diff(rows.ravel())) + 1
    begin, end = (np.sort(np.concatenate([edges[k::2], cuts])) * grain for k in (0, 1))
    points = [abs(height * (q // 2) - y) + height * q, abs(width * (q % 2) - x)]
    points = np.array(points).reshape(2, -1)
    key = np.searchsorted(tops, points[0], "left") * width + points[1]
    order = np.argsort(key, kind="stable")

    def seen(one, first, last):
        """Return points and what each sees between two keys, in the cell where light comes to."""
        of, number = between(key[order], first, key[order], last)
        one, two = one[of], order[number]
        turn = np.array([2, 1]) @ (points[:, one] != points[:, two])
        return one, (two // size ^ turn) * size + two % size

    def in_sight(p, lit):
        for n, way in enumerate((2, 3, 0, 3, 2, 1, 0, 1)):  # round a corner, from cell to cell
            k, turn = n // 2, 1 + n % 2
            one = np.flatnonzero(free[k] & free[k ^ turn] & ~bars[way][at[0][k], at[1][k]])
            yield one + k * size, one + (k ^ turn) * size
        point = np.flatnonzero(lit)
        row, none = np.searchsorted(tops, points[0, point], "right"), np.zeros_like(point)
        shafts = np.stack([point, row, none, none + 1, none, none, none + 1])
        while shafts.size:
            point, row, base, low, across_low, high, across_high = shafts
            start = row * width + points[1, point]
            left = start + across_low * base // np.maximum(low, 1)
            right = start - -across_high * base // np.maximum(high, 1)
            of, run = between(end, left, begin, right)
            shafts, start = shafts[:, of], start[of]
            point, row, base = shafts[:3]
            if not base.any():  # along its row, as far as a run beside it; else where strings bend
                yield seen(point, key[point] + 1, key[point] + end[run] - start)
                shafts[3:, ~taut.ravel()[point]] = 0
            top = tops[row] - points[0, point]
            for limit, side, sign in ((shafts[3:5], begin, 1), (shafts[5:], end, -1)):
                across = side[run] - start
                up = np.where(sign * across > 0, base, top)
                cuts = sign * (across * limit[0] - limit[1] * up) > 0
                limit[:, cuts] = up[cuts], across[cuts]
            shafts[1:3] = row + 1, top
            is_open = shafts[6] * shafts[3] > shafts[4] * shafts[5]
            shafts, start = shafts[:, is_open], start[is_open]
            point, row, top, low, across_low, high, across_high = shafts
            yield seen(point, start - -across_low * top // low, start + across_high * top // high)
            # It goes on where a path over the lit part of the row can be shorter than the bound.
            ahead, across = points[:, point - point % size + 1] - points[:, point]
            ahead, sides = abs(ahead - top), (across_low * top / low, across_high * top / high)
            best = np.clip(across * top / (ahead + top), *sides)
            length = np.hypot(top, best) + np.hypot(ahead, best - across)
            shafts = shafts[:, length < (bound - p[point]) * grain]

    return nodes, plain, in_sight


def check_strings(walls, bars, proof, ends, bound):
    """Check a potential at corners that bounds the lengths of all lines."""
    spare = (bound - abs(ends[1] - ends[0])) / 2 + 3  # nothing beyond is near enough
    low = np.maximum(ends.min(axis=0) - spare, 0).astype(int)
    part = tuple(map(slice, low, (ends.max(axis=0) + spare).astype(int)))
    walls, bars, ends = walls[part].copy(), bars[(np.s_[::2], *part)], ends - low
    walls[[0, -1]] = walls[:, [0, -1]] = True
    heights = np.full((4, *walls.shape), np.inf)
    for row, col, *height in proof["heights"]:
        at = row + 1 - low[0], col + 1 - low[1]
        if 0 <= at[0] < len(walls) and 0 <= at[1] < len(walls[0]):
            heights[:, at[0], at[1]] = height
    if len(walls) > len(walls[0]):  # there are fewer columns than rows to sweep over
        walls, ends, bars = walls.T, ends[:, ::-1], bars[[1, 0, 3, 2]].transpose(0, 2, 1)
        heights = heights[[0, 2, 1, 3]].transpose(0, 2, 1)
    nodes, plain, in_sight = strings_in(walls, bars, ends, bound)
    size, (row, col) = len(nodes), nodes[2:].astype(int).T
    p = np.fmin(np.hstack([[[0, bound]] * 4, heights[:, row, col]]).ravel(), plain)
    for one, two in in_sight(p, p < plain):
        far = np.hypot(*(nodes[two % size] - nodes[one % size]).T)
        need((p[two] - p[one] < far + 1e-9).all(), "p rises too much in sight")


def check(measured, frame, proof):
    """Check a proof about a map, as `read_map` returns it; return its statement in words."""
    try:
        need(frame == [proof["side_m"], *proof["origin"]], "another side of a cell, or origin")
        side, x, y, yaw = frame
        digest = hashlib.sha256(measured := np.ascontiguousarray(measured)).hexdigest()
        need(digest == proof["map_sha256"], "another map, or other thresholds")
        walls, kind, costs = walls_of(measured, proof, side), proof["kind"], proof["costs"]
        turn = cmath.exp(-1j * yaw) / side
        ends = [complex(u - x, v - y) * turn for u, v in (proof["start"], proof["goal"])]
        ends = np.array([(end.imag, end.real) for end in ends]) + 1
        need((ends > 1 - 1e-6).all() and (ends < walls.shape).all(), "ends outside the map")
        bars = bars_of(walls.shape, proof)
        if kind == "no path":
            check_region(walls, bars, proof, np.floor(ends + 1e-9).astype(int))
        else:
            need(kind in {"cells", "line"}, "another kind of proof")
            check_path(walls, factors_of(measured, costs, side), bars, proof, ends)
    except Rejected:
        raise
    except Exception as error:  # whatever else a file may hold
        raise Rejected(f"this is no proof: {type(error).__name__}: {error}") from None
    ends = "from {start} to {goal}, radius {radius_m} m".format(**proof)
    closed = sum(end - first for first, end in proof["closed"])
    ends += f", {closed} cells closed" * (closed > 0) + f", {proof['costs']}" * bool(proof["costs"])
    ends += f", {len(proof.get('one_way', []))} one-way lines" * bool(proof.get("one_way"))
    ends += ", unexplored cells too" * (proof["allow_unexplored"] is True)
    if kind == "no path":
        return f"{kind} {ends}"
    cost, bound = proof["cost"], proof["bound"]
    if bound < cost * (1 - 1e-9):  # else the path is optimal, and its bound is its cost
        bound = math.floor(bound * 1e6) / 1e6
    return f"path {ends}: costs {cost:.6f} m, none less than {min(bound, cost):.6f} m"


def check_path(walls, factors, bars, proof, ends):
    """Check a path, its cost, and the bound on all others."""
    is_cells, bound = proof["kind"] == "cells", proof["bound"] / proof["side_m"] * (1 - 1e-9)
    line = walk(*proof["path"]) + 0.5 if is_cells else np.array(proof["line"], float) + 1
    need((line > 1 - 1e-7).all() and (line < walls.shape).all(), "the path leaves the map")
    need(len(line) + abs(np.diff(line, axis=0)).sum() < 10**6, "a path over too many cells")
    cells = np.floor(ends + 1e-9).astype(int)
    stated, ends = cells + 0.5 if is_cells else ends, line[[0, -1]]
    need((abs(ends - stated) <= 1e-6).all(), "the ends are not start and goal")
    need(follows(walls, bars, line, cells), "the path meets a wall, or a side from its wrong side")
    cost = cost_of(factors, line) * proof["side_m"]
    spare = 1e-9 * cost + 1e-7 * proof["side_m"]
    need(abs(cost - proof["cost"]) <= spare, f"the path costs {cost:.9f} m")
    need(0 <= proof["bound"] <= cost + spare, "the bound is above the cost")
    if is_cells:
        (row, col), (to_row, to_col) = line[:-1].astype(int).T, line[1:].astype(int).T
        need(not (walls[row, to_col] | walls[to_row, col]).any(), "a wall beside a diagonal move")
        check_cells(walls, factors, proof, ends, bound, bars)
    elif bound > math.dist(*ends) and "heights" in proof:  # of lengths, which no cost is below
        check_strings(walls, bars, proof, ends, bound)
    elif bound > math.dist(*ends):
        check_king(walls, factors, proof, ends, bound)


def main(arguments):
    """Check the proof of a file; return 0 if it is accepted, 1 if not, 2 if a file is not read."""
    if len(arguments) != 2:
        print("usage: python check_proof.py MAP PROOF")
        return 2
    reading = arguments[1]
    try:
        proof = json.loads(Path(reading).read_bytes())
        thresholds = [float(one) for one in proof["thresholds"]]
        reading = arguments[0]
        print("accepted:", check(*read_map(Path(reading), thresholds), proof))
    except Rejected as error:
        print("rejected:", error)
        return 1
    except Exception as error:  # whatever else a file may hold
        kind = "" if isinstance(error, ValueError | OSError) else type(error).__name__ + ": "
        print(f"not read: {reading}: {kind}{error} (see the first lines of check_proof.py)")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
