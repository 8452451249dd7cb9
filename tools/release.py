"""What a release says of itself: written from pyproject.toml, and checked before it is published.

`--write` writes the version, addresses and licence of pyproject.toml into CITATION.cff and
codemeta.json. Without it, all that a release must fill or agree on is checked: one line for each
fault, exit code 1 where there is any.
"""

import json
import re
from argparse import Namespace
from pathlib import Path
from typing import Any

import tomllib
import yaml

from benchmarks.common import ROOT
from benchmarks.options import option

OPTIONS = [
    option("--write", action="store_true", help="write CITATION.cff and codemeta.json"),
    option("--root", type=Path, default=ROOT, help="the checkout, this one by default"),
]
PLACEHOLDER = re.compile(r"https?://[\w.-]*\.example\b")
"""Addresses under the top-level domain that is reserved for examples."""
UNNAMED = {"The hybridnav maintainers", "The hybridnav developers", "The hybridnav project"}
"""Authors that whoever publishes it replaces by people."""


def project_of(root: Path) -> dict[str, Any]:
    """Return the table `project` of pyproject.toml."""
    text = (root / "pyproject.toml").read_text(encoding="utf-8")
    table: dict[str, Any] = tomllib.loads(text)["project"]
    return table


def released(root: Path) -> tuple[str, str]:
    """Return version and date of the newest section of the changelog, the date empty if missing."""
    text = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    found = re.search(r"^## \[(\d[^\]]*)\] - (\d{4}-\d\d-\d\d)?", text, re.MULTILINE)
    return ("", "") if found is None else (found[1], found[2] or "")


def codemeta(root: Path) -> dict[str, Any]:
    """Return the description of the software in the terms of CodeMeta 3."""
    project = project_of(root)
    citation = yaml.safe_load((root / "CITATION.cff").read_text(encoding="utf-8"))
    urls = project["urls"]
    return {
        "@context": "https://w3id.org/codemeta/3.0",
        "@type": "SoftwareSourceCode",
        "name": project["name"],
        "description": project["description"],
        "version": project["version"],
        "dateModified": released(root)[1],
        "license": f"https://spdx.org/licenses/{project['license']}",
        "programmingLanguage": f"Python {project['requires-python']}",
        "keywords": project["keywords"],
        "author": [{"@type": "Organization", "name": one["name"]} for one in citation["authors"]],
        "url": urls["Homepage"],
        "codeRepository": urls["Source"],
        "issueTracker": urls["Issues"],
        "softwareHelp": urls["Documentation"],
        "operatingSystem": ["Linux", "macOS"],
        "referencePublication": {
            "@type": "ScholarlyArticle",
            "name": citation["preferred-citation"]["title"],
        },
    }


def cited(root: Path) -> str:
    """Return CITATION.cff with the version, the date and the addresses of the project."""
    text = (root / "CITATION.cff").read_text(encoding="utf-8")
    project = project_of(root)
    for key, value in {
        "version": project["version"],
        "date-released": released(root)[1],
        "url": project["urls"]["Homepage"],
        "repository-code": project["urls"]["Source"],
    }.items():
        text = re.sub(rf"^{key}: .*$", f"{key}: {value}", text, flags=re.MULTILINE)
    return text


def faults(root: Path) -> list[str]:
    """Return what keeps this checkout from being released, one line each."""
    project, (version, date) = project_of(root), released(root)
    citation = yaml.safe_load((root / "CITATION.cff").read_text(encoding="utf-8"))
    found = [
        f"pyproject.toml: {name} is a placeholder, {url}"
        for name, url in project["urls"].items()
        if PLACEHOLDER.match(url)
    ]
    found += [
        f"CITATION.cff: the authors are a placeholder, {one['name']}"
        for one in citation["authors"]
        if one.get("name") in UNNAMED
    ]
    paper = yaml.safe_load((root / "paper" / "paper.md").read_text("utf-8").split("---\n")[1])
    found += [
        f"paper/paper.md: the authors are a placeholder, {one['name']}"
        for one in paper["authors"]
        if one["name"] in UNNAMED
    ]
    module = (root / "src" / "hybridnav" / "_version.py").read_text(encoding="utf-8")
    if f'"{project["version"]}"' not in module:
        found.append(f"src/hybridnav/_version.py: the version is not {project['version']}")
    if version != project["version"]:
        found.append(f"CHANGELOG.md: the newest version is {version}, not {project['version']}")
    if not date:
        found.append(f"CHANGELOG.md: version {version} has no date")
    if cited(root) != (root / "CITATION.cff").read_text(encoding="utf-8"):
        found.append("CITATION.cff: is not what `python -m benchmarks release --write` writes")
    if codemeta(root) != json.loads((root / "codemeta.json").read_text(encoding="utf-8")):
        found.append("codemeta.json: is not what `python -m benchmarks release --write` writes")
    return found


def main(given: Namespace) -> int:
    """Write both files, or print what is missing."""
    if given.write:
        (given.root / "CITATION.cff").write_text(cited(given.root), encoding="utf-8")
        text = json.dumps(codemeta(given.root), indent=2) + "\n"
        (given.root / "codemeta.json").write_text(text, encoding="utf-8")
        return 0
    found = faults(given.root)
    print("\n".join(found) or "ready to be released")
    return int(bool(found))
