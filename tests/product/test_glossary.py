"""The glossary: its words have names in the code, and the words that it rules out have none."""

import ast
import importlib
import re
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import hybridnav as hn

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "hybridnav"
USED, NOT_USED = (
    [[cell.strip() for cell in row.strip("|").split("|")] for row in table.splitlines()[2:]]
    for table in re.findall(
        r"^\|.*?(?=\n\n|\Z)",
        (ROOT / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8").strip(),
        re.MULTILINE | re.DOTALL,
    )
)


@cache
def trees() -> dict[Path, ast.Module]:
    """Read the sources, when a test asks for them: every process collects this file."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in SOURCE.rglob("*.py")}


def _named(name: str) -> Any:
    """Return what a name below the package stands for: a module, or something in one."""
    found: Any = hn
    for part in name.split("."):
        fields = getattr(found, "__dataclass_fields__", {})
        if part in fields:
            return fields[part]
        if not hasattr(found, part):
            importlib.import_module(f"{found.__name__}.{part}")
        found = getattr(found, part)
    return found


def test_every_word_occurs_once_in_alphabetical_order() -> None:
    words = [word for word, _, _ in USED]
    assert words == sorted(set(words), key=str.casefold)


def test_every_name_of_the_glossary_exists() -> None:
    names = [name for _, _, names in USED for name in re.findall(r"`([^`]+)`", names)]
    assert len(names) >= len(USED) - 1
    for name in names:
        assert _named(name) is not None, name


def test_nothing_is_called_by_a_word_that_the_glossary_rules_out() -> None:
    kept = {name for word, _, _ in USED for name in (word, f"{word}s")}
    kept |= {"stop"}  # indices of a slice, and to stop
    old = {name for word, _ in NOT_USED for name in (word, f"{word}s")} - kept - {"side", "sides"}
    found = [
        f"{path.relative_to(SOURCE)}: {name}"
        for path, tree in trees().items()
        for node in ast.walk(tree)
        for name in _names_of(node)
        if name.strip("_").lower() in old
    ]
    assert found == []


def _names_of(node: ast.AST) -> list[str]:
    """Return the names that a definition introduces: its own, and those of its parameters."""
    if isinstance(node, ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.FunctionDef):
        return [node.name, *(arg.arg for arg in [*node.args.args, *node.args.kwonlyargs])]
    return []


def test_no_two_modules_define_a_class_of_the_same_name() -> None:
    counted = Counter(
        node.name
        for tree in trees().values()
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert [name for name, n in counted.items() if n > 1] == []


def test_one_file_alone_is_called_rooms() -> None:
    assert [path.relative_to(SOURCE).as_posix() for path in SOURCE.rglob("rooms.py")] == [
        "cli/rooms.py"
    ]
