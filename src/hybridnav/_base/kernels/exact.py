"""Kernels of predicates that rounding cannot change."""

from hybridnav._base.jit import njit


@njit(cache=True, nogil=True)
def _rounding_error(first, second, product):
    """Return the rounding error of a product (T. J. Dekker: A floating-point technique, 1971)."""
    scaled = 134217729.0 * first
    first_high = scaled - (scaled - first)
    first_low = first - first_high
    scaled = 134217729.0 * second
    second_high = scaled - (scaled - second)
    second_low = second - second_high
    error = product - first_high * second_high - first_low * second_high
    return first_low * second_low - (error - first_high * second_low)


@njit(cache=True, nogil=True)
def compare_products(first, second, third, fourth):
    """Return the sign of first * second - third * fourth: 1, -1 or 0, exact."""
    left, right = first * second, third * fourth
    # Rounding preserves order: only equal rounded products need their errors.
    if left == right and left != 0.0:
        left = _rounding_error(first, second, left)
        right = _rounding_error(third, fourth, right)
    return int(left > right) - int(left < right)


@njit(cache=True, nogil=True)
def turn_of(a_row, a_col, b_row, b_col, c_row, c_col):
    """Return the side of the line from a to b on which c lies: 1, -1 or 0, exact.

    1 is the right side for points given as (row, col), the left one for (x, y). Differences of
    coordinates must be exact in float64, as those of multiples of 2^-24 below 2^28 are.
    """
    return compare_products(b_row - a_row, c_col - a_col, b_col - a_col, c_row - a_row)
