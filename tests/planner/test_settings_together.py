"""Settings of presets that go together, and those that do not."""

from __future__ import annotations

import itertools

import pytest

import hybridnav as hn

EXACT = "planner.epsilon=0"


@pytest.mark.parametrize(
    ("preset", "override", "message"),
    [
        ("paper", "planner.epsilon=0.1", "epsilon needs coarse: mesh or overlay"),
        ("grid-astar", "planner.epsilon=0", "epsilon needs coarse: mesh or overlay"),
        ("paper", "planner.refine=none", "coarse: max-distance goes with refine: grid-astar"),
        ("grid-astar", "planner.refine=none", "coarse: none goes with refine: grid-astar"),
        ("octile", "planner.refine=stored-paths", "planner.refine: should be 'grid-astar', "),
        ("octile", "planner.epsilon=0.1", "epsilon needs coarse: mesh or overlay"),
        ("octile", "planner.refine=grid-astar", "coarse: jumps goes with refine: none or ompl"),
        ("octile", "planner.coarse=none", "coarse: none goes with refine"),
        ("shortest", "planner.refine=grid-astar", "coarse: mesh goes with refine: none or ompl"),
        (
            "shortest",
            "planner.smooth=line-of-sight",
            "smooth shortens grid paths, with coarse: mesh they are any-angle",
        ),
        ("octile", "planner.coarse=max-distance", "coarse: max-distance goes with refine"),
        ("robot", "planner.refine=grid-astar", "coarse: overlay goes with refine"),
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
    with pytest.raises(hn.PresetError) as caught:
        hn.load_preset(preset, overrides=[override])
    assert message in str(caught.value)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 300


def test_settings_that_do_go_together_are_taken() -> None:
    assert hn.load_preset("shortest").planner.epsilon is None
    assert hn.load_preset("shortest", overrides=[EXACT]).planner.epsilon == 0
    assert hn.load_preset("shortest", overrides=["planner.epsilon=1"]).planner.epsilon == 1
