"""Arcs as arguments: an index together with its level."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, order=True)
class LevelArc:
    """An arc together with its level: at another level, the same index is another arc.

    Examples
    --------
    >>> hn.LevelArc(0, 7)
    LevelArc(level=0, index=7)
    """

    level: int
    """Index of the level in its pyramid."""
    index: int
    """Dense index of the arc at that level."""
