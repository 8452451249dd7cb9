"""Whether rooms stay the same when a floor is mapped again: turned, with specks, coarser, later."""

import math
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import ndimage

import hybridnav as hn
from benchmarks.tables import print_head, print_row
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, IntArray
from hybridnav.rooms import CarriedNames, carry_names
from hybridnav.rooms.find import judged_rooms
from hybridnav.rooms.listing import kinds_of
from hybridnav.rooms.merging import Forest
from research._rooms_buildings import Building

_WHOLE = 0.8
"""Share of a true corridor in one found room from which on it counts as whole."""


class View(NamedTuple):
    """A map as it is seen again."""

    cells: AnyArray
    """float32 (rows, cols), 0 for free cells, 1 for occupied ones, 0.5 for others."""
    side: int
    """Side of a cell, in cells of the map."""
    back: Callable[[IntArray], IntArray]
    """Brings its labels back to the cells of the map."""


def _turned(cells: AnyArray, degrees: float) -> View:
    """Turn a map about its middle; each cell takes the nearest one."""
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    side = math.ceil(math.hypot(*cells.shape)) + 2

    def at(shape: tuple[int, ...], of: tuple[int, ...], sign: float) -> tuple[IntArray, ...]:
        y, x = np.indices(shape) - (np.array(shape) - 1).reshape(2, 1, 1) / 2
        there = cosine * y + sign * sine * x, cosine * x - sign * sine * y
        return tuple(
            np.rint(line + (n - 1) / 2).astype(int) for line, n in zip(there, of, strict=True)
        )

    rows, cols = at((side, side), cells.shape, 1.0)
    inside = (rows >= 0) & (rows < cells.shape[0]) & (cols >= 0) & (cols < cells.shape[1])
    seen = np.full((side, side), 0.5, np.float32)
    seen[inside] = cells[rows[inside], cols[inside]]
    return View(seen, 1, lambda found: found[at(cells.shape, found.shape, -1.0)])


def _specks(cells: AnyArray) -> View:
    """Make 1 % of the free cells occupied, and of the occupied ones free."""
    hit = (np.random.default_rng(1).random(cells.shape) < 0.01) & (cells != 0.5)
    return View(np.where(hit, 1 - cells, cells), 1, lambda found: found)


def _coarse(cells: AnyArray) -> View:
    """Join four cells: occupied if one is, else free if two are."""
    rows, cols = cells.shape
    four = np.pad(cells, ((0, rows % 2), (0, cols % 2)), constant_values=0.5)
    four = four.reshape(len(four) // 2, 2, -1, 2).swapaxes(1, 2).reshape(len(four) // 2, -1, 4)
    free = np.where(np.count_nonzero(four == 0, axis=2) >= 2, 0.0, 0.5)
    seen = np.where((four == 1).any(axis=2), 1.0, free).astype(np.float32)
    return View(seen, 2, lambda found: found.repeat(2, 0).repeat(2, 1)[:rows, :cols])


VIEWS: dict[str, tuple[float, Callable[[AnyArray], View]]] = {
    "mirrored": (0.95, lambda cells: View(cells[:, ::-1], 1, lambda found: found[:, ::-1])),
    "turned by 90": (0.95, lambda cells: View(cells.T, 1, lambda found: found.T)),
    "padded": (
        0.95,
        lambda cells: View(
            np.pad(cells, 11, constant_values=0.5), 1, lambda found: found[11:-11, 11:-11]
        ),
    ),
    "by 10": (0.8, lambda cells: _turned(cells, 10.0)),
    "by 37": (0.8, lambda cells: _turned(cells, 37.0)),
    "1 % of specks": (0.8, _specks),
    "half resolution": (0.8, _coarse),
}
"""Views, and the intersection over union with itself that a room has to keep in each."""


def kept(found: IntArray, again: IntArray, free: BoolArray, least: float) -> BoolArray:
    """Whether each room of a map is found again, bool (n_rooms,)."""
    one, other = found[free], again[free] + 1
    rooms, n_others = int(one.max(initial=-1)) + 1, int(other.max(initial=0)) + 1
    both = np.zeros((rooms, n_others))
    np.add.at(both, (one[one >= 0], other[one >= 0]), 1)
    union = both.sum(axis=1)[:, None] + np.bincount(other, minlength=n_others) - both
    shares: FloatArray = np.where(np.arange(n_others) > 0, both / union, 0.0)
    return shares.max(axis=1) >= least


def whole_corridors(building: Building, label_of: IntArray) -> list[bool]:
    """Whether most of each corridor that people drew lies in one found room."""
    kinds = kinds_of(building.true, building.free, building.grid.resolution_m)
    found = []
    for number, kind in enumerate(kinds):
        if kind is not None and kind.name == "corridor":
            labels = label_of[(building.true == number) & building.compared]
            most = np.bincount(labels[labels >= 0], minlength=1).max()
            found.append(bool(most >= _WHOLE * len(labels)))
    return found


def views_table(buildings: list[Building], judge_of: Callable[[str], Forest]) -> None:
    """Print which share of the rooms, and of true corridors, each building keeps."""
    print("\n## Rooms that are found again\n")
    print_head("building", *VIEWS, "corridors whole")
    shares: dict[str, list[bool]] = {name: [] for name in VIEWS}
    corridors: list[bool] = []
    for building in buildings:
        forest, grid = judge_of(building.site), building.grid
        cells = np.where(grid.measured == 2, 0.5, grid.measured == 0).astype(np.float32)
        found = judged_rooms(grid, forest, 1.0)
        row = []
        for name, (least, view) in VIEWS.items():
            seen = view(cells)
            frame = hn.Frame(seen.side * grid.resolution_m)
            again = hn.OccupancyGrid(np.ascontiguousarray(seen.cells), frame, robot_radius_m=0)
            back = seen.back(judged_rooms(again, forest, 1.0))
            row.append(kept(found, back, building.free, least))
            shares[name] += row[-1].tolist()
        whole = whole_corridors(building, found)
        corridors += whole
        stayed = [f"{share.mean():.2f}" for share in row]
        of = f"{sum(whole)} of {len(whole)}"
        print_row(building.name, *stayed, of)
    every = [f"{np.mean(each):.2f}" for each in shares.values()]
    of = f"{sum(corridors)} of {len(corridors)}"
    print_row("all rooms", *every, of)


COST_MAPS = (
    *("bwi_gdc/3/3.yaml", "bwi_gdc/2/2.yaml", "strands/tsc_y4/tsc_1701.yaml"),
    *("strands/g4s/g4s_y2.yaml", "cob_environments/izs-carpark-top/map.yaml"),
)
"""Large maps on which `find_rooms` is timed."""


def cost_table(data: Path) -> None:
    """Print the cost of `find_rooms` against scipy's distance transform in the same process."""
    print("\n## What finding rooms costs\n")
    print("CPU time, the least of five runs in turn; memory is the peak that tracemalloc sees.\n")
    columns = "million cells", "free", "transform, s", "find_rooms, s", "times", "bytes a cell"
    print_head("map", *columns, "rooms")
    for name in COST_MAPS:
        grid = hn.load_map(data / name, robot_radius_m=0)
        found, edt, own, size = _measured(grid)
        free = np.mean(grid.measured == hn.CellClass.FREE)
        cost = f"{edt:.3f}", f"{own:.3f}", f"{own / edt:.2f}", f"{size:.1f}"
        print_row(
            *(name, f"{grid.measured.size / 1e6:.2f}", f"{free:.2f}", *cost, len(found.names))
        )


def _measured(grid: hn.OccupancyGrid) -> tuple[hn.RoomLabels, float, float, float]:
    """Return the rooms, the seconds of scipy's distance transform and of the rooms, and the peak of
    bytes a cell."""
    hn.find_rooms(grid)  # compiled before memory is looked at
    tracemalloc.start()
    found = hn.find_rooms(grid)
    size = tracemalloc.get_traced_memory()[1] / grid.measured.size
    tracemalloc.stop()
    runs: tuple[Callable[[], object], ...] = (
        lambda: ndimage.distance_transform_edt(grid.measured != hn.CellClass.OCCUPIED),
        lambda: hn.find_rooms(grid),
    )
    took = np.zeros((5, 2))
    for times in took:
        for k, run in enumerate(runs):
            began = time.process_time()
            run()
            times[k] = time.process_time() - began
    edt, own = took.min(axis=0).tolist()
    return found, edt, own, size


NAMES_MAPS = (
    ("strands/tsc_y3/tsc20160523.yaml", "strands/tsc_y4/tsc_1701.yaml"),
    ("bwi_gdc/3ne/3ne.yaml", "bwi_gdc/sim_3ne/3ne.yaml"),
    ("bwi_gdc/3/3.yaml", "bwi_gdc/3ne/3ne.yaml"),
    ("giraff_homes/UMA_236.yaml", "giraff_homes/UMA_236_237.yaml"),
    ("strands/g4s/g4s_y2.yaml", "strands/g4s/g4s_sim_cropped.yaml"),
    ("fetch_maps/4_26_15.yaml", "fetch_maps/3_1_16_localization.yaml"),
    ("fetch_maps/3_1_16_localization.yaml", "fetch_maps/9_16_15.yaml"),
)
"""Maps of one building; names are carried there and back."""


def names_table(data: Path) -> None:
    """Print what becomes of names on another map of the building, by the judge of the package."""
    print("\n## Names on another map\n")
    print(
        "`plain`: without another cut of the new rooms. `wrong`: a name is carried though less "
        "than 0.4 of the old room, moved as a whole, or of the new one is in both.\n"
    )
    print_head("from", "to", "rooms", "undecided, plain", "carried", "undecided", "lost", "wrong")
    for pair in (pair[::step] for pair in NAMES_MAPS for step in (1, -1)):
        (old, grid), (new, new_grid) = (
            (hn.find_rooms(grid), grid)
            for grid in (hn.load_map(data / name, robot_radius_m=0) for name in pair)
        )
        plain = carry_names(old, grid, new, new_grid, recut=False)
        carried = carry_names(old, grid, new, new_grid)
        wrong = [n for n, fate in carried.rooms.items() if fate.status == "carried"]
        wrong = [n for n in wrong if _common(n, (old, grid), (carried, new_grid)) < _LEAST_COMMON]
        n_kept = len(carried.rooms) - len(carried.undecided) - len(carried.lost)
        print_row(
            *(*pair, len(carried.rooms), len(plain.undecided), n_kept),
            *(len(carried.undecided), len(carried.lost), len(wrong)),
        )


_LEAST_COMMON = 0.4


def _common(
    name: str,
    old: tuple[hn.RoomLabels, hn.OccupancyGrid],
    new: tuple[CarriedNames, hn.OccupancyGrid],
) -> float:
    """Return the share that an old room and the one of its name have in common, of the larger."""
    (rooms, grid), (carried, new_grid) = old, new
    assert carried.transform is not None  # noqa: S101 - else no name is carried
    own = (rooms.label_of == rooms.index(name)) & (grid.measured == hn.CellClass.FREE)
    is_free = new_grid.measured == hn.CellClass.FREE
    other = (carried.labels.label_of == carried.labels.index(name)) & is_free
    there = carried.transform.moved(grid.frame.points_of(np.argwhere(own)))
    back = carried.transform.inverse.moved(new_grid.frame.points_of(np.argwhere(other)))
    shares = []
    for points, mask, of, on in (
        (there, other, is_free, new_grid),
        (back, own, grid.measured == hn.CellClass.FREE, grid),
    ):
        cells = on.frame.cells_of(points)
        cells = cells[((cells >= 0) & (cells < on.shape)).all(axis=1)]
        shares.append(mask[tuple(cells.T)].sum() / max(1, of[tuple(cells.T)].sum()))
    return float(min(shares))
