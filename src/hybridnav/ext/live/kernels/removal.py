"""Kernels that take cells out of places; see `_cell_kernels` for windows and tables."""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.ext.live.kernels.cells import step_to


@guarded
@njit(cache=True, nogil=True)
def take_out(place, low, table, removed, first):
    """Take cells out of their places, and give new numbers to parts that this cuts off.

    A place that loses half of its cells has a new number too: it has no heir.

    Parameters
    ----------
    place, low, table
        See above; areas and stale places change.
    removed
        int64 (n,) twice: flat cells, and the places that they were in, -1 for none.
    first
        The least new number.

    Returns
    -------
    int64 (m,)
        The place of which each new one was a part.
    int64 (k,)
        All places that lost cells.
    int64 (l,)
        Those of them that lost a part, their surviving cell, or a cell at a side of their box.
    """
    numbers, area, survivor, box, is_stale = table
    order = np.argsort(removed[1], kind="mergesort")
    order = order[np.searchsorted(removed[1][order], 0) :]
    cells, was = removed[0][order], removed[1][order]
    cols = place.shape[1]
    flat = place.ravel()
    for cell in cells:
        flat[cell] = -1
    parts, n_parts = np.empty(16, np.int64), 0
    lost, n_lost = np.empty(cells.size, np.int64), 0
    altered, n_altered = np.empty(cells.size, np.int64), 0
    queue = np.empty(flat.size, np.int64)
    scratch = np.full(place.shape, np.int32(-1), np.int32)
    begin = 0
    while begin < cells.size:
        end = begin
        while end < cells.size and was[end] == was[begin]:
            end += 1
        number = was[begin]
        i = np.searchsorted(numbers, number)
        is_other = 2 * (area[i] - (end - begin)) <= area[i]
        area[i] -= end - begin
        lost[n_lost] = number
        n_lost += 1
        is_stale[i] = True
        alters = False
        for cell in cells[begin:end]:
            row, col = cell // cols + low[0], cell % cols + low[1]
            alters |= row == box[i, 0] or row == box[i, 2] - 1
            alters |= col == box[i, 1] or col == box[i, 3] - 1
        n_cut = cut_off(place, cells[begin:end], number, scratch, queue, first + n_parts)
        if is_other and area[i] > 0:
            rename(place, low, box[i], number, first + n_parts + n_cut)
            n_cut += 1
        if n_parts + n_cut > parts.size:
            longer = np.empty(2 * (n_parts + n_cut), np.int64)
            longer[:n_parts] = parts[:n_parts]
            parts = longer
        parts[n_parts : n_parts + n_cut] = number
        n_parts += n_cut
        if alters or n_cut > 0 or place[survivor[i, 0] - low[0], survivor[i, 1] - low[1]] != number:
            altered[n_altered] = number
            n_altered += 1
        begin = end
    return parts[:n_parts].copy(), lost[:n_lost].copy(), altered[:n_altered].copy()


@njit(cache=True, nogil=True)
def rename(place, low, box, number, final):
    """Write another number of a place, which lies in a box."""
    for row in range(box[0] - low[0], box[2] - low[0]):
        for col in range(box[1] - low[1], box[3] - low[1]):
            if place[row, col] == number:
                place[row, col] = final


@njit(cache=True, nogil=True)
def root_of(parent, item):
    """Return the root of an item in a union-find forest, whose paths become shorter."""
    while parent[item] != item:
        parent[item] = parent[parent[item]]
        item = parent[item]
    return item


@njit(cache=True, nogil=True)
def cut_off(place, cells, number, scratch, queue, first):
    """Give new numbers to the parts that a removal of cells cuts off a place; return how many.

    Searches begin at the cells beside the removed ones and go on by turns until they have met, or
    all but one part is searched.
    """
    cols = place.shape[1]
    flat, marks = place.ravel(), scratch.ravel()
    parent = np.empty(4 * cells.size, np.int64)
    n_open = tail = 0
    for cell in cells:
        for side in range(4):
            beside = cell + step_to(side, cols)
            if flat[beside] == number and marks[beside] < 0:
                marks[beside] = parent[n_open] = n_open
                queue[tail] = beside
                n_open += 1
                tail += 1
    waiting = np.ones(n_open, np.int64)
    part_of = np.full(n_open, np.int64(-1), np.int64)
    n_parts = head = 0
    while head < tail and n_open > 1:
        cell = queue[head]
        head += 1
        root = root_of(parent, marks[cell])
        for side in range(4):
            beside = cell + step_to(side, cols)
            if flat[beside] != number:
                continue
            if marks[beside] < 0:
                marks[beside] = root
                waiting[root] += 1
                queue[tail] = beside
                tail += 1
                continue
            other = root_of(parent, marks[beside])
            if other != root:
                parent[other] = root
                waiting[root] += waiting[other]
                n_open -= 1
        waiting[root] -= 1
        if waiting[root] == 0 and n_open > 1:
            n_open -= 1
            part_of[root] = n_parts
            n_parts += 1
    if n_parts > 0:
        for cell in queue[:tail]:
            part = part_of[root_of(parent, marks[cell])]
            if part >= 0:
                flat[cell] = first + part
    for cell in queue[:tail]:
        marks[cell] = -1
    return n_parts
