"""How stable the numbers of places and rooms are while a robot maps a building.

The logs of Intel and Freiburg 079 are replayed in cells of 5 cm, with a robot of 0.25 m: a map
after every so many scans. A cell flips if it stays free and changes the number of its place,
although more than half of the cells of that place stay free; an untouched place, none of whose
cells changes class, flips if its number is not on most of its cells any more. The last two columns
count only untouched places with no changed cell beside them, and with no touched place beside them
either. The last version is checked: at every level, arcs against boundaries read from the fields
alone.
"""

import itertools
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np

import hybridnav as hn
from benchmarks.common import RADIUS_M
from benchmarks.options import NEEDED_DATA, option
from benchmarks.tables import print_head, print_row
from hybridnav.ext.live import OnlineRooms, ReplayFigures, grids_of_scans, replay
from hybridnav.ext.live.mapping import Mapper

LOGS = {
    "Intel": "radish_logs/intel-corrected.log.gz",
    "Freiburg 079": "radish_logs/freiburg-079-corrected.log.gz",
}
RESOLUTION_M = 0.05


def agreement(rooms: OnlineRooms) -> float:
    """Return the mean, over free cells, of the IoU of their room with that of a fresh build."""
    fresh = hn.find_rooms(rooms.grid).label_of
    both = (rooms.number_of >= 0) & (fresh >= 0) & (rooms.grid.measured == hn.CellClass.FREE)
    ours, theirs = rooms.number_of[both], fresh[both]
    keys, cells = np.unique(np.stack([ours, theirs]), axis=1, return_counts=True)
    areas, others = np.bincount(ours), np.bincount(theirs)
    iou = cells / (areas[keys[0]] + others[keys[1]] - cells)
    return float((iou * cells).sum() / cells.sum())


def followed(log: Path, every: int, rooms_every: int, scans: int | None) -> dict[str, Any]:
    """Return the figures of a replay."""
    figures, step = ReplayFigures(), None
    read = itertools.islice(hn.ext.live.CarmenLog(log), scans)
    mapper = Mapper(resolution_m=RESOLUTION_M)
    grids = grids_of_scans(read, mapper, every=every, robot_radius_m=RADIUS_M)
    for step in replay(grids, rooms_every=rooms_every):
        figures.add(step)
    found = {**figures.figures(), "scans": mapper.n_scans, "agreement": 0.0}
    if step is not None:
        found["agreement"] = agreement(step.rooms)
        found["fresh"] = hn.DualGraphPyramid.build(step.places.grid)[-1].n_vertices
    return found


def show(name: str, kind: str, found: dict[str, Any]) -> None:
    """Print a row of the table."""
    of = found[kind]
    print_row(
        *(f"{name}, {kind}", f"{found['scans']:,}", f"{of['updates']:,}"),
        *(f"{of['median_ms']:.0f}", f"{of['p95_ms']:.0f}"),
        *(f"{of[event]:,}" for event in ("born", "died", "merged", "split")),
        *(f"{of['flipped_cells']:,.0f}", f"{of['flipped_share']:.2%}"),
        *(f"{of['flipped_by_merging']:.0%}", f"{of['flipped_by_cutting_off']:.0%}"),
        *(ever(of[some]) for some in ("untouched", "apart", "far")),
    )


def ever(found: dict[str, Any]) -> str:
    """Return how many places of a kind ever flip."""
    share = found["flipped"] / max(found["places"], 1)
    return f"{found['flipped']} of {found['places']}, {share:.1%}"


OPTIONS = [
    NEEDED_DATA,
    option("--every", type=int, default=10),
    option("--rooms-every", type=int, default=5),
    option("--scans", type=int, default=None),
]


def main(given: Namespace) -> None:
    """Print the table."""
    print_head(
        *("log", "scans", "updates", "median, ms", "p95, ms", "born", "died", "merged", "split"),
        *("cells that flip, an update", "of free cells", "by merging", "by cutting off"),
        *("untouched that ever flip", "no change beside them", "nor in a place beside them"),
    )
    for name, file in LOGS.items():
        log = given.data / file
        found = followed(log, given.every, given.rooms_every, given.scans)
        for kind in ("places", "rooms"):
            show(name, kind, found)
        print(
            f"{name}: {found['levels']} levels, {len(found['faults'])} of them with faults; "
            f"{found['n_places']} places (a fresh build has {found['fresh']}), "
            f"{found['n_rooms']} rooms, "
            f"agreement with those of a fresh build {found['agreement']:.3f}",
            flush=True,
        )
