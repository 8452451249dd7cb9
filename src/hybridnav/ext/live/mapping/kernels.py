"""Kernels of beams: the cells that they pass, by exact walks on integers.

Positions are (row, col) counted in 2^-16 of a cell and always odd, so that no endpoint lies on a
line of the lattice; beams of up to 2^14 cells are compared without rounding in int64.
"""

import math
from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.trig import cos, exp, hypot, sin

_SHIFT = 16
_NONE, _HIT, _CLEAR = 0, 1, 2


@njit(cache=True, nogil=True)
def _on_lattice(cells):
    """Return a position, counted in cells, as an odd number of 2^-16 of a cell."""
    return np.int64(math.floor(cells * (1 << _SHIFT))) | 1


class BeamLimits(NamedTuple):
    """Ranges of a laser, in metres."""

    low: float
    """The least range."""
    high: float
    """The greatest range."""
    clear: float
    """How far a beam without a return clears."""
    blurred: float
    """How far before its return a beam ceases to clear."""
    depth: float
    """How far behind its return a beam occupies a cell."""


class _Walk(NamedTuple):
    """The first cell of a beam, the state of the walk along it, and what each step adds to that."""

    row: int
    col: int
    by_row: int
    by_col: int
    more_row: int
    more_col: int


@guarded
@njit(cache=True, nogil=True)
def beam_ends(ranges_m, pose, angles, limits, resolution_m):
    """Return where the beams of a scan end.

    Parameters
    ----------
    ranges_m
        float64 (n,).
    pose
        `(x, y, heading)` of the laser, x and y relative to the corner of cell (0, 0).
    angles
        Direction of the first beam and the step to the next one, in radians.
    limits
        `BeamLimits`.
    resolution_m
        Side of a cell.

    Returns
    -------
    tuple
        int64 (n, 2), cells that beams occupy. int64 (n + 1, 2), positions at which they cease to
        clear, in the last row the laser. uint8 (n,): 0 for no reading, 1 for a hit, 2 for no
        return. int64 (4,): first and last row, first and last column of the cells that they meet.
    """
    x, y, heading = pose
    high, clear = limits.high, limits.clear
    n = len(ranges_m)
    hits, ends = np.empty((n, 2), np.int64), np.empty((n + 1, 2), np.int64)
    kinds = np.zeros(n, np.uint8)
    ends[:, 0], ends[:, 1] = _on_lattice(y / resolution_m), _on_lattice(x / resolution_m)
    row, col = ends[n, 0] >> _SHIFT, ends[n, 1] >> _SHIFT
    hits[:, 0], hits[:, 1] = row, col
    box = np.array([row, row, col, col])
    for k in range(n):
        reach = ranges_m[k]
        if not reach > limits.low:  # NaN too
            continue
        kinds[k] = _HIT if reach < high else _CLEAR
        until = reach - limits.blurred if reach < high else clear
        reach = reach + limits.depth if reach < high else clear
        angle = heading + (angles[0] + k * angles[1])
        cosine, sine = cos(angle), sin(angle)
        if until > 0.0:
            ends[k, 0] = _on_lattice((y + until * sine) / resolution_m)
            ends[k, 1] = _on_lattice((x + until * cosine) / resolution_m)
        hits[k, 0] = _on_lattice((y + reach * sine) / resolution_m) >> _SHIFT
        hits[k, 1] = _on_lattice((x + reach * cosine) / resolution_m) >> _SHIFT
        box[0], box[1] = min(box[0], hits[k, 0]), max(box[1], hits[k, 0])
        box[2], box[3] = min(box[2], hits[k, 1]), max(box[3], hits[k, 1])
    return hits, ends, kinds, box


@njit(cache=True, nogil=True)
def _start_of_walk(start_row, start_col, end_row, end_col):
    """Return the first cell of a beam, the steps to its last one, and the state of the walk.

    J. Amanatides, A. Woo: A fast voxel traversal algorithm for ray tracing, 1987, on integers. The
    walk crosses next the line with the smaller state; on a tie it passes a corner.
    """
    row, col = start_row >> _SHIFT, start_col >> _SHIFT
    rows, cols = abs(end_row - start_row), abs(end_col - start_col)
    to_row = (
        ((row + 1) << _SHIFT) - start_row if end_row > start_row else start_row - (row << _SHIFT)
    )
    to_col = (
        ((col + 1) << _SHIFT) - start_col if end_col > start_col else start_col - (col << _SHIFT)
    )
    return _Walk(row, col, to_row * cols, to_col * rows, cols << _SHIFT, rows << _SHIFT)


@njit(cache=True, nogil=True)
def add_hits(evidence, seen_at, corner, beams, scan, changes):
    """Add the cells that beams of a scan occupy, unless the scan has met them already.

    Parameters
    ----------
    evidence
        float32 (rows, cols), log odds; changed.
    seen_at
        int32 (rows, cols), the number of the last scan that met a cell; changed.
    corner
        Row and column of the first cell of these arrays.
    beams
        Cells of hits, ends and kinds, as from `beam_ends`.
    scan
        Number of the scan, at least 1; another one than that of every other scan.
    changes
        Log odds of a hit and of a pass, and the limit of their sum, float32.
    """
    hit, _, limit = changes
    hits, _, kinds = beams
    for k in range(len(kinds)):
        if kinds[k] == _HIT:
            row, col = hits[k, 0] - corner[0], hits[k, 1] - corner[1]
            if seen_at[row, col] != scan:
                seen_at[row, col] = scan
                evidence[row, col] = min(evidence[row, col] + hit, limit)


@njit(cache=True, nogil=True)
def add_passes(evidence, seen_at, corner, beams, scan, changes):
    """Add the cells that beams of a scan pass, unless the scan has met them already.

    A beam does not free the cell that it occupies. The parameters are those of `add_hits`.
    """
    _, passed, limit = changes
    hits, ends, kinds = beams
    first_row, first_col = corner
    n = len(kinds)
    for k in range(n):
        if kinds[k] == _NONE or (ends[k, 0] == ends[n, 0] and ends[k, 1] == ends[n, 1]):
            continue
        walk = _start_of_walk(ends[n, 0], ends[n, 1], ends[k, 0], ends[k, 1])
        row, col, by_row, by_col = walk.row, walk.col, walk.by_row, walk.by_col
        row_step = 1 if ends[k, 0] > ends[n, 0] else -1
        col_step = 1 if ends[k, 1] > ends[n, 1] else -1
        last_row, last_col = ends[k, 0] >> _SHIFT, ends[k, 1] >> _SHIFT
        while row != last_row or col != last_col:
            i, j = row - first_row, col - first_col
            if seen_at[i, j] != scan:
                seen_at[i, j] = scan
                evidence[i, j] = max(evidence[i, j] + passed, -limit)
            steps_row, steps_col = by_row <= by_col, by_col <= by_row
            if steps_row:
                row += row_step
                by_row += walk.more_row
            if steps_col:
                col += col_step
                by_col += walk.more_col
        i, j = row - first_row, col - first_col
        is_hit = kinds[k] == _HIT and row == hits[k, 0] and col == hits[k, 1]
        if seen_at[i, j] != scan and not is_hit:
            seen_at[i, j] = scan
            evidence[i, j] = max(evidence[i, j] + passed, -limit)


@guarded
@njit(cache=True, nogil=True)
def ray_lengths(classes, obstacle, start, targets):
    """Return how far rays run before they enter a cell that stops them.

    Parameters
    ----------
    classes
        uint8 (rows, cols).
    obstacle
        The class of cells that stop rays. What lies outside the map stops none.
    start
        `(row, col)` in cells.
    targets
        float64 (n, 2), `(row, col)` in cells, within 2^14 cells of the start.

    Returns
    -------
    FloatArray
        float64 (n,), in cells; infinite where nothing stops the ray before its target.
    """
    lengths = np.full(len(targets), np.inf)
    start_row, start_col = _on_lattice(start[0]), _on_lattice(start[1])
    for k in range(len(targets)):
        end_row, end_col = _on_lattice(targets[k, 0]), _on_lattice(targets[k, 1])
        walk = _start_of_walk(start_row, start_col, end_row, end_col)
        row, col, by_row, by_col = walk.row, walk.col, walk.by_row, walk.by_col
        up, right = end_row > start_row, end_col > start_col
        last_row, last_col = end_row >> _SHIFT, end_col >> _SHIFT
        share = 0.0
        while True:
            inside = 0 <= row < classes.shape[0] and 0 <= col < classes.shape[1]
            if inside and classes[row, col] == obstacle:
                lengths[k] = share * hypot(end_row - start_row, end_col - start_col)
                lengths[k] /= 1 << _SHIFT
                break
            if row == last_row and col == last_col:
                break
            steps_row, steps_col = by_row <= by_col, by_col <= by_row
            if steps_row:
                row += 1 if up else -1
                by_row += walk.more_row
                line = (row if up else row + 1) << _SHIFT
                share = (line - start_row) / (end_row - start_row)
            if steps_col:
                col += 1 if right else -1
                by_col += walk.more_col
                line = (col if right else col + 1) << _SHIFT
                share = (line - start_col) / (end_col - start_col)
    return lengths


@njit(cache=True, nogil=True)
def probabilities(evidence, met):
    """Return the probabilities, float32, of log odds; NaN where no scan met a cell."""
    found = np.full(evidence.shape, np.nan, np.float32)
    for i in range(evidence.shape[0]):
        for j in range(evidence.shape[1]):
            if met[i, j]:
                found[i, j] = 1.0 / (1.0 + exp(-np.float64(evidence[i, j])))
    return found
