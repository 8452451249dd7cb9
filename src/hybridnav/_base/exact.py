"""Predicates that rounding cannot change, for kernels."""

from __future__ import annotations

from hybridnav._base.kernels.exact import compare_products, turn_of

__all__ = ["compare_products", "turn_of"]
