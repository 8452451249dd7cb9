"""Pictures look as they did. After a wanted change: `python -m tests.pictures`, and look."""

from __future__ import annotations

import inspect
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from hybridnav import viz
from hybridnav.viz import style
from tests.pictures import BASELINES, PICTURES, draw

TOLERANCE = 4.0
"""Root mean square over all channels, out of 255; 256 colours and other rounding make about 1."""
MAX_BYTES = 100_000


def difference(one, other):
    assert one.size == other.size
    pixels = [np.asarray(image.convert("RGB"), dtype=float) for image in (one, other)]
    return float(np.sqrt(np.mean((pixels[0] - pixels[1]) ** 2)))


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
    ax = Figure(figsize=(4, 3)).add_subplot()
    assert PICTURES[name](ax) is ax
    assert dict(mpl.rcParams) == before


def test_every_picture_can_be_drawn_on_axes_given():
    names = [name for name in viz.__all__ if name.startswith("plot_")]
    assert len(names) > 8
    for name in names:
        parameters = inspect.signature(getattr(viz, name)).parameters
        given = [parameters[key] for key in ("ax", "axes") if key in parameters]
        assert [parameter.default for parameter in given] == [None], name


def test_drawing_leaves_pyplot_alone():
    code = (
        "import sys\n"
        "from matplotlib.figure import Figure\n"
        "from tests.pictures import PICTURES\n"
        "for plot in PICTURES.values():\n"
        "    plot(Figure().add_subplot())\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)
