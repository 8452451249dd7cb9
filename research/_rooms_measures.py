"""All methods on all buildings with people's rooms, by measures that were published."""

from __future__ import annotations

import time
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import hybridnav as hn
from benchmarks.tables import print_head, print_row
from hybridnav._base.typing import FloatArray, IntArray
from hybridnav.rooms.find import judged_rooms
from hybridnav.rooms.listing import kinds_of
from research._rooms_agreement import compare_rooms
from research._rooms_buildings import SITES, Building
from research._rooms_views import cost_table, names_table, views_table
from research.train_rooms import Training, of_generated

NEAR_M = 1.0
"""How far a found door may lie from a true one."""
UNSEEN = "judged, unseen"


@dataclass(frozen=True)
class Measures:
    """What one method reaches on one building."""

    mcc: float
    mcc_per_zone: float
    iou: float
    recall_50: float
    recall_70: float
    door_recall: float
    door_precision: float
    n_rooms: float
    n_true: float
    seconds: float

    @classmethod
    def of(cls, building: Building, label_of: IntArray, seconds: float) -> Measures:
        """Measure rooms, int32 (rows, cols), against people's."""
        true, found = building.true[building.compared], label_of[building.compared]
        agreed = compare_rooms(true, found)
        doors, drawn = building.doors(label_of), building.true_doors
        right = [r for r in (_is_right(building, point) for point in doors) if r is not None]
        return cls(
            agreed.mcc,
            agreed.mcc_per_zone,
            float(agreed.iou.mean()),
            agreed.recall_at(0.5),
            agreed.recall_at(0.7),
            float(np.mean([_near(doors, point) for point in drawn])) if len(drawn) else np.nan,
            float(np.mean(right)) if right else np.nan,
            float(agreed.n_found),
            float(len(agreed.true_labels)),
            seconds,
        )


def _near(points: FloatArray, point: FloatArray) -> bool:
    return bool(np.hypot(*(points - point).T).min(initial=np.inf) <= NEAR_M)


def _is_right(building: Building, point: FloatArray) -> bool | None:
    """Whether a found door lies near a true one, or two true rooms; None where none is known."""
    if _near(building.true_doors, point):
        return True
    grid = building.grid
    row, col = grid.frame.cell_of(*point.tolist())
    reach = round(NEAR_M / grid.resolution_m)
    window = np.s_[max(row - reach, 0) : row + reach + 1, max(col - reach, 0) : col + reach + 1]
    rooms = building.true[window][building.compared[window]]
    return None if len(rooms) == 0 else len(np.unique(rooms)) > 1


def measures_table(data: Path, out: Path, n_generated: int = 0) -> None:
    """Print what every method reaches on every building, and draw its rooms into a folder.

    The judge never saw the building's site; with some generated floors, none of the buildings.
    """
    buildings = [Building.read(data, name) for name in SITES]
    training = of_generated(n_generated) if n_generated else Training(buildings)
    print("## Rooms by published measures\n")
    columns = "building", "method", "MCC", "MCC per zone", "IoU", "rooms at IoU 0.5", "at 0.7"
    print_head(*columns, "doors found", "found doors right", "rooms / true", "s")
    rows: dict[tuple[str, str], Measures] = {}
    for building in buildings:
        drawn = {"people": building.true}
        if building.rose2 is not None:
            rows[building.name, "ROSE2"] = Measures.of(building, building.rose2, np.nan)
            drawn["ROSE2"] = building.rose2
        forest = training.without(building.site)
        began = time.process_time()
        drawn[UNSEEN] = judged_rooms(building.grid, forest, 1.0)
        seconds = time.process_time() - began
        rows[building.name, UNSEEN] = Measures.of(building, drawn[UNSEEN], seconds)
        _draw(building, drawn, out)
        for (name, shown), found in rows.items():
            if name == building.name:
                _print(name, shown, found)
    _print("mean of all", UNSEEN, _mean([rows[b.name, UNSEEN] for b in buildings]))
    given = [building for building in buildings if building.rose2 is not None]
    for shown in ("ROSE2", UNSEEN):
        _print("mean of ROSE2's maps", shown, _mean([rows[b.name, shown] for b in given]))
    people_table(buildings)
    views_table(buildings, training.without)
    names_table(data)
    cost_table(data)


def people_table(buildings: list[Building]) -> None:
    """Print how well two people's labels of one floor agree, and where they break the rules."""
    print("\n## Where people disagree\n")
    intel, again = (b for b in buildings if b.site == "Intel")
    cells, boxes = np.argwhere(again.compared), []
    for each in (intel, again):
        rows, cols = np.nonzero(each.compared)
        boxes.append(((rows.min(), cols.min()), (rows.max(), cols.max())))
    (low, high), (begin, end) = np.array(boxes)
    there = tuple(np.rint(low + (cells - begin) * (high - low) / (end - begin)).astype(int).T)
    both = intel.compared[there]
    agreed = compare_rooms(intel.true[there][both], again.true[tuple(cells[both].T)])
    print(
        f"{intel.name} and {again.name} show one floor: MCC {agreed.mcc:.3f}, per zone "
        f"{agreed.mcc_per_zone:.3f}. People's corridors that meet where nothing narrows:\n"
    )
    print_head("building", "corridors", "open borders", "between, width in m")
    for building in buildings:
        kinds = kinds_of(building.true, building.free, building.grid.resolution_m)
        is_corridor = np.array([*(k is not None and k.name == "corridor" for k in kinds), False])
        meet = building.boundaries(building.true)
        breadths_m = np.full(len(is_corridor), np.inf)
        for n in np.flatnonzero(is_corridor):
            depths_m = building.clearance_m[(building.true == n) & building.free]
            breadths_m[n] = 2 * np.quantile(depths_m, 0.9)
        narrower_m = breadths_m[meet.labels].min(axis=1)
        is_open = is_corridor[meet.labels].all(axis=1) & (meet.passages_m >= 0.8 * narrower_m)
        opened = np.flatnonzero(is_open)
        shown = (f"{meet.labels[k].tolist()} {meet.widths_m[k]:.1f}" for k in opened)
        print_row(building.name, is_corridor.sum(), len(opened), "; ".join(shown))


def _draw(building: Building, drawn: dict[str, IntArray], out: Path) -> None:
    """Draw the rooms of each method below each other, in colours of no meaning."""
    figure = Figure(figsize=(10.0, 10.0 * len(drawn) * np.divide(*building.grid.shape)))
    colours = np.random.default_rng(0).uniform(0.3, 1.0, (4096, 3))
    grey = np.where(building.free, 1.0, 0.7)
    grey[building.grid.measured == hn.CellClass.OCCUPIED] = 0.0
    for axes, (shown, label_of) in zip(figure.subplots(len(drawn)), drawn.items(), strict=True):
        picture = np.repeat(grey[:, :, None], 3, axis=2)
        inside = (label_of >= 0) & building.free
        picture[inside] = colours[label_of[inside] % len(colours)]
        axes.imshow(picture, origin="lower")
        axes.set_title(f"{building.name}, {shown}")
        axes.set_axis_off()
    figure.savefig(out / f"{building.name}.png", dpi=120, bbox_inches="tight")


def _mean(found: list[Measures]) -> Measures:
    names = [field.name for field in fields(Measures)]
    return Measures(*(float(np.mean([getattr(m, n) for m in found])) for n in names))


def _print(name: str, shown: str, found: Measures) -> None:
    figures = [found.mcc, found.mcc_per_zone, found.iou, found.recall_50, found.recall_70]
    figures += [found.door_recall, found.door_precision]
    written = [f"{figure:.3f}" for figure in figures]
    seconds = "" if np.isnan(found.seconds) else f"{found.seconds:.1f}"
    print_row(name, shown, *written, f"{found.n_rooms:.0f} / {found.n_true:.0f}", seconds)
