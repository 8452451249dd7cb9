"""Random floors of rooms with doors of one cell, and every way through them, by networkx."""

import itertools
import math
from dataclasses import dataclass
from typing import Any

import networkx as nx
import numpy as np

import hybridnav as hn
from tests.strategies import occupancy_grid

Cell = tuple[int, int]
SIDE = 4
"""Cells between two walls."""


@dataclass(frozen=True)
class Floor:
    """Square rooms in rows, with pillars, and the cells on both sides of each door."""

    classes: Any
    label_of: Any
    doors: list[tuple[Cell, Cell]]

    @property
    def topology(self) -> hn.TopologicalMap:
        names = tuple(f"room {label}" for label in range(int(self.label_of.max()) + 1))
        rooms = hn.RoomLabels(names, self.label_of)
        grid = occupancy_grid(self.classes)
        return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=3.0, rooms=rooms))

    def room_of(self, cell: Cell) -> int:
        return int(self.label_of[cell])

    def moves(self, *, doors: set[int] | None = None) -> "nx.Graph[Cell]":
        """The legal moves inside rooms, and through some doors, with their lengths."""
        graph: nx.Graph[Cell] = nx.Graph()
        graph.add_nodes_from((row, col) for row, col in np.argwhere(self.classes == 1).tolist())
        for row, col in graph:
            for up, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
                to = row + up, col + right
                beside = (row + up, col), (row, col + right), to
                if all(self.classes[cell] == 1 for cell in beside) and self.room_of(
                    to
                ) == self.room_of((row, col)):
                    graph.add_edge((row, col), to, weight=math.hypot(up, right))
        for number, (one, other) in enumerate(self.doors):
            if doors is None or number in doors:
                graph.add_edge(one, other, weight=1.0)
        return graph

    def darts(self, start: Cell, goal: Cell) -> "nx.DiGraph[Any]":
        """A node for each door and direction, and the ends; edges are paths inside one room."""
        inside = self.moves(doors=set())
        away = {
            cell: nx.single_source_dijkstra_path_length(inside, cell)
            for cell in {start, goal, *itertools.chain(*self.doors)}
        }
        leaving = [
            (number, half, self.doors[number][half], self.doors[number][1 - half])
            for number, half in itertools.product(range(len(self.doors)), (0, 1))
        ]
        graph: nx.DiGraph[Any] = nx.DiGraph()
        graph.add_nodes_from(["start", "goal"])
        if goal in away[start]:
            graph.add_edge("start", "goal", weight=away[start][goal])
        for number, half, before, behind in leaving:
            if before in away[start]:
                graph.add_edge("start", (number, half), weight=away[start][before] + 1)
            if behind in away[goal]:
                graph.add_edge((number, half), "goal", weight=away[goal][behind])
            for other, other_half, further, _ in leaving:
                if other != number and further in away[behind]:
                    cost = away[behind][further] + 1
                    graph.add_edge((number, half), (other, other_half), weight=cost)
        return graph

    def rooms_passed(self, start: Cell, darts: list[Any]) -> list[int]:
        rooms = [self.room_of(start)]
        return rooms + [self.room_of(self.doors[number][1 - half]) for number, half in darts]


def random_floor(rng: np.random.Generator, rows: int = 3, cols: int = 3) -> Floor:
    """A floor; neighbours have none to two doors."""
    pitch = SIDE + 1
    classes = np.zeros((rows * pitch + 1, cols * pitch + 1), np.uint8)
    label_of = np.full(classes.shape, -1, dtype=np.int32)
    doors = []
    for row, col in itertools.product(range(rows), range(cols)):
        low, left = row * pitch + 1, col * pitch + 1
        classes[low : low + SIDE, left : left + SIDE] = 1
        label_of[low : low + SIDE, left : left + SIDE] = row * cols + col
        for up, right in ((0, 1), (1, 0)):
            if row + up == rows or col + right == cols:
                continue
            along = rng.permutation([0, 2] if rng.random() < 0.5 else [1, 3])
            for at in along[: rng.choice([0, 1, 1, 2])].tolist():
                gap = (low + at, left + SIDE) if right else (low + SIDE, left + at)
                classes[gap], label_of[gap] = 1, row * cols + col
                doors.append((gap, (gap[0] + up, gap[1] + right)))
        if rng.random() < 0.5:
            classes[low + rng.integers(1, 3), left + rng.integers(1, 3)] = 0
    label_of[classes == 0] = -1
    return Floor(classes, label_of, doors)
