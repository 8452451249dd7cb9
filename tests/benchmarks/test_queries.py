"""The table of queries: figures on both optima, broken promises, and runs that go on."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.common import largest_part
from benchmarks.subjects import queries
from benchmarks.subjects._queries_measure import presets_of
from benchmarks.subjects._queries_tables import page
from benchmarks.subjects.scale import tile_of
from benchmarks.worlds import World, figure1_world
from hybridnav.harness.tables import Row
from hybridnav.search.mesh import MeshSearch
from tests.oracle.grid import distances, move_graph

MAP = "figure1/figure1.yaml"
FILES = {MAP: Path(__file__).parents[2] / "maps" / MAP}
ASKED = {"asked": 12, "seed": 0}
NAMES = ("paper", "grid-astar:planner.smooth=line-of-sight")


def rows_of(out: Path | None, *names: str) -> dict[str, Row]:
    """Rows of a run by preset."""
    return {str(row["preset"]): row for row in queries.run(FILES, presets_of(names), out, ASKED)}


@pytest.fixture(autouse=True)
def _cold(monkeypatch: pytest.MonkeyPatch) -> None:
    """No time is looked at: kernels need not be warm."""
    monkeypatch.setattr(queries, "warm_up", lambda _: None)


def test_every_preset_is_set_beside_both_optima(tmp_path: Path) -> None:
    rows: dict[str, dict[str, Any]] = {**rows_of(tmp_path / "queries.csv", *NAMES)}
    assert list(rows) == ["grid-astar", *NAMES]
    assert {row["pairs"] for row in rows.values()} == {12}
    cells, places, smooth = rows.values()
    assert cells["times A*"] == 1
    assert cells["octile loss %"] == cells["gap mean %"] == 0 < cells["any-angle loss %"]
    assert cells["optimal %"] == 100
    assert 0 <= places["octile loss %"] < places["any-angle loss %"]
    assert [row["metric"] for row in rows.values()] == ["octile", "octile", "any-angle"]
    assert math.isnan(smooth["octile loss %"])
    assert 0 <= smooth["any-angle loss %"] < cells["any-angle loss %"]
    assert {row["broken"] for row in rows.values()} == {0}
    text = page(list(rows.values()))
    assert "Promises broken: 0." in text
    assert "| paper | 1 |" in text


def test_a_map_is_not_measured_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "queries.csv"
    before = page(list(rows_of(out, "paper").values()))
    measured = []

    def note(*given: Any, **settings: Any) -> tuple[list[Row], list[str]]:
        measured.append((given, settings))
        return [], []

    monkeypatch.setattr(queries, "measure", note)
    assert page(list(rows_of(out, "paper").values())) == before
    assert not measured
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"queries\.csv holds a run with other presets"
    ):
        rows_of(out, "shortest")
    # The rows of maps that are not asked for this time stay in the file.
    (tmp_path / "other.csv").write_text(out.read_text().replace(MAP, "elsewhere.yaml"))
    rows_of(tmp_path / "other.csv", "paper")
    assert len(measured) == 1
    assert (tmp_path / "other.csv").read_text().count("elsewhere.yaml") == 2


def test_a_broken_promise_is_counted_and_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = hn.HybridPlanner.plan

    def boast(planner: hn.HybridPlanner, *endpoints: Any) -> hn.PlanResult:
        result = plan(planner, *endpoints)
        if planner.preset.name != "paper" or not result.solved:
            return result
        return replace(result, bound_source=1.01 * result.cost)

    monkeypatch.setattr(hn.HybridPlanner, "plan", boast)
    rows = rows_of(None, "paper")
    assert rows["paper"]["broken"] == 12
    assert rows["grid-astar"]["broken"] == 0
    lines = capsys.readouterr().err.splitlines()
    assert sum("paper: " in line and "lower bound above" in line for line in lines) == 12


@pytest.mark.parametrize("kind", ["small", "large"])
def test_plans_on_tiles_are_as_long_as_scipy_finds(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Tiles of a building and its mirror images, joined by streets; as a large map is planned on
    too, whose graphs are built behind the queries."""
    if kind == "large":
        monkeypatch.setattr("hybridnav.planning.methods.octile.MANY_CELLS", 0)
        monkeypatch.setattr("hybridnav.search.mesh.search.MANY_CORNERS", 0)
        monkeypatch.setattr("hybridnav.search.mesh.search._WORTH", 0)
    tile = tile_of(figure1_world().grid(robot_radius_m=0.1), 140)
    grid = World(np.tile(tile, (2, 2)), hn.Frame(0.1), "tiles").grid(robot_radius_m=0.1)
    free = grid.enterable()
    inside = largest_part(free)
    assert len(inside) > 0.8 * free.sum()
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    octile, shortest = (hn.HybridPlanner(topology, preset=name) for name in ("octile", "shortest"))
    chosen = inside[np.random.default_rng(2).integers(len(inside), size=(4, 11))]
    for source, *goals in chosen:
        expected = distances(move_graph(free), grid.shape, tuple(source.tolist()))
        for goal in goals:
            ends = grid.frame.points_of(np.array([source, goal]))
            found = octile.plan(*ends)
            assert found.cost == pytest.approx(expected[tuple(goal)] * grid.resolution_m)
            taut = shortest.plan(*ends)
            assert taut.gap == 0
            assert taut.cost <= found.cost * (1 + 1e-12)
    shortest.prepare()
    assert isinstance(shortest.prepared, MeshSearch)
    assert shortest.prepared.graph is not None
