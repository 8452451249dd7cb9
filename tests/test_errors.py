"""Messages quote what they were given on one line, of at most 80 characters."""

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import brief

LONG = "x" * 1980
MAP = {
    "image": "a.pgm",
    "resolution": 0.05,
    "origin": "[0, 0, 0]",
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.2,
}
values = st.recursive(
    st.text(max_size=200) | st.integers() | st.binary(max_size=200) | st.floats(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(max_size=100), inner),
    max_leaves=40,
)


@given(values)
def test_any_value_is_one_short_line(value: Any) -> None:
    text = brief(value)
    assert len(text) <= 80
    assert text.splitlines() == [text]
    whole = repr(value)
    if isinstance(value, str | int | float) and len(whole) <= 80:
        assert text == " ".join(whole.split())


def test_huge_values_are_one_short_line() -> None:
    for value in (10**5000, np.zeros((900, 900)), [[LONG] * 9] * 9, LONG.encode()):
        assert len(brief(value)) <= 80


@pytest.mark.parametrize("key", [*MAP, "mode", "whole", "unknown"])
@pytest.mark.parametrize("value", [LONG, "a/" * 990, "é\\u0007" * 600, f"[{LONG}, {LONG}]"])
def test_a_bad_map_prints_a_short_line(tmp_path: Path, key: str, value: str) -> None:
    path = tmp_path / "m.yaml"
    described = MAP | ({key: f'"{value}"'} if value[0] != "[" else {key: value})
    text = "\n".join(f"{name}: {each}" for name, each in described.items())
    path.write_text(value if key == "whole" else text, encoding="utf-8")
    with pytest.raises(hn.errors.MapError) as error:
        hn.load_map(path)
    told = str(error.value)
    assert len(told) <= len(str(path)) + 200
    assert told.isprintable()


def test_every_quoted_value_is_cut() -> None:
    """In what is raised, a value is quoted by `brief`, or with a width."""
    package, found = Path(hn.__file__).parent, []
    for path in package.rglob("*.py"):
        for raised in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(raised, ast.Raise):
                continue
            for node in ast.walk(raised):
                if not isinstance(node, ast.FormattedValue) or node.conversion != ord("r"):
                    continue
                width = "" if node.format_spec is None else ast.unparse(node.format_spec)
                if not any(f".{n}" in width for n in range(20, 81)):
                    found.append(f"{path.relative_to(package)}:{node.lineno} {ast.unparse(node)}")
    assert found == []
