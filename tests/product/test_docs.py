"""The pages are complete: every public name, the notebooks, the layers, how to cite."""

import importlib
import inspect
import os
import pkgutil
import re
from pathlib import Path

import nbformat
import pytest
import tomllib
import yaml

import hybridnav as hn
from benchmarks.worlds import figure1_world
from docs.extensions import notebook_pages

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

_DOCUMENTED = re.compile(r"^\.\. auto\w+:: hybridnav\.([\w.]+)(?:\(\))?$", re.MULTILINE)
_LINK = re.compile(r"\[[^\]]*\]\(([^)#]+)[^)]*\)")
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
PAGES_OF_THE_SITE = {
    **{path.relative_to(ROOT / "docs").as_posix(): path for path in (ROOT / "docs").rglob("*.md")},
    **{path.relative_to(ROOT).as_posix(): path for path in NOTEBOOKS},
}


def _documented() -> list[str]:
    pages = (ROOT / "docs" / "reference").glob("*.md")
    return [name for page in pages for name in _DOCUMENTED.findall(page.read_text("utf-8"))]


def _public_names() -> list[str]:
    """Names of the package itself, and of its packages those that it does not export."""
    modules = {"errors", "ext", "graphs", "harness", "viz"}
    names = [name for name in hn.__all__ if name not in modules]
    wing = [f"ext.{name}" for name in importlib.import_module("hybridnav.ext").__all__]
    packages = [module.name for module in pkgutil.iter_modules(hn.__path__) if module.ispkg]
    for place in (*sorted(set(packages) - {"errors", "ext"}), *wing):
        package = importlib.import_module(f"hybridnav.{place}")
        listed = getattr(package, "__all__", [])
        names += [f"{place}.{name}" for name in listed if name not in hn.__all__]
    return names


def test_the_reference_has_every_public_name_once() -> None:
    documented = _documented()
    assert len(documented) == len(set(documented))
    assert set(_public_names()) - set(documented) == set()


def test_each_public_name_stands_outside_the_reference_too() -> None:
    """Somebody who knows the job but not the name finds it."""
    pages = [ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("docs/[!r]*/*.md")]
    pages += [*ROOT.glob("examples/*.py"), *NOTEBOOKS]
    words = set(re.findall(r"[A-Za-z_]\w+", "\n".join(page.read_text("utf-8") for page in pages)))
    assert [name for name in _public_names() if name.rpartition(".")[2] not in words] == []


def test_the_reference_names_nothing_that_is_not_there() -> None:
    for name in _documented():
        module, _, attribute = name.rpartition(".")
        home = importlib.import_module(".".join(filter(None, ("hybridnav", module))))
        assert hasattr(home, attribute), name


@pytest.mark.parametrize("name", sorted(set(hn.__all__) - {"errors", "ext"}))
def test_what_the_reference_shows_is_documented(name: str) -> None:
    thing = getattr(hn, name)
    assert inspect.getdoc(thing)
    if inspect.isfunction(thing) and inspect.signature(thing).parameters:
        text = str(inspect.getdoc(thing))
        assert "Parameters\n-----" in text
        assert all(re.search(rf"\b{p}\b", text) for p in inspect.signature(thing).parameters)


def _prose(path: Path) -> str:
    """The text of a page, or of a notebook's cells that are text."""
    if path.suffix != ".ipynb":
        return path.read_text(encoding="utf-8")
    cells = nbformat.read(path, as_version=4).cells
    return "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")


@pytest.mark.parametrize("page", PAGES_OF_THE_SITE)
def test_links_of_the_site_lead_to_pages_and_pictures_of_it(page: str) -> None:
    source = [_prose(PAGES_OF_THE_SITE[page])]
    notebook_pages.mend_links(None, page.rpartition(".")[0], source)
    links = [link for link in _LINK.findall(source[0]) if not link.startswith("http")]
    for link in links:
        target = os.path.normpath(Path(page).parent / link)
        picture = target.startswith("images/") and (ROOT / "docs" / target).is_file()
        assert picture or target in PAGES_OF_THE_SITE, link


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_links_of_a_notebook_lead_to_files_of_the_checkout(path: Path) -> None:
    links = [link for link in _LINK.findall(_prose(path)) if not link.startswith("http")]
    assert [link for link in links if not (path.parent / link).is_file()] == []


def test_the_site_lists_every_notebook() -> None:
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    listed = re.findall(r"^(\d\d) .+ <notebooks/(.+)>$", index, re.MULTILINE)
    assert listed == [(path.stem[:2], path.stem) for path in NOTEBOOKS]


def test_executed_notebooks_are_kept_until_the_code_changes(tmp_path, monkeypatch):
    monkeypatch.setattr(notebook_pages, "ROOT", tmp_path)
    monkeypatch.setattr(notebook_pages, "CACHES", tmp_path / "out")
    code = tmp_path / "src" / "package" / "code.py"
    code.parent.mkdir(parents=True)
    code.write_text("answer = 42\n", encoding="utf-8")
    first = notebook_pages.execution_cache()
    first.mkdir(parents=True)
    assert notebook_pages.execution_cache() == first
    assert first.is_dir()
    code.write_text("answer = 43\n", encoding="utf-8")
    assert notebook_pages.execution_cache() != first
    assert not first.exists()


@pytest.fixture(scope="module")
def behaviour() -> dict[str, str]:
    """Where the route of each preset comes from, seen in what a query does."""
    grid = figure1_world().grid(robot_radius_m=0.0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    seen = {}
    for name in hn.preset_names():
        preset = hn.load_preset(name)
        if preset.planner.method == "ompl":
            continue  # as the preset whose fields they plan in
        result = hn.HybridPlanner(topology, preset=preset).plan((0.3, 0.3), (0.3, 2.7))
        assert result.solved
        assert result.route is not None
        seen[name] = "chosen on places" if result.stats.expanded_places else "read off the path"
    return seen


@pytest.mark.parametrize(
    ("page", "words"),
    [
        (
            "CONTRIBUTING.md",
            {
                "| the places of the `TopologicalMap` |": "chosen on places",
                "| the corner cells at which shortest paths of cells turn |": "read off the path",
                "| a convex mesh of free space": "read off the path",
                "| a lattice of cheap lines over the cells": "read off the path",
                "| the cells of the whole grid |": "read off the path",
            },
        )
    ],
)
def test_pages_describe_the_flow_of_data_preset_by_preset(page, words, behaviour):
    lines = (ROOT / page).read_text(encoding="utf-8").splitlines()
    described: dict[str, str] = {}
    for mark, source in words.items():
        (line,) = [line for line in lines if mark in line]
        presets = re.findall(r"`([a-z-]+)`", line.partition(mark)[0])
        described |= dict.fromkeys(presets, source)
    assert {name: described.get(name) for name in behaviour} == behaviour


def test_the_picture_of_the_layers_is_the_contract() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    picture = text.partition("```text\n")[2].partition("```")[0]
    lines = [re.split(r" {4,}", line.strip())[0] for line in picture.splitlines()]
    drawn = [re.split(r"\s*\|\s*", line) for line in lines if line not in {"", "|"}]
    (contract,) = PROJECT["tool"]["importlinter"]["contracts"]
    layers = [re.split(r"\s*\|\s*", line) for line in contract["layers"]]
    assert drawn == [[name.removeprefix("hybridnav.") for name in layer] for layer in layers]


def test_how_to_cite_says_what_the_package_says() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["cff-version"] == "1.2.0"
    assert citation["version"] == hn.__version__ == PROJECT["project"]["version"]
    assert citation["license"] == PROJECT["project"]["license"]
    assert citation["title"] == PROJECT["project"]["name"]
    assert citation["authors"]
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    (paper,) = re.findall(r'"(A Dual .+)"', citation["message"])
    assert paper in readme


def test_the_licence_is_whole() -> None:
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "Apache License\n" in text
    assert "Version 2.0, January 2004" in text
    assert "END OF TERMS AND CONDITIONS" in text
    assert all(f"\n{number}. " in text for number in range(1, 10))
    assert re.findall(r"^Copyright .+$", text, re.MULTILINE) == [
        "Copyright 2026 the hybridnav maintainers"
    ]
