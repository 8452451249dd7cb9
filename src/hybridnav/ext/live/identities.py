"""What of an older version is where in a newer one: its cells, and its places. Public: `Flips`,
`CarriedCosts`, `carry_costs` and `NO_PLACE`.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.costs import CostLayer
from hybridnav.rooms.carrying import Heirs, Overlap

NO_PLACE = -1
"""Number that stands for no place: that of occupied cells and of all outside the map."""
_ALIGNED = 1e-6
"""Part of a cell by which the origins of two grids may lie beside whole cells."""


def shift_of(before: OccupancyGrid, after: OccupancyGrid, *, otherwise: str) -> tuple[int, int]:
    """Return the rows and columns by which cell (0, 0) of a newer grid lies lower.

    `before`, `after`: the grids; the newer one has to cover the older one, cell on cell;
    `otherwise`: what a caller can do when the cells have another size, for the message. Raises
    `InvalidValueError` when the newer grid has cells of another size or at other points, or does
    not cover the older one.
    """
    old, new = before.frame, after.frame
    if (old.resolution_m, old.yaw_rad) != (new.resolution_m, new.yaw_rad):
        raise InvalidValueError(
            f"the grid has cells of {new.resolution_m:g} m with yaw {new.yaw_rad:g}, expected "
            f"{old.resolution_m:g} m and {old.yaw_rad:g}: {otherwise}"
        )
    exact = [-value for value in old.position_of(*new.origin_m)]
    rows, cols = map(round, exact)
    if max(abs(exact[0] - rows), abs(exact[1] - cols)) > _ALIGNED:
        raise InvalidValueError(
            f"the origin of the grid lies {exact[0]:g} rows and {exact[1]:g} columns lower, "
            "expected whole numbers: keep the cells where they are"
        )
    if (
        min(rows, cols) < 0
        or rows + before.shape[0] > after.shape[0]
        or cols + before.shape[1] > after.shape[1]
    ):
        raise InvalidValueError(
            f"the grid of {after.shape} cells, {rows} rows and {cols} columns lower, does not "
            f"cover the one before, of {before.shape} cells: mark lost cells as unexplored"
        )
    return rows, cols


def placed(
    array: AnyArray, shape: tuple[int, int], at: tuple[int, int], nothing: float
) -> AnyArray:
    """Return an array of an older grid on the cells of a newer one.

    `array`: shape of the older grid; `shape`: that of the newer one; `at`: as `shift_of` returns
    it; `nothing`: value of the cells that are new.
    """
    if array.shape == shape:
        return array
    whole = np.full(shape, nothing, array.dtype)
    whole[at[0] : at[0] + array.shape[0], at[1] : at[1] + array.shape[1]] = array
    return whole


# How stable the numbers of places and rooms are over an update.


class Flips(NamedTuple):
    """How stable the numbers of places or rooms are over one update.

    A cell flips if it stays free and changes its number, although more than half of the cells of
    its old place stay free. A place is untouched if none of its cells changes class; it flips if
    its number is not on more than half of its cells any more. The same holds for rooms.

    An untouched place that flips has a changed cell beside it, if it is not among `apart`, or else
    a changed place beside it, if it is not among `far`.

    Examples
    --------
    >>> from hybridnav.ext.live import replay
    >>> grid = hn.OccupancyGrid(np.zeros((8, 8)), hn.Frame(0.25), robot_radius_m=0)
    >>> first, second = replay([grid, grid])
    >>> second.place_flips.cells, second.place_flips.free
    (0, 64)
    """

    cells: int
    """Cells that flip."""
    merged: int
    """Those of them whose place is no more, and lies for the most part in one other place."""
    cut_off: int
    """Those whose place still has its number, elsewhere."""
    free: int
    """Cells that stay free."""
    untouched: frozenset[int]
    """Numbers of untouched places."""
    flipped: frozenset[int]
    """Those of them that flip."""
    apart: frozenset[int]
    """Untouched places with no changed cell beside one of their cells, at a side or a corner."""
    far: frozenset[int]
    """Those of them that have no boundary with a place that is touched."""


class Numbered(NamedTuple):
    """Cells with the numbers of their places or rooms."""

    grid: OccupancyGrid
    """Their map."""
    classes: ByteArray
    """uint8 (rows, cols), `CellClass`, of the robot for places, measured for rooms."""
    number_of: IntArray
    """int32 (rows, cols), -1 for none."""


def flips_between(before: Numbered, after: Numbered) -> Flips:
    """Compare the numbers of cells of two versions; see `Flips`."""
    shift = shift_of(before.grid, after.grid, otherwise="begin a new replay")
    shape = after.grid.shape
    number_of = placed(before.number_of, shape, shift, -1)
    classes = placed(before.classes, shape, shift, CellClass.OCCUPIED)
    old = np.where(classes == CellClass.FREE, number_of, np.int32(-1))
    now, changed = after.number_of, classes != after.classes
    inside, stays = old >= 0, (classes == CellClass.FREE) & ~changed
    n_numbers = int(max(number_of.max(initial=0), now.max(initial=0))) + 1
    areas = np.bincount(old[inside], minlength=n_numbers)
    kept = np.bincount(old[inside & stays], minlength=n_numbers)
    same = np.bincount(old[inside & (old == now)], minlength=n_numbers)
    moved = np.flatnonzero(inside & stays & (old != now) & (2 * kept > areas)[old])
    merged, cut_off = _causes(old.ravel()[moved], now.ravel()[moved], areas, now)
    untouched = (areas > 0) & (kept == areas)
    apart = untouched & ~_meets(old, _widened(changed), n_numbers)
    touched = _meets(number_of, changed, n_numbers)
    far = apart & ~_beside(number_of, touched)
    return Flips(
        len(moved),
        merged,
        cut_off,
        int(np.count_nonzero(stays)),
        _numbers(untouched),
        _numbers(untouched & (2 * same <= areas)),
        _numbers(apart),
        _numbers(far),
    )


def _causes(old: IntArray, new: IntArray, areas: LongArray, now: IntArray) -> tuple[int, int]:
    """Return how many cells flip as their places merge, and as they are cut off."""
    is_now = np.zeros(len(areas), np.bool_)
    is_now[now[now >= 0]] = True
    pairs, _, _, cells = unique_rows(np.stack([old, new], axis=1))
    is_cut = is_now[pairs[:, 0]]
    is_merged = ~is_cut & (2 * cells > areas[pairs[:, 0]])
    return int(cells[is_merged].sum()), int(cells[is_cut].sum())


def _meets(number_of: IntArray, cells: BoolArray, n_numbers: int) -> BoolArray:
    """Return which numbers some cells have, bool (n_numbers,)."""
    meets = np.zeros(n_numbers, np.bool_)
    meets[number_of[cells & (number_of >= 0)]] = True
    return meets


def _widened(cells: BoolArray) -> BoolArray:
    """Return cells and those beside them, at a side or a corner."""
    from scipy import ndimage  # noqa: PLC0415 - updates need none

    return np.asarray(ndimage.binary_dilation(cells, np.ones((3, 3), np.bool_)), dtype=np.bool_)


def _beside(number_of: IntArray, numbers: BoolArray) -> BoolArray:
    beside = np.zeros(len(numbers), np.bool_)
    pairs = (number_of[1:], number_of[:-1]), (number_of[:, 1:], number_of[:, :-1])
    for one, other in pairs:
        apart = (one != other) & (one >= 0) & (other >= 0)
        for some, others in ((one[apart], other[apart]), (other[apart], one[apart])):
            beside[some[numbers[others]]] = True
    return beside


def _numbers(of: BoolArray) -> frozenset[int]:
    return frozenset(np.flatnonzero(of).tolist())


# Layers of costs that follow a map: what stays on its cells, and what is outdated.


class CarriedCosts(NamedTuple):
    """A layer of costs on a newer map, and where it could not be kept.

    Examples
    --------
    >>> from hybridnav.ext.live import carry_costs
    >>> before = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.0]]), robot_radius_m=0)
    >>> after = hn.OccupancyGrid(np.array([[0.0, 0.0, 1.0]]), robot_radius_m=0)
    >>> layer = hn.CostLayer.clearance(before) | hn.CostLayer(np.array([[2.0, 1.0, 1.0]]))
    >>> carry_costs(layer, before, after).outdated
    array([[False,  True,  True]])
    """

    layer: CostLayer
    """The layer."""
    outdated: BoolArray
    """bool (rows, cols), cells whose factor depends on obstacles that have changed, but could not
    be computed anew. They have the factors that they had, new ones 1."""


def carry_costs(layer: CostLayer, before: OccupancyGrid, after: OccupancyGrid) -> CarriedCosts:
    """Carry a layer of costs over to a map that has changed or grown.

    Factors and closed cells stay on their cells, whatever became of these; new cells have the
    factor 1 and are open. A layer of clearance is made anew from its settings. Where it was joined
    with others, its part is not known any more. Cells within its inflation radius of an obstacle
    that came or went are returned as outdated, and new ones within that of any obstacle.

    Parameters
    ----------
    layer
        A layer of the older map.
    before, after
        The maps; the newer one has to cover the older one, cell on cell.

    Raises
    ------
    InvalidValueError
        When the layer is not one of the older map, or the newer map does not cover that.

    Examples
    --------
    >>> from hybridnav.ext.live import carry_costs
    >>> before = hn.OccupancyGrid(np.zeros((1, 2)), robot_radius_m=0)
    >>> after = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
    >>> carried = carry_costs(hn.CostLayer(np.array([[2.0, 4.0]])), before, after)
    >>> carried.layer.factors, carried.outdated.any()
    (array([[2., 4., 1.]], dtype=float32), np.False_)
    """
    checked_type("layer", layer, CostLayer)
    checked_type("before", before, OccupancyGrid)
    checked_type("after", after, OccupancyGrid)
    layer.check_fits(before)
    shift = shift_of(before, after, otherwise="make the costs for the new map")
    nothing = np.zeros(after.shape, np.bool_)
    if layer.source["kind"] == "clearance":
        return CarriedCosts(CostLayer.clearance(after, **_settings(layer.source)), nothing)
    factors = placed(layer.factors, after.shape, shift, 1)
    closed, keepout = (
        None if cells is None else placed(cells, after.shape, shift, 0)
        for cells in (layer.closed, layer.keepout)
    )
    reach_m = max((part["inflation_radius_m"] for part in _clearances(layer.source)), default=None)
    if reach_m is None:
        outdated = nothing
    else:
        is_occupied = after.measured == CellClass.OCCUPIED
        was = placed(before.measured == CellClass.OCCUPIED, after.shape, shift, 0)
        new = placed(np.zeros(before.shape, np.bool_), after.shape, shift, 1)
        cells = math.ceil(reach_m / after.resolution_m)
        outdated = within_radius(was != is_occupied, radius_cells=cells)
        outdated |= new & within_radius(is_occupied, radius_cells=cells)
    return CarriedCosts(CostLayer(factors, closed, layer.source, keepout), outdated)


def _settings(source: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in source.items() if name != "kind"}


def _clearances(source: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the sources of the layers of clearance that a layer was joined from."""
    if source["kind"] == "clearance":
        yield source
    for part in source.get("of", ()):
        yield from _clearances(part)


# Places of a new version that are those of the old one.


class Events(NamedTuple):
    """What became of places; see `Update`."""

    born: tuple[int, ...]
    """New ones."""
    died: tuple[int, ...]
    """Old ones that are no more."""
    merged: dict[int, int]
    """Old ones and the heirs that bear another number."""
    split: dict[int, tuple[int, ...]]
    """Old ones, and several new ones that mostly consist of them."""
    changed: tuple[int, ...]
    """Old ones that bear their number still."""


def events_of(
    overlaps: list[Overlap], heirs: Heirs, areas_now: Mapping[int, int], first: int
) -> Events:
    """Return what became of places whose final numbers are known.

    `overlaps`: what old places and new ones have in common; `heirs`: the heirs, with the final
    numbers of all new places; `areas_now`: the cells of each new place; `first`: the least number
    that no old place has.
    """
    kept = set(heirs.name.values())
    old = sorted({place for place, _, _ in overlaps})
    died = [place for place in old if place not in kept]
    split: dict[int, list[int]] = {}
    for place, new, cells in overlaps:
        if new != NO_PLACE and 2 * cells > areas_now[new]:
            split.setdefault(place, []).append(heirs.name[new])
    return Events(
        tuple(sorted(place for place in kept if place >= first)),
        tuple(died),
        {place: heirs.name[heirs.of[place]] for place in died if place in heirs.of},
        {place: tuple(sorted(parts)) for place, parts in split.items() if len(parts) > 1},
        tuple(place for place in old if place in kept),
    )
