"""Small pictures of fixed scenes to compare with; `python -m tests.viz.pictures` renews them."""

import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

import hybridnav as hn
from hybridnav.viz import (
    plot_dual,
    plot_losses,
    plot_map,
    plot_mesh,
    plot_paths,
    plot_places,
    plot_plan,
    plot_rooms,
    plot_speed,
    plot_topology,
    plot_tour,
)

BASELINES = Path(__file__).parent / "baselines"
FIGURE1 = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"


@cache
def figure1() -> hn.TopologicalMap:
    """One place that encloses another, and two arcs round an obstacle."""
    return hn.TopologicalMap(
        hn.DualGraphPyramid.build(hn.load_map(FIGURE1, robot_radius_m=0), merge_distance_m=10.0)
    )


@cache
def two_rooms() -> hn.TopologicalMap:
    """Two rooms with two doors between them, a pillar, and a corner that was never explored."""
    cells = np.zeros((32, 62), dtype=np.float32)
    cells[[0, -1]] = cells[:, [0, 30, 31, -1]] = 1.0
    cells[5:9, 30:32] = cells[22:26, 30:32] = 0.0
    cells[14:18, 44:48] = 1.0
    cells[1:9, 52:61] = 0.5
    grid = hn.OccupancyGrid(cells, hn.Frame(0.2), robot_radius_m=0.25, name="two rooms")
    labels = np.full(cells.shape, -1, dtype=np.int32)
    labels[1:-1, 1:31], labels[1:-1, 31:61] = 0, 1
    rooms = hn.RoomLabels(("west", "east"), labels)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=3.0, rooms=rooms)
    return hn.TopologicalMap(pyramid)


def _plan(ax: Axes) -> Axes:
    preset = hn.load_preset("paper", overrides=["planner.levels=places"])
    result = hn.HybridPlanner(two_rooms(), preset=preset).plan((1.0, 1.0), (11.0, 5.0))
    return plot_plan(two_rooms(), result, ax=ax)


def _tour(ax: Axes) -> Axes:
    tour = hn.plan_tour(hn.HybridPlanner(two_rooms()), [(1.0, 5.5), "east", (1.0, 1.0)])
    return plot_tour(two_rooms(), tour, ax=ax)


def _paths(ax: Axes) -> Axes:
    shortest = [(1.0, 1.0), (5.8, 1.4), (6.6, 1.4), (11.0, 2.4)]
    path = [(1.0, 1.0), (5.8, 4.8), (6.6, 4.8), (10.1, 4.3), (11.0, 2.4)]
    return plot_paths(two_rooms().grid, path, shortest, ax=ax)


def _losses() -> dict[str, np.ndarray]:
    """Three methods: exact, good, and one that loses much on a few pairs."""
    rng = np.random.default_rng(2)
    return {"a": np.zeros(200), "b": rng.gamma(0.6, 0.01, 200), "c": rng.gamma(0.2, 0.3, 200)}


PICTURES: dict[str, Callable[[Axes], Axes]] = {
    "map": lambda ax: plot_map(two_rooms().grid, ax=ax),
    "places": lambda ax: plot_places(two_rooms(), ax=ax, self_loops=True),
    "topology": lambda ax: plot_topology(figure1(), ax=ax),
    "dual": lambda ax: plot_dual(figure1(), ax=ax),
    "plan": _plan,
    "rooms": lambda ax: plot_rooms(two_rooms(), ax=ax),
    "tour": _tour,
    "mesh": lambda ax: plot_mesh(two_rooms().grid, ax=ax),
    "paths": _paths,
    "losses": lambda ax: plot_losses(_losses(), ax=ax),
    "speed": lambda ax: plot_speed(_losses(), {"a": 0.3, "b": 2.0, "c": 40.0}, ax=ax),
}


def draw(name: str, file: Path) -> None:
    """Draw one picture without its words: their pixels differ between versions of FreeType."""
    with mpl.rc_context():
        mpl.rcdefaults()
        figure = Figure(figsize=(4, 3), dpi=100)
        PICTURES[name](figure.add_axes((0.05, 0.22, 0.9, 0.7)))
        for text in figure.findobj(Text):
            text.set_visible(False)
        figure.savefig(file, metadata={"Software": None})


def main() -> None:
    """Draw all, and keep them in 256 colours."""
    BASELINES.mkdir(exist_ok=True)
    for name in PICTURES:
        file = BASELINES / f"{name}.png"
        draw(name, file)
        with Image.open(file) as image:
            kept = image.convert("RGB").quantize(256)
        kept.save(file, optimize=True)
        sys.stdout.write(f"{file.name}: {file.stat().st_size} bytes\n")


if __name__ == "__main__":
    main()
