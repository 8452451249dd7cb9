"""Section `ompl` of a preset: what it takes, and that its tables are those of OMPL itself."""

import pytest
import shapely

import hybridnav as hn
from hybridnav.planning import load_preset
from hybridnav.refine.ompl import OmplSettings
from hybridnav.refine.ompl.settings import PARAMETERS

INERT = {"delay_rewiring_to_first_solution", "use_strict_queue_ordering"}
"""Parameters that OMPL still declares and says have no effect any more."""
SQUARE = ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5))


@pytest.mark.parametrize("planner", sorted(PARAMETERS))
def test_the_parameters_are_those_that_ompl_declares(planner: str) -> None:
    geometric = pytest.importorskip("ompl.geometric")
    base = pytest.importorskip("ompl.base")
    space = base.RealVectorStateSpace(2)
    bounds = base.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(1.0)
    space.setBounds(bounds)
    made = getattr(geometric, planner)(base.SpaceInformation(space))

    def declared() -> dict[str, str]:
        lines = made.printSettings().splitlines()
        return dict(line.split(" = ") for line in lines if " = " in line)

    assert set(declared()) == set(PARAMETERS[planner])
    # Just-in-time sampling needs BIT* without k nearest neighbours.
    for name, setter in sorted(
        PARAMETERS[planner].items(), key=lambda item: "k_nearest" not in item[0]
    ):
        if name in INERT:
            continue
        before = declared()[name]
        other = 1 - int(before) if before in {"0", "1"} else float(before) * 2
        kinds = (bool, int, float) if before in {"0", "1"} else (int, float)
        for kind in kinds:
            try:
                getattr(made, setter)(kind(other))
                break
            except TypeError:
                continue
        assert declared()[name] != before, name


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ("planner: RRTx", ["'RRTx'", "known are BITstar, InformedRRTstar"]),
        ("parameters: {rang: 3}", ["'rang'", "RRTConnect", "known are intermediate_states, range"]),
        ("parameters: {range: true}", ["range", "number from 0", "True"]),
        ("planner: BITstar, parameters: {samples_per_batch: 0}", ["samples_per_batch", "whole"]),
        ("planner: PRMstar, parameters: {range: 1}", ["it has none"]),
        ("space: dubins", ["turning_radius_m"]),
        ("turning_radius_m: 1", ["turning_radius_m"]),
        ("footprint: '[[0, 0], [1, 0], [1, 1]]'", ["a space with headings"]),
        ("space: se2, footprint: '[[0, 0], [1'", ["footprint", "[[x, y], ...]"]),
        ("space: se2, footprint: 'LINESTRING (0 0, 1 1)'", ["footprint"]),
        ("space: se2, footprint: [[0, 0], [1, 0]]", ["footprint", "3"]),
        ("confine: prm", ["confine", "chain"]),
        ("budget_s: .inf", ["budget_s"]),
        ("budget_s: 0", ["budget_s"]),
        ("seed: 0", ["seed"]),
        ("space: dubins, turning_radius_m: 1, planner: PRMstar", ["dubins", "one way", "PRM"]),
        (
            "space: differential, planner: RRTstar",
            ["one way", "BITstar, RRT, RRTConnect", "reverses"],
        ),
        ("space: differential, planner: PRM", ["one way", "reverses: true"]),
        ("space: se2, reverses: true", ["reverses", "differential"]),
        ("space: differential, parameters: {intermediate_states: true}", ["intermediate_states"]),
        ("space: differential, turning_radius_m: 1", ["turning_radius_m"]),
        ("speed: 3", ["speed", "unknown key", "budget_s"]),
    ],
)
def test_a_bad_setting_is_one_line_that_names_it(settings: str, words: list[str]) -> None:
    with pytest.raises(hn.errors.PresetError) as raised:
        load_preset("ompl", overrides=[f"planner.ompl={{{settings}}}"])
    text = str(raised.value)
    assert "\n" not in text
    assert len(text) < 500
    for word in words:
        assert word in text


def test_a_footprint_is_a_list_a_string_a_polygon_or_its_text() -> None:
    polygon = shapely.Polygon(SQUARE)
    texts = [SQUARE, str([list(corner) for corner in SQUARE]), polygon, polygon.wkt]
    for given in texts:
        made = OmplSettings.model_validate({"space": "se2", "footprint": given})
        assert made.footprint == SQUARE


def test_the_section_goes_with_its_refiner_and_single_keys_can_be_set() -> None:
    preset = load_preset(
        "ompl",
        overrides=["planner.ompl.planner=BITstar", "planner.ompl.parameters.rewire_factor=1.5"],
    )
    assert preset.planner.ompl.parameters == {"rewire_factor": 1.5}
    plain = load_preset("octile", overrides=["planner.method=ompl"])
    assert plain.planner.ompl == OmplSettings()
    with pytest.raises(
        hn.errors.PresetError, match=r"planner\.ompl: no key of method octile, but of"
    ):
        load_preset("octile", overrides=["planner.ompl.budget_s=2"])
    with pytest.raises(hn.errors.PresetError, match="smooth"):
        load_preset("ompl", overrides=["planner.smooth=line-of-sight"])


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_settings_that_go_only_together_are_checked_together(order: tuple[int, int]) -> None:
    given = ["planner.ompl.space=dubins", "planner.ompl.turning_radius_m=0.8"]
    preset = load_preset("ompl", overrides=[given[index] for index in order])
    assert (preset.planner.ompl.space, preset.planner.ompl.turning_radius_m) == ("dubins", 0.8)
    with pytest.raises(hn.errors.PresetError, match="dubins or reeds-shepp needs turning_radius_m"):
        load_preset("ompl", overrides=given[:1])
