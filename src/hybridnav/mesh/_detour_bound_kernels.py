"""Kernels of lower bounds on the rest of a path round closed cells.

The landmarks of the graph alone do not bound the rest, because a path round a corner of closed
cells is not in the graph. So the bound is the lesser of two: that of the landmarks, if the rest
bends at corners of the graph only; else the distance to a corner of closed cells and on from it.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.mesh._view_kernels import distance

_SLACK = 1e-9
"""Rounding of distances in the graph, in cells."""


@njit(cache=True, nogil=True)
def bounds_of_goal(table, seen, to_goal, goal_bounds):
    """Fill in the bounds on the distance from each landmark to the goal; see
    `groups_of_closure`."""
    goal_bounds[0], goal_bounds[1] = np.inf, -np.inf
    for corner in seen:
        for mark in range(table.shape[1]):
            if table[corner, mark] < np.inf:
                most, least = table[corner, mark] + to_goal[corner], table[corner, mark]
                goal_bounds[0, mark] = min(goal_bounds[0, mark], most - _SLACK)
                goal_bounds[1, mark] = max(goal_bounds[1, mark], least - to_goal[corner] + _SLACK)
    for mark in range(table.shape[1]):
        if goal_bounds[0, mark] == np.inf:
            goal_bounds[0, mark], goal_bounds[1, mark] = -np.inf, np.inf


@njit(cache=True, nogil=True)
def left_behind(made, groups, to_goal, goal_bounds, tx, ty):
    """Return the least length of a path behind the corners of each group, float64 (g,)."""
    xs, ys, _, _ = made
    group, circles, reach, _ = groups
    n = len(to_goal) - len(group)
    last = np.full(len(circles), np.inf)
    for i in range(len(group)):
        left = to_goal[n + i]
        if left == np.inf:
            left = distance(xs[i], ys[i], tx, ty)
            for mark in range(reach.shape[2]):
                if reach[0, i, mark] < np.inf:
                    left = max(left, goal_bounds[0, mark] - reach[1, i, mark])
                    left = max(left, reach[0, i, mark] - goal_bounds[1, mark])
        last[group[i]] = min(last[group[i]], left - _SLACK)
    behind = last.copy()
    for g in range(len(circles)):
        for other in range(len(circles)):
            between = distance(circles[g, 0], circles[g, 1], circles[other, 0], circles[other, 1])
            between -= circles[g, 2] + circles[other, 2]
            behind[g] = min(behind[g], max(between, 0.0) + last[other])
    return behind


@njit(cache=True, nogil=True)
def estimate(marks, corner, x, y, tx, ty):
    """Return a lower bound on the rest of a path behind a corner, -1 for a corner of closed cells.

    `marks` are the distances from landmarks, the bounds of the goal, the circles round groups of
    corners of closed cells, the bounds of these groups, and the least rest behind each group.
    """
    table, goal_bounds, circles, around, left = marks
    straight = distance(x, y, tx, ty)
    least = np.inf
    if corner >= 0:
        least = straight
        for mark in range(table.shape[1]):
            reached = table[corner, mark]
            if reached < np.inf:
                least = max(least, goal_bounds[0, mark] - reached, reached - goal_bounds[1, mark])
    for g in range(len(circles)):
        there = distance(x, y, circles[g, 0], circles[g, 1]) - circles[g, 2]
        if corner >= 0 and there + left[g] < least:
            for mark in range(table.shape[1]):
                reached = table[corner, mark]
                if reached < np.inf:
                    there = max(there, around[0, g, mark] - reached, reached - around[1, g, mark])
        least = min(least, there + left[g] - _SLACK)
    return max(least, straight)
