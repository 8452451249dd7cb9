#!/bin/sh
# roboticstoolbox 1.5.0: with metric="manhattan" the DistanceTransformPlanner measures in steps to four sides, but query()
# then takes the lowest of eight neighbours. So the path slips between two obstacles that touch at a corner, where the
# planner's own distance map leads around the wall, which has no gap for steps to four sides.
# Most people expect a path that takes as many steps as the distance map says.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check roboticstoolbox-python==1.5.0 numpy==2.4.6
cd "$folder"
./venv/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from roboticstoolbox import DistanceTransformPlanner

wall = [(0, 4), (1, 3), (2, 2), (3, 1)]
grid = np.zeros((5, 5))
for x, y in wall:
    grid[y, x] = 1
planner = DistanceTransformPlanner(grid, goal=(2, 3), metric="manhattan")
planner.plan()
path = planner.query(start=(1, 2)).tolist()
distance = planner.distancemap[2, 1]
print("roboticstoolbox", version("roboticstoolbox-python"))
print(f"a wall of the cells {wall}, from (1, 2) to (2, 3): {distance:g} steps by the distance map")
print("the path:", path)
print("expected: 10 steps to four sides, around the wall's end at (4, 1)")
assert distance == 10 and path == [[1, 2], [2, 3]], "this has changed"
PYTHON
