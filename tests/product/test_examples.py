"""The examples in docstrings run, print what they show, and no public name lacks one."""

import doctest
import inspect
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "hybridnav"
REFERENCE = ROOT / "docs" / "reference"
_NAME = re.compile(r"^\.\. auto(?:class|function):: hybridnav\.([\w.]+)", re.MULTILINE)
_FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
_FINDER = doctest.DocTestFinder(recurse=False)

RETURNED = {
    "harness.baselines.Solver",
    "pyramid.CombinatorialMap",
    "harness.Study",
    "maps.files.Scenario",
    "search.octile.JumpGraph",
    "search.octile.JumpPath",
    "search.octile.JumpPaths",
    "search.mesh.ConvexMesh",
    "search.mesh.CornerGraph",
    "search.mesh.CornerHierarchy",
    "search.mesh.MeshPath",
    "search.mesh.MeshPaths",
    "harness.judges.AnyAnglePath",
    "harness.judges.Buckets",
    "harness.judges.PairedDifference",
    "harness.judges.Summary",
    "harness.judges.Verdict",
    "pyramid.DualGraph",
    "pyramid.FaceKind",
    "refine.Refiner",
    "planning.PlanStats",
    "planning.Refinement",
    "route.CoarseRoute",
    "route.Corridor",
    "topology.Component",
    "topology.Obstacle",
}
"""Protocols, and results of functions whose examples show them."""


def _thing(name: str) -> Any:
    owner, _, attribute = name.rpartition(".")
    return getattr(pkgutil.resolve_name(f"hybridnav.{owner}".rstrip(".")), attribute)


def _names() -> Iterator[str]:
    """Classes and functions of the reference, but for errors."""
    for page in sorted(REFERENCE.glob("*.md")):
        for name in _NAME.findall(page.read_text(encoding="utf-8")):
            thing = _thing(name)
            if not (inspect.isclass(thing) and issubclass(thing, Exception)):
                yield name


NAMES = list(_names())
OTHERS = [
    "harness.judges.clearance_of",
    "harness.judges.contacts_of",
    "CostLayer.changed",
    "CostLayer.clearance",
    "CostLayer.cost_of_cells",
    "CostLayer.inflated",
    "CostLayer.keepout_mask",
    "CostLayer.speed_mask",
    "Frame.moved",
    "HybridPlanner.distance",
    "HybridPlanner.distances",
    "HybridPlanner.update",
    "OccupancyGrid.from_message",
    "Path.profile",
    "Path.to_message",
    "RoomLabels.at",
    "TopologicalMap.local_grid",
    "TopologicalMap.transform",
    "ext.agent.http.description",
    "graphs.WaypointGraph.from_networkx",
    "ext.live.RoomsUpdate.closed_doors",
    "maps.names.folded",
    "maps.names.matching",
    "maps.names.natural_key",
    "refine.curves.shortest_curve",
    "refine.footprint.Footprint",
    "rooms.choices.free_point",
    "rooms.choices.leading_doors",
    "rooms.choices.room_near",
    "search.descent.Descent",
]
"""Names with examples that are not in the reference."""


def _examples(name: str) -> doctest.DocTest:
    """The examples of a docstring; they assume the two imports that the reference names."""
    (found,) = _FINDER.find(_thing(name), name, globs={"hn": hn, "np": np})
    return found


def _run(name: str) -> None:
    runner = doctest.DocTestRunner(optionflags=_FLAGS)
    report: list[str] = []
    runner.run(_examples(name), out=report.append)
    assert runner.tries > 0
    assert runner.failures == 0, "".join(report)


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which the example of `write_records` ran, which others of the harness read."""
    folder = tmp_path_factory.mktemp("evaluated")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        _run("harness.write_records")
    return folder


@pytest.mark.parametrize("name", [*(name for name in NAMES if name not in RETURNED), *OTHERS])
def test_the_example_prints_what_it_shows(name, tmp_path, monkeypatch, request):
    reads_run = name == "harness.write_records" or 'Path("run")' in (
        inspect.getdoc(_thing(name)) or ""
    )
    monkeypatch.chdir(request.getfixturevalue("evaluated") if reads_run else tmp_path)
    if name != "harness.write_records":  # whose example made the run
        _run(name)


def test_every_example_runs() -> None:
    """The docstrings with examples are those of the names above."""
    written = sum(path.read_text("utf-8").count("Examples\n") for path in SOURCE.rglob("*.py"))
    assert written == len(NAMES) - len(RETURNED) + len(OTHERS)


def test_what_has_no_example_is_known() -> None:
    assert set(NAMES) >= RETURNED
    assert not [name for name in RETURNED if _examples(name).examples]
    assert not [name for name in RETURNED if inspect.isfunction(_thing(name))]
