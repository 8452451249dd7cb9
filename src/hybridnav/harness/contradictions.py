"""Contradictions of an answer by the answers of other methods, and above all by the optimum."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hybridnav.harness.records import Record

SLACK = 1e-9
"""Relative difference of lengths that is rounding."""

ANY_ANGLE_SLACK = 1e-6
"""That of any-angle lengths: the judge of segments rounds points to 2^-24 of a cell, so a path may
cut each corner by as much."""

ANSWERED = ("solved", "no path")
"""Statuses of records that hold an answer."""


def is_any_angle(record: Record) -> bool:
    """Return whether a record holds an any-angle path, which is compared with such paths only."""
    return bool(record.get("metric") == "any-angle")


def contradiction(record: Record, reference: Record) -> str | None:
    """Return the contradiction of an answer by the optima, None if there is none.

    Parameters
    ----------
    record
        Record of the answer.
    reference
        The reference's record of the same pair, which holds both optima.

    Returns
    -------
    str or None
        The contradiction.
    """
    if {record["status"], reference["status"]} == set(ANSWERED):
        return f"solvability: {record['status']}, but on the whole grid: {reference['status']}"
    if record.get("length_m") is None or reference.get("length_m") is None:
        return None
    if is_any_angle(record):
        return _any_angle_contradiction(record, reference.get("any_angle_m"))
    return _cells_contradiction(record, reference)


def _cells_contradiction(record: Record, reference: Record) -> str | None:
    length, optimum = record["length_m"], reference["length_m"]
    if length < optimum * (1 - SLACK):
        return f"length {length:.6f} m is below the optimum {optimum:.6f} m"
    bound = record.get("bound")
    if bound is not None and length > optimum * bound * (1 + SLACK) + SLACK:
        return f"length {length:.6f} m breaks its bound, {bound:.6f} x optimum {optimum:.6f} m"
    return None


def _any_angle_contradiction(record: Record, optimum: float | None) -> str | None:
    if optimum is None:  # corners may be cut
        return None
    length = record["length_m"]
    if length < optimum * (1 - ANY_ANGLE_SLACK):
        return f"length {length:.6f} m is below the any-angle optimum {optimum:.6f} m"
    bound = record.get("lower_bound_m")
    if bound is not None and bound > optimum * (1 + ANY_ANGLE_SLACK):
        return f"the lower bound {bound:.6f} m is above the any-angle optimum {optimum:.6f} m"
    return None
