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
_ONE_WORD = re.compile(r"``.+?``|`[^`]+`|\$[^$\n]+\$|!?\[[^\]]*\]\([^)]*\)", re.DOTALL)
_INDENTED = re.compile(r"(?<=\n\n)(?: {4}.*\n)+")
_NOT_WRITTEN = re.compile(r"\b(of which|those that)\b", re.IGNORECASE)
_END = re.compile(r"(?<!\be\.g)(?<!\bi\.e)(?<!\bcf)[.!?][)\"'*]*(?=\s|$)")


def _as_words(place: re.Match[str]) -> str:
    """Return the words of a link, none for a picture, one word for code."""
    text = place.group()
    if text.startswith("!"):
        return " "
    return text[1:].partition("](")[0] if text.startswith("[") else "code"


def sentences(text: str) -> list[str]:
    """Return the sentences of Markdown or of a docstring, without code, tables and headings.

    A paragraph ends at an empty line, an item of a list, or another indentation.
    """
    found: list[str] = []
    depth, paragraph = 0, ""
    for line in [*_NO_PROSE.sub("\n", text).splitlines(), ""]:
        item = re.match(r"\s*(?:[*-]|\d+\.)\s+", line)
        indent = len(line) - len(line.lstrip())
        if not line.strip() or item or (indent != depth and paragraph):
            words = _ONE_WORD.sub(_as_words, paragraph)
            found += [" ".join(part.split()) for part in _END.split(words)]
            paragraph = ""
        depth = item.end() if item else indent
        paragraph += line[depth:] + " "
    return [sentence for sentence in found if sentence]


def faults(text: str) -> list[str]:
    """Return the sentences of a text that have too many words, or words that we do not write."""
    return [
        sentence
        for sentence in sentences(text)
        if sum(any(map(str.isalnum, word)) for word in sentence.split()) > MOST_WORDS
        or _NOT_WRITTEN.search(sentence)
    ]


def _documented() -> list[str]:
    pages = (ROOT / "docs" / "reference").glob("*.md")
    return sorted({name for page in pages for name in _NAME.findall(page.read_text("utf-8"))})


def docstrings(name: str) -> list[str]:
    """Return the texts of a class or a function and of its public parts, and those of fields."""
    module, _, attribute = name.rpartition(".")
    thing = getattr(importlib.import_module(module), attribute)
    if not (inspect.isclass(thing) or inspect.isroutine(thing)):
        return []
    (top,) = ast.parse(textwrap.dedent(inspect.getsource(thing))).body
    parts = [one for one in ast.walk(top) if isinstance(one, ast.ClassDef | ast.FunctionDef)]
    return [
        inspect.cleandoc(one.value.value)
        for part in parts
        if not part.name.startswith("_")
        for one in part.body
        if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant)
        if isinstance(one.value.value, str)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_sentences_of_a_page_are_short(page: Path) -> None:
    assert faults(_INDENTED.sub("\n", page.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_sentences_of_a_notebook_are_short(notebook: Path) -> None:
    cells = nbformat.read(notebook, as_version=4).cells
    assert [one for c in cells if c.cell_type == "markdown" for one in faults(c.source)] == []


def test_sentences_of_the_reference_are_short() -> None:
    names = _documented()
    assert len(names) > 200
    found = {name: [one for text in docstrings(name) for one in faults(text)] for name in names}
    assert {name: long for name, long in found.items() if long} == {}


def test_words_are_counted_without_code_and_tables() -> None:
    long = " ".join(["word"] * 31)
    code = f"```python\n{long}\n```\n| {long} |\n# {long}\n"
    prose = f"{code}{long[5:]}. Short.\n* {long}\n  more\n\n`{long}`, [a link]({long})"
    assert faults(prose) == [f"{long} more"]
