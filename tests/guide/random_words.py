"""Words of routes on small random maps: zones drawn inside halls, doors at the map's edge, rooms of
a cell.

`python -m tests.guide.random_words 20000` asks for so many maps, and prints the first seeds
whose words are wrong.
"""

import json
import sys
import traceback
import warnings
from typing import Any

import numpy as np

import hybridnav as hn


def drawn_map(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return occupancy, float32, and the label of each cell, -1 for none: int32, both (rows, cols).

    Walls have gaps, also at the edge; rooms are rectangles, one over the other.
    """
    rows, cols = random.integers(2, 26, 2).tolist()
    occupancy = np.zeros((rows, cols), dtype=np.float32)
    for _ in range(int(random.integers(0, 5))):
        line = occupancy[int(random.integers(rows))]
        if random.random() < 0.5:
            line = occupancy[:, int(random.integers(cols))]
        gap, width = int(random.integers(-1, len(line))), int(random.integers(1, 5))
        kept = line[max(gap, 0) : gap + width].copy()
        line[:] = 1.0
        line[max(gap, 0) : gap + width] = kept
    speckled = random.random((rows, cols))
    occupancy[speckled < random.choice([0.0, 0.0, 0.03])] = 1.0
    occupancy[speckled > 1 - random.choice([0.0, 0.0, 0.05])] = 0.5
    label_of = np.full((rows, cols), random.choice([-1, 0]), dtype=np.int32)
    for label in range(1, int(random.integers(2, 8))):
        low, high = (np.sort(random.integers(0, size + 1, 2)) for size in (rows, cols))
        label_of[low[0] : low[1], high[0] : high[1]] = label
    return occupancy, label_of


def planners_of(seed: int) -> tuple[list[hn.HybridPlanner], list[Any]]:
    """Return planners and waypoints on a map drawn with a seed: as it is, and with walls round it,
    thin and thick. In half of them points are exact in binary."""
    random = np.random.default_rng(seed)
    occupancy, label_of = drawn_map(random)
    side_m = float(random.choice([0.125, 0.25, 0.5, 1.0] if seed % 2 else [0.05, 0.1, 0.3]))
    frame = hn.Frame(side_m, (-3.0, 7.0), 0.0 if seed % 2 else float(random.choice([0.0, 0.7])))
    names = tuple(f"r{label}" if label % 2 else f"room-{label}" for label in range(8))
    preset = str(random.choice(["shortest", "octile"]))
    free = np.argwhere(occupancy == 0)
    chosen = free[random.integers(len(free), size=int(random.integers(2, 5)))]
    points = frame.points_of(chosen).tolist()
    points[0] += random.uniform(-3, 3, int(random.integers(0, 2))).tolist()
    planners = []
    for margin in (0, 1, 1 + int(np.ceil(1.0 / side_m))):
        wide = np.pad(occupancy, margin, constant_values=1.0)
        labels = hn.RoomLabels(names, np.pad(label_of, margin, constant_values=-1))
        x, y = frame.points_of_grid([[-margin, -margin]])[0].tolist()
        grid = hn.OccupancyGrid(wide, hn.Frame(side_m, (x, y), frame.yaw_rad), robot_radius_m=0)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
        planners.append(hn.HybridPlanner(topology, preset=preset))
    return planners, points


def fault_of(seed: int) -> str | None:
    """Return what is wrong with the words of a map; None for nothing.

    They are words and valid JSON, in both languages, with numbers. They are the same for thin walls
    round a map as for thick ones: nobody comes to where those lie.
    """
    warnings.simplefilter("error")
    try:
        planners, waypoints = planners_of(seed)
        tours = [hn.plan_tour(planner, waypoints) for planner in planners]
        told = [(tour.words(), tour.words("de")) if tour.solved else () for tour in tours]
        json.dumps([tour.to_dict() for tour in tours], allow_nan=False)
    except Exception:  # noqa: BLE001 - any is a fault
        return traceback.format_exc()
    if any("nan" in line or "None" in line for words in told for lines in words for line in lines):
        return f"no words: {told}"
    thin, thick = (
        _facts(planner, tour) for planner, tour in zip(planners[1:], tours[1:], strict=True)
    )
    if seed % 2 and thin == thick and told[1] != told[2]:
        return "\n".join(map(repr, ["other words with thick walls:", *told[1:]]))
    return None


def _facts(planner: hn.HybridPlanner, tour: hn.Tour) -> list[Any]:
    """Return what words are made of: the path, and doors and rooms as people see them."""
    rooms = planner.topology.rooms
    doors = [
        (one.number, one.position, one.kind, one.width_m, one.passage_m) for one in rooms.doors
    ]
    paths = [one.path and one.path.points.tolist() for one in tour.results]
    return [paths, doors, rooms.kinds]


def main() -> None:
    """Print the seeds whose words are wrong, and how many there are."""
    count, found = int(sys.argv[1]), 0
    for seed in range(count):
        fault = fault_of(seed)
        if fault is not None:
            found += 1
            if found <= 5:
                print(seed, fault)  # noqa: T201
    print(f"{found} of {count} maps")  # noqa: T201


if __name__ == "__main__":
    main()
