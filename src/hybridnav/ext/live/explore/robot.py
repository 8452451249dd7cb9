"""A robot that is simulated in a floor plan: what it measures, knows, and where it drives. Public:
`laser_all_round`.
"""

import math
from collections import Counter

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.moves import legal_moves, length_in_cells
from hybridnav._base.trig import atan2, hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import OnlinePyramid, OnlineRooms
from hybridnav.ext.live.explore import goals as plans
from hybridnav.ext.live.mapping import LaserModel, Mapper, SimulatedLaser
from hybridnav.ext.live.mapping.mapper import Area
from hybridnav.ext.live.mapping.sensors import in_sight
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.planning import HybridPlanner
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.search.grid_search import costs_from
from hybridnav.topology import TopologicalMap

_SCAN_EVERY_M = 0.5
_NEAR_M = 0.5
"""Metres that a robot may stand beside the free cells it takes itself to be in."""
_SCANS_AGAIN = 4
"""Scans at a spot from which the robot looks again."""
_BESIDE_CELLS, _SCANS_BESIDE = 10, 8
"""Scans from so near, in sight, that decide about a narrow gap: two looks. From afar, beams graze
its sides, and those that cut a corner may occupy a cell of it again and again."""
_TRIES = 3
"""Visits of an unexplored cell that stays unexplored before it is given up, drives back to the same
cell, and looks at doubtful cells from about the same spot."""


def laser_all_round(*, max_range_m: float = 8.0, noise_m: float = 0.01) -> SimulatedLaser:
    """Return a laser of 360 beams, a degree apart.

    Parameters
    ----------
    max_range_m
        Longer beams have no return.
    noise_m
        Standard deviation of readings.

    Examples
    --------
    >>> from hybridnav.ext.live.explore import laser_all_round
    >>> laser_all_round(max_range_m=4.0).n_beams
    360
    """
    return SimulatedLaser(
        n_beams=360,
        start_rad=-math.pi,
        step_rad=math.pi / 180,
        max_range_m=max_range_m,
        noise_m=noise_m,
    )


class Robot:
    """A robot in a floor plan, and what it knows."""

    def __init__(
        self,
        world: OccupancyGrid,
        start: tuple[float, float] | None,
        sensor: SimulatedLaser,
        seed: int,
    ) -> None:
        self._world = plans.walled(world)
        self._sensor, self._seed = sensor, seed
        self._noise = np.random.default_rng(seed)
        self._mapper = Mapper(
            resolution_m=world.resolution_m,
            laser=_laser_model(sensor, world.resolution_m),
            corner_m=world.frame.origin_m,
            yaw_rad=world.frame.yaw_rad,
        )
        self._tries: Counter[tuple[int, int]] = Counter()
        """Visits of unexplored cells, by their row and column on the lattice."""
        self._given_up: set[tuple[int, int]] = set()
        self._spots: list[tuple[float, float]] = []
        self._returns: Counter[tuple[int, int]] = Counter()
        """Drives back to a cell of the lattice."""
        self._version: OnlinePyramid | None = None
        self._rooms: OnlineRooms | None = None
        self._changed: list[Area] = []
        """Areas of the scans since the last version."""
        self.points: list[tuple[float, float]] = []
        self._track: list[FloatArray] = []
        """Points that the robot has driven through, with the bends between its scans."""
        self.n_goals, self.driven_m = 0, 0.0
        self.seconds = dict.fromkeys(("mapping", "pyramid", "goals", "rooms", "planning"), 0.0)
        point = plans.widest_point(self._world) if start is None else start
        in_reach = np.argwhere(plans.cells_in_reach(self._world, point))
        self._reach_points = self._world.frame.points_of(in_reach)
        self.reach_cells = len(self._reach_points)
        self.pose = (float(point[0]), float(point[1]), 0.0)
        self._scan()

    def _scan(self) -> None:
        began = clock()
        area = self._mapper.add(self._sensor.scan(self._world, self.pose, seed=self._noise))
        if area is not None:
            self._changed.append(area)
        self.points.append(self.pose[:2])
        self.seconds["mapping"] += clock() - began

    def _grid(self, area: Area | None = None) -> OccupancyGrid:
        began = clock()
        grid = self._mapper.to_grid(
            robot_radius_m=self._world.robot_radius_m,
            name=f"{self._world.name}-explored",
            area=area,
        )
        self.seconds["mapping"] += clock() - began
        return grid

    def look(self) -> plans.Goals:
        """Bring map and pyramid up to date, and return the goals."""
        grid = self._grid()
        began = clock()
        grid = plans.rimmed(grid, grid.probability, math.nan)  # frontiers lie at its sides, too
        if self._version is None:
            self._version = OnlinePyramid.of(DualGraphPyramid.build(grid, seed=self._seed))
        elif self._changed:
            low, high = np.array(self._changed).reshape(-1, 2, 2).transpose(1, 0, 2)
            changed = [*low.min(axis=0), *high.max(axis=0)]
            self._version = self._version.update(grid, changed=changed).version
        self._changed.clear()
        self.topology = TopologicalMap(self._version.pyramid)
        self.seconds["pyramid"] += clock() - began
        began = clock()
        self._at = self._cell(grid)
        goals = plans.Goals.of(self.topology, self._at, ~self._goal_cells(grid))
        self.seconds["goals"] += clock() - began
        return goals

    def _cell(self, grid: OccupancyGrid) -> tuple[int, int]:
        """Return the robot's cell, or one near it where noise blocks it or cuts it off: the nearest
        of the largest connected set of free cells that comes near."""
        from scipy import ndimage  # noqa: PLC0415 - half a second

        at = grid.frame.position_of(*self.pose[:2])
        labels, _ = ndimage.label(grid.classes == CellClass.FREE)
        free = np.argwhere(labels)
        if not len(free):
            raise InvalidValueError(
                "no cell round the robot is free: start farther from walls, or with a smaller "
                f"radius than {grid.robot_radius_m:g} m"
            )
        squared = ((free + 0.5 - at) ** 2).sum(axis=1)
        reach = max(_NEAR_M / grid.resolution_m, math.sqrt(squared.min()) + 1)
        near = squared <= reach * reach
        free, squared = free[near], squared[near]
        sizes = np.bincount(labels.ravel())[labels[tuple(free.T)]]
        row, col = free[np.lexsort((squared, -sizes))[0]].tolist()
        return row, col

    def in_its_room(self, goals: plans.Goals) -> BoolArray:
        """Return the goals that lie in the room that the robot is in, bool (n,)."""
        began = clock()
        grid = self.topology.grid
        self._rooms = (
            OnlineRooms.of(grid) if self._rooms is None else self._rooms.update(grid).version
        )
        room_of = self._rooms.number_of
        self.seconds["rooms"] += clock() - began
        return room_of[tuple(goals.cells.T)] == room_of[self._at]

    def visit(self, goals: plans.Goals, chosen: int, *, arrives: bool) -> None:
        """Drive to a goal, or, unless the robot is to arrive there, until it is known."""
        grid = self.topology.grid
        beyond = self._on_lattice(grid, goals.beyond[chosen])
        self.n_goals += 1
        self._tries[beyond] += 1
        if self._tries[beyond] >= _TRIES:
            self._given_up.add(beyond)
        points = self._path_to(goals.cells[chosen])
        if points is None:
            self._given_up.add(beyond)
            return
        self._drive(points, None if arrives else beyond)

    def go_back(self) -> bool:
        """Drive back the way the robot came, to the last part of free space that has goals.

        Noise can close a gap of the map behind a robot that came through it, so it drives a metre
        into that part. Return whether there is such a part.
        """
        from scipy import ndimage  # noqa: PLC0415 - half a second

        if not self._track:
            return False
        grid = self.topology.grid
        parts, n_parts = ndimage.label(grid.classes == CellClass.FREE)
        leads_on = np.zeros(n_parts + 1, dtype=np.bool_)
        leads_on[parts[ndimage.binary_dilation(self._goal_cells(grid))]] = True
        leads_on[[0, parts[self._at]]] = False
        track = np.concatenate(self._track)
        cells = grid.frame.cells_of(track)
        back = np.flatnonzero(leads_on[parts[tuple(cells.T)]])
        if not len(back):
            return False
        last = self._on_lattice(grid, cells[back[-1]])
        self._returns[last] += 1
        if self._returns[last] > _TRIES:
            return False
        steps = hypots(*np.diff(track[::-1], axis=0).T)
        driven = np.concatenate([[0.0], np.cumsum(steps)])[::-1]
        inside = back[driven[back] <= driven[back[-1]] + 2 * _NEAR_M][0]
        self._drive(track[inside:][::-1], None)
        return True

    def _goal_cells(self, grid: OccupancyGrid) -> BoolArray:
        """Return the unexplored cells that were not given up, bool (rows, cols)."""
        cells: BoolArray = grid.classes == CellClass.UNEXPLORED
        for cell in self._given_up:
            cells[self._in_grid(grid, cell)] = False
        return cells

    def look_again(self, within_m: float = math.inf) -> bool:
        """Drive to the nearest spot from which a door may turn out to be open, and scan there.

        Return whether there is one within a distance that the robot has not looked from enough.
        """
        began = clock()
        grid = self.topology.grid
        seldom = (spot for spot in plans.narrow_spots(grid, self._at) if self._is_seldom_seen(spot))
        spots = np.array([*plans.doubtful_spots(grid, self._at), *seldom], np.int64).reshape(-1, 2)
        looked = np.reshape(self._spots, (-1, 1, 2))
        apart_m = hypots(*np.moveaxis(grid.frame.points_of(spots) - looked, -1, 0))
        spots = spots[(apart_m < _NEAR_M).sum(axis=0) < _TRIES]
        if len(spots):
            flat = spots @ np.array([grid.shape[1], 1])
            moves = legal_moves(grid.classes == CellClass.FREE, grid.corner_cutting)
            costs = costs_from(moves, self._at, flat)[flat]
            spots, costs = spots[costs >= 0], costs[costs >= 0]
            within = length_in_cells(costs) * grid.resolution_m < within_m
            spots, costs = spots[within], costs[within]
        self.seconds["goals"] += clock() - began
        if not len(spots):
            return False
        spot = spots[costs.argmin()]
        x_m, y_m = grid.frame.points_of(spot).tolist()
        self._spots.append((x_m, y_m))
        path = self._path_to(spot)
        if path is not None:
            self._drive(path, None)
            for _ in range(_SCANS_AGAIN):
                self._scan()
        return True

    def _is_seldom_seen(self, spot: LongArray) -> bool:
        """Return whether too few scans were taken near a cell, in its sight."""
        grid, centre = self.topology.grid, spot.astype(np.float64) + 0.5
        at = grid.frame.positions_of(np.array(self.points))
        at = at[hypots(*(at - centre).T) < _BESIDE_CELLS]
        return int(in_sight(grid, centre, at).sum()) < _SCANS_BESIDE

    def _path_to(self, cell: LongArray) -> FloatArray | None:
        began = clock()
        from_m, to_m = self.topology.grid.frame.points_of(np.array([self._at, cell]))
        result = HybridPlanner(self.topology, preset="paper").plan(from_m, to_m)
        self.seconds["planning"] += clock() - began
        return None if result.path is None else result.path.points

    def _drive(self, points: FloatArray, beyond: tuple[int, int] | None) -> None:
        """Drive along points, with scans on the way, until a cell is known."""
        points = np.concatenate([[self.pose[:2]], points])
        self._track.append(points)
        steps = hypots(*np.diff(points, axis=0).T)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        n_scans = max(1, math.ceil(along[-1] / _SCAN_EVERY_M))
        x_m, y_m = self.pose[:2]
        for at in np.linspace(0.0, along[-1], n_scans + 1)[1:].tolist():
            last = x_m, y_m
            x_m, y_m = (float(np.interp(at, along, column)) for column in points.T)
            self.pose = x_m, y_m, atan2(y_m - last[1], x_m - last[0])
            self._scan()
            if beyond and self._is_known(beyond):
                self._track[-1] = np.concatenate([points[along < at], [self.pose[:2]]])
                self.driven_m += at
                return
        self.driven_m += float(along[-1])

    def _is_known(self, cell: tuple[int, int]) -> bool:
        far_m = self._world.robot_radius_m + 2 * self._world.resolution_m
        x_m, y_m = self._world.frame.points_of(np.array(cell)).tolist()
        grid = self._grid((x_m - far_m, y_m - far_m, x_m + far_m, y_m + far_m))
        row, col = self._in_grid(grid, cell)
        inside = 0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]
        return inside and bool(grid.classes[row, col] != CellClass.UNEXPLORED)

    def _on_lattice(self, grid: OccupancyGrid, cell: object) -> tuple[int, int]:
        """Return the row and column of a cell on the lattice, which never moves."""
        rows, cols = self._offset(grid)
        row, col = np.asarray(cell).tolist()
        return row + rows, col + cols

    def _in_grid(self, grid: OccupancyGrid, cell: tuple[int, int]) -> tuple[int, int]:
        rows, cols = self._offset(grid)
        return cell[0] - rows, cell[1] - cols

    def _offset(self, grid: OccupancyGrid) -> tuple[int, int]:
        row, col = self._world.frame.position_of(*grid.frame.origin_m)
        return round(row), round(col)

    def known_cells(self) -> int:
        """Return the free cells of the plan in the robot's reach that its map knows."""
        grid = self.topology.grid
        rows, cols = grid.frame.cells_of(self._reach_points).T
        inside = (rows >= 0) & (cols >= 0) & (rows < grid.shape[0]) & (cols < grid.shape[1])
        classes = grid.measured[rows[inside], cols[inside]]
        return int(np.count_nonzero(classes != CellClass.UNEXPLORED))

    @property
    def n_looks_again(self) -> int:
        """Spots from which the robot looked again at doubtful cells and narrow gaps."""
        return len(self._spots)

    @property
    def n_given_up(self) -> int:
        """Unexplored cells that were given up."""
        return len(self._given_up)


def _laser_model(sensor: SimulatedLaser, resolution_m: float) -> LaserModel:
    """Return the inverse model of a laser whose noise and poses are known.

    Nearly all beams occupy a cell behind the surface that they meet, and free none. A quarter of a
    cell at most, for beams that cut a corner would occupy cells behind it.
    """
    far_m, blurred_m = sensor.max_range_m, 3 * sensor.noise_m
    return LaserModel(
        max_range_m=far_m,
        clear_range_m=far_m,
        tolerance_m=min(blurred_m, resolution_m),
        depth_m=min(max(blurred_m, 0.1 * resolution_m), 0.25 * resolution_m),
        hits_win=False,
    )
