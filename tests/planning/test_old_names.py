"""Methods of earlier versions: they warn with the new name, and answer as the functions do."""

import numpy as np
import pytest

import hybridnav as hn


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        (
            lambda planner, ends: planner.plan(*ends).words("de"),
            lambda planner, ends: hn.words(planner.plan(*ends), "de"),
            r"PlanResult\.words\(\.\.\.\) is now hybridnav\.words\(result, ",
        ),
        (
            lambda planner, ends: planner.plan(*ends).proof(),
            lambda planner, ends: hn.prove(planner.plan(*ends)),
            r"PlanResult\.proof\(\) is now hybridnav\.prove\(result\)",
        ),
        (
            lambda planner, ends: planner.explain(*ends, radius_m=0.6).reason,
            lambda planner, ends: hn.explain(planner, *ends, radius_m=0.6).reason,
            r"HybridPlanner\.explain\(\.\.\.\) is now hybridnav\.explain\(planner, ",
        ),
        (
            lambda planner, ends: planner.under("visitor").plan(*ends).settings["profile"],
            lambda planner, ends: hn.under(planner, "visitor").plan(*ends).settings["profile"],
            r"HybridPlanner\.under\(\.\.\.\) is now hybridnav\.under\(planner, ",
        ),
    ],
)
def test_a_method_of_earlier_versions_warns_and_answers(old, new, match) -> None:
    grid = hn.example_map("figure1")
    rooms = hn.RoomLabels(("west", "east"), np.indices(grid.shape)[1] // 20)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    planner, ends = hn.HybridPlanner(topology), ((0.5, 0.5), (2.0, 2.5))
    with pytest.warns(FutureWarning, match=match) as caught:
        answer = old(planner, ends)
    assert caught[0].filename == __file__
    assert answer == new(planner, ends)
    assert answer
