"""The map of the paper's Fig. 1."""

import numpy as np

from benchmarks.worlds.world import FREE, OCCUPIED, UNEXPLORED, World
from hybridnav.maps import Frame


def figure1_world() -> World:
    """Return two regions that meet twice, and a third inside one: a map after the paper's Fig. 1.

    The free region A fills the left, the unexplored region B the right of a walled area of 40 x
    30 cells. An obstacle lies across the line between them, so that A and B meet along two
    separate boundaries, above and below it; the unexplored island C lies inside A. There is no
    noise. With a robot radius of 0, a merge distance that spans the map and any linkage, the
    topological map has

    * 3 places: A (free), B and C (unexplored);
    * 4 arcs: two between A and B, one between A and C, and the self-loop of A round C;
    * 3 faces: two protected ones (the obstacle and the wall) and the face between the arc of C and
    the self-loop round it, so that V - E + F = 2.

    Cells have 0.1 m, the origin is (0, 0).
    """
    row, col = np.indices((30, 40))
    # The line between A and B leans by one cell every four rows: no boundary is a straight one.
    cells = np.where(col < 19 + row // 4, FREE, UNEXPLORED)
    cells[(row - 15) ** 2 + (col - 9) ** 2 <= 18] = UNEXPLORED
    cells[(row - 15) ** 2 + (col - 22) ** 2 <= 20] = OCCUPIED
    cells[[0, -1], :] = OCCUPIED
    cells[:, [0, -1]] = OCCUPIED
    return World(cells[::-1], Frame(resolution_m=0.1), "figure1")
