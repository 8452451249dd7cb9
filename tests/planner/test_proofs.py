"""Proofs of results: the checker accepts the true ones, and none that was altered."""

import json
import pickle
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from benchmarks.subjects.proofs import false_proofs, frame_of, is_accepted
from hybridnav import check_proof
from hybridnav.errors import PlanError
from hybridnav.search.proofs import parting_chain
from tests.oracle.any_angle_cost import SidePoints
from tests.plans import grid_of, map_of, points_in
from tests.strategies import examples

PRESETS = ("shortest", "octile", "grid-astar", "grid-astar by costs", "robot")


def random_grid(rng, shape=(24, 30), radius_m=0.0):
    smooth = ndimage.uniform_filter(rng.random(shape), int(rng.integers(1, 4)))
    classes = np.where(smooth < np.quantile(smooth, rng.uniform(0.1, 0.4)), 0, 1)
    classes[rng.random(shape) < 0.03] = 2
    probability = np.where(classes == 2, 0.5, classes == 0).astype(np.float32)
    frame = hn.Frame(0.05, origin_m=(3.1, -20.4), yaw_rad=0.7)
    return hn.OccupancyGrid(probability, frame, robot_radius_m=radius_m)


def planner_of(grid, preset):
    costs = hn.CostLayer.clearance(grid, inflation_radius_m=0.3) if "costs" in preset else None
    return hn.HybridPlanner(map_of(grid), preset=preset.split()[0], costs=costs)


@pytest.mark.parametrize("preset", PRESETS)
def test_true_proofs_are_accepted_and_altered_ones_are_not(preset):
    rng = np.random.default_rng(PRESETS.index(preset))
    kinds: dict[str, int] = {}
    for n in range(examples(24, 112)):  # in full 10,000 false proofs
        grid = random_grid(rng, radius_m=0.05 * (n % 3))
        planner = planner_of(grid, preset)
        for pair in points_in(grid, rng, 3):
            if n % 4 < 2:  # half of the ends are centres, as in the harness
                pair = grid.frame.points_of(grid.frame.cells_of(pair))  # noqa: PLW2901
            shut = np.argwhere(grid.enterable())[:: max(n, 1) * 7]
            at = grid.frame.cells_of(pair)
            shut = shut[~(shut[:, None] == at).all(axis=2).any(axis=1)]
            result = planner.plan(*pair, blocked={"cells": shut} if n % 2 else None)
            proof = json.loads(json.dumps(result.proof(), allow_nan=False))
            said = check_proof.check(grid.measured, frame_of(grid), proof)
            assert said.startswith("path" if result.solved else "no path")
            if result.solved and preset != "robot":
                assert proof["bound"] == result.lower_bound
                assert proof["bound"] == pytest.approx(proof["cost"], rel=1e-9)
            elif result.solved:
                assert proof["bound"] <= min(proof["cost"], result.cost)
            for kind, false, measured in false_proofs(grid, result, proof, rng):
                kinds[kind] = kinds.get(kind, 0) + 1
                assert not is_accepted(grid, false, measured), (kind, false)
    planted = {"radius", "map", "cost", "bound", "corner", "closure", "wall on the path"}
    print(sum(kinds.values()), "false proofs")  # noqa: T201 - for `pytest -s`
    assert planted | ({"forged bound"} if preset != "robot" else set()) <= kinds.keys()


def is_free(walls, first, last):
    """Whether a line between two corners stays free, by exact fractions, cell by cell."""
    (a_row, a_col), (rows, cols) = first, np.subtract(last, first).tolist()
    at = {Fraction(0), Fraction(1)}
    at |= {Fraction(n - a, d) for a, d in ((a_row, rows), (a_col, cols)) if d
             for n in range(min(a, a + d), max(a, a + d) + 1)}  # fmt: skip
    cuts = sorted(at)

    def cells_at(t):
        row, col = a_row + t * rows, a_col + t * cols
        return [
            (r, c)
            for r in {int(row), int(row) - (row.denominator == 1)}
            for c in {int(col), int(col) - (col.denominator == 1)}
        ]

    for low, high in pairwise(cuts):
        if all(walls[cell] for cell in cells_at((low + high) / 2)):
            return False
    for t in cuts[1:-1]:
        cells = cells_at(t)
        if len(cells) == 4:
            r, c = max(cells)
            turn = rows * cols
            if turn >= 0 and walls[r - 1, c] and walls[r, c - 1]:
                return False
            if turn <= 0 and walls[r - 1, c - 1] and walls[r, c]:
                return False
    return True


@pytest.mark.parametrize("grain", [2, 2**24])
def test_lines_are_cut_where_fractions_say_so(grain):
    rng = np.random.default_rng(grain)
    kind = object if grain > 2 else np.int64
    for _ in range(20):
        walls = np.pad(rng.random((7, 8)) < rng.uniform(0.1, 0.5), 1, constant_values=True)
        ends = rng.integers(1, (8, 9), (2, 60, 2))
        ends = ends[:, (ends[0] != ends[1]).any(axis=1)]
        first, last = (end.astype(kind) * grain for end in ends)
        cut = check_proof.are_cut(walls, first, last, grain)
        free = [is_free(walls, a.tolist(), b.tolist()) for a, b in zip(*ends, strict=True)]
        assert (cut == ~np.array(free)).all()


def test_a_chain_parts_an_island_from_the_rest_and_both_ways_round():
    free = np.zeros((9, 9), bool)
    free[1:8, 1:8] = True
    free[2:7, 2:7] = False
    free[4, 4] = True
    for ends in (((4, 4), (1, 1)), ((1, 1), (4, 4))):
        chain = parting_chain(free, *ends)
        assert chain is not None
        assert (chain[0] == chain[-1]).all()
        assert (np.abs(np.diff(chain, axis=0)).max(axis=1) == 1).all()
        assert not np.pad(free, 1)[tuple((chain + 1).T)].any()
    assert parting_chain(free, (1, 1), (7, 7)) is None


@pytest.mark.parametrize("name", ["office", "figure1"])
def test_the_checker_reads_a_map_as_the_package_does(name, tmp_path):
    grid = hn.example_map(name)
    hn.write_ros_map(grid, tmp_path / "m.yaml")
    thresholds = [grid.free_threshold, grid.occupied_threshold]
    cells, frame = check_proof.read_map(tmp_path / "m.yaml", thresholds)
    assert (cells == grid.measured).all()
    assert frame == frame_of(grid)
    hn.write_movingai_map(grid, tmp_path / "m.map")
    cells, frame = check_proof.read_map(tmp_path / "m.map", thresholds)
    again = hn.load_map(tmp_path / "m.map")
    assert (cells == again.measured).all()
    assert frame == frame_of(again)


@pytest.mark.parametrize("negate", ["0", "1"])
@pytest.mark.parametrize("kind", ["P5 # kept\n4 2\n255\n", "P2\n4 2\n255\n"])
def test_the_checker_reads_other_images_too(kind, negate, tmp_path):
    values = [0, 60, 100, 160, 200, 199, 150, 20]
    body = bytes(values) if "P5" in kind else " ".join(map(str, values)).encode()
    (tmp_path / "m.pgm").write_bytes(kind.encode() + body)
    (tmp_path / "m.yaml").write_text(
        "image: 'm.pgm'  # a map\nresolution: 5e-2\norigin:\n- -1.5\n- 2\n- 0.25\n"
        f"negate: {negate}\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    grid = hn.load_map(tmp_path / "m.yaml")
    cells, frame = check_proof.read_map(tmp_path / "m.yaml", [0.25, 0.65])
    assert (cells == grid.measured).all()
    assert frame == frame_of(grid)


def test_no_proof_is_made_of_what_has_none():
    grid = grid_of(np.ones((5, 5), int), corner_cutting=True)
    pair = grid.frame.points_of([[0, 0], [4, 4]])
    with pytest.raises(PlanError, match="corners may be cut"):
        hn.HybridPlanner(map_of(grid), preset="octile").plan(*pair).proof()
    grid = grid_of(np.ones((5, 5), int))
    planner = hn.HybridPlanner(map_of(grid))
    with pytest.raises(PlanError, match="no proof is known of 'start outside the map'"):
        planner.plan((0, 0), pair[1]).proof()
    copied = pickle.loads(pickle.dumps(planner.plan(*pair)))  # noqa: S301 - our own
    with pytest.raises(PlanError, match="copies of a result have no proof"):
        copied.proof()
    layer = hn.CostLayer(np.full((5, 5), 2.0))
    with pytest.raises(PlanError, match="costs of the kind 'array'"):
        hn.HybridPlanner(map_of(grid), preset="grid-astar", costs=layer).plan(*pair).proof()


@pytest.mark.parametrize(
    ("key", "value", "why"),
    [
        ("radius_m", 1e9, "a radius of too many cells"),
        ("radius_m", float("nan"), "leave other cells free"),
        ("costs", {"multiplier": -1}, "a factor is not from 1 to 1000"),
        ("costs", {"multiplier": float("nan")}, "a factor is not from 1 to 1000"),
        ("costs", {"inflation_radius_m": 1e9}, "costs that reach too far"),
        ("bound", float("nan"), "this is no proof"),
        ("bound", 1e300, "this is no proof"),
        ("bound", -1.0, "a move raises p"),
        ("cost", float("nan"), "the path costs"),
        ("grain", 3, "a wrong grain"),
        ("ends", [[-1, -1], [-1, -1]], "ends outside"),
        ("box", [0, 0, 10**9, 10**9], "this is no proof"),
        ("box", [-1, 0, 3, 3], "."),
        ("tree", "", "this is no proof"),
        ("path", [[0, 0], "89"], "this is no proof"),
        ("closed", [[0, 10**12]], "a closed cell is outside the map"),
    ],
)
def test_hostile_values_are_rejected(key, value, why):
    grid = hn.example_map("figure1")
    planner = hn.HybridPlanner(
        map_of(grid), preset="grid-astar", costs=hn.CostLayer.clearance(grid)
    )
    proof = planner.plan((0.5, 0.5), (2.0, 2.5)).proof()
    assert is_accepted(grid, proof)
    value = proof["costs"] | value if key == "costs" else value
    with np.errstate(all="ignore"), pytest.raises(check_proof.Rejected, match=why):
        check_proof.check(grid.measured, frame_of(grid), {**proof, key: value})


@pytest.mark.parametrize("text", ["{}", "[]", "3", '{"kind": "cells"}', "null"])
def test_any_other_json_is_rejected_in_one_line(text):
    grid = hn.example_map("figure1")
    with pytest.raises(check_proof.Rejected, match="this is no proof"):
        check_proof.check(grid.measured, frame_of(grid), json.loads(text))


def test_no_bound_of_a_line_by_costs_is_above_the_cheapest_path_by_brute_force():
    rng = np.random.default_rng(3)
    gaps = []
    for _ in range(12):
        grid = random_grid(rng, (9, 10))
        planner = planner_of(grid, "robot")
        assert planner.costs is not None
        oracle = SidePoints(grid.enterable(), planner.costs.factors)
        for pair in points_in(grid, rng, 3):
            result = planner.plan(*pair)
            if not result.solved:
                continue
            start, goal = map(tuple, grid.frame.positions_of(pair).tolist())
            cheapest = oracle.cost(start, goal) * grid.resolution_m
            gaps.append(cheapest / result.proof()["bound"] - 1)
    assert len(gaps) > 10
    assert min(gaps) > -1e-6
    assert np.median(gaps) < 0.4  # factors of 1 to 3 side by side, and ends that are no corners
