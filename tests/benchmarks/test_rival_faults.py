"""No rival is believed: what its package returns is judged like any answer, fault by fault."""

from dataclasses import replace

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.rivals_any_angle import count_corners
from benchmarks.worlds import figure1_world
from hybridnav.errors import UnsuitableMapError
from hybridnav.harness.analysis import load_study
from hybridnav.harness.baselines.regions import MethodResult
from hybridnav.harness.columns import consistency_row
from hybridnav.harness.names import NamedMethod
from hybridnav.harness.output import rows_of_methods, write_outputs
from hybridnav.harness.run import RunSettings, write_records
from tests.benchmarks.test_rivals import CASES
from tests.harness.small_runs import ROOMS, run_here, write_map

N_PAIRS = 12


def straight(answer):
    """Straight from start to goal, whatever lies between."""
    if answer.any_angle is not None:
        points = answer.any_angle.points[[0, -1]]
        length_m = float(np.hypot(*(points[1] - points[0])))
        return replace(
            answer, any_angle=replace(answer.any_angle, points=points, length_m=length_m)
        )
    return answer if answer.cells is None else replace(answer, cells=answer.cells[[0, -1]])


def short(answer):
    """The path ends before the goal."""
    if answer.any_angle is not None:
        points = answer.any_angle.points.copy()
        points[-1] += 0.2
        return replace(answer, any_angle=replace(answer.any_angle, points=points))
    return answer if answer.cells is None else replace(answer, cells=answer.cells[:-1])


def nothing(answer):
    """No path is found, ever."""
    return replace(answer, cells=None, any_angle=None, gave_up="")


def boast(answer):
    """More is claimed than holds: a proved bound, or a shorter length."""
    if answer.any_angle is not None:
        shorter = 0.98 * answer.any_angle.length_m
        return replace(answer, any_angle=replace(answer.any_angle, length_m=shorter))
    if answer.cells is None:
        return answer
    to_and_fro = np.repeat(answer.cells[None, :2], len(answer.cells), axis=0).reshape(-1, 2)
    return replace(answer, cells=np.concatenate([to_and_fro, answer.cells]), bound=1.0)


LIES = {straight: "paths", short: "paths", nothing: "no path", boast: "bounds"}


def path_of(name):
    made_of = CASES[name].made_of
    return f"{made_of.__module__}:{made_of.__qualname__}"


def run(folder, names):
    settings = RunSettings(
        maps=(str(write_map(folder, ROOMS)),), presets=(), baselines=names, pairs=N_PAIRS
    )
    write_records(settings, folder / "run")
    return load_study(folder / "run")


@pytest.fixture(autouse=True)
def _here(monkeypatch):
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
    monkeypatch.setattr("hybridnav.harness.judging._WARM", set())


@pytest.mark.parametrize("lie", LIES)
@pytest.mark.parametrize("name", CASES)
def test_a_planted_fault_of_a_rival_is_found(name, lie, tmp_path, monkeypatch):
    case = CASES[name]
    pytest.importorskip(case.package, reason=f"{case.package} is not installed")
    honest = case.made_of.between
    monkeypatch.setattr(
        case.made_of, "between", lambda method, *pair: lie(honest(method, *pair)), raising=True
    )
    outcome = run(tmp_path, (path_of(name),)).of_method(name)[0]
    row = consistency_row([outcome])
    assert int(row[f"{LIES[lie]} wrong"]) > 0
    assert len(outcome.faults) > 3
    # What is no path to the goal is not among the figures of the tables.
    if lie in (short, nothing):
        assert not np.isfinite(outcome.lengths_m).any()


def test_rivals_as_they_are_have_no_fault(tmp_path):
    there = []
    for name, case in CASES.items():
        pytest.importorskip(case.package, reason=f"{case.package} is not installed")
        there.append(name)
    run(tmp_path, tuple(path_of(name) for name in there))
    study = write_outputs(tmp_path / "run")
    assert study.faults == []
    assert set(study.labels) == {"grid-astar", *there}
    for name in there:
        outcome = study.of_method(name)[0]
        assert outcome.is_any_angle == CASES[name].any_angle
        assert np.isfinite(outcome.lengths_m).sum() >= N_PAIRS - 2
        assert (outcome.losses[np.isfinite(outcome.losses)] <= CASES[name].slack).all()
    report = (tmp_path / "run" / "report.html").read_text()
    assert "RRTConnect, up to 1 s a query, seed 1, simplified" in report


def test_a_rival_that_refuses_the_map_is_in_the_table_with_its_file(tmp_path):
    pytest.importorskip("extremitypathfinder", reason="extremitypathfinder is not installed")
    path = "benchmarks.rivals_any_angle:ExtremityPathfinder"
    few = NamedMethod("class", path, "few", {"max_vertices": 4})
    settings = RunSettings(
        maps=(str(write_map(tmp_path, ROOMS)),), presets=("octile",), methods=(few,), pairs=3
    )
    write_records(settings, tmp_path / "run")
    study = load_study(tmp_path / "run")
    assert (study.faults, study.failures) == ([], 0)
    row = next(row for row in rows_of_methods(study) if row["method"] == "few")
    assert row["kind"] == f"class {path}"
    assert str(row["version"]).startswith("file ")
    assert row["settings"] == "max_vertices 4"
    # This map's own vertices, not those of the map on which methods are warmed up.
    n_corners = count_corners(hn.load_map(settings.maps[0], robot_radius_m=0).classes == 1)
    words = f"it is asked about up to 4 vertices of polygons, this map has {n_corners}"
    assert row["not asked"] == words
    assert n_corners != count_corners(figure1_world().grid(robot_radius_m=0).classes == 1)


def test_contraction_hierarchies_plan_by_the_costs_of_a_run(tmp_path):
    pytest.importorskip("pyroutingkit", reason="pyroutingkit is not installed")
    settings = RunSettings(
        maps=(str(write_map(tmp_path, ROOMS)),),
        presets=(),
        baselines=("benchmarks.rivals:RoutingKit", "hpa-star"),
        pairs=N_PAIRS,
        costs=("clearance",),
    )
    write_records(settings, tmp_path / "run")
    study = load_study(tmp_path / "run")
    assert study.faults == []
    kit, other = (study.of_method(name)[0] for name in ("pyroutingkit", "hpa-star"))
    assert (kit.metric, other.metric) == ("weighted", "octile")
    assert kit.losses.max() <= 1e-4
    assert kit.losses.max() < other.losses.max()
    assert (kit.gaps <= 1e-3).all()


class RefusesLate:
    """A class that refuses a map when it is asked, not when it is made."""

    name, region_of, n_nodes, n_edges, memory_bytes = "refuses late", None, 1, 0, 0

    def __init__(self, grid):
        self._shape = grid.shape

    def solve(self, start, goal):  # noqa: ARG002
        """Refuse every pair but those of the map on which all methods are warmed up."""
        if self._shape != (30, 40):
            raise UnsuitableMapError("this pair is beyond me")
        return MethodResult(None, gave_up="timeout")


def test_who_refuses_pair_by_pair_has_no_answers(tmp_path):
    study = run(tmp_path, (f"{__name__}:RefusesLate",))
    outcome = study.of_method("refuses late")[0]
    assert outcome.is_asked
    assert outcome.failures == len(outcome.records) == study.failures
    row = consistency_row([outcome])
    assert row["without an answer"] == len(outcome.records)
