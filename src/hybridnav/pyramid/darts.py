"""Contraction and removal on the darts of a plane graph, compiled."""

from __future__ import annotations

from hybridnav.pyramid.kernels.darts import (
    CONTRACTED,
    Darts,
    base_sigma,
    compact_darts,
    contract,
    next_at_cell,
    simplify,
)

__all__ = [
    "CONTRACTED",
    "Darts",
    "base_sigma",
    "compact_darts",
    "contract",
    "next_at_cell",
    "simplify",
]
