"""Draw the pictures that the pages show: `.venv/bin/python docs/figures.py`."""  # noqa: INP001 - a script

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from PIL import Image

import hybridnav as hn
from hybridnav.ext.fleet import plot_building
from hybridnav.graphs import build_lane_graph, plot_route_graph
from hybridnav.search.descent import Descent, DescentSettings
from hybridnav.viz import (
    plot_costs,
    plot_level,
    plot_levels,
    plot_map,
    plot_mesh,
    plot_proof,
    plot_rooms,
    save_descent,
    save_figure,
)

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
OFFICE = ROOT / "maps" / "office" / "office.yaml"
BUILDING = ROOT / "maps" / "building" / "building.yaml"
LEVELS = (10, -1)
REGION_CELLS = 26_420
"""A tenth of the free cells."""
STEPS = DescentSettings(field_cells=32, step=2.0)
"""More levels than `paper` visits, to see them narrow."""
START, GOAL = (1.0, 13.2), (40.6, 19.4)

BARRIER = [(29.1, 5.0), (29.3, 5.0), (29.3, 20.0), (29.1, 20.0)]
"""An area across three doors between start and goal, metres."""

ROBOT = ("shortest", "robot")
"""Presets whose paths are drawn over costs."""


def draw_route(file: Path) -> None:
    """Draw the picture of `make route`, with its command."""
    command = [sys.executable, "-m", "hybridnav", "plan", str(OFFICE)]
    endpoints = (",".join(map(str, end)) for end in (START, GOAL))
    command += [
        "--start",
        next(endpoints),
        "--goal",
        next(endpoints),
        "--compare",
        "--plot",
        str(file),
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - our own command


def draw_descent(file: Path) -> None:
    """Draw how a route comes down the levels between the same points, and its path."""
    pyramid = hn.DualGraphPyramid.build(hn.load_map(OFFICE, robot_radius_m=0.25))
    grid = pyramid.grid
    descent = Descent(pyramid, grid.enterable(), STEPS)
    watched = descent.watch(grid.frame.cell_of(*START), grid.frame.cell_of(*GOAL))
    assert watched is not None  # noqa: S101 - there is a way
    save_descent(grid, watched, file)


def draw_levels(file: Path) -> None:
    """Draw two levels of the office's pyramid, fine to coarse."""
    pyramid = hn.DualGraphPyramid.build(hn.load_map(OFFICE, robot_radius_m=0.25))
    figure = Figure(figsize=(8, 10.4), layout="constrained")
    for ax, level in zip(figure.subplots(2, 1), LEVELS, strict=True):
        plot_level(pyramid[level], ax=ax)
        ax.set(xlabel="", ylabel="")
    figure.axes[0].get_legend().remove()  # one is enough
    save_figure(figure, file, dpi=110)


def draw_regions(file: Path) -> None:
    """Draw the levels of the office above its places: places, regions, apex."""
    pyramid = hn.DualGraphPyramid.build(hn.load_map(OFFICE, robot_radius_m=0.25))
    pyramid = pyramid.with_regions(REGION_CELLS)
    levels = pyramid.place_level, pyramid.region_level, -1
    save_figure(plot_levels(pyramid, levels, graph_up_to=0)[0].figure, file, dpi=150)


def draw_rooms(file: Path) -> None:
    """Draw the rooms found in the office, with their doors."""
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid))
    save_figure(plot_rooms(hn.TopologicalMap(pyramid)), file, dpi=150)


def draw_mesh(file: Path) -> None:
    """Draw the convex mesh of the office."""
    save_figure(plot_mesh(hn.load_map(OFFICE, robot_radius_m=0.25)), file, dpi=150)


def draw_robot(file: Path) -> None:
    """Draw the paths of `robot` and `shortest` between the same points, over the costs."""
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    found = [hn.HybridPlanner(topology, preset=name).plan(START, GOAL).path for name in ROBOT]
    paths = [path for path in found if path is not None]
    lines = {name: path.poses()[:, :2] for name, path in zip(ROBOT, paths, strict=True)}
    lengths = [f"{name} {path.length_m:.1f} m" for name, path in zip(ROBOT, paths, strict=True)]
    layer = hn.CostLayer.clearance(grid)
    save_figure(plot_costs(grid, layer, paths=lines, title=", ".join(lengths)), file, dpi=150)


def draw_building(file: Path) -> None:
    """Draw the route from a room of one floor to a room of another."""
    building = hn.ext.fleet.load_building(BUILDING, robot_radius_m=0.25)
    save_figure(plot_building(building, building.plan("office 5", "2.04"))[0], file, dpi=130)


def draw_lanes(file: Path) -> None:
    """Draw the route graph of lanes of the office."""
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid))
    graph = build_lane_graph(hn.TopologicalMap(pyramid))
    save_figure(plot_route_graph(graph).figure, file, dpi=150)


def draw_page(file: Path) -> None:
    """Draw the page of the building on a laptop and on a phone; needs Chromium and its driver."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - for this picture alone

    command = [sys.executable, "-m", "hybridnav", "view", str(BUILDING), "--no-browser"]
    server = subprocess.Popen(  # noqa: S603 - our own command
        [*command, "--robot-radius", "0.25"], stdout=subprocess.PIPE, text=True
    )
    try:
        assert server.stdout is not None  # noqa: S101 - it is a pipe
        address = server.stdout.readline().split()[1]
        with sync_playwright() as driver:
            chromium = shutil.which("chromium")
            browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
            shots = [_page_shot(browser, address, size) for size in ((1180, 800), (390, 800))]
    finally:
        server.terminate()
    whole = Image.new("RGB", (sum(shot.width for shot in shots) + 20, shots[0].height), "white")
    whole.paste(shots[0], (0, 0))
    whole.paste(shots[1], (shots[0].width + 20, 0))
    whole.save(file)


def _page_shot(browser: Any, address: str, size: tuple[int, int]) -> Image.Image:
    """Return the page with the way from office 5 to 2.04."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]}, locale="en")
    page.goto(address)
    page.wait_for_selector("canvas[data-ready=true]")
    for which, name in (("start", "1: office 5"), ("goal", "2: 2.04")):
        page.fill(f"#{which}", name)
    page.keyboard.press("Escape")
    page.keyboard.press("Enter")
    page.wait_for_selector("#words li")
    page.locator("#words button").nth(1).focus()
    page.wait_for_timeout(1000)
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def draw_potential(file: Path) -> None:
    """Draw the potential in the proof of a shortest path of cells, and that path."""
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    proof = hn.prove(hn.HybridPlanner(topology, preset="octile").plan(START, GOAL))
    save_figure(plot_proof(grid, proof), file, dpi=130)


def draw_cut(file: Path) -> None:
    """Draw the chain of walls that leaves no path, and the two ends."""
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    shut = hn.Blocked(polygons=[BARRIER])
    chain = hn.explain(hn.HybridPlanner(topology), START, GOAL, blocked=shut).cut
    ax = plot_map(grid, title="A closed chain of walls round the goal")
    ax.plot(*np.asarray(chain).T, color="crimson", linewidth=1.2)
    for (x, y), name in ((START, "start"), (GOAL, "goal")):
        ax.plot(x, y, "o", color="black")
        text = ax.annotate(name, (x, y), textcoords="offset points", xytext=(-12, -14))
        text.set_path_effects([withStroke(linewidth=3, foreground="white")])
    save_figure(ax, file, dpi=130)


def draw_gallery() -> None:
    """Run each example that draws, and keep its picture."""
    (IMAGES / "gallery").mkdir(exist_ok=True)
    for file in sorted((IMAGES / "gallery").glob("*.png")):
        script = ROOT / "examples" / f"{file.stem}.py"
        subprocess.run([sys.executable, script], cwd=ROOT, check=True)  # noqa: S603 - ours
        with Image.open(ROOT / "out" / file.name) as image:
            image.thumbnail((900, 1400))
            image.save(file)
        shrink(file)


def shrink(file: Path) -> None:
    """Keep 256 colours: flat areas need no more, and the file has a third of the size."""
    if file.suffix == ".gif":  # which has no more, and more than one frame
        return
    with Image.open(file) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(file, optimize=True)


PICTURES = {
    "office-descent.gif": draw_descent,
    "office-route.png": draw_route,
    "office-levels.png": draw_levels,
    "office-regions.png": draw_regions,
    "office-rooms.png": draw_rooms,
    "mesh-office.png": draw_mesh,
    "office-robot.png": draw_robot,
    "building.png": draw_building,
    "office-lanes.png": draw_lanes,
    "view.png": draw_page,
    "proof-potential.png": draw_potential,
    "proof-cut.png": draw_cut,
}

if __name__ == "__main__":
    for name, draw in PICTURES.items():
        draw(IMAGES / name)
        shrink(IMAGES / name)
    draw_gallery()
