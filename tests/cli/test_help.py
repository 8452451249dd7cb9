"""The help of the commands, and commands that other packages add."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer

from hybridnav.cli import help as helping
from hybridnav.cli.app import app
from hybridnav.cli.plan import plan
from hybridnav.cli.query import PlanOptions

ROOT = Path(__file__).parents[2]
FIGURE = ROOT / "maps" / "figure1" / "figure1.yaml"
COMMANDS = [
    "plan",
    "closed",
    "verify",
    "show",
    "rooms",
    "view",
    "map",
    "build",
    "judge",
    "evaluate",
    "compare",
    "explore",
    "replay",
    "export",
    "check",
    "serve",
]
QUICK = ("plan", "show", "rooms", "build", "export")  # the rest serves, or needs files


@pytest.fixture(autouse=True)
def columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


def sections_of(text):
    title = ""
    sections: dict[str, list[str]] = {}
    for line in text.splitlines():
        if re.fullmatch(r" *[A-Z][\w ]*:", line):
            title = line.strip(" :")
        sections.setdefault(title, []).append(line)
    return sections


def example_in(text):
    """Return the words of the example in a help."""
    return shlex.split(text.partition("Example: hybridnav ")[2].partition("\n\n")[0])


def test_every_command_stands_in_a_group_with_its_whole_summary(cli):
    text = cli("--help").out
    assert "..." not in text.partition("Commands:")[2]
    sections = sections_of(text)
    groups = ["Plan", "Look", "Prepare", "Measure", "Robots and fleets"]
    assert [*sections][2:] == ["Commands", *groups]
    listed = [line.split()[0] for group in groups for line in sections[group][1:] if line]
    assert sorted(listed) == sorted([*COMMANDS, "preset"])


def test_the_summary_of_a_command_is_that_of_its_docstring_though_it_is_not_loaded() -> None:
    assert sorted(helping.names()) == sorted([*COMMANDS, "preset"])
    for name in helping.names():
        home = app_command(name)
        assert helping._summary_of(name) == home.get_short_help_str(200)


def app_command(name: str) -> Any:
    group: Any = typer.main.get_command(app)
    return group.get_command(None, name)


def test_help_loads_neither_typer_nor_the_commands() -> None:
    code = (
        "import sys\nfrom hybridnav.cli import main\nsys.argv[1:] = ['--help']\n"
        "try:\n    main()\nfinally:\n    loaded = {'typer', 'numpy', 'hybridnav.cli.app'}\n"
        "    sys.stderr.write(str(loaded & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stderr == "set()"
    assert (
        done.stdout
        == subprocess.run(
            [sys.executable, "-c", "from hybridnav.cli.app import run; run(['--help'])"],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    )


def test_options_of_plan_stand_in_panels_what_is_typed_first_on_top(cli):
    sections = sections_of(cli("plan", "--help").out)
    assert [*sections][2:] == [
        "Typed first",
        "Ends and routes",
        "What is closed",
        "Costs",
        "Output",
        "Map",
    ]
    first = [line.split()[0] for line in sections["Typed first"] if line.startswith("  --")]
    assert first == ["--from", "--to", "--start", "--goal", "--plot"]


@pytest.mark.parametrize("name", COMMANDS)
def test_each_help_has_an_example_whose_options_there_are(cli, name):
    example = example_in(cli(name, "--help").out)
    assert example[0] == name
    commands: Any = typer.main.get_command(app)
    command = commands.get_command(None, name)
    command.make_context(name, example[1:])  # refuses what there is not


@pytest.mark.parametrize("name", QUICK)
def test_examples_run(cli, name, tmp_path, monkeypatch):
    example = example_in(cli(name, "--help").out)
    (tmp_path / "maps").symlink_to(ROOT / "maps")
    monkeypatch.chdir(tmp_path)
    assert cli(*example).code == 0


def test_a_command_is_a_function_of_its_options(capsys):
    plan(PlanOptions(map_file=FIGURE, robot_radius_m=0.0, start=(0.5, 0.5), goal=(2.0, 2.5)))
    assert "status     solved" in capsys.readouterr().out


def test_one_preset_is_taken_and_several_are_refused(cli):
    presets = ("--preset", "paper", "--preset", "octile")
    ends = ("--start", "0.5,0.5", "--goal", "2.0,2.5")
    for command in (("plan", FIGURE, *ends), ("show", FIGURE), ("rooms", FIGURE)):
        assert cli(*command, *presets).refuses(2, "--preset is taken once, got 2: leave one")


def test_commands_of_another_package_are_listed_and_run(tmp_path):
    (tmp_path / "greeting.py").write_text(
        "from dataclasses import dataclass\n"
        "from typing import Annotated\n"
        "import typer\n"
        "@dataclass(frozen=True, kw_only=True)\n"
        "class Options:\n"
        "    name: Annotated[str, typer.Argument()]\n"
        "def greet(args: Options):\n"
        "    'Greet somebody.'\n"
        "    print('hello', args.name)\n"
        "def leave(name: str):\n"
        "    'Leave somebody.'\n"
        "    print('farewell', name)\n"
    )
    facts = tmp_path / "greeting-1.0.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: greeting\nVersion: 1.0\n")
    (facts / "entry_points.txt").write_text(
        "[hybridnav.commands]\ngreet = greeting:greet\nleave = greeting:leave\n"
    )

    def run(*arguments):
        command = [sys.executable, "-m", "hybridnav", *arguments]
        paths = os.environ | {"PYTHONPATH": str(tmp_path)}
        return subprocess.run(command, capture_output=True, text=True, check=True, env=paths).stdout

    others = sections_of(run("--help"))["Others"]
    assert [line.split()[0] for line in others[1:]] == ["greet", "leave"]
    assert (run("greet", "Ann"), run("leave", "Bob")) == ("hello Ann\n", "farewell Bob\n")
