"""The study on two maps of our own: its figures, its page, its runs."""

import copy
import json
import re
from pathlib import Path

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.__main__ import main
from benchmarks.subjects import study
from benchmarks.subjects._study_data import collect
from benchmarks.subjects._study_descent import SIZES, levels_of, plot_levels_of
from benchmarks.subjects._study_maps import StudyMap
from benchmarks.subjects._study_page import page
from benchmarks.subjects._study_run import (
    GRAPHS,
    PLANS,
    RIVALS,
    SAMPLING,
    Part,
    Plan,
    parts_of,
    read_note,
    rivals,
    run,
)
from benchmarks.subjects._study_tables import tables_of
from hybridnav.errors import InvalidValueError
from hybridnav.harness.names import BASELINES
from hybridnav.harness.tables import text_of
from hybridnav.planning import load_preset
from tests.benchmarks.recomputed import REFERENCE, Recomputed
from tests.harness.small_runs import run_here

MAPS = Path(__file__).parents[2] / "maps"
NAMES = ("office/office", "figure1/figure1")
PLAN = Plan("small", pairs=6, ompl_pairs=3, repeat=3, limit_s=300.0)
PARTS = (
    Part(
        "lengths",
        ("octile", "paper", "shortest"),
        ("hpa-star",),
        6,
        3,
        methods=(*(one for one in RIVALS if one.name == "networkx"), *GRAPHS),
    ),
    Part("costs", ("robot", "shortest"), (), 6, 3, ("clearance",)),
    Part("ompl", (load_preset("octile", overrides=["planner.smooth=line-of-sight"]),), (), 3, 0),
)
KINDS = dict.fromkeys(NAMES, "ROS")
FIGURES = ("lengths", "costs", "ompl")


def own_maps():
    return [StudyMap(MAPS / f"{name}.yaml", "ROS") for name in NAMES]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hybridnav.harness.run.run_local", run_here)
        run(own_maps(), made, PLAN, PARTS)
    return made


@pytest.fixture(scope="module")
def data(folder):
    """Its figures, after all its outputs were written."""
    study.write_all(folder, MAPS, KINDS, folder / "docs")
    return json.loads((folder / "docs" / "data" / "study.json").read_text(encoding="utf-8"))


# --- figures ------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", FIGURES)
def test_the_figures_are_those_of_the_records(folder, data, part):
    known, figures = Recomputed(folder / part), data["parts"][part]
    assert figures["pairs"] == len(known.asked) > 0
    assert figures["pairs in common"] == len(known.common) > 0
    assert [row["method"] for row in figures["methods"]] != []
    assert {row["method"] for row in figures["methods"]} == set(known.whole)
    assert {r["method"] for r in figures["others"]} == set(known.methods) - set(known.whole)
    optima = ("weighted",) if part == "costs" else ("any-angle", "octile")
    for row in [*figures["methods"], *figures["others"]]:
        name = row["method"]
        expected = known.counts(name) | known.efficiency(name) | known.gaps(name)
        for optimum in optima:
            expected |= known.loss_figures(name, optimum)
        assert len(expected) > 14
        for column, value in expected.items():
            assert row[column] == pytest.approx(value, rel=1e-5, abs=1e-9), (name, column)


@pytest.mark.parametrize("part", FIGURES)
def test_consistency_is_that_of_the_records(folder, data, part):
    known = Recomputed(folder / part)
    answered = 0
    for row in data["parts"][part]["consistency"]:
        found, rightly, own = known.checked(row["method"])
        answered += own
        for kind, count in found.items():
            assert row[kind] == (f"0 of {count}" if count else ""), (row["method"], kind)
        assert row['"no path", right'] == rightly
    assert data["parts"][part]["checks"] == answered
    assert data["parts"][part]["contradictions"] == 0


def test_the_study_says_how_many_any_angle_optima_were_checked(folder, data):
    found = []
    for name, plan in zip(FIGURES, PARTS, strict=True):
        lines = (folder / name / "records.jsonl").read_text(encoding="utf-8").splitlines()
        checked = sum("visibility_optimum_m" in json.loads(line) for line in lines)
        assert checked == min(plan.pairs, 3) * len(NAMES)
        found.append(f"{checked} of {data['parts'][name]['pairs']}")
    assert [data["parts"][name]["checked any-angle"] for name in FIGURES] == found
    words = "checked any-angle: Lengths {}, Costs {}, OMPL {} optima".format(*found)
    assert words in page(data)
    older = copy.deepcopy(data)
    for part in older["parts"].values():
        del part["checked any-angle"]
    assert "checked any-angle" not in page(older)


def test_a_longer_path_in_the_records_is_a_larger_loss(folder, data, tmp_path):
    made = tmp_path / "study"
    made.mkdir()
    for file in folder.glob("*/r*.jsonl"):
        lines = file.read_text(encoding="utf-8").splitlines()
        if file.parent.name == "lengths" and file.name == "records.jsonl":
            records = [json.loads(line) for line in lines]
            for record in records:
                if record["method"] == "paper" and record["status"] == "solved":
                    record |= {"length_m": 2 * record["length_m"], "bound": None}
            lines = [json.dumps(record) for record in records]
        (made / file.parent.name).mkdir(exist_ok=True)
        (made / file.parent.name / file.name).write_text("\n".join([*lines, ""]))
    (made / "study-run.json").write_bytes((folder / "study-run.json").read_bytes())
    changed = collect(made, MAPS, KINDS)
    (before,) = [r for r in data["parts"]["lengths"]["methods"] if r["method"] == "paper"]
    (after,) = [r for r in changed["parts"]["lengths"]["methods"] if r["method"] == "paper"]
    column = "octile loss mean %"
    assert after[column] == pytest.approx(2 * before[column] + 100, rel=1e-4)
    assert page(changed) != page(data)


def test_a_method_that_one_map_is_too_large_for_takes_no_pairs_from_the_others(data):
    lengths = data["parts"]["lengths"]
    (networkx,) = lengths["others"]
    assert (networkx["method"], networkx["maps"]) == ("networkx", 1)
    assert networkx["pairs in common"] < lengths["pairs in common"] == lengths["pairs"]
    assert networkx["octile loss mean %"] == 0
    assert networkx["speed-up of octile"] > 0
    (missing,) = [one for one in lengths["unanswered"] if one["method"] == "networkx"]
    assert missing["maps"] == ["office/office"]
    assert "up to 100,000 free cells" in missing["first"]
    text = page(data)
    assert re.search(r"\| Lengths \| networkx \| not (made|asked) \|", text)
    assert "up to 100,000 free cells" in text


def test_graphs_of_waypoints_have_a_table_with_nodes_edges_and_settings(folder, data):
    lengths = data["parts"]["lengths"]
    known = Recomputed(folder / "lengths")
    (table,) = [one for one in tables_of(data) if one.name == "graphs"]
    rows = {row[0]: dict(zip(table.columns, row, strict=True)) for row in table.rows}
    assert list(rows) == [method.name for method in GRAPHS]
    assert "any-angle optimum" in table.title
    needed = {"solved %", "mean %", "expansions", "work in cells"}
    needed |= {"query ms, median", "preparation s", "nodes", "edges", "maps"}
    for name, row in rows.items():
        assert all(row[column] for column in needed)
        ready = [r for (_, method), r in known.ready.items() if method == name]
        nodes = sum(record["n_nodes"] for record in ready) / len(ready)
        assert float(row["nodes"].replace(",", "")) == pytest.approx(nodes, abs=0.6)
        assert lengths["settings"][name] == ready[0]["settings_text"]
        assert f"{name}: {ready[0]['settings_text']}" in table.note
        assert row["maps"] == "2"
    assert {row["method"] for row in lengths["methods"]} >= set(rows)


def test_no_name_of_the_machine_and_no_path_of_it_is_published(folder, data):
    text = (folder / "docs" / "data" / "study.json").read_text(encoding="utf-8") + page(data)
    first = json.loads((folder / "lengths" / "records.jsonl").read_text().splitlines()[0])
    assert first["environment"]["host"] not in re.findall(r"[\w.-]+", text)
    assert str(MAPS) not in text
    assert str(folder) not in text


# --- page ---------------------------------------------------------------------------------------


def test_the_page_is_that_of_its_figures(folder, data):
    text = (folder / "docs" / "study.md").read_text(encoding="utf-8")
    assert text == page(data)
    for part in data["parts"].values():
        for row in [*part["methods"], *part["others"]]:
            assert f"| {row['method']} |" in text
    for picture in re.findall(r"\]\((images/.+?)\)", text):
        assert (folder / "docs" / picture).read_text(encoding="utf-8").startswith("<?xml")
    stale = copy.deepcopy(data)
    stale["parts"]["lengths"]["methods"][1]["query ms, median"] *= 1.5
    assert page(stale) != text


def test_the_page_says_what_the_levels_of_a_descent_do(data):
    (office, _) = own_maps()
    levels = levels_of([office], MAPS)
    figures = levels["office/office"]["figures"]
    assert list(figures) == [*SIZES, "octile"]
    assert figures["octile"]["loss mean %"] == 0
    assert figures["places"]["loss mean %"] > figures["128"]["loss mean %"] > 0
    assert figures["128"]["work %"] < figures["1"]["work %"] < 100
    ax = plot_levels_of(levels)
    curve = max((np.asarray(line.get_ydata()) for line in ax.lines), key=np.size)
    assert curve.tolist() == [figures[name]["loss mean %"] for name in SIZES]
    text = page(data | {"descent": levels})
    assert f"at the places {text_of(figures['places']['loss mean %'])} % in the mean" in text
    assert "study-descent.svg" not in page(data)


def test_a_contradiction_stands_on_the_page(data):
    wrong = copy.deepcopy(data)
    wrong["parts"]["lengths"] |= {"contradictions": 3, "first contradictions": ["office: a wall"]}
    text = page(wrong)
    assert "* Contradictions: 3 in " in text
    assert "3 contradictions" in text
    assert "office: a wall" in text


# --- runs ---------------------------------------------------------------------------------------


def test_a_second_run_asks_nothing_again(folder, monkeypatch):
    asked = []

    def ask(tasks, **_):
        asked.extend(tasks)
        return iter(())

    monkeypatch.setattr("hybridnav.harness.run.run_local", ask)
    run(own_maps(), folder, PLAN, PARTS)
    assert asked == []


def test_a_run_that_is_stopped_goes_on_and_its_time_counts(tmp_path, monkeypatch):
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
    monkeypatch.setattr("benchmarks.subjects._study_run._SPEAK_S", 0.0)
    part = Part("lengths", ("octile",), (), 4, 0)
    figure = [StudyMap(MAPS / "figure1/figure1.yaml", "ROS")]

    def stopped(tasks, **_):
        for count, batch in enumerate(run_here(tasks)):
            if count == 1:
                raise KeyboardInterrupt
            yield batch

    with monkeypatch.context() as patch:
        patch.setattr("hybridnav.harness.run.run_local", stopped)
        with pytest.raises(KeyboardInterrupt):
            run(figure, tmp_path, PLAN, [part])
    records = tmp_path / "lengths" / "records.jsonl"
    first, before = records.read_text(), read_note(tmp_path)["seconds"]["lengths"]
    run(figure, tmp_path, PLAN, [part])
    assert first != records.read_text()
    assert records.read_text().startswith(first)
    assert read_note(tmp_path)["seconds"]["lengths"] > before > 0


def test_a_folder_holds_one_study(folder):
    with pytest.raises(InvalidValueError, match=r"6 pairs a map \(small\), this one has 16"):
        run(own_maps(), folder, PLANS["quarter"], PARTS)


@pytest.mark.parametrize("name", PLANS)
def test_every_method_is_in_a_part_or_said_to_be_left_out(name):
    lengths, costs, ompl = parts_of(PLANS[name])
    asked = {*lengths.baselines, *lengths.presets, *ompl.presets, *costs.presets}
    there, missing = rivals()
    asked |= {method.name for method in (*lengths.methods, *ompl.methods)}
    asked -= {method.name for method in GRAPHS}
    known = {*BASELINES, *hn.preset_names(), *(one.name for one in (*there, *SAMPLING))}
    known -= {REFERENCE, "ompl"}
    assert known - asked == set(PLANS[name].without)
    assert [one.name for one in RIVALS if one.name not in missing] == [one.name for one in there]
    assert {"octile", "paper", "shortest"} <= set(lengths.presets)
    assert {"hpa-star", "thrun", "weighted-astar"} <= set(lengths.baselines)
    assert REFERENCE in lengths.baselines
    assert {"route graph", "swagger-like", "networkx"} <= {one.name for one in lengths.methods}
    assert {"robot", "shortest"} <= set(costs.presets)
    assert costs.costs == ("clearance",)
    assert "shortest" in ompl.presets
    assert {"ompl-rrtconnect", "ompl-bitstar"} <= {method.name for method in ompl.methods}


def test_a_quarter_asks_a_quarter_of_the_pairs():
    quarter, whole = PLANS["quarter"], PLANS["whole"]
    assert (4 * quarter.pairs, 4 * quarter.ompl_pairs) == (whole.pairs, whole.ompl_pairs)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ((), 2, "HYBRIDNAV_DATA"),
        (("--data", "nowhere"), 1, "no map of the study is in"),
        (("--data", str(MAPS)), 1, "no map of the study is in"),
    ],
)
def test_what_cannot_be_run_is_said_in_one_line(arguments, code, words, monkeypatch, capsys):
    monkeypatch.delenv("HYBRIDNAV_DATA", raising=False)
    assert main(["study", *arguments]) == code
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1
