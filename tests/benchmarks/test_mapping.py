"""The table of maps from logs, on real logs: agreement with counting grids of the same scans."""

from pathlib import Path

import pytest

import hybridnav as hn
from benchmarks.subjects.mapping import compare, map_log
from tests.layers import grid_of


@pytest.mark.parametrize("name", ["intel", "orebro"])
def test_maps_agree_with_counting_grids_of_the_same_logs(data: Path, name: str) -> None:
    given = hn.load_map(data / "radish_grids" / f"{name}.yaml", robot_radius_m=0)
    ours, _ = map_log(data / "radish_logs" / f"{name}-corrected.log.gz", given)
    found = compare(ours, given)
    assert found.disagreeing < 0.01 * found.by_both
    assert found.by_both > 0.95 * found.by_given


def test_agreement_counts_cells_that_both_maps_know() -> None:
    given = grid_of([[0.0, 1.0, 0.5, 0.0]], hn.Frame(0.5, (2.0, 1.0)), robot_radius_m=0)
    ours = grid_of([[1.0, 0.0, 0.0], [0.0] * 3], hn.Frame(0.5, (1.5, 1.0)))
    found = compare(ours, given)
    assert (found.by_both, found.disagreeing, found.by_given, found.by_ours) == (2, 1, 3, 6)
