"""Pickles and deep copies of everything public: equal arrays, equal flags, equal answers."""

import copy
import importlib.util
import pickle
import subprocess
import sys
import weakref
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher
from shapely import box

import hybridnav as hn
from benchmarks.baselines.hpa import HpaStar
from benchmarks.baselines.thrun import ThrunMap
from hybridnav._base.threads import Pool
from hybridnav.ext.live import OnlinePyramid, OnlineRooms
from hybridnav.harness.baselines.regions import SimpleGraphPyramid
from hybridnav.planning import PlanBatch
from hybridnav.search.grid_search import GridSearch
from tests.strategies import Scene, scenes, tried

FIGURE1 = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"


def pickled(thing: Any) -> Any:
    return restored(pickle.dumps(thing))


def restored(data: bytes) -> Any:
    return pickle.loads(data)  # noqa: S301 - our own


START, GOAL = (0.55, 0.55), (2.55, 2.85)
QUICK = [name for name in hn.preset_names() if name != "ompl"]
WAYS = pytest.mark.parametrize("copied", [pickled, copy.deepcopy], ids=["pickle", "deep"])


@cache
def topology() -> hn.TopologicalMap:
    grid = hn.load_map(FIGURE1, robot_radius_m=0)
    label_of = np.zeros(grid.shape, np.int32)
    label_of[:, grid.shape[1] // 2 :] = 1
    labels = hn.RoomLabels(("west", "east"), label_of, points={"dock": START})
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0, rooms=labels))


@cache
def planner(preset: str) -> hn.HybridPlanner:
    return hn.HybridPlanner(topology(), preset=preset)


@cache
def things() -> dict[str, Any]:
    """One of every public kind, with what it finds lazily found."""
    topo = topology()
    found = {
        "grid": topo.grid,
        "frame": topo.grid.frame,
        "pyramid": topo.pyramid,
        "level": topo.level,
        "topology": topo,
        "rooms": topo.rooms,
        "labels": topo.rooms.labels,
        "door": topo.rooms.doors[0],
        "preset": hn.load_preset("paper"),
        "blocked": hn.Blocked(cells=[[1, 1]], polygons=[box(0, 0, 1, 1)]),
        "one-way": hn.OneWay(sides=[[1, 1, 1, 2]], lines=[[(1, 0), (1, 2)]]),
        "tour": hn.plan_tour(planner("shortest"), [START, topo.rooms.names[0], GOAL]),
        "alternatives": hn.plan_alternatives(planner("shortest"), START, GOAL, 2),
        "dual": topo.level.dual,
        "map": topo.pyramid[0].darts,
        "islands": topo.pyramid.islands,
        "simple-graph": SimpleGraphPyramid(topo),
        "hpa": HpaStar(topo.grid),
        "thrun": ThrunMap(topo.grid),
    }
    found |= followed(topo.grid)
    for name in QUICK:
        found[f"planner {name}"] = planner(name)
        found[f"result {name}"] = planner(name).plan(START, GOAL).raise_for_status()
        found[f"line {name}"] = planner(name).plan(START, GOAL, smooth="line-of-sight")
        found[f"batch {name}"] = planner(name).plan_many([START], [GOAL])
    return found


def followed(grid: hn.OccupancyGrid) -> dict[str, Any]:
    places = OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    rooms = OnlineRooms.of(grid, topology().rooms.labels).with_name(1, "first")
    probability = grid.probability.copy()
    probability[5:8, 5:14] = 1.0
    update = places.update(replace(grid, probability=probability))
    now = update.version.pyramid.grid  # levels are found lazily
    return {"places": update, "rooms update": rooms.update(now)}


@WAYS
def test_copies_of_versions_follow_a_map_alike(copied: Any) -> None:
    grid = topology().grid
    for update in followed(grid).values():
        version, other = update.version, copied(update).version
        one, two = (each.update(grid) for each in (version, other))
        np.testing.assert_array_equal(one.version.number_of, two.version.number_of)
        assert (one.born, one.died, one.merged) == (two.born, two.died, two.merged)


def held_by(thing: Any) -> dict[str, Any]:
    """What an object holds; a copy of a path has its arrays, not how to find them."""
    if isinstance(thing, hn.Path):
        return {name: getattr(thing, name) for name in ("cells", "points", "length_m")}
    return vars(thing)


def assert_alike(one: Any, other: Any, done: set[int]) -> None:
    """All that two objects hold is equal, and read-only where the other's is."""
    assert type(one) is type(other)
    if id(one) in done:
        return
    done.add(id(one))
    if isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other)
        assert (one.dtype, one.flags.writeable) == (other.dtype, other.flags.writeable)
        assert one.flags.c_contiguous == other.flags.c_contiguous
    elif isinstance(one, dict | MappingProxyType):
        assert sorted(map(str, one)) == sorted(map(str, other))
        for name in one:
            assert_alike(one[name], other[name], done)
    elif isinstance(one, list | tuple):
        assert len(one) == len(other)
        for first, second in zip(one, other, strict=True):
            assert_alike(first, second, done)
    elif isinstance(one, GridSearch | Pool | hn.PlanResult | PlanBatch):
        pass  # searches anew, and told by now; what both answer is asked for elsewhere
    elif type(one).__module__.startswith("hybridnav") and hasattr(one, "__dict__"):
        assert_alike(held_by(one), held_by(other), done)
    elif isinstance(one, int | float | str):
        assert repr(one) == repr(other)


def kernels() -> dict[str, int]:
    """How often each kernel was compiled for other types, or loaded."""
    return {
        f"{module}.{name}": len(kernel.signatures)
        for module in sorted(sys.modules)
        if module.startswith("hybridnav") and sys.modules[module] is not None
        for name, kernel in vars(sys.modules[module]).items()
        if isinstance(kernel, CPUDispatcher)
    }


def told(result: hn.PlanResult) -> dict[str, Any]:
    return {key: value for key, value in result.to_dict().items() if key != "seconds"}


@WAYS
def test_everything_comes_back_as_it_was(copied: Any) -> None:
    for name, thing in things().items():
        try:
            assert_alike(thing, copied(thing), set())
        except BaseException as error:
            error.add_note(name)
            raise


@WAYS
def test_a_shallow_copy_of_a_copy_works_too(copied: Any) -> None:
    labels = copy.copy(copied(topology().rooms.labels))
    assert labels.points == {"dock": START}
    with pytest.raises(TypeError):
        labels.points["dock"] = (0.0, 0.0)
    with pytest.raises(ValueError, match="read-only"):
        labels.label_of[0, 0] = 0


@WAYS
@pytest.mark.parametrize("preset", QUICK)
def test_a_copied_planner_answers_alike_without_compiling_anything(preset, copied):
    original = planner(preset)
    room = topology().rooms.names[0]

    def asked(who: hn.HybridPlanner) -> list[Any]:
        single = [
            who.plan(START, GOAL),
            who.plan(START, GOAL, smooth="line-of-sight"),
            who.plan(GOAL, room, blocked={"cells": [[9, 9]]}),
        ]
        batch = who.plan_many([START, GOAL], [GOAL, START])
        return [*map(told, single), batch.cost.tolist(), batch.points.tolist()]

    expected = asked(original)
    other = copied(original)
    before = kernels()
    assert asked(other) == expected
    fresh = hn.HybridPlanner(hn.TopologicalMap(copied(topology().pyramid)), preset=preset)
    assert asked(fresh) == expected
    if before:  # none with the JIT off
        assert kernels() == before


@WAYS
def test_copied_baselines_answer_alike(copied: Any) -> None:
    method: Any = SimpleGraphPyramid(topology())
    cells = topology().grid.frame.cells_of([START, GOAL]).tolist()
    found = [who.solve(*map(tuple, cells)).cells for who in (method, copied(method))]
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("preset", QUICK)
def test_a_result_travels_without_its_planner(preset: str) -> None:
    result = planner(preset).plan(START, GOAL).raise_for_status()
    data = pickle.dumps(result)
    arrays = result.path.cells.nbytes + result.path.points.nbytes
    assert len(data) < arrays + 4000
    assert b"HybridPlanner" not in data
    again = restored(data)
    assert told(again) == told(result)
    assert again.route == result.route
    assert pickle.dumps(again) == pickle.dumps(pickled(again))
    with pytest.raises(ValueError, match="read-only"):
        again.path.points[0] = 0.0


@WAYS
@pytest.mark.parametrize("preset", QUICK)
def test_results_of_all_kinds_travel_without_their_planner(preset: str, copied: Any) -> None:
    shut = {"cells": np.argwhere(~topology().grid.enterable())}
    for ends in ((START, GOAL), (START, START), (START, (99.0, 0.0)), (START, "east")):
        plan, unread = (planner(preset).plan(*ends, blocked=shut) for _ in range(2))
        other = copied(unread)  # nothing of it was read before
        assert (other.status, other.cost, other.lower_bound) == (
            plan.status,
            plan.cost,
            plan.lower_bound,
        )
        assert told(other) == told(plan)
        assert b"HybridPlanner" not in pickle.dumps(unread)
        assert b"OverMesh" not in pickle.dumps(unread)
        assert told(copied(other)) == told(plan)


def test_a_result_is_read_where_there_is_no_map(tmp_path: Path) -> None:
    result = planner("shortest").plan(START, GOAL)
    (tmp_path / "result").write_bytes(pickle.dumps(result))
    script = (
        "import pickle, sys\n"
        f"result = pickle.load(open({str(tmp_path / 'result')!r}, 'rb'))\n"
        "print(result.cost, *result.route.places)\n"
        "assert 'hybridnav.planning.planner' not in sys.modules and 'numba' not in sys.modules\n"
    )
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert run.stdout.split() == [str(result.cost), *map(str, result.route.places)]


@tried(25, scene=scenes())
def test_a_copied_search_finds_the_same_paths(scene: Scene) -> None:
    enterable = scene.grid.enterable()
    free = np.argwhere(enterable)
    if not len(free):
        return
    for corner_cutting in (False, True):
        search = GridSearch(enterable, corner_cutting=corner_cutting)
        other = pickled(search)
        for goal in free[:: max(1, len(free) // 5)]:
            endpoints = tuple(free[0].tolist()), tuple(goal.tolist())
            one, two = search.search(*endpoints), other.search(*endpoints)
            np.testing.assert_array_equal(one.cells, two.cells)
            assert one.expanded == two.expanded


def test_a_copied_search_does_not_hold_the_original() -> None:
    search = GridSearch(np.ones((4, 4), dtype=np.bool_))
    moves = weakref.ref(search._moves)
    other = copy.deepcopy(search)
    del search
    assert moves() is None
    blocked = np.array([5])
    found = other.search((0, 0), (3, 3), blocked=blocked)
    assert [1, 1] not in found.cells.tolist()


@pytest.mark.skipif(importlib.util.find_spec("ompl") is None, reason="OMPL is not installed")
def test_a_planner_with_ompl_is_copied_and_starts_its_own_process() -> None:
    preset = hn.load_preset("ompl", overrides=["planner.ompl.budget_s=0.5"])
    original = hn.HybridPlanner(topology(), preset=preset)
    result = original.plan(START, GOAL)
    data = pickle.dumps(original)
    original.close()
    for other in (restored(data), copy.deepcopy(original)):
        again = other.plan(START, GOAL).raise_for_status()
        assert not again.refinement.by_grid
        other.close()
    again = pickled(result)
    assert told(again) == told(result)
    assert len(pickle.dumps(result)) < 20_000
