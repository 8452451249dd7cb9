"""What the pages show is what happens: their Python and their commands run, their links lead on."""

from __future__ import annotations

import contextlib
import doctest
import io
import itertools
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from PIL import Image

import hybridnav as hn

ROOT = Path(__file__).parents[1]
_DOCS = ("harness", "ompl", "portals", "pyramid", "rooms")
PAGES = ("README.md", *(f"docs/{name}.md" for name in _DOCS))
MAX_PICTURE_BYTES = 400_000

_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)#]+)[^)]*\)")
_IMAGE = re.compile(r"!\[[^\]]*\]\(([^)]+)\)")
_ENDS = re.compile(r"--start (\S+) --goal (\S+)")


class Example(NamedTuple):
    """Something a page runs, and what it says comes out; `...` stands for anything."""

    page: str
    text: str
    expected: str


def _blocks(page: str) -> list[tuple[str, str]]:
    return _BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))


def _python_of(page: str) -> list[Example]:
    """Blocks of Python, each with the block of text that follows it."""
    blocks = [*_blocks(page), ("", "")]
    return [
        Example(page, code, output if kind == "text" else "")
        for (language, code), (kind, output) in itertools.pairwise(blocks)
        if language == "python"
    ]


def _commands_of(page: str) -> list[Example]:
    """Lines that start with `$` in console blocks, each with the lines up to the next."""
    found = []
    for language, text in _blocks(page):
        if language == "console":
            for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, output = part.partition("\n")
                found.append(Example(page, command, output))
    return found


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What a reader has after `make route`: the project's maps, and a folder for results."""
    shutil.copytree(ROOT / "maps", tmp_path / "maps")
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _check(expected: str, got: str) -> None:
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    if not doctest.OutputChecker().check_output(expected, got, flags):
        pytest.fail(f"the page shows\n{expected}\nand it prints\n{got}")


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.usefixtures("folder")
def test_python_of_a_page_prints_what_the_page_shows(page: str) -> None:
    names: dict[str, object] = {}
    for example in _python_of(page):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(example.text, page, "exec"), names)  # noqa: S102 - our own page
        _check(example.expected, printed.getvalue())
    assert names, f"{page} shows no Python"


@pytest.mark.parametrize("page", [page for page in PAGES if _commands_of(page)])
def test_commands_of_a_page_print_what_the_page_shows(page: str, folder: Path) -> None:
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    for example in _commands_of(page):  # in order, in one folder, as a reader types them
        run = subprocess.run(
            ["sh", "-c", example.text],
            cwd=folder,
            env={**os.environ, "PATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode in {0, 1}, run.stderr  # 1: not solved
        _check(example.expected, run.stdout)


def test_readme_plans_the_route_that_make_draws() -> None:
    recipe = _ENDS.findall((ROOT / "Makefile").read_text(encoding="utf-8"))
    commands = _commands_of("README.md")
    assert recipe[0] in [ends for command in commands for ends in _ENDS.findall(command.text)]


def test_readme_lists_every_preset_with_its_settings() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    section = readme.partition("## Presets\n")[2].partition("\n## ")[0]
    rows = dict(re.findall(r"^\| `([\w-]+)` \| (.+)$", section, re.MULTILINE))
    assert sorted(rows) == hn.preset_names()
    for name, row in rows.items():
        planner = hn.load_preset(name).planner
        assert f"`{planner.coarse}`" in row
        assert f"`{planner.refine}`" in row


@pytest.mark.parametrize("page", [*PAGES, "CHANGELOG.md", "maps/README.md"])
def test_links_of_a_page_lead_to_files(page: str) -> None:
    links = _LINK.findall((ROOT / page).read_text(encoding="utf-8"))
    gone = [
        link
        for link in links
        if not link.startswith(("http://", "https://"))
        and not (ROOT / page).parent.joinpath(link).exists()
    ]
    assert not gone


@pytest.mark.parametrize("page", PAGES)
def test_pictures_of_a_page_are_sound_and_small(page: str) -> None:
    for link in _IMAGE.findall((ROOT / page).read_text(encoding="utf-8")):
        picture = (ROOT / page).parent / link
        assert picture.stat().st_size < MAX_PICTURE_BYTES
        with Image.open(picture) as image:
            image.verify()
