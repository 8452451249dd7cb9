"""Seams between modules: what is private to a package stays in it, and no imports form a circle.

Imports in functions and those for type checkers count: a module that needs another one only there
still cannot be understood, or moved, without it.
"""

import ast
from pathlib import Path

import networkx as nx

import hybridnav

ROOT = Path(hybridnav.__file__).parents[1]


def imports() -> dict[str, set[str]]:
    files = {name_of(file): file for file in (ROOT / "hybridnav").rglob("*.py")}
    found: dict[str, set[str]] = {name: set() for name in files}
    for name, file in files.items():
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found[name] |= {alias.name for alias in node.names} & set(files)
            elif isinstance(node, ast.ImportFrom) and node.module in files:
                parts = {f"{node.module}.{alias.name}" for alias in node.names}
                found[name] |= parts & set(files) or {node.module}
    return found


def name_of(file: Path) -> str:
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def package_of(module: str) -> str:
    """Return the package inside which a module is private; an empty name for a public module."""
    parts = module.split(".")
    private = [i for i, part in enumerate(parts) if part.startswith("_") or part == "kernels"]
    return ".".join(parts[: private[0]]) if private else ""


def test_nothing_imports_a_private_module_of_another_package() -> None:
    foreign = [
        f"{name} imports {other}"
        for name, others in imports().items()
        for other in sorted(others)
        if not f"{name}.".startswith(f"{package_of(other)}.") and package_of(other)
    ]
    assert foreign == []


def test_no_imports_form_a_circle() -> None:
    graph = nx.DiGraph((name, other) for name, others in imports().items() for other in others)
    circles = [sorted(found) for found in nx.strongly_connected_components(graph) if len(found) > 1]
    assert circles == []
