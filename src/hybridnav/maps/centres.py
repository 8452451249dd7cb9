"""Conversions of `Frame`, compiled: for kernels, and for few cells, where numpy is slower."""

from __future__ import annotations

from hybridnav.maps.kernels.centres import centres, position_of

__all__ = ["centres", "position_of"]
