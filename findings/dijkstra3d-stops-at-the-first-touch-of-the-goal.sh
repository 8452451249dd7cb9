#!/bin/sh
# dijkstra3d 1.15.2 ends its search when the goal is first touched, not when it is the nearest open cell. That is right
# only if all steps into a cell cost the same; once steps have lengths (anisotropy=, euclidean_metric=), paths are longer.
# Most people expect a shortest path, as both functions' documents promise.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check dijkstra3d==1.15.2 numpy==2.4.6
cd "$folder"
./venv/bin/python - <<'PYTHON'
from importlib.metadata import version

import dijkstra3d
import numpy as np


def length(path, cost):
    steps = np.linalg.norm(np.diff(path.astype(float), axis=0), axis=1)
    return sum(steps * [cost[tuple(cell)] for cell in path[1:]])


print("dijkstra3d", version("dijkstra3d"))
free = np.array([[0, 1, 1, 1, 1], [1, 0, 0, 1, 1], [1, 1, 0, 1, 0], [1, 0, 1, 1, 1], [0, 1, 0, 1, 1]], bool)
found = dijkstra3d.binary_dijkstra(free, (0, 4), (3, 0), background_color=0, connectivity=8)
other = np.array([(0, 4), (0, 3), (0, 2), (0, 1), (1, 0), (2, 0), (3, 0)])
assert all(free[tuple(cell)] for cell in np.vstack([found, other]))
lengths = length(found, free), length(other, free)
print("free cells, steps of 1 and sqrt(2):", found.tolist(), f"of length {lengths[0]:.2f}")
print(f"expected: at most the {lengths[1]:.2f} of", other.tolist())
cost = np.array([[1, 1], [1, 5]], np.float32)
path = dijkstra3d.dijkstra(cost, (0, 0), (1, 1), connectivity=8, anisotropy=(1, 1))
costs = length(path, cost), length(np.array([(0, 0), (0, 1), (1, 1)]), cost)
print("costs [[1, 1], [1, 5]], anisotropy (1, 1):", path.tolist(), f"of cost {costs[0]:.2f}")
print(f"expected: a path of cost {costs[1]:.2f} over (0, 1) or (1, 0)")
assert lengths[0] > lengths[1] + 0.2 and costs[0] > costs[1] + 1, "this has changed"
PYTHON
