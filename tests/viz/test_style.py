"""Colours that everybody can tell apart, and grey that a printer keeps."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from skimage.color import deltaE_ciede2000, rgb2lab

from hybridnav.viz import style

# Machado, Oliveira, Fernandes 2009, "A Physiologically-based Model for Simulation of Color Vision
# Deficiency", severity 1.0; they act on linear RGB.
VISION = {
    "usual": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
PALE = style.rgb(*style.PLACES, strength=style.PALE)


def seen(colours, vision):
    """L*a*b* of uint8 (n, 3) as somebody with that vision sees it."""
    value = np.asarray(colours) / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    linear = (linear @ VISION[vision].T).clip(0, 1)
    value = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return rgb2lab(value[None])[0]


def least(first, second, vision):
    """The least difference (CIEDE2000) between a colour of one list and one of another."""
    one, other = seen(first, vision), seen(second, vision)
    return float(deltaE_ciede2000(one[:, None], other[None]).min())


def least_within(colours, vision):
    return min(least([a], [b], vision) for a, b in itertools.combinations(colours, 2))


def lightness_steps(colours):
    return float(np.diff(np.sort(seen(colours, "usual")[:, 0])).min())


@pytest.mark.parametrize("vision", VISION)
@pytest.mark.parametrize(
    "names",
    [
        ("PATH", "INK", "ARC"),  # path, coarse route, other arcs
        ("PARALLEL", "SELF_LOOP", "INK", "RIM_ARC"),
        ("HOLE", "OUTSIDE", "INK"),
    ],
)
def test_lines_of_one_picture_are_told_apart(names, vision):
    assert least_within(style.rgb(*(getattr(style, name) for name in names)), vision) > 14


@pytest.mark.parametrize("vision", VISION)
def test_routes_are_told_apart_and_stand_out_from_pale_places(vision):
    routes = style.rgb(*style.ROUTES)
    assert least_within(routes, vision) > 20
    assert least(routes, np.concatenate([PALE, style.rgb(style.FREE)]), vision) > 20


@pytest.mark.parametrize("vision", VISION)
def test_places_are_told_apart(vision):
    assert least_within(style.rgb(*style.PLACES), vision) > 8
    assert least_within(PALE, vision) > 2.5


@pytest.mark.parametrize("vision", VISION)
def test_the_corridor_stands_out_and_the_unexplored_too(vision):
    strong, unexplored = style.rgb(*style.PLACES), style.rgb(*style.UNEXPLORED_PLACES)
    assert least(strong, PALE, vision) > 5.5
    assert least(strong, unexplored, vision) > 8
    assert least(PALE, unexplored, vision) > 4.4


@pytest.mark.parametrize("vision", VISION)
def test_the_path_stands_out_from_every_place(vision):
    ground = np.concatenate([style.rgb(*style.PLACES), PALE, style.rgb(style.FREE)])
    assert least(style.rgb(style.PATH), ground, vision) > 18  # a white rim lies between them


def test_classes_of_cells_and_places_differ_in_grey():
    classes = style.rgb(style.OCCUPIED, style.BLOCKED, style.UNEXPLORED, style.FREE)
    assert lightness_steps(classes) > 14
    assert lightness_steps(style.rgb(*style.PLACES)) > 3.5


def test_places_of_the_corridor_are_darker_than_all_others():
    strong = seen(style.rgb(*style.PLACES), "usual")[:, 0]
    assert strong.max() < seen(PALE, "usual")[:, 0].min()
