"""Any-angle planners of others on the whole map, as methods of the harness."""

import math
import time
from typing import Any

import numpy as np

from benchmarks.rivals import Rival, needed_package, refuse_corner_cutting
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.errors import UnsuitableMapError
from hybridnav.harness.baselines.regions import AnyAngleResult, MethodResult
from hybridnav.maps import OccupancyGrid
from hybridnav.refine.ompl import OmplQuery, OmplSettings, Setup, Worker, require_ompl

Cell = tuple[int, int]

MAX_VERTICES = 1000
"""Vertices of polygons up to which extremitypathfinder is asked: 18 s to prepare, by the cube."""
_CHAMFER_CELLS = 2.0**-10


class ExtremityPathfinder(Rival):
    """The visibility graph of extremitypathfinder over the polygons of the free cells.

    It asks for polygons that do not touch, so where two blocked cells meet at a corner, that corner
    of the free cells beside it is cut off by 2^-10 of a cell. No shortest path goes there.

    `max_vertices`: the most vertices of its polygons. Raises `UnsuitableMapError` when there are
    more, or paths may cut corners.
    """

    name = package = "extremitypathfinder"

    def __init__(self, grid: OccupancyGrid, *, max_vertices: int = MAX_VERTICES) -> None:
        package = needed_package("extremitypathfinder")
        refuse_corner_cutting(grid)
        settings = f"up to {max_vertices:,} vertices"
        super().__init__(grid, settings)
        self._frame = grid.frame
        self._rooms = polygons_of(self.free, max_vertices)
        self._room_of = _rooms_of(self.free, self._rooms)
        self._environments = []
        for shell, holes in self._rooms:
            environment = package.PolygonEnvironment()
            environment.store(shell, holes)
            self._environments.append(environment)
        self.n_nodes = sum(len(part) for shell, holes in self._rooms for part in (shell, *holes))

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between the centres of two different free cells."""
        room = self._room_of[start]
        if room != self._room_of[goal]:
            return MethodResult(None)
        ends = [(col + 0.5, row + 0.5) for row, col in (start, goal)]
        found, length = self._environments[room].find_shortest_path(*ends, verify=False)
        if not found:
            return MethodResult(None)
        points = self._frame.points_of_grid(np.array(found, dtype=np.float64)[:, ::-1])
        length_m = float(length) * self._frame.resolution_m
        return MethodResult(None, any_angle=AnyAngleResult(points, length_m))


Room = tuple["FloatArray", list["FloatArray"]]
"""A boundary, counter-clockwise, and holes, clockwise; float64 (n, 2), (column, row)."""


def polygons_of(free: BoolArray, max_vertices: int) -> list[Room]:
    """Return the polygons of the free cells, one for each set that moves join.

    Raises `UnsuitableMapError` when they have too many vertices.
    """
    import shapely  # noqa: PLC0415 - half a second, rarely needed

    n_corners = count_corners(free)
    if n_corners > max_vertices:
        raise UnsuitableMapError(
            f"it is asked about up to {max_vertices:,} vertices of polygons, this map has "
            f"{n_corners:,}"
        )
    rows, first, last = _runs(free)
    whole = shapely.union_all(shapely.box(first, rows, last, rows + 1))
    pinches = _pinches(free)
    tips = np.array([[0, 1], [1, 0], [0, -1], [-1, 0]]) * _CHAMFER_CELLS
    diamonds: Any = shapely.polygons(pinches[:, None] + tips) if len(pinches) else []
    parts = shapely.get_parts(shapely.difference(whole, shapely.union_all(diamonds)))
    rooms = []
    for part in shapely.orient_polygons(shapely.simplify(parts, 0)):
        rings = [shapely.get_coordinates(ring)[:-1] for ring in (part.exterior, *part.interiors)]
        rooms.append((rings[0], rings[1:]))
    return rooms


def _quads(free: BoolArray) -> Any:
    """Return the four cells round each corner of the lattice: below left and right, above left and
    right."""
    padded = np.pad(free, 1)
    return padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]


def _pinches(free: BoolArray) -> FloatArray:
    """Return the corners at which two free cells touch diagonally, float64 (n, 2), (column,
    row)."""
    a, b, c, d = _quads(free)
    crossed: FloatArray = np.argwhere((a == d) & (b == c) & (a != b))[:, ::-1].astype(np.float64)
    return crossed


def count_corners(free: BoolArray) -> int:
    """Return the number of vertices that the polygons have, four at a pinch."""
    count = sum(quad.astype(np.int64) for quad in _quads(free))
    return int((count % 2).sum()) + 4 * len(_pinches(free))


def _runs(free: BoolArray) -> Any:
    """Return row, first column and column after the last, of each run of free cells in a row."""
    edges = np.diff(np.pad(free, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, first = np.nonzero(edges == 1)
    _, last = np.nonzero(edges == -1)
    return rows, first, last


def _rooms_of(free: BoolArray, rooms: list[Room]) -> Any:
    """Return the room of each cell, -1 for cells that are not free."""
    from scipy.ndimage import label  # noqa: PLC0415 - as above

    labels, n_labels = label(free)
    of_label = np.full(n_labels + 1, -1, dtype=np.int64)
    for number, (shell, _) in enumerate(rooms):
        # The leftmost of the lowest vertices: its free cell lies to the right, above.
        low = shell[np.lexsort((shell[:, 0], shell[:, 1]))[0]]
        of_label[labels[math.floor(low[1]), math.floor(low[0])]] = number
    return of_label[labels]


class OmplWhole(Rival):
    """A planner of OMPL on the whole map, without a corridor and without a path of the grid.

    `planner`, `budget_s`, `seed`, `simplify`, `parameters`: as in section `planner.ompl` of a
    preset. Raises `OmplError` when OMPL is not installed, or its process does not start;
    `UnsuitableMapError` when paths may cut corners.
    """

    name, package = "ompl-whole", "ompl"

    def __init__(  # noqa: PLR0913 - the settings of a section
        self,
        grid: OccupancyGrid,
        *,
        planner: str = "RRTConnect",
        budget_s: float = 1.0,
        seed: int = 1,
        simplify: bool = True,
        parameters: dict[str, Any] | None = None,
    ) -> None:
        require_ompl()
        refuse_corner_cutting(grid)
        own = OmplSettings(
            planner=planner,
            budget_s=budget_s,
            seed=seed,
            simplify=simplify,
            parameters=parameters or {},
        )
        words = f"{planner}, up to {budget_s:g} s a query, seed {seed}"
        given = "".join(f", {key} {value}" for key, value in own.parameters.items())
        super().__init__(grid, words + (", simplified" if simplify else "") + given)
        self._frame, self._budget_s = grid.frame, own.budget_s
        self._worker = Worker(Setup(grid, None, own, allow_unexplored=False))

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between the centres of two different free cells."""
        self._worker.ensure()
        centres = self._frame.points_of(np.array([start, goal]))
        poses = np.column_stack([centres, np.zeros(2)])
        deadline_s = time.monotonic() + self._budget_s
        nothing = np.empty((0, 2), dtype=np.int64)  # only a corridor is made of cells
        self._worker.send(
            OmplQuery(poses[0], poses[1], nothing, deadline_s, (("whole map", None),))
        )
        reply = self._worker.reply()
        if reply.outcome != "solved":
            return MethodResult(None, gave_up=reply.outcome)
        points = reply.points[:, :2].copy()
        steps = np.diff(points, axis=0)
        length_m = math.fsum(np.hypot(steps[:, 0], steps[:, 1]).tolist())
        first = {"first path": reply.trace[0][0]} if reply.trace else {}
        return MethodResult(None, any_angle=AnyAngleResult(points, length_m), seconds=first)

    def close(self) -> None:
        """End the process of OMPL."""
        self._worker.close()
