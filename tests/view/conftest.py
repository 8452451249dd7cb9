"""A page of a little map, served for one test."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

pytest.importorskip("uvicorn", reason="the page needs the extra view")
pytest.importorskip("starlette", reason="the page needs the extra view")

from tests.view.server import served, session_of, write_map

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.view.server import Client


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a map, with another one beside it that nothing may touch."""
    inside = tmp_path / "maps"
    inside.mkdir()
    (tmp_path / "secret.txt").write_text("secret", encoding="utf-8")
    write_map(inside)
    return inside


@pytest.fixture
def client(folder: Path) -> Iterator[Client]:
    """A client of a server of the page."""
    with served(session_of(folder / "four.yaml"), folder) as client:
        yield client
