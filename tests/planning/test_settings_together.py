"""Settings of presets that go together, and those that do not."""

import itertools

import pytest

import hybridnav as hn


@pytest.mark.parametrize(
    ("preset", "override", "message"),
    [
        *(
            (preset, f"planner.{key}={value}", f"planner.{key}: no key of method {method}, but of ")
            for method, preset, key, value in (
                ("paper", "paper", "epsilon", "0.1"),
                ("grid-astar", "grid-astar", "epsilon", "0"),
                ("octile", "octile", "epsilon", "0.1"),
                ("octile", "octile", "refine", "grid-astar"),
                ("octile", "octile", "refine", "gates"),
                ("shortest", "shortest", "refine", "grid-astar"),
                ("shortest", "shortest", "smooth", "line-of-sight"),
                ("cheapest", "robot", "refine", "a:C"),
            )
        ),
        (
            "paper",
            "planner.refine=stored-paths",
            "planner.refine: should be 'grid-astar' or a class",
        ),
        ("octile", "planner.method=fast", "planner.method: should be one of 'shortest', "),
        ("octile", "planner.method=[1]", "planner.method: should be one of 'shortest', "),
        ("octile", "planner.coarse=fast", "coarse is gone: write method, one of shortest, "),
        ("octile", "planner.coarse=[]", "coarse is gone: write method, one of shortest, "),
        ("shortest", "planner.labels_mb=100", "labels_mb is gone: leave it out"),
        ("octile", "planner.smooth=arcs", "planner.smooth: "),
        *itertools.product(["paper", "octile"], ["planner.smooth=los"], ["planner.smooth: "]),
        ("octile", "planner.smooth=true", "planner.smooth: "),
        ("octile", "planner.smooth=", "planner.smooth: "),
        *(
            ("shortest", f"planner.epsilon={value}", "planner.epsilon: ")
            for value in ("-0.01", ".nan", "2", ".inf", "yes", "small", "[0.1]")
        ),
    ],
)
def test_settings_that_do_not_go_together_are_refused(preset, override, message):
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
