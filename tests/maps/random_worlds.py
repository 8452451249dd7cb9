"""Lower bounds among random shapes: `python -m tests.maps.random_worlds 10000` counts those that
are above the length of a path that shapely calls free.
"""

import sys
from typing import Any

import numpy as np
import shapely

import hybridnav as hn

BOUNDS = (0.0, 0.0, 4.0, 4.0)


def count(number: int, seed: int = 63) -> tuple[int, int]:
    """Judge so many free paths or a few more; returns their number, and that of false bounds."""
    rng, judged, wrong = np.random.default_rng(seed), 0, 0
    while judged < number:
        shapes: list[Any] = [*map(shapely.Point, rng.uniform(0, 4, (6, 2)))]
        corners = rng.integers(0, 17, (2, 2)) / 4  # on sides of cells, and touching each other
        shapes += [shapely.box(*low, *(low + np.array([0.25, 1.5]))) for low in corners]
        shapes.append(shapely.LineString(rng.integers(0, 17, (3, 2)) / 4))
        radii_m = np.append(rng.uniform(0.05, 0.4, 6), rng.choice([0.0, 0.1], 3))
        radii_m[-1] = max(radii_m[-1], 0.05)
        side_m = rng.choice([0.05, 0.1, 0.25])
        _, bounding = hn.grids_of_shapes(shapes, side_m, BOUNDS, radii_m=radii_m)
        planner = hn.HybridPlanner(bounding)
        points = rng.uniform(0, 4, (300, 4, 2))
        points[:, 1:] = points[:, :1] + rng.uniform(-1, 1, (300, 3, 2)).cumsum(axis=1)
        lines: Any = shapely.linestrings(points.clip(0.001, 3.999))
        for line in lines[_is_free(lines, shapes, radii_m)][:100]:
            judged += 1
            result = planner.plan(line.coords[0], line.coords[-1])
            wrong += not result.lower_bound <= line.length * (1 + 1e-9)
    return judged, wrong


def _is_free(lines: Any, shapes: list[Any], radii_m: Any) -> Any:
    """Return the lines that keep each radius, and touch no shape without one."""
    apart = shapely.distance(lines[:, None], shapes)
    return ((apart >= radii_m) & (apart > 0)).all(axis=1)


if __name__ == "__main__":
    judged, wrong = count(int(sys.argv[1]))
    print(f"{judged} free paths, {wrong} bounds above one")  # noqa: T201
