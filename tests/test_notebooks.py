"""Every notebook runs from a clean kernel, and finds the maps wherever it is started."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
NEEDS_OMPL = ROOT / "notebooks" / "05_ompl_in_the_corridor.ipynb"
TIMEOUT_S = 300
WITHOUT_OMPL = """
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *args: None if name == "ompl" else found(name, *args)
"""


@pytest.fixture(autouse=True)
def clean_kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No start-up files of whoever runs the tests."""
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))


def executed(notebook: Any, start: str = "notebooks") -> list[Any]:
    """Run a notebook and give its outputs."""
    client = NotebookClient(
        notebook,
        timeout=TIMEOUT_S,
        kernel_name="python3",
        resources={"metadata": {"path": str(ROOT / start)}},
    )
    client.execute()
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def written(outputs: list[Any]) -> str:
    return "".join(output.text for output in outputs if output.output_type == "stream")


def pictures(outputs: list[Any]) -> int:
    return sum("image/png" in output.get("data", {}) for output in outputs)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(path: Path) -> None:
    outputs = executed(nbformat.read(path, as_version=4))
    assert pictures(outputs) > 3
    assert "Warning" not in written(outputs)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_finds_the_maps_from_the_root_of_the_checkout(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    found = next(number for number, cell in enumerate(code) if "maps = next(" in cell.source)
    notebook.cells = [*code[: found + 1], nbformat.v4.new_code_cell("print(maps)")]
    assert written(executed(notebook, start=".")).strip().endswith(str(ROOT / "maps"))


def test_without_ompl_one_sentence_says_so_and_the_rest_runs(tmp_path: Path) -> None:
    startup = tmp_path / "profile_default" / "startup"
    startup.mkdir(parents=True)
    (startup / "without_ompl.py").write_text(WITHOUT_OMPL)
    outputs = executed(nbformat.read(NEEDS_OMPL, as_version=4))
    assert written(outputs).count("not installed") == 1
    assert "Error" not in written(outputs)
    assert pictures(outputs) == 1  # the coarse route, which needs no OMPL


def test_there_are_notebooks() -> None:
    assert [path.name[:3] for path in NOTEBOOKS] == ["01_", "02_", "03_", "04_", "05_", "06_"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_kept_without_outputs(path: Path) -> None:
    cells = nbformat.read(path, as_version=4).cells
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)
