"""What the pages show is what happens: their Python and their commands run, their links lead on."""

import contextlib
import doctest
import io
import itertools
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

import pytest
from PIL import Image

import hybridnav as hn
from hybridnav.cli.app import run
from tests.strategies import full_but

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs").rglob("*.md")))
QUICK = [page for page in PAGES if page != "docs/gallery.md"]
MAX_PICTURE_BYTES = 400_000

SAVED = ("python ", "yaml ")
"""Beginnings of blocks that a reader saves under the name that follows."""

_BLOCK = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)#]+)[^)]*\)")
_IMAGE = re.compile(r"!\[[^\]]*\]\(([^)]+)\)")
_ENDPOINTS = re.compile(r"--start (\S+) --goal (\S+)")


class Example(NamedTuple):
    """Something a page runs, and the output that it shows; `...` stands for anything.
    For a file that a reader saves, its text and its name."""

    language: str
    text: str
    expected: str


def _examples_of(page: str) -> list[Example]:
    """What a reader types, in order: blocks of Python, each with the block of text that follows it,
    and lines that start with `$` in console blocks, each with the lines up to the next."""
    blocks = [*_BLOCK.findall((ROOT / page).read_text(encoding="utf-8")), ("", "")]
    found = []
    for (language, text), (kind, output) in itertools.pairwise(blocks):
        if language == "python":
            found.append(Example(language, text, output if kind == "text" else ""))
        elif language.startswith(SAVED):
            found.append(Example("file", text, language.split()[1]))
        elif language == "console":
            for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, printed = part.partition("\n")
                found.append(Example(language, command, printed))
    return found


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What a reader has after `make route`: maps, examples, and a folder for results."""
    for name in ("maps", "examples"):
        shutil.copytree(ROOT / name, tmp_path / name)
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)  # as where Python is started
    return tmp_path


def _check(expected: str, got: str) -> None:
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    if not doctest.OutputChecker().check_output(expected, got, flags):
        pytest.fail(f"the page shows\n{expected}\nand it prints\n{got}")


def _run_python(text: str, page: str, names: dict[str, object]) -> str:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(text, page, "exec"), names)  # noqa: S102 - our own page
    return printed.getvalue()


def _run_command(text: str, folder: Path) -> str:
    """Run a line of a page, and return what it prints.

    `hybridnav` with a file for its output at most runs in this process, which has its kernels
    already. What else a shell reads runs in one, and with it the program as it is installed
    (`hybridnav preset`).
    """
    words = shlex.split(text)
    command, output = words, None
    if words[-2:-1] == [">"]:
        command, output = words[:-2], folder / words[-1]
    if words[0] != "hybridnav" or words[1] == "preset" or ">" in command:
        return _run_in_shell(text, folder)
    printed, complaints = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(complaints):
        code = run(command[1:])
    assert code in {0, 1}, complaints.getvalue()  # 1: not solved
    if output is None:
        return printed.getvalue()
    output.write_text(printed.getvalue(), encoding="utf-8")
    return ""


def _run_in_shell(text: str, folder: Path) -> str:
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    done = subprocess.run(
        ["sh", "-c", text],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("page", full_but(QUICK, [page for page in PAGES if _examples_of(page)]))
def test_a_page_shows_what_happens(page: str, folder: Path) -> None:
    names: dict[str, object] = {"__name__": "__main__"}
    for example in _examples_of(page):  # in order, in one folder, as a reader types them
        if example.language == "file":
            (folder / example.expected).write_text(example.text, encoding="utf-8")
            continue
        if example.language == "python":
            got = _run_python(example.text, page, names)
        else:
            got = _run_command(example.text, folder)
        _check(example.expected, got)


def test_every_guide_has_something_to_run() -> None:
    guides = [page for page in PAGES if page.startswith(("docs/howto/", "docs/explanation/"))]
    assert len(guides) > 8
    assert [
        page for page in ("README.md", "docs/tutorial.md", *guides) if not _examples_of(page)
    ] == []


def test_readme_plans_the_route_that_make_draws() -> None:
    recipe = _ENDPOINTS.findall((ROOT / "Makefile").read_text(encoding="utf-8"))
    commands = [example.text for example in _examples_of("README.md")]
    assert recipe[0] in [
        endpoints for command in commands for endpoints in _ENDPOINTS.findall(command)
    ]


def test_the_reference_lists_every_preset_with_its_settings() -> None:
    page = (ROOT / "docs/reference/presets.md").read_text(encoding="utf-8")
    section = page.partition("## The presets of the package\n")[2].partition("\n## ")[0]
    rows = dict(re.findall(r"^\| `([\w-]+)` \| (.+)$", section, re.MULTILINE))
    assert sorted(rows) == hn.preset_names()
    for name, row in rows.items():
        planner = hn.load_preset(name).planner
        assert f"`{planner.method}`" in row


@pytest.mark.parametrize("page", [*PAGES, "CHANGELOG.md", "CONTRIBUTING.md", "maps/README.md"])
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
        if picture.suffix == ".svg":
            assert ET.parse(picture).getroot().tag.endswith("}svg")  # noqa: S314 - our own
        else:
            with Image.open(picture) as image:
                image.verify()


def test_the_documentation_is_built_without_compiling_kernels(tmp_path: Path) -> None:
    for target, warms in (("docs", False), ("site", True)):
        command = ["make", "-n", target, f"VENV={tmp_path}"]
        steps = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        assert ("hybridnav.cli.warm" in steps) == warms
        assert "-r requirements.lock" in steps
