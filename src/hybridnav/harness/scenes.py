"""What a run asks: maps with their costs, and pairs of start and goal."""

import hashlib
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from scipy import ndimage

from hybridnav._base.rows import unique_rows
from hybridnav._base.trig import hypots
from hybridnav._base.typing import BoolArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError, MapWarning
from hybridnav.maps import DEFAULT_MAX_CELLS, CellClass, OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.costs.files import read_costs
from hybridnav.maps.files import load_map
from hybridnav.maps.files.movingai import Scenario

GivenCosts = tuple[str, ...] | CostLayer
"""Texts as in `hybridnav plan --costs`, or a layer; an empty tuple for lengths."""


_DIGITS = 12
"""Digits of the hash of a layer in texts."""


@dataclass(frozen=True)
class MapSpec:
    """A map file and its reading."""

    path: str
    robot_radius_m: float | None
    """None for that of a model."""
    corner_cutting: bool = False
    max_cells: int = DEFAULT_MAX_CELLS
    costs: GivenCosts = ()


@dataclass(frozen=True, eq=False)
class Scene:
    """A map on which cells that the costs close are occupied, so that no method enters them, and
    the factors of its cells."""

    grid: OccupancyGrid
    costs: CostLayer | None
    """Factors, without closed cells; None for lengths."""

    @property
    def digest(self) -> str:
        """The SHA-256 of all that planners see: `map_digest`, and with costs also the factors."""
        of_map = map_digest(self.grid)
        if self.costs is None:
            return of_map
        return hashlib.sha256(of_map.encode() + self.costs.units.tobytes()).hexdigest()


@lru_cache(maxsize=2)
def read_map(spec: MapSpec) -> OccupancyGrid:
    """Return the grid of a map file, without costs; the last two are kept."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MapWarning)
        grid = load_map(spec.path, robot_radius_m=spec.robot_radius_m, max_cells=spec.max_cells)
    return replace(grid, corner_cutting=True) if spec.corner_cutting else grid


@lru_cache(maxsize=2)
def read_scene(spec: MapSpec) -> Scene:
    """Return the map of a file with its costs; the last two are kept.

    Raises `InvalidValueError` when the costs have another form, or are those of another map. Raises
    `MapError` when a file cannot be read.
    """
    grid = read_map(replace(spec, costs=()))
    given = spec.costs
    layer = given if isinstance(given, CostLayer) else read_costs(given, grid)
    if layer is None:
        return Scene(grid, None)
    layer.check_fits(grid)
    layer = layer.inflated(grid)
    if layer.keepout is None:
        return Scene(grid, layer)
    classes = np.where(layer.keepout, np.uint8(CellClass.OCCUPIED), grid.classes)
    open_grid = OccupancyGrid.restored(**vars(grid) | {"classes": classes})
    return Scene(open_grid, CostLayer(layer.factors, source=layer.source))


def clear_scenes() -> None:
    """Forget what was read, because files may have changed."""
    read_map.cache_clear()
    read_scene.cache_clear()


def text_of_costs(given: GivenCosts) -> str:
    """Return costs as one text, empty for lengths.

    That of a layer ends in a hash of its factors and closed cells: two arrays have one source.
    """
    if not isinstance(given, CostLayer):
        return " ".join(given)
    return f"{_text_of_source(given.source)} {given.digest[:_DIGITS]}"


def _text_of_source(source: dict[str, Any]) -> str:
    parts: Sequence[dict[str, Any]] = source.get("of", ())
    return "+".join(map(_text_of_source, parts)) if parts else str(source["kind"])


def map_digest(grid: OccupancyGrid) -> str:
    """Return the SHA-256 of all that planners see of a map: its size, resolution, classes and
    moves."""
    digest = hashlib.sha256(repr((grid.shape, grid.resolution_m, grid.corner_cutting)).encode())
    digest.update(np.ascontiguousarray(grid.classes).tobytes())
    return digest.hexdigest()


# Pairs of start and goal: sampled, on a lattice, or from a scenario file.

Cell = tuple[int, int]
Kind = Literal["sampled", "across", "lattice", "scenario", "recorded"]

SAMPLER_VERSION = 1
"""Raised when `sample_pairs` answers otherwise for the same seed; part of every record's run."""

STRATA = 5
LEAST_DISTANCE_M = 1.0
MAX_PAIRS = 10_000_000
MAX_SAMPLED = 1_000_000
"""Sampling draws forty times as many."""


@dataclass(frozen=True, slots=True)
class Pair:
    """One query, and its known optimum if there is one."""

    start: Cell
    goal: Cell
    kind: Kind = "sampled"
    stated_optimum_cells: float | None = None
    """Optimum that a scenario file states, in cells."""
    seed: int | None = None
    """Seed of the sampler that drew the pair."""

    @property
    def key(self) -> str:
        """Name of the pair in ids of records."""
        (row, col), (goal_row, goal_col) = self.start, self.goal
        return f"{self.kind}:{row},{col}>{goal_row},{goal_col}"

    @property
    def fields(self) -> dict[str, Any]:
        """What each record of the pair holds."""
        return {"kind": self.kind, "start": list(self.start), "goal": list(self.goal)}


def components(grid: OccupancyGrid) -> tuple[IntArray, LongArray]:
    """Return the 4-connected components of free cells: an int32 label for each cell, 0 for none,
    and their sizes.

    Without corner cutting these are what paths can join.
    """
    labels, count = ndimage.label(grid.classes == CellClass.FREE)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:].astype(np.int64)
    return labels.astype(np.int32), sizes


def sample_pairs(
    grid: OccupancyGrid, count: int, *, seed: int, least_distance_m: float = LEAST_DISTANCE_M
) -> list[Pair]:
    """Draw pairs of free cells, stratified by distance.

    `grid`: the map, inflated; `count`: pairs in its largest component of free cells, equally many
    in each of five classes of distance. The classes are equally wide between the least distance and
    the 95th percentile of the distances of random pairs; the last one is open. For every twenty
    pairs one more joins two components, if there are two. `seed`: seed of the generator (PCG64);
    `least_distance_m`: straight-line distance below which no pair of the largest component lies;
    halved as long as the component has no such pair. Result: `count` of kind "sampled", all
    different, fewer on a map of a few cells; then those of kind "across". Raises
    `InvalidValueError` when the count or the seed is out of range.
    """
    if not 0 < count <= MAX_SAMPLED:
        raise InvalidValueError(f"the number of pairs must be from 1 to {MAX_SAMPLED}, got {count}")
    if seed < 0:
        raise InvalidValueError(f"the seed must be a whole number >= 0, got {seed}")
    labels, sizes = components(grid)
    if sizes.size == 0:
        return []
    rng = np.random.default_rng(seed)
    largest = int(sizes.argmax())
    cells = np.argwhere(labels == largest + 1)
    pairs = []
    if len(cells) > 1:
        chosen = _stratified(cells, count, least_distance_m / grid.resolution_m, rng)
        pairs = [_pair(cells[i], cells[j], "sampled") for i, j in chosen]
    if sizes.size > 1:
        pairs += _across(labels, largest + 1, -(-count // 20), rng)
    return [replace(pair, seed=seed) for pair in pairs]


def _stratified(
    cells: LongArray, count: int, least_cells: float, rng: np.random.Generator
) -> LongArray:
    """Return indices (count, 2) of cells, equally many in each class of distance if there are
    enough."""
    draws = rng.integers(len(cells), size=(max(40 * count, 2000), 2))
    apart = hypots(*(cells[draws[:, 0]] - cells[draws[:, 1]]).T)
    least = least_cells
    while not (apart >= max(least, 1)).any():
        if least < 1:
            draws = np.array([[0, len(cells) - 1]])
            apart = hypots(*(cells[draws[:, 0]] - cells[draws[:, 1]]).T)
            break
        least /= 2
    allowed = np.flatnonzero(apart >= max(least, 1))
    edges = np.linspace(apart[allowed].min(), np.quantile(apart[allowed], 0.95), STRATA + 1)[1:-1]
    stratum = np.searchsorted(edges, apart[allowed], side="right")
    # The n-th draw of every stratum before the (n + 1)-th of any.
    order = np.argsort(stratum, kind="stable")
    turn = np.empty(len(allowed), dtype=np.int64)
    starts = np.searchsorted(stratum[order], np.arange(STRATA))
    turn[order] = np.arange(len(allowed)) - starts[stratum[order]]
    best = draws[allowed[np.lexsort((stratum, turn))]]
    first = np.sort(unique_rows(best).first)[:count]
    return best[first]


def _across(labels: IntArray, largest: int, count: int, rng: np.random.Generator) -> list[Pair]:
    """Return pairs from the largest component to others, which no path joins."""
    inside = np.argwhere(labels == largest)
    outside = np.argwhere((labels > 0) & (labels != largest))
    starts = inside[rng.integers(len(inside), size=count)]
    goals = outside[rng.integers(len(outside), size=count)]
    pairs = (_pair(start, goal, "across") for start, goal in zip(starts, goals, strict=True))
    return list(dict.fromkeys(pairs))


def lattice_pairs(grid: OccupancyGrid, step_m: float) -> list[Pair]:
    """Return all pairs, each in one direction, of the free cells on a lattice.

    `grid`: the map, inflated; `step_m`: distance of neighbouring lattice points in metres, rounded
    to whole cells. Raises `InvalidValueError` when the step is not positive or there would be more
    than ten million pairs.
    """
    if not 0 < step_m < np.inf:
        raise InvalidValueError(f"the step must be a positive length in metres, got {step_m}")
    step = max(1, round(step_m / grid.resolution_m))
    on_lattice: BoolArray = np.zeros(grid.shape, dtype=np.bool_)
    on_lattice[step // 2 :: step, step // 2 :: step] = True
    cells = np.argwhere(on_lattice & (grid.classes == CellClass.FREE))
    n_pairs = len(cells) * (len(cells) - 1) // 2
    if n_pairs > MAX_PAIRS:
        raise InvalidValueError(
            f"{n_pairs} pairs of lattice points on map {grid.name}, at most {MAX_PAIRS}: "
            f"take a larger step than {step_m:g} m"
        )
    first, second = np.triu_indices(len(cells), 1)
    return [_pair(cells[i], cells[j], "lattice") for i, j in zip(first, second, strict=True)]


def scenario_pairs(grid: OccupancyGrid, scenarios: Iterable[Scenario]) -> list[Pair]:
    """Return the pairs of a MovingAI scenario file, with their optima as stated there.

    The stated optima do not hold on an inflated map, or if diagonals may cut corners: there pairs
    have none. Pairs with an endpoint that is not free are left out.

    Raises `InvalidValueError` when a scenario was made for a map of another size.
    """
    pairs = []
    as_stated = not grid.corner_cutting and np.array_equal(grid.classes, grid.measured)
    for scenario in scenarios:
        if (scenario.rows, scenario.cols) != grid.shape:
            raise InvalidValueError(
                f"the scenarios are for a map of {scenario.rows} x {scenario.cols} cells, "
                f"{grid.name} has {grid.shape[0]} x {grid.shape[1]}"
            )
        endpoints = scenario.start, scenario.goal
        if all(grid.classes[end] == CellClass.FREE for end in endpoints):
            stated = scenario.optimum_cells if as_stated else None
            pairs.append(Pair(*endpoints, "scenario", stated))
    return list(dict.fromkeys(pairs))


def evenly_spread(pairs: list[Pair], count: int) -> list[Pair]:
    """Return some pairs, spread evenly over a list; all if the list is shorter."""
    count = min(count, len(pairs))
    return [pairs[at * len(pairs) // count] for at in range(count)]


def _pair(start: LongArray, goal: LongArray, kind: Kind) -> Pair:
    (row, col), (goal_row, goal_col) = start.tolist(), goal.tolist()
    return Pair((row, col), (goal_row, goal_col), kind)
