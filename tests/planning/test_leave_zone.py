"""Starts in closed cells, and the way out of them, judged by Dijkstra of scipy."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from tests.oracle.grid import distances, move_graph
from tests.planning.test_costs import topology_of
from tests.strategies import class_grids, seeds, tried

FRAME = hn.Frame(resolution_m=0.5, origin_m=(-3.0, 7.0), yaw_rad=0.4)
ENDS = (0.5, 0.5), (5.5, 0.5)


@tried(
    80,
    class_grids(max_side=12),
    st.sampled_from(["octile", "grid-astar", "shortest", "robot"]),
    seeds,
)
def test_it_leaves_by_the_shortest_way_and_goes_on_by_the_best_path(classes, preset, seed):
    rng = np.random.default_rng(seed)
    probability = np.array([0.0, 1.0, 0.5])[np.searchsorted([0, 1, 2], classes)]
    grid = hn.OccupancyGrid(probability, frame=FRAME)
    free = grid.classes == hn.CellClass.FREE
    if free.sum() < 2:
        return
    cells = np.argwhere(free)
    start, goal = (tuple(each) for each in rng.choice(cells, 2, replace=False).tolist())
    apart = np.abs(cells - start).max(axis=1)
    shut = cells[(apart <= rng.integers(4)) | (rng.random(len(cells)) < rng.choice([0.0, 0.3]))]
    shut = shut[(shut != goal).any(axis=1)]
    is_open = free.copy()
    is_open[tuple(shut.T)] = False
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    ends, blocked = FRAME.points_of(np.array([start, goal])), hn.Blocked(cells=shut)
    plain = planner.plan(*ends, blocked=blocked)
    assert str(plain.status) == "start blocked"
    assert plain.leaves_m is None
    found = planner.plan(*ends, blocked=blocked, leave_zone=True)
    # Oracle: from the start over all cells without walls to the nearest open one.
    out = distances(move_graph(free), free.shape, start)[is_open].min(initial=math.inf)
    if math.isinf(out):
        assert found.status == plain.status
        assert found.leaves_m is None
        return
    assert found.leaves_m == pytest.approx(0.5 * out)
    if not found.solved:
        assert str(found.status) == "no path"
        assert found.reason
        return
    assert found.lower_bound <= found.cost + 1e-9
    rows_cols = found.path.cells
    inside = ~is_open[tuple(rows_cols.T)]
    first = int(np.argmin(inside))
    assert inside[:first].all()
    assert not inside[first:].any(), "it comes back into closed cells"
    assert free[tuple(rows_cols.T)].all()
    if preset in {"octile", "grid-astar"}:
        steps = np.abs(np.diff(rows_cols[: first + 1], axis=0)).sum(axis=1)
        way = np.sqrt(steps).sum()
        rest = distances(move_graph(is_open), is_open.shape, tuple(rows_cols[first].tolist()))[goal]
        if way > out + 1e-9:
            # The cells of the shortest way are open: the last move out of them may be a diagonal.
            assert way <= out + math.sqrt(2) - 1 + 1e-9
            is_open[tuple(rows_cols[:first].T)] = True
            way, rest = 0, distances(move_graph(is_open), is_open.shape, start)[goal]
        assert found.cost == pytest.approx(0.5 * (way + rest))
        assert found.lower_bound == pytest.approx(found.cost)


def test_the_way_out_crosses_no_wall_of_the_zone() -> None:
    # A closed room with one door on the left: out of it, not through its wall.
    classes = np.zeros((5, 9))
    classes[:, 4] = 1.0
    classes[2, 4] = 0.0
    grid = hn.OccupancyGrid(classes.astype(np.float32), frame=hn.Frame(resolution_m=1.0))
    planner, zone = hn.HybridPlanner(topology_of(grid)), shapely.box(0.1, 0.1, 4.9, 4.9)
    found = planner.plan((3.5, 4.5), (8.5, 4.5), blocked={"keepout": [zone]}, leave_zone=True)
    assert found.solved
    assert found.leaves_m == pytest.approx(2 + 2)
    assert found.to_dict()["leaves_m"] == found.leaves_m
    assert found.gap == pytest.approx(0, abs=1e-9)
    within = planner.plan((3.5, 4.5), (8.5, 4.5), leave_zone=True)
    assert within.solved
    assert within.leaves_m is None


@pytest.mark.parametrize("preset", ["robot", "grid-astar", "paper"])
@pytest.mark.parametrize("kind", ["keepout", "closed"])
def test_costs_that_close_the_start_are_left_like_closures(preset: str, kind: str) -> None:
    """Zones in rows 0 and 1: the start's of 3 columns, and one of costs on the only way back."""
    grid = hn.OccupancyGrid(
        np.zeros((6, 14), np.float32), frame=hn.Frame(resolution_m=1.0), robot_radius_m=0.0
    )
    zone, other = np.zeros((6, 14), np.bool_), np.zeros((6, 14), np.bool_)
    zone[:2, :3], other[:5, 7] = True, True
    factors = np.ones((6, 14), np.float32)
    factors[:, 5] = 3.0
    topology = topology_of(grid)
    query: dict[str, Any] = {"start": (0.5, 0.5), "goal": (12.5, 0.5)}
    closes: dict[str, Any] = {kind: zone | other}
    by_costs = hn.HybridPlanner(topology, preset=preset, costs=hn.CostLayer(factors, **closes))
    before = by_costs.plan(**query)
    assert str(before.status) == "start blocked"
    found = by_costs.plan(**query, leave_zone=True)
    assert found.solved
    assert found.leaves_m == pytest.approx(2)  # up, in its column
    inside = zone[tuple(found.path.cells.T)]
    assert inside[: inside.sum()].all(), "it comes back into the zone"
    assert not other[tuple(found.path.cells.T)].any()
    # The same zones as closures of the query.
    cells = np.argwhere(zone | other)
    plain = hn.HybridPlanner(topology, preset=preset, costs=hn.CostLayer(factors))
    wanted = plain.plan(**query, blocked=hn.Blocked(cells=cells), leave_zone=True)
    assert (found.cost, found.leaves_m) == pytest.approx((wanted.cost, wanted.leaves_m))
    assert found.lower_bound <= found.cost + 1e-9
    # With closures of a query, `paper` searches the whole map, and has its bound.
    assert preset == "paper" or found.lower_bound == pytest.approx(wanted.lower_bound)
    # The planner is as it was; a goal that costs close stays closed, and so does a zone of costs
    # beside one that is left.
    assert str(by_costs.plan(**query).status) == "start blocked"
    assert str(by_costs.plan((0.5, 0.5), (7.5, 0.5), leave_zone=True).status) == "start blocked"
    column = hn.Blocked(cells=[(row, 3) for row in range(6)])
    beside = by_costs.plan((3.5, 0.5), query["goal"], blocked=column, leave_zone=True)
    assert beside.leaves_m == pytest.approx(1)
    assert not (zone | other)[tuple(beside.path.cells.T)].any()
    both = hn.Blocked(cells=[(0, col) for col in range(3)])
    again = by_costs.plan(**query, blocked=both, leave_zone=True)
    assert again.cost == pytest.approx(found.cost)


def test_the_command_leaves_a_keepout_mask_of_costs(cli: Any, tmp_path: Any) -> None:
    mask = np.zeros((60, 60), np.float32)
    mask[:30, :20] = 1.0
    frame = hn.Frame(resolution_m=0.05, origin_m=(0.5, 12.5))
    hn.write_ros_map(hn.OccupancyGrid(mask, frame=frame), tmp_path / "zone.yaml")
    query: tuple[str, ...] = ("plan", "maps/office/office.yaml", "--robot-radius", "0.25")
    query += (
        "--start",
        "1.0,13.2",
        "--goal",
        "40.6,19.4",
        "--costs",
        f"keepout:{tmp_path}/zone.yaml",
    )
    shut = cli(*query)
    assert shut.code == 1
    assert "The start is closed by the keep-out of the costs.\n" in shut.out
    done = cli(*query, "--leave-zone")
    assert done.code == 0, done.err
    assert "leaves     the keep-out of the costs over " in done.out


def test_it_is_refused_where_it_means_nothing() -> None:
    grid = hn.OccupancyGrid(np.zeros((3, 9), np.float32), frame=hn.Frame(resolution_m=1.0))
    topology = topology_of(grid)
    planner = hn.HybridPlanner(topology)
    with pytest.raises(InvalidValueError, match="leave_zone does not go with within_m"):
        planner.plan(*ENDS, leave_zone=True, within_m=1.0)
    # A goal in the zone stays closed.
    both = planner.plan(*ENDS, blocked={"keepout": [shapely.box(0, 0, 9, 1)]}, leave_zone=True)
    assert str(both.status) == "start blocked"
    assert "The goal is closed by keep-out area 1." in both.reason
    outside = planner.plan((-5.0, 0.0), ENDS[1], leave_zone=True)
    assert str(outside.status) == "start outside the map"


def test_the_command_says_what_it_leaves(cli: Any, tmp_path: Any) -> None:
    zone = tmp_path / "zone.geojson"
    zone.write_text(
        '{"type": "Polygon", "coordinates": [[[0.4, 12.6], [3, 12.6], [3, 13.8], [0.4, 13.8], '
        "[0.4, 12.6]]]}"
    )
    query: tuple[str, ...] = ("plan", "maps/office/office.yaml", "--robot-radius", "0.25")
    query += ("--start", "1.0,13.2", "--goal", "40.6,19.4", "--blocked", str(zone))
    shut = cli(*query)
    assert shut.code == 1
    assert f"The start is closed by {zone}.\n" in shut.out
    done = cli(*query, "--leave-zone")
    assert done.code == 0, done.err
    assert "status     solved\n" in done.out
    assert f"leaves     {zone} over " in done.out
    named = (*query[:-4], "--to", "room-7", "--leave-zone")
    assert cli(*named).refuses(2, "--leave-zone goes with --start, --goal and files as --blocked")


def test_closures_keep_their_names_in_unions_and_reasons() -> None:
    grid = hn.OccupancyGrid(np.zeros((3, 9), np.float32), frame=hn.Frame(resolution_m=1.0))
    planner = hn.HybridPlanner(topology_of(grid))
    column = [hn.Blocked(cells=[(row, 4) for row in rows]) for rows in ((0, 1), (2,))]
    one = hn.Blocked(named={"keepout: a.yaml": column[0]})
    joined = hn.Blocked(cells=[(0, 2)]) | one | hn.Blocked(named={"keepout: a.yaml": column[1]})
    assert list(joined.named) == ["keepout: a.yaml"]
    result = planner.plan(*ENDS, blocked=joined)
    assert result.reason == "Keepout: a.yaml is closed, and there is no other way."
    with pytest.raises(InvalidValueError, match="named must be a mapping of names to Blocked"):
        hn.Blocked(named={"a": [(0, 1)]})  # type: ignore[dict-item]
