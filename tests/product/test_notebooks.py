"""Every notebook runs from a clean kernel, far from the checkout and on other maps."""

import shutil
from pathlib import Path
from typing import Any

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from benchmarks.worlds import World, office_world, write_world
from hybridnav.maps import Frame
from tests.strategies import full_but

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
NEEDS_OMPL = ROOT / "notebooks" / "05_ompl_in_the_corridor.ipynb"
TIMEOUT_S = 300
ELSEWHERE: dict[str, dict[str, Any]] = {
    "01_map_to_route": {"START": (12.0, 2.0), "GOAL": (24.0, 23.0), "ROBOT_RADIUS_M": 0.2},
    "02_inside_the_pyramid": {"MERGE_DISTANCE_M": 6.0, "LARGE_M": 20.0},
    "03_rooms_and_alternatives": {"NAMES": {}, "FROM": (12.0, 2.0), "TO": (24.0, 23.0)}
    | {"STOPS": [(24.0, 23.0), (12.0, 2.0)]},
    "04_thruns_criteria": {"PAIRS": 20, "MERGE_DISTANCES_M": (3.0, 6.0), "ROBOT_RADIUS_M": 0.2},
    "05_ompl_in_the_corridor": {"START": (12.0, 2.0), "GOAL": (24.0, 23.0), "LENGTH_M": 1.2},
    "06_certificates": {"NEAR": ((12.0, 2.0), (12.0, 7.5)), "FAR": ((12.0, 2.0), (24.0, 23.0))}
    | {"DOORS": ((15.5, 6.2), (9.9, 6.2))},
    "07_a_robot_wakes_up": {"STARTS": [(12.0, 2.0)]},
    "08_break_a_proof": {"START": (12.0, 2.0), "GOAL": (24.0, 23.0), "ISLAND": (24.0, 23.0)},
}
"""Settings with which each notebook runs on another map."""
WITHOUT_OMPL = """
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *args: None if name == "ompl" else found(name, *args)
"""


@pytest.fixture(autouse=True)
def clean_kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No start-up files of whoever runs the tests."""
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))


def executed(notebook: Any, start: Path = ROOT / "notebooks") -> list[Any]:
    client = NotebookClient(
        notebook,
        timeout=TIMEOUT_S,
        kernel_name="python3",
        resources={"metadata": {"path": str(start)}},
    )
    client.execute()
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def written(outputs: list[Any]) -> str:
    return "".join(output.text for output in outputs if output.output_type == "stream")


def pictures(outputs: list[Any]) -> int:
    return sum("image/png" in output.get("data", {}) for output in outputs)


def settings(notebook: Any) -> Any:
    (cell,) = (cell for cell in notebook.cells if cell.source.startswith("MAP = None"))
    return cell


def with_settings(notebook: Any, **values: Any) -> Any:
    cell = settings(notebook)
    cell.source += "".join(f"\n{name} = {value!r}" for name, value in values.items())
    return notebook


@pytest.mark.parametrize("path", full_but(NOTEBOOKS[::3], NOTEBOOKS), ids=lambda path: path.stem)
def test_a_copy_of_a_notebook_runs_far_from_the_checkout(path: Path, tmp_path: Path) -> None:
    notebook = nbformat.read(shutil.copy(path, tmp_path), as_version=4)
    outputs = executed(notebook, start=tmp_path)
    assert pictures(notebook.cells[3].outputs) == 1  # what one will see comes first
    assert pictures(outputs) > 3
    assert "Warning" not in written(outputs)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_its_map_in_one_place(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    cells = [cell.source for cell in notebook.cells]
    place = cells.index(settings(notebook).source)
    assert "## Your map here" in cells[place - 1]
    assert sum("hn.load_map(" in cell for cell in cells) == 1


@pytest.mark.full
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_holds_on_another_map(path: Path, tmp_path: Path) -> None:
    """Other noise, another place in the map frame, cells of another size."""
    office = office_world(seed=7)
    halved = np.min([office.pixels[row::2, col::2] for row in (0, 1) for col in (0, 1)], axis=0)
    frame = Frame(2 * office.frame.resolution_m, office.frame.origin_m)
    write_world(World(halved, frame, "other"), tmp_path, "other")
    outputs = executed(
        with_settings(nbformat.read(path, as_version=4), MAP="other.yaml", **ELSEWHERE[path.stem]),
        start=tmp_path,
    )
    assert pictures(outputs) > 3


def test_without_ompl_one_sentence_says_so_and_the_rest_runs(tmp_path: Path) -> None:
    startup = tmp_path / "profile_default" / "startup"
    startup.mkdir(parents=True)
    (startup / "without_ompl.py").write_text(WITHOUT_OMPL)
    outputs = executed(nbformat.read(NEEDS_OMPL, as_version=4))
    assert written(outputs).count("not installed") == 1
    assert "Error" not in written(outputs)
    assert pictures(outputs) == 2  # a path and the coarse route, which need no OMPL


def test_there_are_notebooks() -> None:
    assert [path.name[:3] for path in NOTEBOOKS] == [f"0{number}_" for number in range(1, 9)]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_kept_without_outputs(path: Path) -> None:
    cells = nbformat.read(path, as_version=4).cells
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_no_empty_cell_and_installs_nothing(path: Path) -> None:
    cells = [cell.source for cell in nbformat.read(path, as_version=4).cells]
    assert all(cell.strip() for cell in cells)
    assert not any("pip install --quiet" in cell for cell in cells)
    assert "docs/howto/install.md" in cells[0]
    assert not any("ipywidgets" in cell for cell in cells)  # matplotlib's player has no need of it


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_ends_with_three_questions(path: Path) -> None:
    last = nbformat.read(path, as_version=4).cells[-1].source
    asked = last.partition("## Three questions\n")[2].lstrip().partition("\n\n")[0].splitlines()
    assert len(asked) == 3
    assert all(line.startswith("* ") and "?" in line for line in asked)


def test_every_page_that_names_an_extra_points_to_the_one_on_installing() -> None:
    for page in [ROOT / "README.md", *ROOT.glob("docs/**/*.md")]:
        text = page.read_text(encoding="utf-8")
        if page.name != "install.md":
            assert "pip install hybridnav" not in text
            assert "'hybridnav[" not in text or "install.md)" in text, page
