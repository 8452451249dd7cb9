"""Presets: the ones that come along, those in files, settings beside them, and what is refused."""

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.planning import PyramidSettings, planner_settings
from hybridnav.planning.preset import is_preset_name
from tests.strategies import seeds

PLANNERS = Path(__file__).parents[2] / "planners"


@pytest.fixture
def write(tmp_path):
    def write(content, name="mine.yaml"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def _problem(source, *overrides):
    """Text of the error that a preset makes: one line."""
    with pytest.raises(hn.errors.PresetError) as caught:
        hn.load_preset(source, overrides=overrides)
    text = str(caught.value)
    assert text.isprintable()
    assert len(text) < 1000
    return text


# --- the presets that come along ----------------------------------------------------------------


def test_every_file_in_planners_is_a_preset_and_valid():
    names = sorted(path.stem for path in PLANNERS.iterdir())
    assert hn.preset_names() == names
    assert {"paper", "grid-astar"} <= set(names)
    for name in names:
        preset = hn.load_preset(name)
        assert preset.name == name
        assert preset.description
        assert preset == hn.load_preset(PLANNERS / f"{name}.yaml")


def test_paper_is_the_papers_rule_and_the_default():
    paper = hn.load_preset("paper")
    assert paper.planner.method == "paper"
    assert paper.planner.corridor == "joined"
    assert paper.planner.refine == "grid-astar"
    assert not paper.planner.allow_unexplored
    assert paper.pyramid.linkage == "throats"
    assert paper.pyramid.merge_distance_m == 4
    # What a file leaves out is as in the paper.
    assert (paper.pyramid, paper.planner) == (PyramidSettings(), planner_settings("paper"))


def test_grid_astar_differs_in_nothing_but_the_coarse_planner():
    paper, grid = hn.load_preset("paper"), hn.load_preset("grid-astar")
    assert grid.planner.method == "grid-astar"
    assert grid.pyramid == paper.pyramid
    own = {"method", "levels", "field_cells", "step", "ring", "horizon_cells", "corridor"}
    both = paper.planner.model_dump(exclude=own)
    assert grid.planner.model_dump(exclude={"method"}) == both


@pytest.mark.parametrize("name", hn.preset_names())
def test_the_files_state_both_sections_and_only_known_keys(name):
    tree = yaml.safe_load((PLANNERS / f"{name}.yaml").read_text(encoding="utf-8"))
    assert tree.keys() - {"limits"} == {"description", "pyramid", "planner"}
    assert tree["pyramid"].keys() == PyramidSettings.model_fields.keys()


# --- names and files ----------------------------------------------------------------------------


def test_an_unknown_name_lists_the_names_there_are(monkeypatch, write):
    monkeypatch.chdir(write("planner: {}\n", "mine.yaml").parent)
    with pytest.raises(hn.errors.PresetNotFoundError, match=r"'mine'.*octile, ompl, .*with \.yaml"):
        hn.load_preset("mine")
    with pytest.raises(FileNotFoundError, match="''"):
        hn.load_preset("")
    assert hn.load_preset("mine.yaml").name == "mine"
    assert hn.load_preset(Path("mine.yaml")).planner == planner_settings("paper")


def test_what_has_a_suffix_or_a_separator_is_a_path(write, monkeypatch):
    path = write("planner: {method: grid-astar}\n", "plain")
    monkeypatch.chdir(path.parent)
    assert hn.load_preset("./plain").planner.method == "grid-astar"
    assert hn.load_preset(path).planner.method == "grid-astar"
    assert not any(map(is_preset_name, ("./paper", "paper.yaml", "a/paper", path)))
    assert is_preset_name("grid-astar")
    for gone in ("paper.yaml", "./paper", "no/such/paper"):
        with pytest.raises(hn.errors.PresetNotFoundError, match="no such file"):
            hn.load_preset(gone)


def test_what_a_file_leaves_out_has_its_default(write):
    preset = hn.load_preset(write("pyramid: {merge_distance_m: 2}\n"))
    assert preset.name == "mine"
    assert preset.description == ""
    assert preset.pyramid == PyramidSettings(merge_distance_m=2)
    assert preset.planner == planner_settings("paper")
    assert hn.load_preset(write("{}\n")).pyramid == PyramidSettings()


def test_yaml_writes_numbers_in_many_ways(write):
    text = "pyramid: {merge_distance_m: 1e1, robot_radius_m: 0, seed: 0x10}\n"
    pyramid = hn.load_preset(write(text)).pyramid
    assert (pyramid.merge_distance_m, pyramid.robot_radius_m, pyramid.seed) == (10, 0, 16)
    assert hn.load_preset(write("pyramid: {merge_distance_m: .inf}")).pyramid == PyramidSettings(
        merge_distance_m=math.inf
    )
    assert hn.load_preset(write("planner: {allow_unexplored: yes}")).planner.allow_unexplored


def test_a_preset_is_a_frozen_value(write):
    preset = hn.load_preset("paper")
    with pytest.raises(ValueError, match="frozen"):
        preset.pyramid.seed = 1  # type: ignore[misc]
    assert hn.load_preset(preset) == preset
    assert hn.load_preset(preset, overrides=["pyramid.seed=9"]).pyramid.seed == 9
    assert preset.pyramid.seed == 0
    assert hash(preset) == hash(hn.load_preset("paper"))
    mine = hn.load_preset(write("planner: {}\n"))
    assert hn.load_preset(mine, overrides=["pyramid.seed=9"]).name == "mine"


# --- what is refused ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("speed: 3\n", ["speed: unknown key", "description, pyramid, planner"]),
        ("pyramid: {speed: 3}\n", ["pyramid.speed: unknown key", "merge_distance_m", "seed"]),
        ("planner: {speed: 3}\n", ["planner.speed: unknown key", "paper has", "allow_unexplored"]),
        ('planner: {"a\\nb": 3}\n', ["a\\nb", "unknown key"]),
        ("planner: {1: 3}\n", ["planner.1"]),
        ("name: octile\n", ["name: a preset is named after its file"]),
        ("pyramid:\n", ["pyramid: expected a section with keys, got nothing"]),
        ("planner: [coarse]\n", ["planner: expected a section with keys, got ['coarse']"]),
        ("description: 3\n", ["description: should be a valid string, got 3"]),
        ("pyramid: {merge_distance_m: far}\n", ["pyramid.merge_distance_m", "number", "'far'"]),
        ("pyramid: {merge_distance_m: }\n", ["pyramid.merge_distance_m", "got nothing"]),
        ("pyramid: {merge_distance_m: yes}\n", ["pyramid.merge_distance_m", "got True"]),
        ("pyramid: {merge_distance_m: [4]}\n", ["pyramid.merge_distance_m", "got [4]"]),
        ("pyramid: {merge_distance_m: 0}\n", ["pyramid.merge_distance_m", "greater than 0"]),
        ("pyramid: {merge_distance_m: -.inf}\n", ["pyramid.merge_distance_m", "got -inf"]),
        ("pyramid: {merge_distance_m: .nan}\n", ["pyramid.merge_distance_m", "got nan"]),
        ("pyramid: {robot_radius_m: .nan}\n", ["pyramid.robot_radius_m", "got nan"]),
        ("pyramid: {robot_radius_m: .inf}\n", ["pyramid.robot_radius_m", "finite", "got inf"]),
        ("pyramid: {robot_radius_m: -0.1}\n", ["pyramid.robot_radius_m", "got -0.1"]),
        ("pyramid: {seed: 1.5}\n", ["pyramid.seed: should be a valid integer, got 1.5"]),
        ("pyramid: {seed: on}\n", ["pyramid.seed", "got True"]),
        ("pyramid: {seed: -1}\n", ["pyramid.seed", "got -1"]),
        ("pyramid: {seed: 4294967296}\n", ["pyramid.seed", "less than 4294967296"]),
        ("pyramid: {seed: " + "9" * 2000 + "}\n", ["pyramid.seed"]),
        ("pyramid: {linkage: average}\n", ["pyramid.linkage", "'radius'", "got 'average'"]),
        (
            "planner: {method: fast}\n",
            ["planner.method", "'shortest', 'octile', 'cheapest', 'grid-astar'", "'fast'"],
        ),
        ("planner: {refine: rrt}\n", ["planner.refine", "'grid-astar'", "got 'rrt'"]),
        ("planner: {allow_unexplored: maybe}\n", ["planner.allow_unexplored", "got 'maybe'"]),
        ("planner: {allow_unexplored: 2}\n", ["planner.allow_unexplored", "got 2"]),
        ("", ["expected a mapping"]),
        ("- 1\n", ["expected a mapping"]),
        ("a: &a [x, x]\nb: [*a, *a]\n", ["line 1: anchors and aliases"]),
        ("pyramid: {seed: 1, seed: 2}\n", ["line 1: key 'seed' is given twice"]),
        ("planner: !!python/object/apply:os.abort []\n", ["line 1: tags"]),
        ("planner: " + "[" * 100_000, ["line 1: nested more than"]),
        (b"planner: \xff\n", ["line 1: not UTF-8"]),
    ],
)
def test_a_bad_file_is_one_line_that_names_file_and_key(write, content, words):
    path = write(content)
    text = _problem(path)
    assert text.startswith(f"preset {path}")
    for word in words:
        assert word in text


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("seed", ["'seed'", "section.key=value", "pyramid or planner"]),
        ("seed=1", ["'seed=1'", "section.key=value"]),
        ("=1", ["'=1'"]),
        ("pyramid.=1", ["'pyramid.=1'"]),
        (".seed=1", ["'.seed=1'"]),
        ("pyramid=1", ["'pyramid=1'"]),
        ("name.first=1", ["'name.first=1'"]),
        ("description.first=1", ["'description.first=1'"]),
        ("robot.seed=1", ["'robot.seed=1'", "pyramid or planner"]),
        ("pyramid.speed=1", ["pyramid.speed: unknown key", "known are merge_distance_m"]),
        ("pyramid.seed.low=1", ["pyramid.seed.low: unknown key"]),
        ("pyramid.seed=", ["pyramid.seed", "got nothing"]),
        ("pyramid.seed=one", ["pyramid.seed", "integer", "'one'"]),
        ("pyramid.seed=yes", ["pyramid.seed", "got True"]),
        ("pyramid.merge_distance_m=.nan", ["pyramid.merge_distance_m", "got nan"]),
        ("pyramid.merge_distance_m=nan", ["pyramid.merge_distance_m", "got 'nan'"]),
        ("pyramid.merge_distance_m=[1", ["pyramid.merge_distance_m: the value is not YAML"]),
        ("pyramid.seed=" + "[" * 2_000, ["pyramid.seed: the value is not YAML"]),
        ("pyramid.seed=" + "9" * 5_000, ["pyramid.seed"]),
        ("pyramid.seed=!!python/name:os.abort", ["pyramid.seed: the value is not YAML"]),
        ("pyramid.seed=&a [1, *a]", ["pyramid.seed"]),
        ("pyramid.a\nb=1", ["pyramid.a\\nb"]),
    ],
)
def test_a_bad_setting_is_one_line_that_names_the_key(override, words):
    text = _problem("paper", override)
    assert text.startswith("setting ")
    for word in words:
        assert word in text


def test_settings_win_over_the_file_and_the_last_one_wins():
    settings = ("pyramid.merge_distance_m=8", "planner.allow_unexplored=true", "pyramid.seed=1")
    preset = hn.load_preset("paper", overrides=(*settings, " pyramid.seed = 2"))
    assert preset.name == "paper"
    assert preset.pyramid == PyramidSettings(merge_distance_m=8, seed=2)
    assert preset.planner == planner_settings("paper", allow_unexplored=True)
    assert hn.load_preset("paper") == hn.load_preset("paper", overrides=[])


def test_a_setting_does_not_mend_a_bad_file(write):
    text = _problem(write("pyramid: {seed: x}\n"), "pyramid.seed=1")
    assert "mine.yaml: pyramid.seed" in text


# --- round trip ---------------------------------------------------------------------------------

TEXT = st.text(st.characters(codec="utf-8"), max_size=40)
PRESETS = st.builds(
    hn.Preset,
    name=st.just("mine"),
    description=TEXT,
    pyramid=st.builds(
        PyramidSettings,
        merge_distance_m=st.floats(min_value=0, exclude_min=True),
        seed=seeds,
        robot_radius_m=st.floats(min_value=0, allow_infinity=False),
    ),
    planner=st.builds(
        planner_settings,
        method=st.sampled_from(["paper", "ompl"]),
        corridor=st.sampled_from(["route", "neighbours"]),
        allow_unexplored=st.booleans(),
    ),
)


@example(preset=hn.Preset(name="mine", description="\x85 Büro\u2028\n"))
@given(preset=PRESETS)
def test_a_preset_written_as_yaml_reads_back_equal(preset, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "mine.yaml"
    path.write_text(preset.to_yaml(), encoding="utf-8")
    assert hn.load_preset(path) == preset


def test_to_yaml_gives_every_key():
    tree = yaml.safe_load(hn.load_preset("paper").to_yaml())
    assert tree["pyramid"].keys() == PyramidSettings.model_fields.keys()
    assert tree["planner"].keys() == {*type(planner_settings("paper")).model_fields}
    assert list(tree) == ["description", "pyramid", "planner", "limits"]
    assert "description: Büro\n" in hn.Preset(description="Büro").to_yaml()
