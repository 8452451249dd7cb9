"""Pictures look as they did. After an intended change: `python -m tests.viz.pictures`, and look."""

import inspect
import itertools
import subprocess
import sys
from functools import partial

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image

from hybridnav import viz
from hybridnav.viz import (
    plot_dual,
    plot_level,
    plot_map,
    plot_mesh,
    plot_places,
    plot_rooms,
    plot_topology,
    style,
)
from tests.viz.pictures import BASELINES, PICTURES, draw, figure1, two_rooms

NEW = {
    "map": partial(plot_map, two_rooms().grid),
    "places": partial(plot_places, two_rooms()),
    "level": partial(plot_level, two_rooms().level),
    "topology": partial(plot_topology, figure1()),
    "dual": partial(plot_dual, figure1()),
    "rooms": partial(plot_rooms, two_rooms()),
    "mesh": partial(plot_mesh, two_rooms().grid),
}
TOLERANCE = 4.0
"""Root mean square over all channels, out of 255; 256 colours and other rounding make about 1."""
MAX_BYTES = 100_000


def difference(one, other):
    assert one.size == other.size
    pixels = [np.asarray(image.convert("RGB"), dtype=float) for image in (one, other)]
    return float(np.sqrt(np.mean((pixels[0] - pixels[1]) ** 2)))


def legend_of(ax):
    return ax.get_legend()


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_looks_as_it_did(name, tmp_path):
    draw(name, tmp_path / "drawn.png")
    baseline = BASELINES / f"{name}.png"
    assert baseline.stat().st_size < MAX_BYTES
    with Image.open(tmp_path / "drawn.png") as drawn, Image.open(baseline) as kept:
        assert difference(drawn, kept) < TOLERANCE, f"look at {tmp_path / 'drawn.png'}"


@pytest.mark.parametrize(
    ("name", "setting", "value"),
    [
        ("map", "UNEXPLORED", style.FREE),
        ("topology", "SELF_LOOP", style.FREE),
        ("dual", "INK", style.FREE),
        ("plan", "PATH", style.FREE),
        ("rooms", "PLACES", style.PLACES[::-1]),
    ],
)
def test_a_picture_that_lacks_something_does_not(name, setting, value, tmp_path, monkeypatch):
    monkeypatch.setattr(style, setting, value)
    draw(name, tmp_path / "drawn.png")
    with Image.open(tmp_path / "drawn.png") as drawn, Image.open(BASELINES / f"{name}.png") as kept:
        assert difference(drawn, kept) > TOLERANCE


@pytest.mark.parametrize("name", PICTURES)
def test_axes_given_are_axes_returned_and_settings_stay(name):
    before = dict(mpl.rcParams)
    figure = Figure(figsize=(4, 3))
    ax, other = figure.subplots(1, 2)
    assert PICTURES[name](ax) is ax
    assert figure.axes == [ax, other]
    assert tuple(figure.get_size_inches()) == (4, 3)
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize("width", [3.0, 3.75, 6.5, 12.0])
@pytest.mark.parametrize("name", NEW)
def test_words_fit_and_do_not_collide_at_any_width(name, width):
    ax = NEW[name](width_in=width)
    figure = ax.figure.figure
    figure.draw_without_rendering()
    legend = legend_of(ax)
    boxes = [ax.title.get_window_extent(), legend.get_window_extent(), ax.get_window_extent()]
    boxes += [a.get_window_extent() for a in ax.findobj(Text) if a.get_gid() == "scale-bar-label"]
    if ax.axison:
        boxes += [axis.get_tightbbox() for axis in (ax.xaxis, ax.yaxis) if axis.get_ticklocs().size]
    for first, second in itertools.combinations(boxes, 2):
        assert Bbox.intersection(first.padded(-1), second.padded(-1)) is None
    for box in boxes:
        assert figure.bbox.padded(1.5).containsx(box.x0)
        assert figure.bbox.padded(1.5).containsx(box.x1)
        assert figure.bbox.padded(1.5).containsy(box.y0)
        assert figure.bbox.padded(1.5).containsy(box.y1)
    sizes = {text.get_fontsize() for text in [ax.title, *legend.get_texts()]}
    assert len(sizes) == 1
    assert 5.5 <= sizes.pop() <= 12


def test_every_picture_can_be_drawn_on_axes_given():
    names = [name for name in viz.__all__ if name.startswith("plot_")]
    assert len(names) > 8
    for name in names:
        parameters = inspect.signature(getattr(viz, name)).parameters
        given = [parameters[key] for key in ("ax", "axes") if key in parameters]
        assert [parameter.default for parameter in given] == [None], name


def test_drawing_and_saving_leave_pyplot_and_settings_alone(tmp_path):
    code = (
        "import sys, matplotlib as mpl\n"
        "from matplotlib.figure import Figure\n"
        "from hybridnav.viz import save_figure\n"
        "from tests.viz.pictures import PICTURES\n"
        "kept = ['font.size', 'pdf.fonttype', 'svg.hashsalt']\n"
        "before = [mpl.rcParams[key] for key in kept]\n"
        "for plot in PICTURES.values():\n"
        "    picture = plot(Figure().add_subplot())\n"
        f"save_figure(picture, {str(tmp_path / 'a.svg')!r})\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
        "assert [mpl.rcParams[key] for key in kept] == before\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)
