"""Centres of cells, compiled: for kernels, and for paths of few cells, where numpy is slower."""

from __future__ import annotations

from hybridnav.grid._centre_kernels import centres

__all__ = ["centres"]
