"""Sines, angles, exponentials, logarithms, lengths: right, and bit for bit the same everywhere."""

import hashlib
import itertools
import math
import re

import llvmlite.binding as llvm
import numpy as np
import pytest
from numba import njit

import hybridnav._base.compiler  # noqa: F401 - makes the functions known to numba
from hybridnav._base import trig as _trig
from hybridnav._base.trig import (
    acos,
    asin,
    atan2,
    cos,
    dist,
    exp,
    hypot,
    hypots,
    lengths_along,
    log,
    sin,
    tan,
)

ODD = [0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan, 1e-300, -1e300, 5e-324]
RANGES = [
    (sin, np.sin, -1e5, 1e5),
    (sin, np.sin, -4.0, 4.0),
    (cos, np.cos, -1e5, 1e5),
    (cos, np.cos, -4.0, 4.0),
    (tan, np.tan, -1.5, 1.5),
    (asin, np.arcsin, -1.0, 1.0),
    (acos, np.arccos, -1.0, 1.0),
    (exp, np.exp, -40.0, 40.0),
    (log, np.log, 1e-9, 9.0),
]


@pytest.mark.parametrize(("ours", "theirs", "low", "high"), RANGES)
def test_values_are_right_to_two_units_in_the_last_place(ours, theirs, low, high):
    x = np.random.default_rng(0).uniform(low, high, 20_000)
    wanted = theirs(x.astype(np.longdouble))
    off = np.abs(np.array([ours(value) for value in x.tolist()]) - wanted)
    assert (off <= 2 * np.spacing(np.abs(wanted.astype(np.float64)))).all()


def test_directions_are_right_and_along_axes_exact() -> None:
    for y, x in itertools.product(ODD, ODD):
        found, wanted = atan2(y, x), math.atan2(y, x)
        assert found == wanted or math.isnan(found + wanted), (y, x)
        assert math.copysign(1, found) == math.copysign(1, wanted) or math.isnan(wanted)
    y, x = np.random.default_rng(0).normal(size=(2, 20_000))
    wanted = np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))
    off = np.abs(_trig.directions(y, x) - wanted)
    assert (off <= 2 * np.spacing(np.abs(wanted.astype(np.float64)))).all()


def test_lengths_have_equal_bits_in_kernels_in_arrays_and_of_numbers() -> None:
    """A multiplication fused with the sum would differ in one pair of nine."""

    @njit(cache=False)
    def of_all(x, y):
        found = np.empty_like(x)
        for k in range(len(x)):
            found[k] = hypot(x[k], y[k])
        return found

    x, y = np.random.default_rng(0).normal(0, 100, size=(2, 100_000))
    wanted = np.array([math.sqrt(a * a + b * b) for a, b in zip(x.tolist(), y.tolist())])  # noqa: B905
    assert (of_all(x, y) == wanted).all()
    assert (hypots(x, y) == wanted).all()
    pairs = zip(x[:999].tolist(), y[:999].tolist(), wanted.tolist(), strict=False)
    assert all(hypot(a, b) == dist((a, 0), (0, -b)) == c for a, b, c in pairs)
    exact = np.sqrt(x.astype(np.longdouble) ** 2 + y.astype(np.longdouble) ** 2)
    assert (np.abs(wanted - exact) <= 2 * np.spacing(wanted)).all()
    assert (hypot(1e200, 1.0), *hypots([1e200, 3], [0.0, 4])) == (math.inf, math.inf, 5.0)
    assert hypot(math.inf, 0.0) == math.inf


def test_lengths_along_a_line_are_sums_of_the_lengths_of_its_segments() -> None:
    points = np.random.default_rng(0).uniform(-9, 9, (50, 2))
    steps = np.diff(points, axis=0)
    sums = [0.0, *itertools.accumulate(hypots(steps[:, 0], steps[:, 1]).tolist())]
    assert lengths_along(points).tolist() == sums
    assert lengths_along(points[:1]).tolist() == [0.0]


def test_values_at_the_ends_of_their_ranges() -> None:
    assert (exp(0.0), exp(-800.0), exp(800.0), log(1.0), sin(0.0), cos(0.0)) == (
        1,
        0,
        np.inf,
        0,
        0,
        1,
    )
    for x in (-745.0, 709.7):
        assert exp(x) == pytest.approx(math.exp(x))
    assert log(5e-324) == pytest.approx(math.log(5e-324))
    for function in (sin, cos, tan, exp):
        assert math.isnan(function(math.nan))
    assert abs(sin(1e300)) <= 1


@njit()
def _in_a_kernel(x, y, out):
    for i in range(len(x)):
        out[i, 0], out[i, 1], out[i, 2] = sin(x[i]), cos(x[i]), tan(x[i])
        out[i, 3], out[i, 4], out[i, 5] = atan2(x[i], y[i]), asin(y[i]), acos(y[i])
        out[i, 6], out[i, 7] = exp(x[i]), log(abs(y[i]))


def test_numbers_arrays_and_kernels_have_the_same_bits_on_every_machine() -> None:
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-60, 60, 3000), rng.uniform(-1, 1, 3000)
    x[:3] = 3e9, -(2.0**20), 1e18
    numbers = np.array(
        [
            (sin(a), cos(a), tan(a), atan2(a, b), asin(b), acos(b), exp(a), log(abs(b)))
            for a, b in zip(x.tolist(), y.tolist(), strict=True)
        ]
    )
    kernel = np.empty_like(numbers)
    _in_a_kernel(x, y, kernel)
    assert kernel.tobytes() == numbers.tobytes()
    arrays = np.stack([*_trig.sines_and_cosines(x), _trig.directions(x, y)], axis=1)
    assert arrays.tobytes() == np.ascontiguousarray(numbers[:, [0, 1, 3]]).tobytes()
    assert hashlib.sha256(numbers.tobytes()).hexdigest()[:16] == "699c19ad8be17907"


@njit()
def _differences(x, squares):
    return x * x - squares


def test_kernels_do_not_fuse_products_and_sums() -> None:
    x = np.random.default_rng(0).uniform(-1, 1, 1000)
    assert not _differences(
        x, x * x
    ).any()  # a fused difference is what the product's rounding lost


@pytest.mark.parametrize(
    ("target", "features"),
    [("aarch64-unknown-linux-gnu", ""), ("x86_64-unknown-linux-gnu", "+avx2,+fma")],
)
def test_no_processor_has_code_that_fuses_a_length(target: str, features: str) -> None:
    """LLVM fuses `fmul` and `fadd` where both have the flag `contract`, which fast math alone sets.

    LLVM 22, LangRef.rst, "Fast-Math Flags"; with the flag the test finds the fused instruction.
    """
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    found = []
    for flags in (set[str](), {"contract"}):
        kernel = njit("f8(f8, f8)", cache=False, fastmath=flags)(hypot)
        (code,) = kernel.inspect_llvm().values()
        module = llvm.parse_assembly(code)
        module.triple = target
        machine = llvm.Target.from_triple(target).create_target_machine(features=features)
        found.append(set(re.findall("v?fn?m(?:add|sub)", machine.emit_assembly(module))))
    plain, fused = found
    assert not plain
    assert fused
