"""Shortest curves of Dubins and of Reeds and Shepp against words driven with 50 digits.

Draws words of both kinds with arcs near 0 and full circles, lengths near 0 and poses that touch,
drives each with 50 digits from a pose, rounds its end, and asks for the shortest curve to there. It
must be no longer than the word, it must arrive, driven with 50 digits, and no straight line may be
longer. Exits with 1 where one fails.
"""

import math
import time
from argparse import Namespace
from collections.abc import Iterable
from decimal import Context, Decimal, localcontext
from typing import NamedTuple

import numpy as np

from benchmarks.options import option
from hybridnav.refine.curves import Curve, Pose, shortest_curve

Exact = tuple[Decimal, Decimal, Decimal]

DIGITS = Context(prec=50)
PI = Decimal("3.14159265358979323846264338327950288419716939937510582")
FORWARDS = ((1, 0, 1), (1, 0, -1), (1, -1, 1))
BOTH_WAYS = (*FORWARDS, (1, -1, 1, -1), (1, -1, 0, 1), (1, -1, 0, -1), (1, -1, 0, 1, -1))
LONGER, OFF = 1e-7, 3e-9
"""Turning radii that a curve may be longer than the word, and off its goal."""

OPTIONS = [
    option("--count", type=int, default=1_000_000, help="pairs (1,000,000)"),
    option("--seed", type=int, default=0),
]


class Drive(NamedTuple):
    """A word, driven from a pose."""

    start: Pose
    goal: Pose
    """Where it ends, rounded."""
    radius_m: float
    length: float
    """Of the word, in turning radii."""
    reverses: bool


def exactly(pose: Pose) -> Exact:
    """Return a pose in decimals."""
    x, y, yaw = pose
    return Decimal(x), Decimal(y), Decimal(yaw)


def turned(angle: Decimal) -> tuple[Decimal, Decimal]:
    """Return sine and cosine: a series for a 64th of the angle, which is doubled six times."""
    angle = angle.remainder_near(2 * PI) / 64
    square, term, sine, versine = angle * angle, angle, angle, Decimal(0)
    for n in range(2, 32):
        term = term * angle / n if n % 2 == 0 else -term * angle / n
        if n % 2:
            sine += term
        else:
            versine += term  # 1 - cosine, without its loss of digits
        if abs(term) < square * Decimal("1e-50"):
            break
    for _ in range(6):
        sine, versine = 2 * sine * (1 - versine), 2 * versine * (2 - versine)
    return sine, 1 - versine


def ends(start: Exact, word: Iterable[tuple[int, Decimal]], radius: Decimal) -> Exact:
    """Return the pose where a word ends, with lengths in the unit of the radius."""
    x, y, yaw = start
    sine, cosine = turned(yaw)
    for kind, length in word:
        if kind == 0:
            x, y = x + length * cosine, y + length * sine
            continue
        yaw += kind * length / radius
        before, sine, cosine = (sine, cosine), *turned(yaw)
        x += kind * radius * (sine - before[0])
        y += kind * radius * (before[1] - cosine)
    return x, y, yaw


def drawn_length(rng: np.random.Generator, *, straight: bool, reverses: bool) -> float:
    """Return the length of a segment in radii: near what an arc may degenerate to, or anything."""
    tiny = float(10 ** rng.uniform(-17, -2)) * rng.choice([0.0, 1.0])
    most = 6.0 if straight else math.pi if reverses else math.tau
    near = rng.choice([0.0, 0.0, *([] if straight else [math.pi / 2, math.pi, most])])
    if rng.random() < 0.5:
        return float(rng.uniform(0, most))
    return float(abs(near - tiny))


def drawn(rng: np.random.Generator) -> Drive:
    """Draw a word and the pose that it is driven from."""
    reverses = bool(rng.integers(2))
    words = BOTH_WAYS if reverses else FORWARDS
    mirror = int(rng.choice([-1, 1]))
    word = words[rng.integers(len(words))]
    signs = rng.choice([-1.0, 1.0], len(word)) if reverses else np.ones(len(word))
    lengths = [
        float(sign) * drawn_length(rng, straight=kind == 0, reverses=reverses)
        for kind, sign in zip(word, signs, strict=True)
    ]
    if rng.random() < 0.5:  # fewer segments
        lengths = [length * float(rng.integers(2)) for length in lengths]
    radius = float(rng.choice([0.05, 0.4, 1.0, 5.0]))
    extent = float(rng.choice([0.0, 5.0, 100.0]))
    start = (*rng.uniform(-extent, extent, 2).tolist(), float(rng.uniform(-math.pi, math.pi)))
    with localcontext(DIGITS):
        exact = [
            (mirror * kind, Decimal(length) * Decimal(radius))
            for kind, length in zip(word, lengths, strict=True)
        ]
        x, y, yaw = ends(exactly(start), exact, Decimal(radius))
        goal = float(x), float(y), float(yaw.remainder_near(2 * PI))
    return Drive(start, goal, radius, math.fsum(map(abs, lengths)), reverses)


def miss(curve: Curve, goal: Pose) -> float:
    """Return how far a curve ends from a pose, in radii and radians, with 50 digits."""
    with localcontext(DIGITS):
        lengths = map(Decimal, curve.lengths_m.tolist())
        word = zip(curve.kinds.tolist(), lengths, strict=True)
        radius = Decimal(curve.radius_m)
        x, y, yaw = ends(exactly(curve.start), word, radius)
        off = [(x - Decimal(goal[0])) / radius, (y - Decimal(goal[1])) / radius]
        return float(max(*map(abs, off), abs((yaw - Decimal(goal[2])).remainder_near(2 * PI))))


def faults(drive: Drive) -> tuple[list[str], float]:
    """Return what is wrong with the shortest curve to where a word ends, and by how many radii it
    is longer than the word."""
    start, goal, radius, length, reverses = drive
    curve = shortest_curve(start, goal, radius_m=radius, reverses=reverses)
    longer, off = curve.length_m / radius - length, miss(curve, goal)
    found = []
    if longer > LONGER:
        found.append(f"longer than the word by {longer:.3g} radii")
    if off > OFF:
        found.append(f"{off:.3g} radii or radians off the goal")
    if not reverses and (curve.lengths_m < 0).any():
        found.append("backwards")
    if curve.length_m < math.dist(start[:2], goal[:2]) - OFF * radius:
        found.append("shorter than the straight line")
    return found, longer


def main(given: Namespace) -> int:
    """Print what was found in all pairs."""
    rng, began = np.random.default_rng(given.seed), time.process_time()
    bad, equal, most = 0, 0, -math.inf
    for _ in range(given.count):
        drive = drawn(rng)
        found, longer = faults(drive)
        most, equal = max(most, longer), equal + (abs(longer) < LONGER)
        if found:
            bad += 1
            if bad <= 10:
                print(drive, *found, sep="; ")
    print(
        f"{given.count} pairs, seed {given.seed}: {bad} with a fault; {equal} curves as long as "
        f"their word, none longer by more than {most:.2g} radii; "
        f"{time.process_time() - began:.0f} s of CPU"
    )
    return int(bad > 0)
