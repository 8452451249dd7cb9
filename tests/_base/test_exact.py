"""Predicates that rounding must not change, against fractions."""

from fractions import Fraction

from hypothesis import example, given
from hypothesis import strategies as st

from hybridnav._base.kernels.exact import compare_products, turn_of

coordinates = st.integers(-(2**51), 2**51).map(lambda n: n / 2**24)
"""Multiples of 2^-24 below 2^27, whose differences fit a float64."""


def sign(value: Fraction) -> int:
    return (value > 0) - (value < 0)


@given(coordinates, coordinates, coordinates, st.integers(-1, 1))
@example(134217727.99999994, 134217727.99999994, 134217727.99999994, 1)
def test_products_that_differ_by_less_than_rounding_are_compared(first, second, third, off):
    fourth = second if off == 0 else second + off / 2**24
    expected = sign(Fraction(first) * Fraction(second) - Fraction(third) * Fraction(fourth))
    assert compare_products(first, second, third, fourth) == expected
    nearly = sign(Fraction(first) * Fraction(second) - Fraction(first) * Fraction(fourth))
    assert compare_products(first, second, first, fourth) == nearly


points = st.tuples(coordinates, coordinates)


@given(points, points, points, st.integers(0, 3))
def test_a_turn_has_the_sign_of_the_exact_area(a, b, c, times):
    if times:  # c on the line through a and b, or as near as coordinates come
        c = tuple(p + times * (q - p) for p, q in zip(a, b, strict=True))
    (a0, a1), (b0, b1), (c0, c1) = (tuple(map(Fraction, point)) for point in (a, b, c))
    area = (b0 - a0) * (c1 - a1) - (b1 - a1) * (c0 - a0)
    if max(map(abs, (*a, *b, *c))) < 2**28:
        assert turn_of(*a, *b, *c) == sign(area)
