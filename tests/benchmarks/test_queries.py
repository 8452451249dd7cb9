"""The table of queries: figures on both optima, broken promises, and runs that go on."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from benchmarks.subjects import queries
from benchmarks.subjects._queries_measure import presets_of
from benchmarks.subjects._queries_tables import page
from benchmarks.subjects.start import tiled_building
from hybridnav.harness.tables import Row

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


def test_a_tiled_building_is_connected() -> None:
    free = np.zeros((9, 14), np.bool_)
    free[2:7, 3:9] = free[4, 9:13] = free[0, 0] = True
    whole = tiled_building(free, 1000)
    assert whole.size >= 1000
    assert ndimage.label(whole)[1] == 1
