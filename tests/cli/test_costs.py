"""`hybridnav plan --costs`: what it prints, what it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn

MAP = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
QUERY = ("plan", MAP, "--start", "0.5,0.5", "--goal", "2.0,2.5", "--robot-radius", "0")


def test_a_plan_by_clearance_prints_length_cost_and_bound(cli: Any) -> None:
    answer = json.loads(cli(*QUERY, "--costs", "clearance:multiplier=4", "--json").out)
    grid = hn.load_map(MAP, robot_radius_m=0)
    layer = hn.CostLayer.clearance(grid, multiplier=4.0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    planner = hn.HybridPlanner(topology, preset="grid-astar", costs=layer)
    result = planner.plan((0.5, 0.5), (2.0, 2.5))
    assert result.path is not None
    assert answer["settings"]["costs"] == layer.source
    assert answer["cost"] == answer["lower_bound"] == result.cost > answer["length_m"]
    told = cli(*QUERY, "--costs", "clearance:multiplier=4").out.splitlines()
    assert f"length     {result.path.length_m:.2f} m" in told
    assert f"cost       {result.cost:.2f} m (weighted)" in told
    assert f"bound      {result.cost:.2f} m, the path is optimal" in told
    taut = cli(*QUERY, "--costs", "clearance", "--smooth", "line-of-sight").out
    assert "(any-angle-weighted)" in taut
    assert "% too dear" in taut


def test_the_corridor_is_compared_with_the_cheapest_path(cli: Any) -> None:
    query = (*QUERY, "--costs", "clearance", "--preset", "paper", "--compare")
    answer = json.loads(cli(*query, "--json").out)
    assert answer["metric"] == "weighted"
    assert answer["loss"] == answer["cost"] / answer["optimum_m"] - 1
    assert answer["grid_length_m"] < answer["optimum_m"] == answer["grid_cost"]
    taut = cli(*query, "--smooth", "line-of-sight").out
    length, cost = (f"{answer[key]:.2f} m" for key in ("grid_length_m", "grid_cost"))
    assert f"grid       {length}, cost {cost} (weighted), " in taut


def test_masks_are_read_and_joined(cli: Any, tmp_path: Path) -> None:
    rows, cols = hn.load_map(MAP, robot_radius_m=0).shape
    for name, grey in (("slow", 50), ("shut", 100)):
        (tmp_path / f"{name}.pgm").write_bytes(b"P5 1 1 255 " + bytes([grey]))
        (tmp_path / f"{name}.yaml").write_text(
            f"{{image: {name}.pgm, resolution: {max(rows, cols) * 0.1}, origin: [0, 0, 0], "
            "negate: 0, mode: raw, free_thresh: 0.196, occupied_thresh: 0.65}"
        )
    slow = json.loads(cli(*QUERY, "--costs", f"speed:{tmp_path / 'slow.yaml'}", "--json").out)
    assert slow["cost"] == pytest.approx(2 * slow["length_m"])
    base = f"speed:{tmp_path / 'slow.yaml'},base=90,multiplier=-1.3"
    slower = json.loads(cli(*QUERY, "--costs", base, "--costs", "clearance", "--json").out)
    assert slower["cost"] == pytest.approx(4 * slower["length_m"], rel=1e-3)
    shut = cli(*QUERY, "--costs", f"keepout:{tmp_path / 'shut.yaml'}", "--json")
    assert shut.code == 1
    assert json.loads(shut.out)["status"] == "start blocked"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--costs", "height"), "--costs must begin with clearance, speed, keepout, got 'height'"),
        (("--costs", "clearance:radius=1"), "--costs clearance takes KEY=VALUE with"),
        (("--costs", "clearance:scaling=high"), "scaling must be a number, got 'high'"),
        (("--costs", "clearance:scaling=-1"), "planner.costs.clearance.scaling"),
        (("--costs", "speed"), "--costs speed: expected speed:FILE, got 'speed'"),
        (
            ("--costs", "clearance", "--preset", "shortest"),
            "planner.costs: unknown key; shortest has ",
        ),
    ],
)
def test_wrong_costs_are_wrong_usage_in_one_line(cli: Any, options: Any, message: str) -> None:
    done = cli(*QUERY, *options)
    assert done.code == 2
    assert message in done.err
    assert done.err.count("\n") == 1


def test_a_missing_mask_is_unreadable_input(cli: Any) -> None:
    done = cli(*QUERY, "--costs", "speed:nowhere.yaml")
    assert done.code == 3
    assert done.err.count("\n") == 1
