"""Settings of presets that go together, and those that do not."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import pytest
import yaml

import hybridnav as hn

if TYPE_CHECKING:
    from pathlib import Path

EXACT = "planner.epsilon=0"


@pytest.mark.parametrize(
    ("preset", "override", "message"),
    [
        ("paper", "planner.epsilon=0.1", "planner.epsilon: no key of method paper, but of "),
        (
            "grid-astar",
            "planner.epsilon=0",
            "planner.epsilon: no key of method grid-astar, but of ",
        ),
        (
            "paper",
            "planner.refine=stored-paths",
            "planner.refine: should be 'grid-astar' or a class",
        ),
        ("octile", "planner.epsilon=0.1", "planner.epsilon: no key of method octile, but of "),
        ("octile", "planner.refine=grid-astar", "planner.refine: no key of method octile, but of "),
        ("octile", "planner.refine=gates", "planner.refine: no key of method octile, but of "),
        ("octile", "planner.method=fast", "planner.method: should be one of 'shortest', "),
        ("octile", "planner.method=[1]", "planner.method: should be one of 'shortest', "),
        ("octile", "planner.coarse=fast", "coarse is gone: write method, one of shortest, "),
        ("octile", "planner.coarse=[]", "coarse is gone: write method, one of shortest, "),
        ("octile", "planner.smooth=arcs", "planner.smooth: "),
        (
            "shortest",
            "planner.refine=grid-astar",
            "planner.refine: no key of method shortest, but of ",
        ),
        (
            "shortest",
            "planner.smooth=line-of-sight",
            "planner.smooth: no key of method shortest, but of ",
        ),
        ("robot", "planner.refine=a:C", "planner.refine: no key of method cheapest, but of "),
        *itertools.product(["paper", "octile"], ["planner.smooth=los"], ["planner.smooth: "]),
        ("octile", "planner.smooth=true", "planner.smooth: "),
        ("octile", "planner.smooth=", "planner.smooth: "),
        *(
            ("shortest", f"planner.epsilon={value}", "planner.epsilon: ")
            for value in ("-0.01", ".nan", "2", ".inf", "yes", "small", "[0.1]")
        ),
    ],
)
def test_settings_that_do_not_go_together_are_refused(
    preset: str, override: str, message: str
) -> None:
    with pytest.raises(hn.errors.PresetError) as caught:
        hn.load_preset(preset, overrides=[override])
    assert message in str(caught.value)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 300


def test_settings_that_do_go_together_are_taken() -> None:
    assert hn.load_preset("shortest").planner.epsilon is None
    both = ["planner.method=shortest", "planner.epsilon=0.02"]
    assert hn.load_preset("paper", overrides=both).planner.epsilon == 0.02
    by_grid = hn.load_preset("robot", overrides=["planner.method=grid-astar"]).planner
    assert by_grid.costs == hn.load_preset("robot").planner.costs


@pytest.mark.parametrize(
    ("old", "method"),
    [
        ("{coarse: max-distance, refine: grid-astar}", "paper"),
        ("{coarse: mesh, refine: none, epsilon: 0.1}", "shortest"),
        ("{coarse: jumps, refine: none, smooth: line-of-sight}", "octile"),
        ("{coarse: overlay, refine: none, costs: {clearance: {}}}", "cheapest"),
        ("{coarse: none, refine: 'mine:C', smooth: none}", "grid-astar"),
        ("{coarse: mesh, refine: ompl, ompl: {space: se2}}", "ompl along shortest"),
        ("{refine: ompl}", "ompl along paper"),
        ("{coarse: overlay, refine: ompl}", "ompl along grid-astar"),
    ],
)
def test_sections_of_earlier_versions_name_what_to_write_instead(
    old: str, method: str, tmp_path: Path
) -> None:
    whole: dict[str, Any] = {"corridor": "route", "ompl": None, "epsilon": None, "budget_s": None}
    whole |= {"smooth": "none", "turning_radius_m": 0.3, "costs": None, "allow_unexplored": True}
    name, _, along = method.partition(" along ")
    for every_key in (False, True):
        section = yaml.safe_load(old)
        section = whole | section if every_key else section
        file = tmp_path / "old.yaml"
        file.write_text(yaml.safe_dump({"planner": section}))
        with pytest.warns(FutureWarning, match=f"are gone: write planner.method: {name}$") as told:
            settings = hn.load_preset(file).planner
        assert len(told) == 1
        assert (settings.method, getattr(settings, "along", "")) == (name, along)
        assert settings.allow_unexplored == every_key
        if "epsilon" in old:
            assert settings.epsilon == 0.1
        if "line-of-sight" in old:
            assert settings.smooth == "line-of-sight"
        if "mine" in old:
            assert settings.refine == "mine:C"
        if "space" in old:
            assert settings.ompl.space == "se2"
    assert hn.load_preset("shortest", overrides=[EXACT]).planner.epsilon == 0
    assert hn.load_preset("shortest", overrides=["planner.epsilon=1"]).planner.epsilon == 1
