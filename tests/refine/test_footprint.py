"""Footprints: radii, convex parts, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.refine.footprint import MAX_CORNERS, Footprint
from tests.strategies import examples

TRUCK = [[1.5, 0.5], [1.5, -0.5], [-0.25, -0.5], [-0.25, 0.5]]
L_SHAPE = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]


def star(radii: list[float]) -> Any:
    """Corners at these distances all round the base, a simple polygon."""
    angles = np.linspace(0, 2 * math.pi, len(radii), endpoint=False)
    return np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


stars = st.lists(st.floats(0.1, 2), min_size=4, max_size=12).map(star)


def test_radii_of_a_truck() -> None:
    footprint = Footprint.of(TRUCK)
    assert footprint.inscribed_radius_m == 0.25
    assert footprint.circumscribed_radius_m == math.hypot(1.5, 0.5)


def test_base_outside_has_no_inscribed_disc() -> None:
    assert Footprint.of([[1, 0], [2, 0], [2, 1]]).inscribed_radius_m == 0
    assert Footprint.of(L_SHAPE).inscribed_radius_m == 0


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("step", [1, -1])
def test_same_footprint_however_it_is_given(closed: bool, step: int) -> None:  # noqa: FBT001
    corners = [*TRUCK, TRUCK[0]] if closed else TRUCK
    expected = shapely.Polygon(TRUCK)
    for shape in (corners[::step], np.array(corners)[::step], shapely.Polygon(corners[::step])):
        footprint = Footprint.of(shape)
        assert Footprint.of(footprint) is footprint
        assert len(footprint.corners_m) == 4
        assert shapely.LinearRing(footprint.corners_m).is_ccw
        assert shapely.Polygon(footprint.corners_m).equals(expected)


@given(stars)
@settings(max_examples=examples(200), derandomize=True)
def test_convex_parts_tile_the_outline(corners: Any) -> None:
    footprint = Footprint(corners)
    parts = [shapely.Polygon(part) for part in footprint.convex_parts()]
    outline = shapely.Polygon(corners)
    assert math.isclose(sum(part.area for part in parts), outline.area, rel_tol=1e-9)
    assert shapely.unary_union(parts).symmetric_difference(outline).area < 1e-9
    for part in parts:
        assert math.isclose(part.convex_hull.area, part.area, rel_tol=1e-9)


@given(stars)
@settings(max_examples=examples(100), derandomize=True)
def test_discs_of_the_radii_lie_inside_and_around(corners: Any) -> None:
    footprint, outline = Footprint(corners), shapely.Polygon(corners)
    inner = shapely.Point(0, 0).buffer(footprint.inscribed_radius_m * 0.999)
    outer = shapely.Point(0, 0).buffer(footprint.circumscribed_radius_m * 1.01, quad_segs=64)
    assert outline.contains(inner)
    assert outer.contains(outline)
    assert not outline.contains(shapely.Point(0, 0).buffer(footprint.inscribed_radius_m * 1.01))


def test_convex_outline_is_one_part_and_cannot_be_written_to() -> None:
    footprint = Footprint.of(TRUCK)
    (part,) = footprint.convex_parts()
    assert part is footprint.corners_m
    with pytest.raises(ValueError, match="read-only"):
        part[0, 0] = 1.0


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ([[0, 0], [1, 0]], "3 to 1000 corners"),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0]], "3 to 1000 corners"),
        ([[0, 0], [1, 0], [1]], "3 to 1000 corners"),
        (None, "3 to 1000 corners"),
        ("[[0, 0", "3 to 1000 corners"),
        (star([1.0] * (MAX_CORNERS + 2)), "3 to 1000 corners"),
        ([[0, 0], [1, 0], [1, math.nan]], "within 10000 m"),
        ([[0, 0], [1, 0], [1, math.inf]], "within 10000 m"),
        ([[0, 0], [1, 0], [1, 1e9]], "within 10000 m"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "Self-intersection"),
        ([[0, 0], [1, 1], [2, 2]], "simple polygon"),
        ([[1, 1], [1, 1], [1, 1]], "simple polygon"),
        (shapely.Polygon(), "3 to 1000 corners"),
        (shapely.Point(0, 0).buffer(2) - shapely.Point(0, 0).buffer(1), "no holes"),
    ],
)
def test_refused_shapes(shape: Any, words: str) -> None:
    with pytest.raises(InvalidValueError, match=words) as caught:
        Footprint.of(shape)
    assert "\n" not in str(caught.value)
