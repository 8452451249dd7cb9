"""The harness on a dask.distributed cluster: the same records, and lost workers' tasks again."""

import os
import signal
import threading
import time
from dataclasses import replace
from functools import partial

import dask
import distributed
import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.harness import distances_on_cluster, workers
from hybridnav.harness.records import read_records
from hybridnav.harness.run import RunSettings, write_records
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import ROOMS, ROOT, name_of, write_map
from tests.harness.test_run import timeless

N_PAIRS = 30


@pytest.fixture(scope="module")
def cluster():
    """A scheduler in this process and one worker, no dashboard, nothing written."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(ROOT))
        patch.setenv(faulty.FATAL_PAIR, "2,2>2,2")
        with (
            dask.config.set(
                {
                    # What is asked of a worker that died is asked again soon.
                    "distributed.comm.timeouts.connect": "5s",
                    # So long after a worker died, dask stops its nanny if the next one is not up
                    # just then: by default 15 s, in which another test kills the next one.
                    "distributed.deploy.lost-worker-timeout": "1h",
                }
            ),
            distributed.LocalCluster(
                n_workers=1,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                silence_logs=50,
            ) as running,
        ):
            yield running


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    path = write_map(tmp_path_factory.mktemp("map"), ROOMS)
    return RunSettings(
        maps=(str(path),),
        baselines=("simple-graph", name_of(faulty.Slow)),
        pairs=N_PAIRS,
        merge_distance_m=4.0,
    )


def test_a_cluster_makes_the_records_of_local_workers(cluster, settings, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    made = write_records(settings, tmp_path / "local")
    there = replace(settings, scheduler=cluster.scheduler_address)
    assert write_records(there, tmp_path / "cluster") == made
    assert timeless(tmp_path / "cluster") == timeless(tmp_path / "local")
    assert write_records(there, tmp_path / "local") == 0


@pytest.mark.full  # starts workers until one is lost
def test_the_tasks_of_a_worker_that_is_lost_run_again(cluster, settings, tmp_path):
    only = replace(
        settings,
        presets=(),
        baselines=(name_of(faulty.Slow),),
        pairs=150,
        scheduler=cluster.scheduler_address,
    )
    killed = []

    def kill_the_worker_at_work():
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            for worker in list(cluster.scheduler.workers.values()):
                if any("_whole" in str(task.key) for task in worker.processing):
                    time.sleep(0.5)
                    pid = cluster.workers[worker.name].pid
                    os.kill(pid, signal.SIGKILL)
                    killed.append(pid)
                    return
            time.sleep(0.005)

    thread = threading.Thread(target=kill_the_worker_at_work)
    thread.start()
    made = write_records(only, tmp_path)
    thread.join()
    assert killed
    records = read_records(tmp_path)
    assert {record["status"] for record in records} <= {"ready", "solved", "no path"}
    assert len({record["id"] for record in records}) == len(records) == made > 2 * 150


@pytest.mark.full  # starts workers until one is lost
def test_a_task_that_kills_every_worker_is_recorded_as_lost(
    cluster, settings, tmp_path, monkeypatch
):
    monkeypatch.setattr(cluster.scheduler, "allowed_failures", 0)
    baselines = (name_of(faulty.Dies), "grid-dijkstra")
    only = replace(settings, presets=(), baselines=baselines, scheduler=cluster.scheduler_address)
    write_records(only, tmp_path)
    status: dict[str, set[str]] = {}
    for record in read_records(tmp_path):
        status.setdefault(record["method"], set()).add(record["status"])
    assert status[name_of(faulty.Dies)] == {"lost"}
    assert status["grid-dijkstra"] == {"ready", "solved", "no path"}


def test_a_cluster_finds_the_tables_of_one_process(cluster, monkeypatch):
    monkeypatch.setattr(workers, "_ENTRIES", 20)  # several tasks
    grid = hn.example_map("figure1")
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    planner.prepare()
    cells = np.argwhere(grid.enterable())
    picked = np.random.default_rng(0).integers(len(cells), size=(2, 9))
    starts, goals = (grid.frame.points_of(cells[part]) for part in picked)
    cluster.scale(2)
    with distributed.Client(cluster) as client:
        client.wait_for_workers(2, timeout=60)
    done: list[tuple[int, int]] = []
    there = partial(
        distances_on_cluster,
        planner,
        address=cluster.scheduler_address,
        progress=lambda *step: done.append(step),
    )
    for blocked in (None, {"cells": cells[::50]}):
        table = there((starts, goals), blocked=blocked)
        np.testing.assert_array_equal(table, planner.distances(starts, goals, blocked=blocked))
    assert done[-1] == (81, 81)
    near, same = there((starts, goals), nearest=3), planner.distances(starts, goals, nearest=3)
    for part in ("data", "indices", "indptr"):
        np.testing.assert_array_equal(getattr(near, part), getattr(same, part))
    assert there(([], goals)).shape == (0, 9)


@pytest.mark.parametrize("address", ["nonsense", "bogus://x:1", "tcp://127.0.0.1", ""])
def test_an_address_that_is_none_is_refused_in_a_line(settings, tmp_path, address):
    with pytest.raises(InvalidValueError, match="scheduler") as caught:
        write_records(replace(settings, scheduler=address), tmp_path)
    assert "\n" not in str(caught.value)


def test_a_scheduler_that_is_not_there_is_missed_in_a_line(settings, tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "CONNECT_S", 1.0)
    began = time.monotonic()
    with pytest.raises(InvalidValueError, match=r"scheduler tcp://127\.0\.0\.1:9: ") as caught:
        write_records(replace(settings, scheduler="tcp://127.0.0.1:9"), tmp_path)
    assert "\n" not in str(caught.value)
    assert time.monotonic() - began < 8


def test_a_scheduler_without_workers_is_not_waited_for(settings, tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "NO_WORKER_S", 0.5)
    monkeypatch.setattr(workers, "_LOOK_S", 0.2)
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=50) as empty:
        only = replace(settings, scheduler=empty.scheduler_address)
        with pytest.raises(InvalidValueError, match=r"has had no worker for 0\.5 s: start workers"):
            write_records(only, tmp_path)
