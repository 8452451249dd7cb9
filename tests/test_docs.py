"""The pages are complete: every public name, the layers, how to cite."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
import tomllib
from pathlib import Path

import pytest
import yaml

import hybridnav as hn

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

_DOCUMENTED = re.compile(r"^\.\. auto\w+:: hybridnav\.([\w.]+)(?:\(\))?$", re.MULTILINE)


def _documented() -> list[str]:
    pages = (ROOT / "docs" / "reference").glob("*.md")
    return [name for page in pages for name in _DOCUMENTED.findall(page.read_text("utf-8"))]


def _public_names() -> list[str]:
    """Names of the package itself, and of its packages those that it does not export."""
    names = list(hn.__all__)
    for module in pkgutil.iter_modules(hn.__path__):
        if not module.ispkg:
            continue
        package = importlib.import_module(f"hybridnav.{module.name}")
        listed = getattr(package, "__all__", [])
        names += [f"{module.name}.{name}" for name in listed if name not in hn.__all__]
    return names


def test_the_reference_has_every_public_name_once() -> None:
    documented = _documented()
    assert len(documented) == len(set(documented))
    assert set(_public_names()) - set(documented) == set()


def test_the_reference_names_nothing_that_is_not_there() -> None:
    for name in _documented():
        module, _, attribute = name.rpartition(".")
        home = importlib.import_module(".".join(filter(None, ("hybridnav", module))))
        assert hasattr(home, attribute), name


@pytest.mark.parametrize("name", hn.__all__)
def test_what_the_reference_shows_is_documented(name: str) -> None:
    thing = getattr(hn, name)
    assert inspect.getdoc(thing)
    if inspect.isfunction(thing) and inspect.signature(thing).parameters:
        text = str(inspect.getdoc(thing))
        assert "Parameters\n-----" in text
        assert all(re.search(rf"\b{p}\b", text) for p in inspect.signature(thing).parameters)


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
