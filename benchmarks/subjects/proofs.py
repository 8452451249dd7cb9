"""Proofs of answers on the study's maps: sizes, times against A*, and planted false ones.

The maps are those of the study; robot radius 0.25 m, on MovingAI maps 0. Pairs are drawn from the
largest connected part, and for `no path` from two parts. Rows are presets; columns:

    pairs       answers that were asked for a proof
    accepted    share that `check_proof.py` accepts
    off         median and most by which the proved bound is below the result's, as a share of it
    size        median, 95 % quantile and most of the file, kB
    made        median and 95 % quantile of the time of `hn.prove(result)`, ms
    checked     the same of the check, from the map in memory
    of them map median of the part of that which belongs to the map: digests and the robot's radius
    times A*    median and 95 % quantile of (checked - map) / the time of `grid-astar` by the same
                costs on that pair
    false       planted false proofs that were rejected, of all: another cost or bound, a bound that
                the prover itself was made to state, a moved corner or cell of the path, another
                map, another radius, a dropped closure; with digests as they were, and made anew
"""

import base64
import copy
import hashlib
import json
import zlib
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import ndimage

import hybridnav as hn
from benchmarks.common import read as read_grid
from benchmarks.common import timed
from benchmarks.options import MAPS, NEEDED_DATA, SEED, option
from benchmarks.subjects._study_maps import maps_of
from benchmarks.tables import print_head, print_load, print_row
from hybridnav import check_proof
from hybridnav._base.typing import ByteArray, FloatArray
from hybridnav.errors import HybridNavError

Proof = dict[str, Any]
MORE = 1e-6
"""Share by which planted costs and bounds are false."""
PRESETS = ("shortest", "octile", "grid-astar", "grid-astar, costs", "robot")
COLUMNS = (
    "preset", "pairs", "accepted", "off", "size", "made", "checked", "of them map", "times A*",
    "false",
)  # fmt: skip


def frame_of(grid: hn.OccupancyGrid) -> list[float]:
    """Return the frame of a grid as the checker takes it."""
    return [grid.resolution_m, *grid.frame.origin_m, grid.frame.yaw_rad]


def is_accepted(grid: hn.OccupancyGrid, proof: Proof, measured: ByteArray | None = None) -> bool:
    """Return whether the checker accepts a proof, on the cells of a grid or others."""
    try:
        check_proof.check(grid.measured if measured is None else measured, frame_of(grid), proof)
    except check_proof.Rejected:
        return False
    return True


def with_digests(proof: Proof, measured: ByteArray) -> Proof:
    """Return a proof whose digests are those of its map and robot, as a forger would make them."""
    made = {**proof, "map_sha256": hashlib.sha256(measured.tobytes()).hexdigest()}

    class Digest(dict[str, Any]):
        def __getitem__(self, key: str) -> Any:
            return super().__getitem__(key) if key != "free_sha256" else _Any()

    class _Any:
        def __eq__(self, other: object) -> bool:
            made["free_sha256"] = other
            return True

        __hash__ = None  # type: ignore[assignment]

    check_proof.walls_of(measured, Digest(made), made["side_m"])
    return made


def false_proofs(
    grid: hn.OccupancyGrid, result: hn.PlanResult, proof: Proof, rng: np.random.Generator
) -> Iterator[tuple[str, Proof, ByteArray]]:
    """Make false proofs of a true one: the kind, the proof, and the cells that were measured."""
    measured = grid.measured
    for radius in (proof["radius_m"] + 1.5 * proof["side_m"], proof["radius_m"] / 2):
        if radius * 2 > 3 * proof["side_m"]:
            yield "radius", {**proof, "radius_m": radius}, measured
    free = np.flatnonzero(measured == hn.CellClass.FREE)
    other = measured.copy()
    other.flat[rng.choice(free)] = hn.CellClass.OCCUPIED
    yield "map", proof, other
    if proof["closed"]:
        dropped = [run for run in proof["closed"] if run != proof["closed"][0]]
        yield "closure", {**proof, "closed": dropped}, measured
    if proof["kind"] == "no path":
        region = check_proof.unpacked(proof["region"], measured.shape).copy()
        if len(inside := np.flatnonzero(region)) > 1:
            region.flat[rng.choice(inside)] = 0
            text = base64.b85encode(zlib.compress(region.tobytes())).decode()
            yield "region", {**proof, "region": text}, measured
        yield "end", {**proof, "goal": proof["start"]}, measured
        return
    more = MORE * max(proof["cost"], proof["side_m"])
    for off in (-more, more):
        yield "cost", {**proof, "cost": proof["cost"] + off}, measured
    both = {key: proof[key] + more for key in ("cost", "bound")}
    yield "bound", {**proof, **both}, measured
    yield from _moved(grid, proof, rng)
    if result.gap < MORE and not (
        proof["kind"] == "line" and proof["costs"]
    ):  # the prover itself states a bound that is too high, on a longer path
        dearer = proof["cost"] + more
        forged = hn.prove(
            replace(result, lower_bound_source=proof["bound"] + more, weighted_cost=dearer)
        )
        yield "forged bound", {**forged, "cost": dearer}, measured
        yield "forged bound", {**forged, "cost": proof["cost"]}, measured


def _moved(
    grid: hn.OccupancyGrid, proof: Proof, rng: np.random.Generator
) -> Iterator[tuple[str, Proof, ByteArray]]:
    """Make proofs whose path has a moved corner, or stands on a cell that is occupied now."""
    made, measured = copy.deepcopy(proof), grid.measured
    line = made.get("line")
    if line is None:
        start, moves = made["path"]
        if not moves:
            return
        at = int(rng.integers(len(moves)))
        made["path"] = [start, moves[:at] + str((int(moves[at]) + 1) % 8) + moves[at + 1 :]]
        cells = check_proof.walk(start, moves) - 1
        cell = cells[int(rng.integers(len(cells)))]
    else:
        if len(line) < 3:
            return
        at = int(rng.integers(1, len(line) - 1))
        line[at][int(rng.integers(2))] += int(rng.choice([-1, 1]))
        cell = np.floor(line[0]).astype(int)
    yield "corner", made, measured
    other = measured.copy()
    other[tuple(np.minimum(cell, np.subtract(measured.shape, 1)))] = hn.CellClass.OCCUPIED
    yield "wall on the path", with_digests(proof, other), other


def no_paths(grid: hn.OccupancyGrid, rng: np.random.Generator, n: int) -> FloatArray:
    """Return pairs of points that nothing joins, float64 (n, 2, 2); fewer in one part."""
    labels, count = ndimage.label(grid.enterable())
    if count < 2:
        return np.empty((0, 2, 2))
    cells = np.argwhere(labels)
    largest = np.bincount(labels.ravel())[1:].argmax() + 1
    is_in = labels[tuple(cells.T)] == largest
    ends = [rng.choice(cells[which], n) for which in (is_in, ~is_in)]
    return grid.frame.points_of(np.stack(ends, axis=1))


def measure(
    planners: dict[str, hn.HybridPlanner], preset: str, pair: FloatArray, rng: Any, closed: Any
) -> Proof:
    """Return the figures of the proof of one query; without `rng` no false ones are planted."""
    planner = planners[preset]
    grid = planner.grid
    result = planner.plan(*pair, blocked=closed)
    try:
        proof, made_s = timed(result.proof)
    except HybridNavError as error:
        return {"accepted": False, "why": str(error)}
    text = json.dumps(proof, separators=(",", ":"))
    read = json.loads(text)
    accepted, checked_s = timed(lambda: is_accepted(grid, read), 2)
    _, map_s = timed(lambda: check_proof.walls_of(grid.measured, read, grid.resolution_m))
    _, digest_s = timed(lambda: hashlib.sha256(grid.measured.tobytes()).hexdigest())
    if read["costs"] is not None:
        _, more_s = timed(
            lambda: check_proof.factors_of(grid.measured, read["costs"], grid.resolution_m)
        )
        map_s += more_s
    rival = planners["grid-astar, costs" if preset == "robot" else "grid-astar"]
    rival = planner if preset.startswith("grid-astar") else rival
    _, astar_s = timed(lambda: rival.plan(*pair, blocked=closed), 2)
    outcome = (
        [
            (kind, not is_accepted(grid, other, measured))
            for kind, other, measured in false_proofs(grid, result, read, rng)
        ]
        if rng
        else []
    )
    bound = result.lower_bound
    return {
        "accepted": accepted,
        "off": 0.0 if not result.solved or bound == 0 else 1 - read["bound"] / bound,
        "size": len(text) / 1e3,
        "made": 1e3 * made_s,
        "checked": 1e3 * checked_s,
        "map": 1e3 * (map_s + digest_s),
        "times": max(checked_s - map_s - digest_s, 0) / astar_s,
        "false": outcome,
    }


def row(name: str, every: list[Proof]) -> None:
    """Print the line of a preset."""
    done = [one for one in every if one["accepted"]]

    def two(key: str) -> str:
        values = [one[key] for one in done]
        largest = f" / {max(values):.1f}" if key == "size" else ""
        return f"{np.median(values):.1f} / {np.quantile(values, 0.95):.1f}{largest}"

    if not done:
        print_row(name, len(every), "0 %", *[""] * 7)
        return
    planted = [outcome for one in done for outcome in one["false"]]
    print_row(
        name,
        len(every),
        f"{100 * len(done) / len(every):.1f} %",
        f"{np.median([one['off'] for one in done]):.1e} / {max(one['off'] for one in done):.1e}",
        two("size"),
        two("made"),
        two("checked"),
        f"{np.median([one['map'] for one in done]):.1f}",
        two("times"),
        f"{sum(rejected for _, rejected in planted)} of {len(planted)}",
    )


OPTIONS = [
    NEEDED_DATA,
    MAPS,
    option("--pairs", type=int, default=10, help="pairs a map and preset"),
    option("--planted", type=int, default=1, help="pairs a map and preset with false proofs too"),
    SEED,
]


def main(given: Namespace) -> None:
    """Print the table, and what was not rejected or not proved."""
    rng = np.random.default_rng(given.seed)
    rows: dict[str, list[Proof]] = {name: [] for name in (*PRESETS, "no path")}
    print_load()
    for one in maps_of(given.data, given.map):
        grid = read_grid(one.path)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        costs = hn.CostLayer.clearance(grid)
        planners = {
            name: hn.HybridPlanner(
                topology, preset=name.split(",")[0], costs=costs if "costs" in name else None
            )
            for name in PRESETS
        }
        labels, _ = ndimage.label(grid.enterable())
        part = np.argwhere(labels == np.bincount(labels.ravel())[1:].argmax() + 1)
        pairs = grid.frame.points_of(rng.choice(part, (given.pairs, 2)).reshape(-1, 2))
        for name, planner in planners.items():
            planner.prepare()
            for n, pair in enumerate(pairs.reshape(-1, 2, 2)):
                shut = rng.choice(part, 20)
                at = grid.frame.cells_of(pair)
                shut = shut[~(shut[:, None] == at).all(axis=2).any(axis=1)]
                closed = hn.Blocked(cells=shut) if n % 2 else None
                planted = rng if n < given.planted else None
                rows[name].append(measure(planners, name, pair, planted, closed))
        for n, pair in enumerate(no_paths(grid, rng, given.pairs)):
            planted = rng if n < given.planted else None
            rows["no path"].append(measure(planners, "shortest", pair, planted, None))
        print(one.path.relative_to(given.data), flush=True)
    print_head(*COLUMNS)
    for name, every in rows.items():
        row(name, every)
    print(
        "not proved:",
        {
            one.get("why", "rejected")
            for each in rows.values()
            for one in each
            if not one["accepted"]
        },
    )
    taken = [
        kind
        for each in rows.values()
        for one in each
        for kind, no in one.get("false", ())
        if not no
    ]
    print("false, but accepted:", {kind: taken.count(kind) for kind in taken})
    print_load()
