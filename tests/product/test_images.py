"""Pictures of the pages are those that the code draws now, with the numbers of the text."""

import importlib.util
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn
from hybridnav.ext.fleet import plot_building
from tests.strategies import full_but

ROOT = Path(__file__).parents[2]
WIDTH = 240
MOST = 0.3
"""Mean difference in grey levels of one picture and the same; another route makes 0.7."""
OFTEN = ("building.png", "proof-potential.png")
"""Pictures that are drawn in every run; a full one draws all."""
NEEDS_BROWSER = "view.png"


def figures() -> Any:
    """Load the script that draws the pictures."""
    spec = importlib.util.spec_from_file_location("figures", ROOT / "docs" / "figures.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def small(file: Path) -> np.ndarray[Any, Any]:
    with Image.open(file) as image:
        image.seek(getattr(image, "n_frames", 1) - 1)  # a moving picture ends with its path
        height = round(image.height * WIDTH / image.width)
        return np.asarray(image.convert("L").resize((WIDTH, height)), float)


def difference(one: Path, other: Path) -> float:
    """Return the mean difference of two pictures in grey levels, infinite for other shapes."""
    first, second = small(one), small(other)
    return float(np.abs(first - second).mean()) if first.shape == second.shape else np.inf


DRAWN = full_but(OFTEN, [name for name in figures().PICTURES if name != NEEDS_BROWSER])


@pytest.mark.parametrize("name", DRAWN)
def test_a_picture_on_file_is_the_one_that_is_drawn(name: str, tmp_path: Path) -> None:
    module = figures()
    module.PICTURES[name](tmp_path / name)
    module.shrink(tmp_path / name)
    assert difference(tmp_path / name, module.IMAGES / name) < MOST


def test_another_route_is_another_picture(tmp_path: Path) -> None:
    module = figures()
    building = hn.ext.fleet.load_building(module.BUILDING, robot_radius_m=0.25)
    plan = building.plan("office 2", "library")
    hn.viz.save_figure(plot_building(building, plan)[0], tmp_path / "b.png", dpi=130)
    assert difference(tmp_path / "b.png", module.IMAGES / "building.png") > MOST


def test_the_building_has_the_numbers_of_its_page() -> None:
    module = figures()
    building = hn.ext.fleet.load_building(module.BUILDING, robot_radius_m=0.25)
    axes = plot_building(building, building.plan("office 5", "2.04"))
    lengths = [
        float(part.split()[0]) for ax in axes for part in re.findall(r"[\d.]+ m$", ax.get_title())
    ]
    text = page("building.md")
    (length,), (cost,) = (
        re.findall(rf"{word} +([\d.]+) m", text)[:1] for word in ("length", "cost")
    )
    assert sum(lengths) == pytest.approx(float(length), abs=0.11)
    legend = " ".join(
        entry.get_text() for ax in axes if (found := ax.get_legend()) for entry in found.get_texts()
    )
    assert f"cost {float(cost):.1f} m, 63 s, by north lift" in legend
    assert "63 s" in text


def test_counts_in_the_prose_are_those_of_the_office() -> None:
    pyramid = hn.DualGraphPyramid.build(hn.load_map(figures().OFFICE, robot_radius_m=0.25))
    dropped = pyramid[-1].to_simple_graph().dropped
    counts = re.match(
        r"(\d+) vertices, (\d+) arcs.* (\d+) parallel arcs and (\d+) self-", str(dropped)
    )
    places, arcs, parallel, loops = counts.groups()
    assert f"become {places} places]" in page("pyramid.md")
    assert f"drops {parallel} arcs and {loops} self-loops of {arcs}." in page("pyramid.md")


def test_the_page_in_a_browser_shows_the_way_of_its_text() -> None:
    building = hn.ext.fleet.load_building(figures().BUILDING, robot_radius_m=0.25)
    words = building.plan("office 5", "2.04").words()
    assert "with the way from office 5 to 2.04" in page("view.md")
    assert words[1] in page("building.md")
