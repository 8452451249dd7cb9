#!/bin/sh
# tcod 21.2.2: path2d searches from the goals back to the start, along edges whose cost is that of "movement into" a cell.
# So each step is charged for the cell that it leaves: a goal costs nothing to enter, and of two goals the dear one is taken.
# Most people expect "the single shortest path", as path2d's documents say, by the costs that its own Pathfinder reports.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check tcod==21.2.2 numpy==2.4.6
cd "$folder"
./venv/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import tcod.path


def compare(cost, start, goals, **steps):
    array = np.array(cost)
    path = tcod.path.path2d(array, start_points=[start], end_points=goals, **steps).tolist()
    finder = tcod.path.Pathfinder(tcod.path.SimpleGraph(cost=array, **steps))
    finder.add_root(start)
    finder.resolve()
    best = min(goals, key=lambda goal: finder.distance[goal])
    moves = [sum(a != b for a, b in zip(*pair)) for pair in zip(path, path[1:])]
    paid = sum(steps[("cardinal", "diagonal")[m - 1]] * cost[i][j] for m, (i, j) in zip(moves, path[1:]))
    print(f"costs {cost}, from {start} to {goals}: path2d gives {path}, which costs {paid}")
    print(f"expected: {finder.path_to(best).tolist()}, which costs {finder.distance[best]} by Pathfinder from the start")
    return int(paid), int(finder.distance[best])


print("tcod", version("tcod"))
goals = compare([[9, 1, 1, 1]], (0, 1), [(0, 0), (0, 3)], cardinal=1, diagonal=0)
corner = compare([[2, 3, 1], [3, 0, 1]], (1, 0), [(0, 1)], cardinal=1, diagonal=2)
assert (goals, corner) == ((9, 2), (6, 5)), "this has changed"
PYTHON
