"""The source paper's Fig. 1 and Fig. 3, drawn anew on the project's own maps.

Writes `paper-figure-1.png` and `paper-figure-3.png`; with `--data` (or HYBRIDNAV_DATA) also
`paper-figure-3-real.png`, Fig. 3 on a real map, which belongs in no repository: `--out` must then
be given.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

import hybridnav as hn
from benchmarks.common import DATA, OFFICE, ROOT, option, read
from hybridnav.viz import plot_figure1, plot_map, plot_topology, save_figure

if TYPE_CHECKING:
    from argparse import Namespace

IMAGES = ROOT / "docs" / "images"
MAPS = ROOT / "maps"
REAL_MAP = "bwi_gdc/3ne/3ne.yaml"
WIDTH_IN = 7.0


def draw_figure1(file: Path) -> None:
    """A map of three surfaces: simple graph, dual graph pyramid's top, and its dual."""
    grid = read(MAPS / "figure1" / "figure1.yaml", 0)
    top = hn.DualGraphPyramid.build(grid, merge_distance_m=10.0)[-1]
    print(f"figure1: {top.to_simple_graph().dropped}")
    save_figure(plot_figure1(top, width_in=WIDTH_IN)[0], file, dpi=150)


def draw_figure3(map_file: Path, file: Path) -> None:
    """A map thresholded, and the top of its pyramid with places spaced at about 4 m."""
    grid = read(map_file)
    top = hn.DualGraphPyramid.build(grid, merge_distance_m=4.0)[-1]
    figure = Figure(figsize=(WIDTH_IN, 2 * WIDTH_IN), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    plot_map(grid, ax=upper, title="a) thresholded occupancy grid")
    upper.set(xlabel="", ylabel="", xticks=[], yticks=[])
    upper.get_legend().set_bbox_to_anchor((0.5, -0.02), transform=upper.transAxes)
    plot_topology(top, ax=lower, title="b) top level of the dual graph pyramid")
    # The panels show the known part of the map; titles and legends take 0.6 inches each.
    shape = np.ptp(upper.get_ylim()) / np.ptp(upper.get_xlim())
    figure.set_size_inches(WIDTH_IN, 2 * (WIDTH_IN * float(shape) + 0.6))
    save_figure(figure, file, dpi=150)
    print(f"{grid.name}: {str(top.to_simple_graph().dropped).splitlines()[0]}")


def shrink(file: Path) -> None:
    """Keep 256 colours: flat areas need no more, and the file has a third of the size."""
    with Image.open(file) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(file, optimize=True)


OPTIONS = [
    DATA,
    option("--out", type=Path, default=None),
]


def main(given: Namespace) -> None:
    """Draw the figures."""
    out = given.out or IMAGES
    draw_figure1(out / "paper-figure-1.png")
    draw_figure3(OFFICE, out / "paper-figure-3.png")
    drawn = ["paper-figure-1.png", "paper-figure-3.png"]
    if given.data is not None and given.out is not None:
        drawn.append("paper-figure-3-real.png")
        draw_figure3(given.data / REAL_MAP, out / drawn[-1])
    elif given.data is not None:
        print("no picture of the real map: name a folder for it with --out")
    for name in drawn:
        shrink(out / name)
        print(out / name)
