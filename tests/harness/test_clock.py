"""No time that is shown contains a compilation."""

import json
import threading
import time

import numba
import numpy as np
import pytest
from numba.core.compiler_lock import global_compiler_lock

import hybridnav as hn
from hybridnav._base.clock import clock
from hybridnav.ext.fleet import load_building
from hybridnav.ext.fleet.search import LinkSearch
from hybridnav.ext.live import OnlinePyramid, OnlineRooms, replay
from hybridnav.ext.live.explore import explore
from hybridnav.ext.live.mapping import Mapper
from hybridnav.harness import RunSettings, write_records
from hybridnav.harness.records import read_records
from hybridnav.search.grid_search import GridSearch
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import ROOT, label_of, name_of, write_map

LONG_S = 1000.0
passed_s = 0.0


@pytest.fixture(autouse=True)
def _long_days(monkeypatch):
    """Let 1000 s pass at each call of `compile_long`."""
    right = time.perf_counter
    monkeypatch.setattr(time, "perf_counter", lambda: right() + passed_s)


def compile_long():
    """Hold numba's lock for long, as it does while it compiles a function."""
    global passed_s  # noqa: PLW0603 - the time of day
    with global_compiler_lock, global_compiler_lock:
        passed_s += LONG_S


def test_the_clock_stands_still_while_numba_compiles():
    began, work = time.perf_counter(), clock()
    compile_long()
    passed = time.perf_counter() - began
    assert passed - (clock() - work) >= LONG_S - 1e-6
    numba.njit(lambda x: x + 1)(np.float32(1))
    assert time.perf_counter() - began - (clock() - work) > LONG_S


def test_the_clock_goes_on_while_another_thread_compiles():
    other = threading.Thread(target=compile_long)
    work = clock()
    other.start()
    other.join()
    assert clock() - work >= LONG_S


class Compiles(faulty.Sound):
    """A method that compiles for long in its construction and at each query, but not in warm-up."""

    def __init__(self, grid):
        super().__init__(grid)
        self._long = grid.shape != faulty.WARM_UP_SHAPE
        if self._long:
            compile_long()

    def solve(self, start, goal):
        if self._long:
            compile_long()
        return super().solve(start, goal)


@pytest.mark.usefixtures("here")
def test_no_time_of_a_record_contains_a_compilation(tmp_path):
    settings = RunSettings(
        maps=(str(write_map(tmp_path, ["....", "...."])),),
        presets=(),
        baselines=(name_of(Compiles),),
        pairs=2,
        repeat=1,
    )
    write_records(settings, tmp_path / "run")
    records = read_records(tmp_path / "run")
    own = [one for one in records if one["method"] == label_of(Compiles)]
    seconds = [one["method_seconds" if "method_seconds" in one else "seconds"] for one in own]
    timed = [times for one in records for times in one.get("times", {}).values()]
    assert len(seconds) == 3
    assert len(timed) == 4
    assert all(one < LONG_S for one in [*seconds, *(s for times in timed for s in times)])


def test_no_time_of_a_comparison_contains_a_compilation(tmp_path, cli, monkeypatch):
    slowed(monkeypatch, GridSearch, "search")
    file = write_map(tmp_path, ["....", "...."])
    ends = "--start=0.5,0.5", "--goal=2.5,1.5"
    for preset in ("shortest", "grid-astar"):
        words = (*ends, "--compare", "--robot-radius", "0", "--preset", preset, "--json")
        figures = json.loads(cli("plan", file, *words).out)
        assert figures["grid_seconds"] < LONG_S
        assert all(seconds < LONG_S for seconds in figures["seconds"].values())


def slowed(monkeypatch, owner, name):
    """Let a method compile for long whenever it is called."""
    right = getattr(owner, name)

    def slow(*given, **more):
        compile_long()
        return right(*given, **more)

    monkeypatch.setattr(owner, name, slow)


def test_no_time_of_the_wing_contains_a_compilation(monkeypatch):
    """Of maps that change, explorations, and routes over floors."""
    grid = hn.OccupancyGrid(np.zeros((9, 21), np.float32), hn.Frame(0.25), robot_radius_m=0)
    building = load_building(ROOT / "maps/building/building.yaml")
    for owner, name in (
        (hn.DualGraphPyramid, "build"),
        (OnlinePyramid, "update"),
        (OnlineRooms, "of"),
        (OnlineRooms, "update"),
        (Mapper, "add"),
        (hn.HybridPlanner, "plan"),
        (LinkSearch, "best"),
    ):
        slowed(monkeypatch, owner, name)
    before = passed_s
    first, second = replay([grid, grid])
    seconds = [first.seconds, first.rooms_seconds, second.seconds, second.rooms_seconds]
    seconds += explore(hn.example_map(robot_radius_m=0.1), most_goals=2).seconds.values()
    floor, other = building.floors[0], building.floors[-1]
    ends = [(one.name, one.rooms.names[0]) for one in (floor, other) if one.rooms]
    plan = building.plan(ends[0], ends[1])
    assert plan.solved
    seconds += plan.stats.seconds.values()
    assert passed_s - before > 5 * LONG_S
    assert max(seconds) < LONG_S


def test_only_deadlines_are_told_by_another_clock():
    read = {
        str(path.relative_to(ROOT / "src/hybridnav"))
        for path in (ROOT / "src/hybridnav").rglob("*.py")
        if "perf_counter" in path.read_text(encoding="utf-8")
    }
    mesh = {"search/mesh/search.py"}
    assert read == {"_base/clock.py", "_base/compiler.py", *mesh}
