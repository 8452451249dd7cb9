"""Contraction and removal on the darts of a plane graph, compiled."""

from __future__ import annotations

from hybridnav.combinatorial._kernels import Darts, compact_darts, contract, simplify

__all__ = ["Darts", "compact_darts", "contract", "simplify"]
