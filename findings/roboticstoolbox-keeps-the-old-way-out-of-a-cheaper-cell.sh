#!/bin/sh
# roboticstoolbox 1.5.0: when the sensor of DstarPlanner.query() reports that a cell became cheap, the planner leads through
# it, but out of it only to the neighbour that was best before: the cell itself is not compared with its neighbours again.
# Most people expect of D*, which replans only to be faster, the path that planning anew on the changed map gives.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check roboticstoolbox-python==1.5.0 numpy==2.4.6
cd "$folder"
./venv/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from roboticstoolbox import DstarPlanner


def plan(costs, sensor=None):
    planner = DstarPlanner(costs, goal=(2, 1))
    planner.plan()
    path, _ = planner.query(start=(0, 1), sensor=sensor)
    cells = [planner.costmap[y, x] for x, y in path.astype(int)]  # the costs as they are at the end
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    return path.astype(int).tolist(), sum(steps * (np.array(cells[1:]) + cells[:-1]) / 2)


before = np.array([[1.0, 20, 2], [2, 20, 1]])
after = before.copy()
after[0, 1] = 1
replanned, cost = plan(before.copy(), sensor=lambda position: [(1, 0, 1.0)])
anew, best = plan(after)
print("roboticstoolbox", version("roboticstoolbox-python"))
print(f"costs {before.tolist()}, then cell (1, 0) costs 1")
print(f"replanned: {replanned}, which costs {cost:.2f}")
print(f"expected, and planned anew: {anew}, which costs {best:.2f}")
assert len(replanned) == 4 and len(anew) == 3 and cost > best + 1, "this has changed"
PYTHON
