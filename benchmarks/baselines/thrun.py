"""Thrun's map: regions cut out of free space by critical lines of its Voronoi diagram."""

import numpy as np
from scipy import ndimage

from benchmarks.baselines.kernels import thrun as kernels
from hybridnav._base.copies import copies_alike
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines.regions import Cell, MethodResult, RegionPlanner
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.route.coarse import ArcSearch

_AROUND = np.ones((3, 3), dtype=np.bool_)
_STEPS = np.argwhere(_AROUND) - 1
_OPPOSITE = -0.5
"""Greatest cosine of the angle between two basis points on two sides, seen from the critical
point."""


@copies_alike
class ThrunMap:
    """Thrun's topological map of a grid, and his planning: regions first, then cells.

    S. Thrun: Learning metric-topological maps for indoor mobile robot navigation, Artificial
    Intelligence 99, 1998. The paper defines: free space by a threshold; its Voronoi diagram, the
    points whose nearest occupied points (basis points) are two or more; critical points, those of
    the diagram that minimise clearance within a neighbourhood `epsilon`; critical lines from each
    to its basis points; regions, the connected parts without these lines; a graph of adjacent
    regions.

    Choices where the paper leaves them open or the grid requires them:

    * Free space is that of the robot's centre, after inflation. Unexplored cells and the outside of
    the map are obstacles.
    * The neighbourhood `epsilon` is measured along the diagram, in steps from cell to cell.
    * The diagram is the integer medial axis (W. H. Hesselink, J. B. T. M. Roerdink: Euclidean
      skeletons of digital image and volume data in linear time by the integer medial axis
      transform, 2008), thinned to lines one cell wide.
    * Only points with basis points on two sides count (120 degrees apart or more; at a narrowing
      it is 180), so the branches into corners and most branches from noise on walls are ignored.
      Among connected points of equal rank, as along a corridor of constant width, the middle one is
      taken, if the diagram leads away from them in two directions along which clearance does not
      fall: the middle of a room and dead ends are no passages.
    * The cells of a critical line go to a region beside it, so that regions partition the free
      cells; they are connected by moves along sides.
    * The coarse plan is the cheapest by the distances from centre to centre of regions (the means
      of their cells) through the middle of the line between them. On two maps at 5 cm, paths by
      straight distances between centres are 3 to 8 % longer than the shortest, with this choice 2
      to 5 %. The path is the shortest inside the regions of the plan, and so no longer than
      Thrun's, which joins plans for three regions at a time.

    `grid`: the map whose free cells are planned on; `epsilon_cells`: steps along the diagram within
    which a critical point has the least clearance, >= 1. Larger values make fewer, larger regions.
    Raises `InvalidValueError` when `epsilon_cells` is less than 1, or scikit-image, of the extra
    `study`, is missing.
    """

    def __init__(self, grid: OccupancyGrid, *, epsilon_cells: int = 10) -> None:
        if epsilon_cells < 1:
            raise InvalidValueError(f"epsilon must be at least 1 cell, got {epsilon_cells}")
        free = np.asarray(grid.classes == CellClass.FREE)
        self.name = "thrun"
        self.critical_points, self.basis_points = critical_points(free, epsilon_cells)
        """int64 (n, 2) and (n, 2, 2): critical points and the two basis points of each, as (row,
        col); basis points are cells that are not free, or lie one cell outside the map."""
        region_of = regions_between(free, self.critical_points, self.basis_points)
        region_of.flags.writeable = False
        self.region_of: IntArray = region_of
        edges, middles = joined_regions(region_of, corner_cutting=grid.corner_cutting)
        self.n_nodes = int(region_of.max()) + 1
        self.n_edges = len(edges)
        halves = centres_of(region_of, self.n_nodes)[edges] - middles[:, None]
        costs = np.hypot(halves[..., 0], halves[..., 1]).sum(axis=1) * grid.resolution_m
        every = np.ones(self.n_nodes, dtype=np.bool_)
        graph = ArcSearch(every, edges, costs, np.zeros(len(edges)))
        self._planner = RegionPlanner(region_of, graph, corner_cutting=grid.corner_cutting)
        self.memory_bytes = self._planner.memory_bytes

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells. See `RegionPlanner`."""
        return self._planner.solve(start, goal)


def critical_points(free: BoolArray, epsilon_cells: int) -> tuple[LongArray, LongArray]:
    """Return the critical points of free space's Voronoi diagram, and two basis points of each.

    `free`: bool (rows, cols), free space; cells outside are not free; `epsilon_cells`: see
    `ThrunMap`. Returns int64 (n, 2) and (n, 2, 2) as (row, col).
    """
    padded = np.pad(free, 1)
    clearance, basis = ndimage.distance_transform_edt(padded, return_indices=True)
    diagram = voronoi_diagram(padded, basis)
    cells = np.argwhere(diagram)
    endpoints, cosine = basis_pairs(cells, basis)
    cells, endpoints = cells[cosine <= _OPPOSITE], endpoints[cosine <= _OPPOSITE]
    rank = clearance[tuple(cells.T)]
    candidates = np.zeros_like(diagram)
    least = cells[rank == least_nearby(cells, rank, diagram.shape, epsilon_cells)]
    candidates[tuple(least.T)] = True
    chosen = middles_of_passages(candidates, np.where(diagram, clearance, 0.0))[tuple(cells.T)]
    return cells[chosen] - 1, endpoints[chosen] - 1


def voronoi_diagram(free: BoolArray, basis: IntArray) -> BoolArray:
    """Return the Voronoi diagram of free space: its integer medial axis, thinned.

    `free`: bool (rows, cols), with a rim that is not free; `basis`: int32 (2, rows, cols), row and
    column of the nearest cell that is not free.
    """
    try:
        from skimage import morphology  # noqa: PLC0415 - an optional extra
    except ImportError as error:
        raise InvalidValueError(
            "Thrun's map needs scikit-image: pip install 'hybridnav[study]'"
        ) from error
    axis = np.zeros_like(free)
    place = np.indices(free.shape)
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1, :], np.s_[1:, :])):
        each, other = (np.s_[:], *here), (np.s_[:], *there)
        first, second = basis[each], basis[other]
        apart = first - second
        # The cell of the two that is nearer to the bisector of both basis points.
        hand = (apart * (first + second - place[each] - place[other])).sum(axis=0)
        meet = (apart**2).sum(axis=0) > 1
        axis[here] |= meet & (hand >= 0)
        axis[there] |= meet & (hand <= 0)
    return np.asarray(
        morphology.skeletonize(axis & free),  # type: ignore[no-untyped-call]
        dtype=np.bool_,
    )


def basis_pairs(cells: LongArray, basis: IntArray) -> tuple[LongArray, FloatArray]:
    """Return the two most opposite basis points of each cell and its neighbours.

    The two nearest obstacles of a cell are seldom equally near on a grid; one of them is the
    nearest of a neighbour. Return int64 (n, 2, 2), and the cosine of the angle between them as seen
    from the cell, float64 (n,).
    """
    around = cells[:, None, :] + _STEPS
    nearest = basis[:, around[..., 0], around[..., 1]].astype(np.int64)
    candidates = np.moveaxis(nearest, 0, -1)
    towards = (candidates - cells[:, None, :]).astype(np.float64)
    towards /= np.hypot(towards[..., 0], towards[..., 1])[..., None]
    cosine = (
        (towards[:, :, None] * towards[:, None]).sum(axis=3).reshape(len(cells), len(_STEPS) ** 2)
    )
    most = cosine.argmin(axis=1)
    first, second = np.divmod(most, len(_STEPS))
    index = np.arange(len(cells))
    pairs = np.stack([candidates[index, first], candidates[index, second]], axis=1)
    return pairs, cosine[index, most]


def least_nearby(
    cells: LongArray, values: FloatArray, shape: tuple[int, ...], steps: int
) -> FloatArray:
    """Return the least value among the cells within some 8-neighbour steps of each cell."""
    index_of = np.full(shape, len(cells))
    index_of[tuple(cells.T)] = np.arange(len(cells))
    around = cells[:, None, :] + _STEPS
    nearby = index_of[around[..., 0], around[..., 1]]
    least = np.append(values, np.inf)
    for _ in range(steps):
        least[:-1] = least[nearby].min(axis=1)
    return least[:-1]


def middles_of_passages(candidates: BoolArray, clearance: FloatArray) -> BoolArray:
    """Return one cell of each 8-connected run of candidates in a passage, the nearest to its mean.

    At least two paths along the diagram lead out of a passage without loss of clearance; a dead
    end, the middle of a room and the foot of a branch have fewer. `clearance` is 0 off the diagram.
    """
    runs, n_runs = ndimage.label(candidates, structure=_AROUND)
    cells = np.argwhere(candidates)
    run = runs[candidates].astype(np.int64) - 1
    diagram = clearance > 0
    n_around = ndimage.convolve(diagram.astype(np.int8), _AROUND.astype(np.int8), mode="constant")
    exits = diagram & ~candidates & (n_around > 2)
    around = cells[:, None, :] + _STEPS
    rows, cols = around[..., 0], around[..., 1]
    leads_out = exits[rows, cols] & (clearance[rows, cols] >= clearance[candidates][:, None])
    keys = (run[:, None] * candidates.size + rows * candidates.shape[1] + cols)[leads_out]
    n_exits = np.bincount(np.unique(keys) // candidates.size, minlength=n_runs)

    size = np.bincount(run, minlength=n_runs)
    mean = np.stack([np.bincount(run, weights=w, minlength=n_runs) for w in cells.T], axis=1)
    squared = ((cells - mean[run] / size[run, None]) ** 2).sum(axis=1)
    order = np.lexsort((squared, run))
    nearest = cells[order[np.searchsorted(run[order], np.arange(n_runs))]]
    chosen = np.zeros_like(candidates)
    chosen[tuple(nearest[n_exits >= 2].T)] = True
    return chosen


def regions_between(free: BoolArray, cells: LongArray, basis: LongArray) -> IntArray:
    """Return the regions between critical lines; the cells of lines go to regions beside them.

    `free`: bool (rows, cols), free space; `cells`, `basis`: critical points and their basis points;
    see `critical_points`. Returns int32 (rows, cols), -1 where not free; numbered in the order of
    their first cells.
    """
    padded = np.pad(free, 1)
    on_line = kernels.draw_lines(padded, cells + 1, basis + 1)[1:-1, 1:-1]
    labels, n_labels = ndimage.label(free & ~on_line)
    labels = labels.astype(np.int32) - 1
    kernels.give_away(labels, on_line)
    # Passages so narrow that lines fill them.
    rest, _ = ndimage.label(free & (labels < 0))
    labels[rest > 0] = rest[rest > 0] - 1 + n_labels
    found, first, dense = np.unique(labels[free], return_index=True, return_inverse=True)
    rank = np.empty(len(found), dtype=np.int32)
    rank[np.argsort(first, kind="stable")] = np.arange(len(found), dtype=np.int32)
    region_of = np.full(free.shape, -1, dtype=np.int32)
    region_of[free] = rank[dense]
    return region_of


def centres_of(region_of: IntArray, n_regions: int) -> FloatArray:
    """Return the mean (row, col) of the cells of each region, float64 (n_regions, 2)."""
    rows, cols = np.nonzero(region_of >= 0)
    label = region_of[rows, cols]
    sums = [np.bincount(label, weights=w, minlength=n_regions) for w in (rows, cols)]
    return np.stack(sums, axis=1) / np.bincount(label, minlength=n_regions)[:, None]


def joined_regions(
    region_of: IntArray, *, corner_cutting: bool = False
) -> tuple[LongArray, FloatArray]:
    """Return the pairs of regions with a legal move from one to the other.

    `region_of`: int32 (rows, cols), the region of each free cell, -1 elsewhere; `corner_cutting`:
    whether diagonals may cut corners. Returns int64 (n_pairs, 2), the lower label first, sorted;
    float64 (n_pairs, 2), the mean of the middles of the moves between the two, (row, col) with
    cells at whole numbers.
    """
    n_regions = int(region_of.max(initial=-1)) + 1
    free = region_of >= 0
    rising, falling = free[:-1, :-1] & free[1:, 1:], free[:-1, 1:] & free[1:, :-1]
    if not corner_cutting:
        rising = falling = rising & falling
    keys, rows, cols = [], [], []
    for tail, head, legal, offset in (
        (np.s_[:, :-1], np.s_[:, 1:], free[:, :-1] & free[:, 1:], (0.0, 0.5)),
        (np.s_[:-1, :], np.s_[1:, :], free[:-1] & free[1:], (0.5, 0.0)),
        (np.s_[:-1, :-1], np.s_[1:, 1:], rising, (0.5, 0.5)),
        (np.s_[:-1, 1:], np.s_[1:, :-1], falling, (0.5, 0.5)),
    ):
        row, col = np.nonzero(legal & (region_of[tail] != region_of[head]))
        endpoints = np.stack([region_of[tail][row, col], region_of[head][row, col]]).astype(
            np.int64
        )
        keys.append(endpoints.min(axis=0) * n_regions + endpoints.max(axis=0))
        rows.append(row + offset[0])
        cols.append(col + offset[1])
    found, pair_of, count = np.unique(np.concatenate(keys), return_inverse=True, return_counts=True)
    sums = [
        np.bincount(pair_of, weights=np.concatenate(w), minlength=len(found)) for w in (rows, cols)
    ]
    pairs = np.stack(np.divmod(found, max(n_regions, 1)), axis=1)
    return pairs, np.stack(sums, axis=1) / count[:, None]
