"""Sentences are short: on the pages, in notebooks, and in the docstrings of the reference."""

import ast
import importlib
import inspect
import re
import textwrap
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[2]
MOST_WORDS = 30
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
_NAME = re.compile(r"^\.\. auto\w+:: (hybridnav\.[\w.]+)", re.MULTILINE)
_NO_PROSE = re.compile(
    r"^```.*?^```|^#.*?$|^ *\|.*?$|^ *>>>.*?(?=\n *\n|\Z)|^\.\. .*?$|^ *-{3,}$|<!--.*?-->",
    re.MULTILINE | re.DOTALL,
)
_INDENTED = re.compile(r"(?<=\n\n)(?: {4}.*\n)+")
_LINK = re.compile(r"(!?)\[([^\]]*)\]\([^)]*\)")
_CODE = re.compile(r"``.+?``|`[^`]+`", re.DOTALL)
_END = re.compile(r"[.!?][)\"'*]*(?=\s|$)")
_NOT_WRITTEN = re.compile(r"\b(of which|those that)\b", re.IGNORECASE)


def faults(text: str) -> list[str]:
    """Return the sentences of Markdown or of a docstring with too many words, or with words that
    we do not write; code is one word, tables and headings are left out.

    A paragraph ends at an empty line, an item of a list, or another indentation.
    """
    paragraphs, depth = [""], 0
    for line in _NO_PROSE.sub("\n", text).splitlines():
        item = re.match(r"\s*(?:[*-]|\d+\.)\s+", line)
        indent = len(line) - len(line.lstrip())
        if not line.strip() or item or (indent != depth and paragraphs[-1]):
            paragraphs.append("")
        depth = item.end() if item else indent
        paragraphs[-1] += line[depth:] + " "
    plain = [_CODE.sub("code", _LINK.sub(_words, one)) for one in paragraphs]
    sentences = [" ".join(part.split()) for one in plain for part in _END.split(one)]
    return [one for one in sentences if _count(one) > MOST_WORDS or _NOT_WRITTEN.search(one)]


def _words(link: re.Match[str]) -> str:
    return "" if link[1] else link[2]  # none for a picture


def _count(sentence: str) -> int:
    return sum(any(map(str.isalnum, word)) for word in sentence.split())


def _docstrings(name: str) -> list[str]:
    """Return the texts of a class or a function and of its public parts, and those of fields."""
    module, _, attribute = name.rpartition(".")
    thing = getattr(importlib.import_module(module), attribute)
    if not (inspect.isclass(thing) or inspect.isroutine(thing)):
        return []
    tree = ast.parse(textwrap.dedent(inspect.getsource(thing)))
    parts = [one for one in ast.walk(tree) if isinstance(one, ast.ClassDef | ast.FunctionDef)]
    nodes = [one for p in parts if p.name[0] != "_" for one in p.body if isinstance(one, ast.Expr)]
    texts = [one.value.value for one in nodes if isinstance(one.value, ast.Constant)]
    return [inspect.cleandoc(text) for text in texts if isinstance(text, str)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_sentences_of_a_page_are_short(page):
    assert faults(_INDENTED.sub("\n", page.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_sentences_of_a_notebook_are_short(notebook):
    cells = nbformat.read(notebook, as_version=4).cells
    assert [one for c in cells if c.cell_type == "markdown" for one in faults(c.source)] == []


def test_sentences_of_the_reference_are_short():
    pages = (ROOT / "docs" / "reference").glob("*.md")
    names = {name for page in pages for name in _NAME.findall(page.read_text("utf-8"))}
    assert len(names) > 200
    assert [(n, one) for n in sorted(names) for t in _docstrings(n) for one in faults(t)] == []


def test_words_are_counted_without_code_and_tables():
    long = " ".join(["word"] * 31)
    code = f"```python\n{long}\n```\n| {long} |\n# {long}\n"
    prose = f"{code}{long[5:]}. Short.\n* {long}\n  more\n\n`{long}`, [a link]({long})"
    assert faults(prose) == [f"{long} more"]
    assert faults("Rooms, one of which is large.") == ["Rooms, one of which is large"]
