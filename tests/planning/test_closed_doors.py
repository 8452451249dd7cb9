"""A door that is shut is shut: doors, rooms and arcs of any level, whoever plans."""

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.closures import Blocked
from hybridnav.pyramid import LevelArc
from tests.oracle.grid import distances, move_graph
from tests.strategies import class_grids, drawn, examples, occupancy_grid, seeds

OFFICE = Path(__file__).parents[2] / "maps" / "office" / "office.yaml"
# Kitchen and lab with two doors between them, and a hall below with a door to each.
HOUSE = drawn(
    "###############",
    "#......#......#",
    "#.............#",
    "#......#......#",
    "#......#......#",
    "#.............#",
    "#......#......#",
    "###.#######.###",
    "#.............#",
    "#.............#",
    "###############",
)
NAMES = ("kitchen", "lab", "hall")
presets = pytest.mark.parametrize("preset", ["shortest", "octile", "paper", "grid-astar"])


def house() -> hn.TopologicalMap:
    """The house, its cells half a metre."""
    label_of = np.full(HOUSE.shape, -1, dtype=np.int32)
    label_of[3:, :8], label_of[3:, 8:], label_of[:3] = 0, 1, 2
    grid = occupancy_grid(HOUSE, resolution_m=0.5)
    rooms = hn.RoomLabels(NAMES, label_of)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0, rooms=rooms))


@pytest.fixture(scope="module")
def planners() -> dict[str, hn.HybridPlanner]:
    topology = house()
    names = ["shortest", "octile", "paper", "grid-astar"]
    return {name: hn.HybridPlanner(topology, preset=name) for name in names}


@pytest.fixture(scope="module")
def office() -> hn.HybridPlanner:
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid))
    return hn.HybridPlanner(hn.TopologicalMap(pyramid), preset="octile")


def crossings(topology: hn.TopologicalMap, door: hn.Door) -> set[frozenset[int]]:
    """Moves across a door as pairs of flat cells: over a side of its boundary, or diagonally past
    one from the one part to the other."""
    level, cols = topology.rooms.level, topology.grid.shape[1]
    field = level.field_of.ravel()
    found = set()
    for arc in door.arcs:
        for one, other in (level.boundary(arc.index) @ np.array([cols, 1])).tolist():
            found.add(frozenset((one, other)))
            step = 1 if abs(one - other) == cols else cols
            for (tail, head), by in itertools.product(((one, other), (other, one)), (-step, step)):
                end = head + by
                if 0 <= end < field.size and field[tail] != field[end] == field[head]:
                    found.add(frozenset((tail, end)))
    return found


def optimum(
    topology: hn.TopologicalMap,
    endpoints: Any,
    *,
    without: set[frozenset[int]] = frozenset(),  # type: ignore[assignment]
    removed: Any = None,
) -> float:
    """Length in metres by Dijkstra's algorithm where moves are forbidden, or cells removed."""
    grid = topology.grid
    enterable = grid.enterable() if removed is None else grid.enterable() & ~removed
    graph = move_graph(enterable).tocoo()
    low, high = np.sort(np.stack([graph.row, graph.col]).astype(np.int64), axis=0)
    shut = [min(pair) * grid.classes.size + max(pair) for pair in without]
    graph.data[np.isin(low * grid.classes.size + high, shut)] = np.inf
    first, last = (grid.frame.cell_of(*end) for end in endpoints)
    return float(distances(graph.tocsr(), grid.shape, first)[last]) * grid.resolution_m


def moves_of(paths: Any, cols: int) -> set[frozenset[int]]:
    """The moves of paths as pairs of flat cells."""
    flat = [(path.cells @ np.array([cols, 1])).tolist() for path in paths]
    return {frozenset(pair) for own in flat for pair in itertools.pairwise(own)}


def forms_of(door: hn.Door) -> list[Any]:
    """Return every form in which a caller can close a door."""
    return [
        {"doors": [door.number]},
        {"doors": (np.int64(door.number),)},
        {"doors": [door]},
        door,
        {"arcs": door.arcs},
        Blocked(doors=[door]) | Blocked(doors=[door.number]),
    ]


def test_a_shut_door_of_the_office_is_not_passed_and_the_others_are(office):
    topology, names = office.topology, ["room-1", "room-4"]
    cols = topology.grid.shape[1]
    opened = hn.plan_tour(office, names, at="point")
    passed = [leg.door for leg in opened.legs if leg.door is not None]
    assert len(passed) >= 3
    endpoints = [topology.rooms.point_of(name) for name in names]
    detours = 0
    for door in passed:
        shut = crossings(topology, door)
        assert moves_of([opened.results[0].path], cols) & shut
        best = optimum(topology, endpoints, without=shut)
        for form in forms_of(door):
            tour = hn.plan_tour(office, names, at="point", blocked=form)
            assert tour.solved == (best < math.inf)
            if not tour.solved:
                continue
            assert not moves_of([tour.results[0].path], cols) & shut
            others = [leg.door for leg in tour.legs if leg.door is not None]
            assert others
            assert door not in others
            detours += bool(set(others) & set(passed))
            assert opened.length_m < best <= tour.length_m * (1 + 1e-9)
            assert opened.lower_bound <= tour.lower_bound <= tour.length_m
    assert detours


def test_a_room_of_the_office_closed_for_cleaning_is_not_entered(office: hn.HybridPlanner) -> None:
    topology = office.topology
    opened = hn.plan_tour(office, ["room-1", "room-4"])
    through = {leg.room for leg in opened.legs} - {"room-1", "room-4", None}
    assert through
    labels = topology.rooms.labels
    for name in sorted(filter(None, through)):
        inside = labels.label_of == labels.index(name)
        tour = hn.plan_tour(office, ["room-1", "room-4"], blocked={"rooms": [name]})
        assert name not in {leg.room for leg in tour.legs}
        start, goal = topology.rooms.point_of("room-1"), topology.rooms.point_of("room-4")
        result = office.plan(start, goal, blocked={"rooms": [name]})
        best = optimum(topology, (start, goal), removed=inside)
        assert result.cost == pytest.approx(best) or best == result.cost == math.inf
        assert result.lower_bound == result.cost


@presets
def test_each_door_of_the_house_shuts_alone(planners, preset):
    planner = planners[preset]
    topology = planner.topology
    cols = topology.grid.shape[1]
    points = [topology.grid.frame.points_of(cell) for cell in ((9, 2), (9, 12), (1, 7), (4, 5))]
    doors = topology.rooms.doors
    assert [set(door.rooms) for door in doors].count({"kitchen", "lab"}) == 2
    assert len(doors) == 4
    for closed in [*itertools.combinations(doors, 1), *itertools.combinations(doors, 2)]:
        shut = set().union(*(crossings(topology, door) for door in closed))
        for start, goal in itertools.combinations(points, 2):
            result = planner.plan(start, goal, blocked={"doors": [d.number for d in closed]})
            best = optimum(topology, (start, goal), without=shut)
            assert result.solved == (best < math.inf)
            if result.path is not None:
                assert not moves_of([result.path], cols) & shut
                if result.metric == "any-angle":
                    assert math.dist(start, goal) <= result.cost <= best * (1 + 1e-9)
                    assert result.gap == 0
                    continue
                assert best <= result.cost * (1 + 1e-9)
                assert result.lower_bound <= result.cost
    both = [d for d in doors if set(d.rooms) == {"kitchen", "lab"}]
    first, second = (
        hn.plan_tour(planner, ["kitchen", "lab"], blocked={"doors": [door]}, at="point")
        for door in both
    )
    assert [leg.door for leg in first.legs if leg.door] == both[1:]
    assert [leg.door for leg in second.legs if leg.door] == both[:1]
    round_the_hall = hn.plan_tour(planner, ["kitchen", "lab"], blocked={"doors": both}, at="point")
    assert [leg.room for leg in round_the_hall.legs] == ["kitchen", "hall", "lab"]
    everything = planner.plan("kitchen", "lab", blocked={"doors": doors})
    assert everything.status is hn.PlanStatus.NO_PATH


@presets
def test_ends_in_a_closed_room_are_named(planners, preset):
    planner = planners[preset]
    inside, outside = planner.grid.frame.points_of([(9, 2), (1, 7)])
    closed = {"rooms": ["kitchen"]}
    assert planner.plan(inside, outside, blocked=closed).status is hn.PlanStatus.START_BLOCKED
    assert planner.plan(outside, inside, blocked=closed).status is hn.PlanStatus.GOAL_BLOCKED
    assert planner.plan("lab", "kitchen", blocked=closed).status is hn.PlanStatus.GOAL_BLOCKED
    tour = hn.plan_tour(planner, ["hall", "lab", "kitchen"], blocked=closed)
    assert tour.status is hn.PlanStatus.GOAL_BLOCKED
    assert [result.solved for result in tour.results] == [True, False]


@presets
@pytest.mark.parametrize("smooth", [None, "line-of-sight"])
def test_many_answers_are_those_of_one_whatever_is_closed(planners, preset, smooth):
    planner = planners[preset]
    grid = planner.grid
    cells = np.random.default_rng(7).integers(-1, np.array(grid.shape) + 1, size=(2, 60, 2))
    starts, goals = grid.frame.points_of(cells)
    door = planner.topology.rooms.doors[0]
    area = shapely.LineString([(0.5, 4.3), (3.4, 4.3)])
    for closed in (door, {"rooms": ["hall"]}, area, {"doors": [1, 2], "polygons": [area]}, {}):
        batch = planner.plan_many(starts, goals, smooth=smooth, blocked=closed)
        endpoints = zip(starts, goals, strict=True)
        single = [planner.plan(*pair, smooth=smooth, blocked=closed) for pair in endpoints]
        assert batch.status.tolist() == [str(result.status) for result in single]
        assert batch.cost.tolist() == [result.cost for result in single]
        assert batch.lower_bound.tolist() == [result.lower_bound for result in single]
        for i, result in enumerate(single):
            if result.path is not None:
                points = batch.points[batch.path_start[i] : batch.path_start[i + 1]]
                np.testing.assert_allclose(points, result.path.points)
    assert {"start blocked", "solved"} <= set(
        planner.plan_many(starts, goals, blocked={"rooms": ["hall"]}).status.tolist()
    )


def test_alternatives_go_by_no_door_that_is_shut(planners: dict[str, hn.HybridPlanner]) -> None:
    planner = planners["octile"]
    topology = planner.topology
    cols = topology.grid.shape[1]
    start, goal = topology.grid.frame.points_of([(9, 2), (9, 12)])
    opened = [other.doors for other in hn.plan_alternatives(planner, start, goal, 3)]
    assert len(opened) > 1
    for door in topology.rooms.doors:
        shut = crossings(topology, door)
        found = hn.plan_alternatives(planner, start, goal, 3, blocked=door)
        still = {doors for doors in opened if door.number not in doors}
        assert still <= {other.doors for other in found}
        assert not moves_of([other.path for other in found], cols) & shut
        assert found[0].path.length_m == planner.plan(start, goal, blocked=door).cost
    closed = hn.plan_alternatives(planner, "kitchen", "lab", 5, blocked={"rooms": ["lab"]})
    assert closed.complete
    assert not closed
    # What was closed for one query is open for the next.
    assert [other.doors for other in hn.plan_alternatives(planner, start, goal, 3)] == opened


@st.composite
def divided_maps(draw: st.DrawFn) -> hn.TopologicalMap:
    """Draw maps with rooms: rectangles painted over each other, and space without a name."""
    grid = occupancy_grid(draw(class_grids(12)))
    rng = np.random.default_rng(draw(seeds))
    count = int(rng.integers(1, 5))
    label_of = np.full(grid.shape, -1, dtype=np.int32)
    for label in range(count):
        (low, high), (left, right) = (np.sort(rng.integers(0, side + 1, 2)) for side in grid.shape)
        label_of[low:high, left:right] = label
    rooms = hn.RoomLabels(tuple(f"room {label}" for label in range(count)), label_of)
    merge_distance_m = float(rng.choice([1.5, 4.0]))
    return hn.TopologicalMap(
        hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m, rooms=rooms)
    )


@given(topology=divided_maps(), seed=seeds)
@settings(max_examples=examples(120), deadline=None, derandomize=True)
def test_no_plan_crosses_a_shut_door_wherever_rooms_are(topology, seed):
    grid, doors = topology.grid, topology.rooms.doors
    free = np.argwhere(grid.enterable())
    if not doors:
        return
    rng = np.random.default_rng(seed)
    planner = hn.HybridPlanner(topology, preset="octile")
    for door in rng.choice(np.array(doors, dtype=object), min(3, len(doors)), replace=False):
        shut = crossings(topology, door)
        endpoints = grid.frame.points_of(rng.choice(free, 2))
        result = planner.plan(*endpoints, blocked={"doors": [door.number]})
        opened = planner.plan(*endpoints)
        best = optimum(topology, endpoints, without=shut)
        closed = Blocked(doors=[door]).cells_of(topology)
        assert set(closed.tolist()) <= set().union(*shut)
        remaining = grid.enterable()
        remaining.ravel()[closed] = False
        graph = move_graph(remaining).tocoo()
        moves = set(map(frozenset, zip(graph.row.tolist(), graph.col.tolist(), strict=True)))
        assert not moves & shut
        if result.path is not None:
            assert not moves_of([result.path], grid.shape[1]) & shut
            assert best <= result.cost * (1 + 1e-9)
            assert opened.lower_bound <= result.cost * (1 + 1e-9)
            assert result.lower_bound <= optimum(topology, endpoints, removed=~remaining) * (
                1 + 1e-9
            )


@given(topology=divided_maps())
@settings(max_examples=examples(60), deadline=None, derandomize=True)
def test_a_closed_room_loses_all_its_cells_and_no_others(topology: hn.TopologicalMap) -> None:
    labels = topology.rooms.labels
    for label, name in enumerate(labels.names):
        closed = Blocked(rooms=[name]).cells_of(topology)
        assert closed.tolist() == np.flatnonzero(labels.label_of == label).tolist()


def test_arcs_of_any_level_close_with_the_arc_s_own_boundary() -> None:
    topology = house()
    for level in topology.pyramid:
        for arc in np.flatnonzero(~level.is_self_loop)[:20].tolist():
            closed = Blocked(arcs=[LevelArc(level.index, arc)]).cells_of(topology)
            pairs = level.boundary(arc) @ np.array([topology.grid.shape[1], 1])
            assert np.isin(pairs, closed).any(axis=1).all()
            assert np.isin(closed, pairs).all()
    places = topology.pyramid.place_level
    assert (
        Blocked(arcs=[LevelArc(places, 1)]).cells_of(topology).tolist()
        == Blocked(arcs=[1]).cells_of(topology).tolist()
    )


def test_two_closures_close_what_either_closes() -> None:
    topology = house()
    line = shapely.LineString([(1.0, 4.3), (3.0, 4.3)])
    parts = [
        Blocked(doors=[1]),
        Blocked(rooms=["hall"]),
        Blocked(cells=[(9, 3)]),
        Blocked(polygons=[line]),
        Blocked(places=[0], arcs=[2, *topology.rooms.doors[1].arcs]),
    ]
    whole = parts[0] | parts[1] | parts[2] | parts[3] | parts[4]
    each = [part.cells_of(topology) for part in parts]
    assert whole.cells_of(topology).tolist() == np.unique(np.concatenate(each)).tolist()
    with pytest.raises(TypeError):
        _ = parts[0] | {"rooms": ["hall"]}  # type: ignore[operator]


@presets
@pytest.mark.parametrize(
    ("closed", "message"),
    [
        ({"doors": [5]}, "no door has the number 5: the doors are 1-4; hybridnav rooms"),
        ({"doors": [0]}, "no door has the number 0"),
        ({"rooms": ["kichen"]}, "no room is called 'kichen': did you mean kitchen"),
        ({"rooms": ["hall", ""]}, "no room is called ''"),
        ({"arcs": [LevelArc(99, 0)]}, "there is no level 99, levels are 0 to"),
        ({"arcs": [LevelArc(0, 10**6)]}, "there is no arc 1000000 at level 0 of this map, it has"),
        ({"arcs": [10**6]}, "there is no arc 1000000 on this map"),
        ({"cells": [(99, 0)]}, "cells must lie on the map"),
        (shapely.box(90, 90, 91, 91), "an area must meet the map, which spans x 0.00 to 7.50 m"),
    ],
)
def test_what_names_nothing_is_refused(planners, preset, closed, message):
    planner = planners[preset]
    start, goal = planner.grid.frame.points_of([(9, 2), (9, 12)])
    asked = (
        lambda: planner.plan(start, goal, blocked=closed),
        lambda: planner.plan("kitchen", "lab", blocked=closed),
        lambda: planner.plan_many([start], [goal], blocked=closed),
        lambda: hn.plan_tour(planner, ["kitchen", "lab"], blocked=closed),
        lambda: hn.plan_alternatives(planner, "kitchen", "lab", 2, blocked=closed),
    )
    for ask in asked:
        with pytest.raises(hn.errors.InvalidValueError, match=message) as caught:
            ask()
        assert "\n" not in str(caught.value)


def test_a_door_of_another_map_is_refused() -> None:
    topology = house()
    door = topology.rooms.doors[0]
    assert Blocked(doors=[replace(door)]).cells_of(topology).size
    for other in (
        replace(door, position=(1.0, 1.0)),
        replace(door, number=2),
        replace(door, rooms=("attic", "kitchen")),
    ):
        with pytest.raises(
            hn.errors.InvalidValueError, match=f"door {other.number} is one of another"
        ):
            Blocked(doors=[other]).cells_of(topology)


def test_what_is_closed_again_is_not_searched_for_again(planners, monkeypatch):
    planner = planners["shortest"]
    door = planner.topology.rooms.doors[0]
    area = shapely.box(1.0, 1.0, 1.4, 1.4)
    forms = ({"doors": [2]}, door, area, {"rooms": ["hall"], "doors": [door]}, {"cells": [(9, 3)]})

    def closed(form: Any) -> list[int]:
        cells = planner.closed(form)
        return list(cells.flat)

    cells = [closed(form) for form in forms]
    # What is asked for again and again stays, whatever else is closed between.
    searched, cells_of = [], Blocked.cells_on

    def counted(*given: Any) -> Any:
        searched.append(given)
        return cells_of(*given)

    monkeypatch.setattr(Blocked, "cells_on", counted)
    for col in range(20):
        assert closed({"cells": [(col % 10, col // 10)]}) == [col % 10 * 15 + col // 10]
        assert [closed(form) for form in forms] == cells
    assert len(searched) == 20
    monkeypatch.setattr(Blocked, "cells_of", None)
    assert [closed(form) for form in forms] == cells
    assert closed(shapely.box(1.0, 1.0, 1.4, 1.4)) == cells[2]
    monkeypatch.undo()
    assert closed(shapely.box(1.0, 1.0, 1.9, 1.9)) != cells[2]


def test_a_map_without_rooms_has_no_doors_to_close() -> None:
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(HOUSE)))
    for closed in (Blocked(doors=[1]), Blocked(rooms=["hall"])):
        with pytest.raises(hn.errors.InvalidValueError, match="has no rooms"):
            closed.cells_of(topology)
