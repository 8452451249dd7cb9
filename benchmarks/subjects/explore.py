"""Exploration: what stays unknown in random worlds of narrow doors, and metres in the office.

A cell counts as missed if a flood fill of the true world, with the robot's radius, reaches it from
the start and the robot's map does not know it in the end.
"""

import time
from argparse import Namespace
from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

import hybridnav as hn
from benchmarks.options import option
from benchmarks.tables import print_head, print_load, print_row
from hybridnav.ext.live.explore import By, explore, laser_all_round

_WALL, _DEPTH, _LEAST_ROOM, _BIG_ROOM = 2, 4, 10, 24


def narrow_world(seed: int, *, resolution_m: float = 0.1) -> hn.OccupancyGrid:
    """Return rooms, at one of four yaws, whose doors are at most a cell wider than need be.

    Walls are one or two cells thick, doors as narrow as a robot of the world's radius, 1.6 to 4.2
    cells, can pass, or a cell wider; pillars stand anywhere, in doors too.
    """
    rng = np.random.default_rng(seed)
    radius_cells = float(rng.uniform(1.6, 4.2))
    door = 2 * int(radius_cells) + 1  # the middle one is more than the radius from both sides
    cells = np.zeros(rng.integers((50, 60), (100, 130)), np.float32)
    cells[:_WALL] = cells[-_WALL:] = cells[:, :_WALL] = cells[:, -_WALL:] = 1.0
    _divide(cells[_WALL:-_WALL, _WALL:-_WALL], door, _DEPTH, rng)
    for row, col in rng.integers(3, np.array(cells.shape) - 5, (int(rng.integers(12)), 2)):
        rows, cols = rng.integers(1, 4, 2)
        cells[row : row + rows, col : col + cols] = 1.0
    frame = hn.Frame(resolution_m, (-1.0, 2.0), float(rng.choice([0.0, 0.3, -1.1, 2.0])))
    radius_m = radius_cells * resolution_m
    return hn.OccupancyGrid(cells, frame, robot_radius_m=radius_m, name=f"narrow-{seed}")


def _divide(room: NDArray[np.float32], door: int, depth: int, rng: np.random.Generator) -> None:
    """Divide a room by a wall across its longer side, with one or two doors, and so on."""
    if room.shape[0] < room.shape[1]:
        room = room.T
    long, wide = room.shape
    if not depth or long < _BIG_ROOM or wide < door + _LEAST_ROOM:
        return
    thick, at = int(rng.integers(1, 3)), int(rng.integers(_LEAST_ROOM, long - _LEAST_ROOM))
    _divide(room[:at], door, depth - 1, rng)
    _divide(room[at + thick :], door, depth - 1, rng)
    room[at : at + thick] = 1.0
    for _ in range(rng.integers(1, 3)):
        first = int(rng.integers(1, wide - door - 3))
        room[at : at + thick, first : first + door + int(rng.integers(2))] = 0.0


def cells_in_reach(world: hn.OccupancyGrid, start: tuple[float, float]) -> set[tuple[int, int]]:
    """Return the cells that a robot reaches from a point, by a flood fill."""
    walls = np.argwhere(world.measured != hn.CellClass.FREE)
    far = np.asarray(KDTree(walls).query(np.argwhere(np.ones(world.shape, np.bool_)))[0])
    enterable = (far * world.resolution_m > world.robot_radius_m).reshape(world.shape)
    row, col = world.frame.cells_of(np.array(start)).tolist()
    reached, queue = {(row, col)}, deque([(row, col)])
    while queue:
        row, col = queue.popleft()
        for cell in ((row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)):
            if cell not in reached and enterable[cell]:
                reached.add(cell)
                queue.append(cell)
    return reached


def widest_point(world: hn.OccupancyGrid) -> tuple[float, float]:
    """Return the centre of the free cell that is farthest from walls."""
    free = np.argwhere(world.measured == hn.CellClass.FREE)
    walls = np.argwhere(world.measured != hn.CellClass.FREE)
    far = np.asarray(KDTree(walls).query(free)[0])
    x_m, y_m = world.frame.points_of(free[far.argmax()]).tolist()
    return x_m, y_m


def missed_cells(
    world: hn.OccupancyGrid, made: hn.OccupancyGrid, start: tuple[float, float]
) -> int:
    """Return how many cells in reach a robot's map does not know."""
    cells = np.array(sorted(cells_in_reach(world, start)))
    at = made.frame.cells_of(world.frame.points_of(cells))
    inside = ((at >= 0) & (at < made.shape)).all(axis=1)
    known = made.measured[tuple(at[inside].T)] != hn.CellClass.UNEXPLORED
    return len(cells) - int(known.sum())


_SETTINGS: list[tuple[By, float, float]] = [
    ("path", 0.1, 0.01),
    ("frontier", 0.1, 0.01),
    ("room", 0.1, 0.01),
    ("path", 0.1, 0.0),
    ("path", 0.05, 0.01),
    ("path", 0.05, 0.02),
    ("path", 0.05, 0.025),
]
"""Ranking, metres of a cell, and of the noise."""


def _worlds(n_worlds: int) -> None:
    columns = "ranking", "cells", "noise", "worlds", "with missed cells", "most missed"
    print_head(*columns, "metres", "looks again")
    for by, resolution_m, noise_m in _SETTINGS:
        missed, driven_m, looks = [], 0.0, 0
        for seed in range(n_worlds):
            world = narrow_world(seed, resolution_m=resolution_m)
            start, laser = widest_point(world), laser_all_round(noise_m=noise_m)
            done = explore(world, start, sensor=laser, seed=seed, by=by)
            missed.append(missed_cells(world, done.grid, start))
            driven_m, looks = driven_m + done.driven_m, looks + done.n_looks_again
        asked = by, f"{resolution_m:g} m", f"{noise_m:g} m", n_worlds
        print_row(*asked, np.count_nonzero(missed), max(missed), f"{driven_m:,.0f}", looks)


def _office(n_seeds: int) -> None:
    office = hn.example_map("office", robot_radius_m=0.25)
    walls = np.where(office.measured == hn.CellClass.FREE, np.float32(0.0), np.float32(1.0))
    plan = replace(office, probability=walls)
    columns = "metres by path", "by frontier", "seconds by path", "by frontier"
    print_head("start", "noise's seed", *columns, "missed")
    for start in ((6.0, 17.2), (1.0, 13.2), widest_point(plan)):
        for seed in range(n_seeds):
            metres, seconds, missed = [], [], 0
            rankings: tuple[By, ...] = ("path", "frontier")
            for by in rankings:
                began = time.process_time()
                done = explore(office, start, seed=seed, by=by)
                seconds.append(f"{time.process_time() - began:.0f}")
                metres.append(f"{done.driven_m:.0f}")
                missed += missed_cells(plan, done.grid, start)
            print_row(f"{start[0]:g}, {start[1]:g}", seed, *metres, *seconds, missed)


OPTIONS = [
    option("--worlds", type=int, default=150, help="random worlds"),
    option("--seeds", type=int, default=2, help="explorations of the office a start"),
]


def main(given: Namespace) -> None:
    """Print the tables."""
    print_load()
    _worlds(given.worlds)
    _office(given.seeds)
