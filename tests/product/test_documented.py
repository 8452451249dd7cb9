"""What docstrings hold: the parameters of kernels and public functions, the fields of tuples."""

import ast
import importlib
import inspect
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "hybridnav"
PACKAGES = sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))
_MOST_PARAMETERS = 6
"""A kernel with more of them describes them all in a section."""


@cache
def trees() -> dict[str, ast.Module]:
    """Read the sources, when a test asks for them: every process collects this file."""
    return {
        path.relative_to(SOURCE).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted(SOURCE.rglob("*.py"))
    }


def _nodes(kind: type[Any]) -> Iterator[tuple[str, Any]]:
    for path, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, kind):
                yield f"{path}::{node.name}", node


def _kernels() -> list[tuple[str, ast.FunctionDef]]:
    return [
        (name, node)
        for name, node in _nodes(ast.FunctionDef)
        if any("njit" in ast.unparse(decorator) for decorator in node.decorator_list)
    ]


def _undescribed(doc: str, names: list[str]) -> list[str]:
    """The names that no line at the head of an entry of the section Parameters has."""
    _, _, section = doc.partition("Parameters\n----------\n")
    section = re.split(r"\n\w+\n-+\n", section)[0]
    heads = [line.split(" : ")[0] for line in section.splitlines() if re.match(r"[\w*]", line)]
    described = {name.strip("* ") for head in heads for name in head.split(",")}
    return [name for name in names if name not in described]


def test_kernels_with_many_parameters_describe_each() -> None:
    """In a section, or in a paragraph that names each before a colon: "`rows`, `cols`: ..."."""
    kernels = [(name, node) for name, node in _kernels() if len(node.args.args) > _MOST_PARAMETERS]
    assert len(kernels) > 50
    missing = {}
    for name, node in kernels:
        doc = ast.get_docstring(node) or ""
        lists = re.findall(r"(?:`\w+`(?:,\s|\sand\s)?)+(?=:)", doc)
        named = {each for text in lists for each in re.findall(r"\w+", text)}
        names = _undescribed(doc, [arg.arg for arg in node.args.args if arg.arg not in named])
        missing[name] = names
    assert {name: names for name, names in missing.items() if names} == {}


def test_every_kernel_has_a_docstring() -> None:
    assert [name for name, node in _kernels() if not ast.get_docstring(node)] == []


def test_named_tuples_describe_their_fields() -> None:
    """Below the field, or by name in the docstring of the tuple."""
    tuples = [
        (name, node)
        for name, node in _nodes(ast.ClassDef)
        if "NamedTuple" in map(ast.unparse, node.bases) and not node.name.startswith("_")
    ]
    assert len(tuples) > 5
    missing = []
    for name, node in tuples:
        for field, below in zip(node.body, [*node.body[1:], None], strict=True):
            if not isinstance(field, ast.AnnAssign) or isinstance(below, ast.Expr):
                continue
            label = ast.unparse(field.target)
            prefix = f"`{label.split('_')[0]}_*`"
            doc = ast.get_docstring(node) or ""
            if not re.search(rf"\b{label}\b", doc) and prefix not in doc:
                missing.append(f"{name}.{label}")
    assert missing == []


def _public_functions() -> list[tuple[str, Callable[..., object]]]:
    found: list[tuple[str, Callable[..., object]]] = []
    for package in PACKAGES:
        module = importlib.import_module(f"hybridnav.{package}")
        for name in getattr(module, "__all__", []):
            thing = getattr(module, name)
            if inspect.isfunction(thing):
                found.append((f"{package}.{name}", thing))
    return found


@pytest.mark.parametrize(("name", "function"), _public_functions())
def test_public_functions_describe_parameters_and_result(name, function):
    """A result needs a section of its own where neither its class nor the first sentence describes
    it."""
    doc = inspect.getdoc(function) or ""
    signature = inspect.signature(function)
    assert _undescribed(doc, list(signature.parameters)) == [], name
    result = signature.return_annotation
    is_class = inspect.isclass(result) or re.fullmatch(r"[A-Z]\w+", str(result))
    if signature.parameters and result not in {"None", None} and not is_class:
        assert re.search(r"^(Returns|Yields)\n-+$|\AReturn ", doc, re.MULTILINE), name


_NO_IMPERATIVE = {"A", "An", "The", "Whether", "What", "Which", "How", "Where", "This", "Of"}


def test_functions_are_described_by_an_imperative() -> None:
    """Properties are nouns; other functions do something."""
    described = [
        (name, (ast.get_docstring(node) or "").split(maxsplit=1)[:1])
        for name, node in _nodes(ast.FunctionDef)
        if not any("property" in ast.unparse(one) for one in node.decorator_list)
    ]
    assert [name for name, first in described if set(first) & _NO_IMPERATIVE] == []


def test_no_sentence_begins_with_of() -> None:
    texts = [
        (path, node.value)
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]
    begins = re.compile(r"(?:\A|[.:;] |\n\s*\n\s*)Of\s")
    assert [(path, text) for path, text in texts if begins.search(text)] == []
