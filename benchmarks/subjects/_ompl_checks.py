"""Checks of the subject `ompl`: a long robot through doors, parking, and a soak."""

from __future__ import annotations

import itertools
import math
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import shapely

import hybridnav as hn
from benchmarks.worlds import office_world
from hybridnav.planning import load_preset

CORNERS = ((0.9, 0.3), (0.9, -0.3), (-0.9, -0.3), (-0.9, 0.3))
"""A robot of 0.6 x 1.8 m."""
DOOR_M = 0.9
RESOLUTION_M = 0.05
FINE_M = 0.01
"""Metres and radians between the poses that the independent check looks at."""
SOAK_BYTES = 50e6
LEAST_SOLVED = {"se2": 0.95, "differential": 0.85, "reeds-shepp": 0.8, "dubins": 0.7}
"""Parts of the runs that must be solved; a robot that only drives ahead cannot leave every pose."""
_SHARES = {"se2": 5, "reeds-shepp": 3, "dubins": 2, "differential": 2}
"""Parts of the runs by state space."""
_CURVED = {"reeds-shepp", "dubins"}


def rooms() -> hn.OccupancyGrid:
    """Six rooms of 20 x 12 m in all with doors of 0.9 m, and a dead end 1.2 m wide."""
    occupied = np.zeros((240, 400), dtype=np.float32)
    occupied[:2] = occupied[-2:] = occupied[:, :2] = occupied[:, -2:] = 1
    door = round(DOOR_M / RESOLUTION_M)
    for col, doors in ((120, (40, 160)), (260, (60, 180))):
        occupied[:, col : col + 3] = 1
        for row in doors:
            occupied[row : row + door, col : col + 3] = 0
    occupied[120:123] = 1
    for col in (60, 180, 320):
        occupied[120:123, col : col + door] = 0
    occupied[4:50, 340:343] = occupied[4:50, 367:370] = 1
    return hn.OccupancyGrid(occupied, hn.Frame(RESOLUTION_M), robot_radius_m=0.3, name="doors")


def footprint_runs(runs: int, *, seed: int = 0) -> dict[str, dict[str, Any]]:
    """Plans of the long robot between random poses, and into the dead end; by state space, how
    many were solved and how many poses of their paths touch a wall."""
    grid = rooms()
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    walls = Walls(grid)
    rng = np.random.default_rng(seed)
    counts = {}
    for space, share in _SHARES.items():
        corners = str([list(corner) for corner in CORNERS])
        radius = ", turning_radius_m: 0.8" if space in _CURVED else ""
        settings = f"{{space: {space}, footprint: '{corners}', budget_s: 2{radius}}}"
        planner = hn.HybridPlanner(
            topology, preset=load_preset("ompl", overrides=[f"planner.ompl={settings}"])
        )
        solved = faults = by_grid = 0
        seconds = []
        for number in range(max(round(share * runs / sum(_SHARES.values())), 1)):
            start, goal = walls.pose(rng), walls.pose(rng)
            if space == "reeds-shepp" and number % 2:
                goal = np.array([17.75, 1.3, math.pi / 2])  # parked: ahead is the way out
            began = time.perf_counter()
            result = planner.plan(start, goal)
            seconds.append(time.perf_counter() - began)
            if not result.solved or result.path is None or result.path.headings_rad is None:
                continue
            solved += 1
            by_grid += bool(result.refinement and result.refinement.by_grid)
            poses = np.column_stack([result.path.points, result.path.headings_rad])
            faults += walls.touched(poses, curved=space in _CURVED)
        counts[space] = {
            "runs": len(seconds),
            "solved": solved,
            "by line of sight": by_grid,
            "violations": faults,
            "seconds, median": round(float(np.median(seconds)), 3),
            "seconds, max": round(max(seconds), 3),
        }
    return counts


class Walls:
    """The raw occupied cells of a map whose frame is at the origin, asked by shapely alone."""

    def __init__(self, grid: hn.OccupancyGrid) -> None:
        low = np.argwhere(grid.measured == hn.CellClass.OCCUPIED)[:, ::-1] * grid.resolution_m
        self._cells = shapely.STRtree(shapely.box(*low.T, *(low + grid.resolution_m).T))
        self._size = np.array(grid.shape)[::-1] * grid.resolution_m

    def collides(self, x: float, y: float, yaw: float) -> bool:
        """Whether the robot overlaps a cell by more than a thousandth of its side."""
        cosine, sine = math.cos(yaw), math.sin(yaw)
        corners = np.array(CORNERS) @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y)
        body = shapely.Polygon(corners).buffer(-1e-3 * RESOLUTION_M)
        return bool(len(self._cells.query(body, predicate="intersects")))

    def pose(self, rng: np.random.Generator) -> Any:
        """A random pose that collides with nothing, 5 cm from touching."""
        while True:
            pose = np.append(rng.uniform(0.4, self._size - 0.4), rng.uniform(-math.pi, math.pi))
            if not any(self.collides(*(pose + shift)) for shift in _SHIFTS):
                return pose

    def touched(self, poses: Any, *, curved: bool) -> int:
        """Poses in collision, of those `FINE_M` apart between some poses: on a straight line with
        an even turn, or on the arc that joins them."""
        count = 0
        for first, second in itertools.pairwise(poses):
            turn = math.remainder(second[2] - first[2], math.tau)
            offset = (second - first)[:2]
            steps = math.ceil(math.hypot(*offset, turn) / FINE_M) + 1
            for along in np.linspace(0, 1, steps):
                yaw = first[2] + along * turn
                x, y = first[:2] + along * offset
                if curved and abs(turn) > 1e-9:
                    x, y = first[:2] + _on_arc(first[2], turn, offset, along)
                count += self.collides(x, y, yaw)
        return count


def _on_arc(heading: float, turn: float, chord: Any, along: float) -> Any:
    """Where a share of the turn leads on the arc over a chord, from its start."""
    middle = np.array([math.cos(heading + turn / 2), math.sin(heading + turn / 2)])
    radius = float(chord @ middle) / (2 * math.sin(turn / 2))
    now = heading + along * turn
    return radius * np.array([math.sin(now) - math.sin(heading), math.cos(heading) - math.cos(now)])


_SHIFTS = 0.05 * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])


def soak(plans: int, *, seed: int = 0) -> dict[str, float]:
    """Plans in one process; how much memory planner and worker gain after the first hundredth."""
    grid = office_world().grid(robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    preset = load_preset(
        "ompl", overrides=["planner.ompl.planner=BITstar", "planner.ompl.budget_s=0.25"]
    )
    planner = hn.HybridPlanner(topology, preset=preset)
    worker: Any = planner._now.ompl._worker  # type: ignore[union-attr]  # noqa: SLF001
    free = np.argwhere(grid.classes == hn.CellClass.FREE)
    pairs = np.random.default_rng(seed).choice(free, (plans, 2))
    unsolved, longest, before = 0, 0.0, 0
    for number, pair in enumerate(pairs):
        began = time.perf_counter()
        result = planner.plan(*grid.frame.points_of(pair))
        longest = max(longest, time.perf_counter() - began)
        unsolved += not result.solved and result.status is not hn.PlanStatus.NO_PATH
        if number == max(plans // 100, 1):
            before = _resident(os.getpid()) + _resident(worker._running.process.pid)  # noqa: SLF001
    gained = _resident(os.getpid()) + _resident(worker._running.process.pid) - before  # noqa: SLF001
    return {"plans": plans, "unsolved": unsolved, "longest_s": longest, "gained_bytes": gained}


def _resident(pid: int) -> int:
    pages = Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]
    return int(pages) * os.sysconf("SC_PAGE_SIZE")
