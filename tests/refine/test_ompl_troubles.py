"""What a query with OMPL costs when the search hangs, crashes or fails: its time, no more."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.worlds import office_world
from hybridnav.harness.judges import segment_faults
from hybridnav.planning import load_preset
from hybridnav.refine.ompl import client
from tests.refine.troubled_query import TroubledQuery

pytest.importorskip("ompl")

ROOT = Path(__file__).parents[2]
ENDS = (1.0, 13.2), (40.6, 19.4)
BUDGET_S = 1.0
START_S = 60.0
OVER_PLACES = "planner.along=paper"
"""For processes of their own, which would prepare a mesh."""
LATE = "the worker did not answer in time"
"""What a busy machine can make of the first of these."""
REASONS = {
    "hang": "killed when the time was over",
    "crash": "the planner crashed",
    "failure": "the search failed, ZeroDivisionError: failure on purpose",
}


@pytest.fixture(scope="module")
def planner() -> Iterator[hn.HybridPlanner]:
    """Its worker finds the troubled query in the tests."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("PYTHONPATH", str(ROOT))
        yield office_planner()


def office_planner() -> hn.HybridPlanner:
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(office_world().grid(robot_radius_m=0.25))
    )
    preset = load_preset("ompl", overrides=[f"planner.ompl.budget_s={BUDGET_S}"])
    return hn.HybridPlanner(topology, preset=preset)


def worker_of(planner: hn.HybridPlanner) -> Any:
    assert planner._now.ompl is not None
    return planner._now.ompl._worker


@pytest.fixture
def troubled(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Make queries troubled from now on; without a kind no more."""

    def arm(trouble: str | None, *, after_path: bool = False) -> None:
        made = hn.refine.ompl.OmplQuery if trouble is None else partial(
            TroubledQuery, trouble=trouble, after_path=after_path
        )  # fmt: skip
        monkeypatch.setattr("hybridnav.planning.methods.ompl.OmplQuery", made)

    return arm


def children_of(pid: int) -> list[int]:
    return [int(p) for p in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def gone(pid: int, *, within_s: float) -> bool:
    """Whether a process ends in time; one that nobody has waited for yet has ended too."""
    until = time.monotonic() + within_s
    while time.monotonic() < until:
        try:
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (FileNotFoundError, ProcessLookupError):
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize("trouble", list(REASONS))
def test_trouble_before_a_path_costs_the_time_at_most_and_the_grid_takes_over(
    planner: hn.HybridPlanner, troubled: Callable[..., None], trouble: str
) -> None:
    troubled(trouble)
    spent = []
    for _ in range(3):
        began = time.perf_counter()
        result = planner.plan(*ENDS)
        spent.append(time.perf_counter() - began)
        assert result.status is hn.PlanStatus.SOLVED
        assert result.refinement is not None
        assert result.refinement.by_grid
        reasons = {REASONS[trouble], LATE} if trouble == "hang" else {REASONS[trouble]}
        assert result.refinement.steps[0] in reasons
        assert children_of(worker_of(planner)._running.process.pid) == []
    # The promise; a busy machine adds to some of the three what it takes to wake a process up.
    assert min(spent) <= 1.1 * BUDGET_S
    assert max(spent) <= 1.5 * BUDGET_S
    troubled(None)
    assert planner.plan(*ENDS).refinement.by_grid is False


@pytest.mark.parametrize("trouble", list(REASONS))
def test_what_was_found_before_the_trouble_counts(planner, troubled, trouble):
    troubled(trouble, after_path=True)
    result = planner.plan(*ENDS)
    assert result.status is hn.PlanStatus.SOLVED
    assert result.refinement is not None
    assert result.refinement.by_grid is False
    assert result.refinement.steps[-1] in {REASONS[trouble], LATE}
    assert result.path is not None
    assert segment_faults(planner.grid, result.path.points) == ()
    assert result.lower_bound <= result.cost


@pytest.mark.parametrize(
    ("planner_name", "confine"),
    [
        ("RRTstar", "mask"),
        ("InformedRRTstar", "mask"),
        ("BITstar", "mask"),
        ("BITstar", "chain"),
        ("PRMstar", "mask"),
    ],
)
def test_planners_that_go_on_keep_to_their_time(planner, planner_name, confine):
    settings = f"{{planner: {planner_name}, confine: {confine}, budget_s: {BUDGET_S}}}"
    preset = load_preset("ompl", overrides=[f"planner.ompl={settings}"])
    made = hn.HybridPlanner(planner.topology, preset=preset)
    spent = []
    for _ in range(2):
        began = time.perf_counter()
        assert made.plan(*ENDS).solved
        spent.append(time.perf_counter() - began)
    assert min(spent) <= 1.1 * BUDGET_S


def test_a_worker_that_dies_is_started_beside_the_queries(planner: hn.HybridPlanner) -> None:
    worker = worker_of(planner)
    first = worker._running.process
    os.kill(first.pid, signal.SIGKILL)
    first.wait()
    began, spent = time.monotonic(), []
    while time.monotonic() - began < START_S:
        asked = time.perf_counter()
        result = planner.plan(*ENDS)
        spent.append(time.perf_counter() - asked)
        assert result.solved
        assert result.refinement is not None
        if not result.refinement.by_grid:
            break
    assert result.refinement is not None
    assert result.refinement.by_grid is False
    assert worker._running.process.pid != first.pid
    assert np.median(spent) <= 1.1 * BUDGET_S
    assert max(spent) <= 2 * BUDGET_S


def test_a_fork_does_not_outlive_its_worker(planner, troubled):
    troubled("hang")
    worker = worker_of(planner)
    results: list[hn.PlanResult] = []
    query = threading.Thread(target=lambda: results.append(planner.plan(*ENDS)))
    query.start()
    until = time.monotonic() + BUDGET_S
    while not (forks := children_of(worker._running.process.pid)) and time.monotonic() < until:
        time.sleep(0.01)
    worker._running.process.send_signal(signal.SIGKILL)
    query.join(10 * BUDGET_S)
    assert results[0].refinement is not None
    assert results[0].refinement.by_grid
    assert forks
    assert all(gone(fork, within_s=BUDGET_S) for fork in forks)


def test_nothing_outlives_a_planner_that_is_killed(tmp_path: Path) -> None:
    code = f"""
import hybridnav as hn
from functools import partial
from benchmarks.worlds import office_world
from hybridnav.planning.methods import ompl
from tests.refine.troubled_query import TroubledQuery
grid = office_world().grid(robot_radius_m=0.25)
preset = hn.load_preset("ompl", overrides=["{OVER_PLACES}"])
planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), preset=preset)
print(planner._now.ompl._worker._running.process.pid, flush=True)
ompl.OmplQuery = TroubledQuery
planner.plan(*{ENDS})
"""
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    started = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=env, cwd=tmp_path
    )
    assert started.stdout is not None
    server = int(started.stdout.readline())
    until = time.monotonic() + 10
    while not (forks := children_of(server)) and time.monotonic() < until:
        time.sleep(0.01)
    started.kill()
    started.wait()
    started.stdout.close()
    assert forks
    assert all(gone(pid, within_s=10 * BUDGET_S) for pid in [*forks, server])


def test_ctrl_c_ends_a_search_that_has_an_hour_left(tmp_path: Path) -> None:
    code = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    code += "from hybridnav.cli import main; main()"
    points = ["--start", "1.0,13.2,0", "--goal", "40.6,19.4,0"]
    settings = ["--preset", "ompl", "--set", "planner.ompl.planner=RRTstar"]
    settings += ["--set", "planner.ompl.space=se2"]
    settings += ["--set", "planner.ompl.budget_s=3600", "--set", OVER_PLACES]
    office = str(ROOT / "maps" / "office" / "office.yaml")
    command = [sys.executable, "-c", code, "plan", office, *points, *settings]
    with subprocess.Popen(command, stderr=subprocess.PIPE, cwd=tmp_path) as planning:
        servers: list[int] = []
        forks: list[int] = []
        lasting: list[int] = []  # a start too has children, for a moment
        until = time.monotonic() + START_S
        while not lasting and time.monotonic() < until and planning.poll() is None:
            time.sleep(0.5)
            before, servers = forks, children_of(planning.pid)
            forks = [fork for server in servers for fork in children_of(server)]
            lasting = [fork for fork in forks if fork in before]
        planning.send_signal(signal.SIGINT)
        complaint = planning.communicate(timeout=START_S)[1]
    assert (planning.returncode, complaint) == (130, b"")
    assert lasting
    assert all(gone(pid, within_s=5) for pid in [*lasting, *servers])


def test_a_closed_planner_plans_again_at_once(planner: hn.HybridPlanner) -> None:
    planner.close()
    result = planner.plan(*ENDS)
    assert result.refinement is not None
    assert result.refinement.by_grid is False


def test_queries_of_two_threads_do_not_mix(planner: hn.HybridPlanner) -> None:
    other = (20.0, 5.0), (1.0, 13.2)
    found: list[tuple[Any, Any]] = []

    def ask(endpoints: Any) -> None:
        assert planner._now.ompl is not None
        poses = tuple(np.append(end, 0.0) for end in endpoints)
        cells = cells_of[endpoints]
        for _ in range(4):
            plan = planner._now.ompl.plan(cells, (poses[0], poses[1]), None)
            assert plan.path is not None
            found.append((endpoints, plan.path.points[[0, -1]].tolist()))

    cells_of = {endpoints: planner.plan(*endpoints).path.cells for endpoints in (ENDS, other)}
    threads = [threading.Thread(target=ask, args=(endpoints,)) for endpoints in (ENDS, other)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    for endpoints, reached in found:
        np.testing.assert_allclose(reached, endpoints, atol=1e-9)


def test_a_fork_has_a_worker_of_its_own_and_leaves_that_of_its_parent(planner):
    before = worker_of(planner)._running.process.pid
    child = os.fork()
    if child == 0:
        code = 1
        with contextlib.suppress(BaseException):
            how = planner.plan(*ENDS).refinement
            code = int(
                how is None or how.by_grid or worker_of(planner)._running.process.pid == before
            )
            planner.close()
        os._exit(code)
    assert os.waitpid(child, 0)[1] == 0
    assert worker_of(planner)._running.process.pid == before
    assert planner.plan(*ENDS).refinement.by_grid is False


def test_who_ignores_the_ends_of_children_gets_answers_too() -> None:
    code = f"""
import signal
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
import hybridnav as hn
from benchmarks.worlds import office_world
grid = office_world().grid(robot_radius_m=0.25)
topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
preset = hn.load_preset("ompl", overrides=["{OVER_PLACES}"])
planner = hn.HybridPlanner(topology, preset=preset)
print([planner.plan(*{ENDS}).refinement.by_grid for _ in range(2)])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[False, False]"


def test_files_of_the_working_directory_are_not_taken_for_modules(tmp_path: Path) -> None:
    (tmp_path / "random.py").write_text("raise SystemExit('not the module')\n", encoding="utf-8")
    command = [
        sys.executable,
        "-P",
        "-m",
        "hybridnav",
        "plan",
        str(ROOT / "maps/office/office.yaml"),
    ]
    command += ["--start", "1.0,13.2", "--goal", "40.6,19.4", "--preset", "ompl"]
    command += ["--set", OVER_PLACES]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_what_fails_at_a_new_start_is_said_and_the_grid_takes_over(planner, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr("sys.executable", "/nowhere/python")
        worker_of(planner)._running.process.kill()
        worker_of(planner)._running.process.wait()
        result = planner.plan(*ENDS)
    assert result.solved
    assert result.refinement is not None
    assert result.refinement.by_grid
    assert "does not start" in result.refinement.steps[0]
    assert "/nowhere/python" in result.refinement.steps[0]
    planner.close()
    with monkeypatch.context() as patched:
        patched.setattr("hybridnav.refine.ompl.client._START_S", 0.0)
        late = planner.plan(*ENDS)
    assert "is not ready" in late.refinement.steps[0]
    planner.close()
    assert planner.plan(*ENDS).refinement.by_grid is False


@pytest.mark.parametrize("dies", [False, True])
def test_a_process_that_was_started_ahead_is_the_next_planners_if_it_lives(*, dies: bool) -> None:
    for _ in range(2):  # one is enough
        hn.refine.ompl.start_ahead()
    [(ahead, _)] = client._ahead
    if dies:
        ahead.kill()
        ahead.wait()
    first, second = office_planner(), office_planner()
    is_taken = [worker_of(one)._running.process is ahead for one in (first, second)]
    assert (is_taken, client._ahead) == ([not dies, False], [])
    assert first.plan(*ENDS).solved


def test_a_process_that_no_planner_takes_ends_with_the_one_that_started_it() -> None:
    code = (
        "from hybridnav.refine.ompl import client as c; c.start_ahead(); print(c._ahead[0][0].pid)"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert gone(int(ended.stdout), within_s=START_S)
    assert ended.stderr == ""
