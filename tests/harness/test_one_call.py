"""`hybridnav.evaluate`: one call from maps and methods to a table."""

from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.harness import NamedMethod, RunSettings, write_records
from hybridnav.harness.tables import Table, latex_of
from hybridnav.viz import plot_losses
from tests.harness.faulty_methods import Raises
from tests.harness.small_runs import ROOMS, write_map

METHODS = ("octile", "weighted-astar", hn.load_preset("shortest"))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> hn.harness.Study:
    file = write_map(tmp_path_factory.mktemp("map"), ROOMS)
    return hn.evaluate(file, METHODS, pairs=8, robot_radius_m=0.0)


def test_the_study_prints_as_a_table(study: hn.harness.Study) -> None:
    head, *rows, caption = str(study).splitlines()
    assert head.split()[:2] == ["method", "metric"]
    assert {row.split()[0] for row in rows} == {
        "grid-astar",
        "octile",
        "weighted-astar",
        "shortest",
    }
    assert "loss over the any-angle optimum" in caption
    assert len({len(row.rstrip()) <= len(head) for row in rows}) == 1


def test_its_losses_are_those_of_the_chart_and_of_notebooks(study: hn.harness.Study) -> None:
    assert list(study.losses) == study.labels
    assert max(study.losses["shortest"]) < 1e-6
    legend = plot_losses(study).get_legend()
    assert len(legend.get_texts()) == 4
    assert hn.plot(study).get_xlabel() == "loss in per cent"
    assert "<pre>method" in str(study._repr_html_())


def test_latex_writes_every_character_as_it_is(study: hn.harness.Study) -> None:
    assert study.to_latex().splitlines()[:2] == [r"\begin{tabular}{llrrrrrr}", r"\toprule"]
    table = Table(["a_b %", "$x$"], [["A* & {B}", r"~\<#"]], "", frozenset({1}))
    assert latex_of(table).splitlines()[2:5] == [
        r"a\_b \% & \$x\$ \\",
        r"\midrule",
        r"A* \& \{B\} & \textasciitilde{}\textbackslash{}\textless{}\# \\",
    ]


def test_methods_are_names_presets_and_classes(tmp_path: Path) -> None:
    file = write_map(tmp_path, ["...", ".@."])
    named = NamedMethod("baseline", "weighted-astar", "mine", {"weight": 3.0})
    found = hn.evaluate(str(file), [Raises, named], pairs=2, folder=tmp_path / "run")
    assert "mine" in found.labels
    assert found.failures > 0
    assert (tmp_path / "run" / "records.jsonl").exists()


@pytest.mark.parametrize(
    ("method", "words"), [("no-such", "no baseline"), (3, "a name, a preset or a class")]
)
def test_what_is_no_method_is_refused(tmp_path: Path, method: Any, words: str) -> None:
    with pytest.raises(InvalidValueError, match=words):
        hn.evaluate(write_map(tmp_path, ["..."]), [method], pairs=1)


def test_a_class_that_cannot_be_imported_is_refused(tmp_path: Path) -> None:
    class Inner:
        pass

    inner: Any = Inner

    with pytest.raises(InvalidValueError, match="file of its own"):
        hn.evaluate(str(write_map(tmp_path, ["..."])), inner, pairs=1)


def test_the_call_of_earlier_versions_warns_and_works(tmp_path: Path) -> None:
    file = str(write_map(tmp_path, ["...", ".@."]))
    settings = RunSettings(maps=(file,), presets=("octile",), pairs=2)
    with pytest.warns(FutureWarning, match="write_records"):
        made = hn.harness.evaluate(settings, tmp_path / "old")
    assert made == write_records(settings, tmp_path / "new")
