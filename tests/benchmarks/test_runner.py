"""The runner of the benchmarks: it knows all subjects, and each command that a page gives works."""

import re
from pathlib import Path

import pytest

from benchmarks.__main__ import SUBJECTS, main
from benchmarks.rivals import needed_package

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("maps/*.md")]
PAGES += [*ROOT.glob("src/**/*.py"), ROOT / "Makefile"]


def test_without_a_name_all_subjects_are_listed(capsys):
    assert main([]) == 0
    lines = capsys.readouterr().out.splitlines()[2:]
    assert [line.split()[0] for line in lines] == list(SUBJECTS)
    assert all(len(line.split(maxsplit=1)[1]) > 20 for line in lines)


def test_an_unknown_subject_is_refused(capsys):
    assert main(["mesh"]) == 2
    assert "no subject is called mesh" in capsys.readouterr().err


@pytest.mark.parametrize("name", SUBJECTS)
def test_every_subject_tells_its_options(name, capsys):
    with pytest.raises(SystemExit, match="0"):
        main([name, "--help"])
    assert f"usage: python -m benchmarks {name}" in capsys.readouterr().out


def test_pages_name_subjects_that_there_are():
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    named = set(re.findall(r"-m\s+benchmarks[ .]([a-z_0-9]+)", text))
    assert len(named) > 20
    assert named <= set(SUBJECTS)
    assert not re.findall(r"-m\s+benchmarks\.[a-z]", text)


def test_a_subject_that_needs_the_data_says_so(monkeypatch, capsys):
    monkeypatch.delenv("HYBRIDNAV_DATA", raising=False)
    assert main(["rooms"]) == 2
    assert capsys.readouterr().err.count("HYBRIDNAV_DATA") == 1


@pytest.mark.parametrize("lost", ["rosbags", "evo"])
def test_a_subject_without_its_packages_ends_in_one_line(lost, monkeypatch, capsys):
    def fail(_name):
        raise ModuleNotFoundError(name=lost)

    monkeypatch.setattr("benchmarks.__main__.import_module", fail)
    assert main(["peers", "--pairs", "1"]) == 2
    assert capsys.readouterr().err.splitlines() == [
        f"peers needs {lost}, which is not installed: python -m pip install '.[bench,dev]'"
    ]


def test_a_planner_of_others_without_its_package_ends_in_one_line(monkeypatch, capsys, tmp_path):
    def fail(_given):
        needed_package("no-such-package")

    monkeypatch.setattr("benchmarks.subjects.peers.main", fail)
    assert main(["peers", "--data", str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.full
def test_every_wait_is_measured(capsys):
    assert main(["start", "--cells", "10000", "--runs", "1"]) == 0
    lines = capsys.readouterr().out.strip().splitlines()[2:]
    assert len(lines) == 9
    assert all(cells.split("|")[2].strip()[0].isdigit() for cells in lines)
